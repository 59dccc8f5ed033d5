"""Where the texels of a texture lie, for every kind of texture, in the path tracer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import IDENTITY, DirectionalLight, MaterialTextures, Scene, SceneObject, Texture
from tests.tools.texture_tiles import REPEATED, tiles

ABOVE = Camera("above", (0.0, -0.6, 2.0), (0.0, 0.0, 0.0), fov_y_deg=28.0)
SUN = DirectionalLight((0.1, -0.3, -1.0), (4.0, 3.0, 2.0))
MATERIAL = Material(name="m", kd=0.4, lobes=(Lobe(mx=0.3, my=0.12, k=0.5, r0=0.6),))


@pytest.mark.parametrize("part", REPEATED)
def test_a_uv_transform_is_a_picture_of_many(mi: object, part: str) -> None:
    """Twice across, three times up and moved by a whole number: the picture repeated so often, in every kind."""
    from lambent.baking.reference.path_traced import render_reference

    def seen(texture: Texture) -> np.ndarray:
        mesh = patch((-0.5, -0.5, 0), (1, 0, 0), (0, 1, 0))
        worn = {"m": MaterialTextures(**{part: texture})}
        scene = Scene("wall", (SceneObject("wall", mesh, "m"),), {"m": MATERIAL}, lights=(SUN,), textures=worn)
        return render_reference(scene, ABOVE, 48, 48, 4)[0]

    moved, repeated = tiles(part)
    one, other, unmoved = (seen(texture) for texture in (moved, repeated, replace(moved, uv_transform=IDENTITY)))
    assert np.abs(one - other).mean() < 0.05 * np.abs(one - unmoved).mean()
    np.testing.assert_allclose(one, other, rtol=1e-2, atol=2e-3)
