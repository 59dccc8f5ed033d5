"""Pictures as arrays: reduced, filled, told apart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.core.errors import UserError
from lambent.scenes import load_scene
from lambent.scenes.looks import textures
from lambent.scenes.scene import MaterialTextures, Texture


def picture(values: np.ndarray) -> Texture:
    return Texture(np.asarray(values, np.float16))


def test_colours_beyond_a_masks_edge_come_from_within() -> None:
    """Green leaves on white: no average of the filled picture is whiter than a leaf."""
    rng = np.random.default_rng(0)
    leaf = rng.random((37, 50)) < 0.2
    colour = np.where(leaf[..., None], (0.2, 0.8, 0.1), (1.0, 1.0, 20.0))
    given = {"leaf": MaterialTextures(diffuse=picture(colour), opacity=picture(leaf[..., None]))}
    filled = textures.prepared(given)["leaf"].diffuse.texels
    np.testing.assert_allclose(filled, np.broadcast_to((0.2, 0.8, 0.1), filled.shape), rtol=2e-3)
    assert np.array_equal(filled[leaf], picture(colour).texels[leaf])


def test_large_pictures_are_reduced_and_shared_ones_stay_shared(monkeypatch) -> None:
    monkeypatch.setattr(textures, "SIDE_MAX", 16)
    large = picture(np.random.default_rng(0).random((50, 20, 3)))
    given = {"a": MaterialTextures(diffuse=large), "b": MaterialTextures(specular=large)}
    prepared = textures.prepared(given)
    small = prepared["a"].diffuse.texels
    assert small.shape == (12, 5, 3)
    assert small is prepared["b"].specular.texels
    np.testing.assert_allclose(small.mean(axis=(0, 1)), large.texels.mean(axis=(0, 1), dtype=float), rtol=2e-3)


def test_wrong_channels_and_holes_in_the_numbers_are_refused() -> None:
    with pytest.raises(UserError, match="roughness texture of m"):
        textures.prepared({"m": MaterialTextures(roughness=picture(np.ones((2, 2, 3))))})
    with pytest.raises(UserError, match="not finite"):
        textures.prepared({"m": MaterialTextures(diffuse=picture(np.full((2, 2, 3), np.nan)))})


def test_an_object_whose_uv_is_one_point_can_show_an_image(tmp_path: Path) -> None:
    """Unless its material has a texture, of which the point may be a swatch."""
    corners = "v 0 0 0\nv 2 0 0\nv 2 3 0\nvt 0.5 0.5\nvn 0 0 1\n"
    faces = "".join(f"o {name}\nusemtl {name}\nf 1/1/1 2/1/1 3/1/1\n" for name in ("plain", "swatch"))
    (tmp_path / "t.obj").write_text(f"mtllib t.mtl\n{corners}{faces}")
    (tmp_path / "t.mtl").write_text("newmtl plain\nKd .5 .5 .5\nnewmtl swatch\nmap_Kd palette.png\n")
    Image.fromarray(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)).save(tmp_path / "palette.png")
    scene = load_scene(tmp_path / "t.obj")
    assert np.array_equal(scene.object("plain").mesh.uv, [[0, 0], [2, 0], [2, 3]])
    assert np.array_equal(scene.object("swatch").mesh.uv, np.full((3, 2), 0.5))
