"""A closed white furnace stays white: from the bake over the store to the picture that the window shows."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.baking.interreflection.settings import Bounces
from lambent.baking.quality import quality_named
from lambent.baking.transport.view import View
from lambent.core.views.camera import Camera
from lambent.editing.interreflection.whole import whole_picture
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box
from lambent.scenes.scene import Scene, SceneObject
from tests.baking.small_scenes import turned_inwards

SIZE = 16
INSIDE = Camera("inside", (0.3, 0.2, 0.4), (-0.5, -0.3, -1.0), fov_y_deg=60.0)
# What Fresnel's factor takes from the diffuse light, the lobe returns: all but 3e-4 of it.
POLISHED = Material(kd=0.9, kd_coupled=True, lobes=(Lobe(mx=0.01, my=0.01, r0=0.1, alpha=0.5),))


@pytest.mark.long
def test_a_closed_white_furnace_stays_white(tmp_path: Path) -> None:
    """Walls that shine with 1 and reflect all: each further surface adds 1, to 1e-3 in the mean of them.

    The noise of a mean is below 1e-3. Direct light is as exact with 400 lights, beside walls that shine and touch.
    """
    from lambent.baking.bake import bake

    room = SceneObject("room", turned_inwards(box((2, 2, 2))), "white", emission=(1.0, 1.0, 1.0))
    scene = Scene("furnace", (room,), {"white": POLISHED})
    quality = quality_named("normal").changed("test", visibility={"lights": (400,)})
    store = bake(
        scene, tmp_path / "s", quality=quality, only={"transport", "interreflection"}, views=[View(INSIDE, SIZE, SIZE)],
        bounces=Bounces((64, 1, 1, 1), samples=4096),
    )  # fmt: skip
    whole = whole_picture(store, Session.new("furnace", INSIDE, scene.materials, size=(SIZE, SIZE)))
    light = []
    for surfaces in ((1, 1), (2, 2), (3, 3), (4, 4), (1, 99)):
        whole.see(surfaces)
        whole.draw()
        light.append(np.array(whole.image()))
    whole.close()
    shines_and_direct, *further, total = light
    added = np.array([image - 1 for image in further])
    noise = added.mean(axis=-1).std(axis=(1, 2)) / SIZE
    assert (noise < 1e-3).all()
    assert abs(added.mean() - 1) < 2e-3
    assert (np.abs(added.mean(axis=(1, 2, 3)) - 1) < 5e-4 + 3 * noise).all()
    assert abs(shines_and_direct.mean() - 2) < 1e-3
    assert np.allclose(total, shines_and_direct + added.sum(axis=0), rtol=1e-3)
