"""Variants of scenes, and textures as arrays: reduced, filled, exchanged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lambent.core.errors import UserError
from lambent.core.light.light_mix import GroupMix
from lambent.core.pictures.images import write_shown
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.looks import textures
from lambent.scenes.looks.variants import VariantByObject, textures_in_looks, variant_named, with_variants
from lambent.scenes.scene import ImageTexture, Look, MaterialTextures, Scene, SceneObject, Texture
from tests.scenes.loaders.test_toml import written

PAINTED = """
[materials.white]
kd = 0.7
[materials.gold]
kd = 0.02
lobes = [{ mx = 0.1, my = 0.1, r0 = [0.9, 0.7, 0.4] }]
[assign]
"*" = "white"
"""
GREY, GRAIN = Material(name="grey", kd=0.5), Material(name="grain", kd=(0.4, 0.3, 0.2))
SQUARE = patch((0, 0, 0), (1, 0, 0), (0, 0, -1))


def test_a_scene_toml_names_colours_numbers_documents_and_light(tmp_path: Path) -> None:
    Material(name="copper", kd=(0.3, 0.1, 0.05)).save(tmp_path / "copper.json")
    scene = load_scene(written(tmp_path, PAINTED + """
[[variants]]
name = "blue"
materials.white.colour = "#0000ff"
light = { sun = "off", lamp = "0.5,2700K", sky = 2 }
[[variants]]
name = "metal"
materials.white = { use = "gold" }
[[variants]]
name = "copper"
materials.white = { file = "copper.json" }
[[variants]]
name = "dark"
materials.white.kd = 0.1
"""))  # fmt: skip
    blue, metal, copper, dark = scene.variants
    assert [one.name for one in scene.variants] == ["blue", "metal", "copper", "dark"]
    assert blue.materials["white"].kd == pytest.approx((0, 0, 1)) and [*blue.looks] == ["white"]
    assert blue.light.factors["sun"] == (0, 0, 0) and blue.light.of("lamp").temperature_k == 2700
    assert blue.light.of("sky") == GroupMix(intensity=2.0)
    assert metal.materials["white"].lobes == scene.materials["gold"].lobes
    assert copper.materials["white"].kd == (0.3, 0.1, 0.05)
    assert dark.materials["white"].kd == (0.1, 0.1, 0.1) and not dark.light.groups
    assert tmp_path / "copper.json" in scene.sources


def test_objects_of_one_material_that_part_ways_get_materials_of_their_own(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, PAINTED + '[[variants]]\nname = "a"\nobjects.sphere = "gold"\n'))
    sphere = scene.object("sphere").material
    others = {o.material for o in scene.objects if o.name != "sphere"}
    assert sphere not in others and {sphere, *others} == {"white", "white_2"}
    assert scene.materials["white_2"].model_copy(update={"name": "white"}) == scene.materials["white"]
    assert [*scene.variants[0].looks] == [sphere]
    assert "material white: variants split its objects; the others get white_2" in scene.warnings


def test_a_material_keeps_its_textures_with_other_numbers_and_takes_those_of_another(tmp_path: Path) -> None:
    texture = MaterialTextures(diffuse=Texture(np.ones((2, 2, 3), np.float16)))
    objects = tuple(SceneObject(name, SQUARE, "grain") for name in ("left", "right"))
    tables = {"grain": Path("grain.txt"), "grey": Path("grey.txt")}
    scene = Scene("s", objects, {"grain": GRAIN, "grey": GREY}, textures={"grain": texture}, measured=tables)
    darker, plain = Look(GRAIN.model_copy(update={"kd": (0.1, 0.1, 0.1)}), "grain"), Look(GREY)
    same = Look(GRAIN, "grain")
    found = with_variants(scene, [VariantByObject("dark", (darker, darker)), VariantByObject("half", (same, plain))])
    left, right = (o.material for o in found.objects)
    assert (left, right) == ("grain", "grain_2") and found.textures["grain_2"] is texture
    dark, half = found.variants
    assert {*dark.looks} == {left, right} and {*half.looks} == {right}
    assert textures_in_looks(found.textures, dark.looks) == {left: texture, right: texture}
    assert textures_in_looks(found.textures, half.looks) == {left: texture}


WRONG = {
    '[[variants]]\nname = "a"\nmaterials.wite.kd = 0.1': r"a.materials.wite: unknown material.*did you mean 'white'",
    '[[variants]]\nname = "a"\nmaterials.white = {}': r"white: is empty; expected use, file, texture, colour",
    '[[variants]]\nname = "a"\nmaterials.white.colour = "blue"': r"white.colour: not a colour; found blue; .*#rrggbb",
    '[[variants]]\nname = "a"\nmaterials.white = {colour = "#000000", kd = 1}': r"has two colours",
    '[[variants]]\nname = "a"\nmaterials.white = {use = "gold", kd = 1}': r"has other keys beside use; found kd",
    '[[variants]]\nname = "a"\nmaterials.white.use = "goold"': r"white.use: unknown material; found goold",
    '[[variants]]\nname = "a"\nmaterials.white.use = 3': r"white.use: is not a name; found 3",
    '[[variants]]\nname = "a"\nmaterials.white.file = "../a.json"': r"white.file: .*leaves its folder",
    '[[variants]]\nname = "a"\nmaterials.white.kd = -1': r"materials.white: kd.*greater than or equal to 0",
    '[[variants]]\nname = "a"\nobjects."chair*" = "gold"': r"objects.chair\*: matches no object",
    '[[variants]]\nname = "a"\nobjects.sphere = "goold"': r"objects.sphere: unknown material; found goold",
    '[[variants]]\nname = "a"\nlight.sun = "blck"': r"a.light.sun: is no light setting; found blck",
    '[[variants]]\nname = "a"\nlight.sun = "1@4"': r"a.light.sun: is no light setting; found 1@4",
    '[[variants]]\nname = "a"\nlight.sun = 5000': r"a.light.sun: intensity is out of range; found 5000",
    '[[variants]]\nname = "a"\n[[variants]]\nname = "a"': r"variants: name is used twice; found a",
    '[[variants]]\nname = ""': r"variants.0.name",
    '[[variants]]\nname = "a"\nmaterial.white.kd = 1': r"variants.0.material: unknown key",
}


@pytest.mark.parametrize("text", WRONG)
def test_what_is_wrong_is_said(tmp_path: Path, text: str) -> None:
    with pytest.raises(UserError, match=WRONG[text]):
        load_scene(written(tmp_path, PAINTED + text))


def test_an_unknown_variant_is_said_with_those_there_are() -> None:
    scene = with_variants(Scene("s", (), {"grey": GREY}), [VariantByObject("oak", ())])
    with pytest.raises(UserError, match=r"--variant: unknown variant; found oke; expected oak; did you mean 'oak'"):
        variant_named(scene.variants, "oke")
    with pytest.raises(UserError, match=r"the store has no variants"):
        variant_named((), "oak")


STRIPES = np.repeat(np.array([[[255, 0, 0], [0, 0, 0]]], np.uint8), 2, axis=0)
BRICKS = """
[[variants]]
name = "bricks"
materials.white.texture = "images/bricks.png,3"
[[variants]]
name = "tinted"
materials.white = {{ texture = "images/bricks.png", colour = "#0000ff" }}
[[variants]]
name = "wrong"
materials.white.texture = {wrong}
"""


def test_a_variant_shows_an_image(tmp_path: Path) -> None:
    """The mean becomes the diffuse colour, unless the variant has one; the image is a source of the scene."""
    image = tmp_path / "images" / "bricks.png"
    image.parent.mkdir()
    write_shown(image, STRIPES)
    scene = load_scene(written(tmp_path, PAINTED + BRICKS.format(wrong='"none"')))
    bricks, tinted, none = scene.variants
    assert bricks.looks["white"].textures == ImageTexture(str(image.resolve()), 3.0)
    assert bricks.materials["white"].kd == pytest.approx((0.5, 0, 0), abs=1e-3)
    assert tinted.materials["white"].kd == pytest.approx((0, 0, 1)) and tinted.looks["white"].textures
    assert not none.looks and image.resolve() in [path.resolve() for path in scene.sources]
    shown = textures_in_looks(scene.textures, bricks.looks)
    np.testing.assert_allclose(shown["white"].diffuse.texels[0, :, 0], (2, 0), atol=0.01)


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
