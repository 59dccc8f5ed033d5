"""Glass as files describe it: what an architect would look through passes the sun, what spreads light does not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.materials.clear import clear_terms, transmittance
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.panes import panes_of
from lambent.scenes.scene import MaterialTextures, Scene, SceneObject, Texture
from tests.scenes.loaders.gltf.test_gltf import loaded, textured
from tests.scenes.loaders.mitsuba.test_scene_mitsuba_bsdfs import bsdf, rgb
from tests.scenes.loaders.test_scene_obj import QUAD

TINT = rgb("specular_transmittance", "0.5 0.9 0.7")
IN_MITSUBA = {
    "pane": (bsdf("thindielectric", int_ior=1.5, ext_ior=1), (0.92,) * 3),
    "face of a solid": (bsdf("dielectric", int_ior=1.5, ext_ior=1), (0.96,) * 3),
    "tinted": (bsdf("thindielectric", TINT, int_ior=1.5, ext_ior=1), (0.46, 0.83, 0.65)),
    "half there": (bsdf("mask", inside=bsdf("diffuse"), opacity=0.4), (0.6,) * 3),
    "frosted": (bsdf("roughdielectric", alpha=0.2, int_ior=1.5, ext_ior=1), None),
    "wall": (bsdf("diffuse"), None),
    "curtain": (bsdf("principledthin", roughness=0.5, diff_trans=1.0), None),
}
PLAIN = {"metallicFactor": 0, "roughnessFactor": 0}
CLEAR = {"KHR_materials_transmission": {"transmissionFactor": 1}}
ABSORBING = {"thicknessFactor": 2, "attenuationDistance": 1, "attenuationColor": [0.5, 0.9, 1]}
BLENDED = PLAIN | {"baseColorFactor": [1, 1, 1, 0.2]}
IN_GLTF: dict[str, tuple[dict[str, Any], tuple[float, ...] | None]] = {
    "glass": ({"extensions": CLEAR}, (0.96,) * 3),
    "green": ({"extensions": {**CLEAR, "KHR_materials_volume": ABSORBING}}, (0.24, 0.78, 0.96)),
    "blended": ({"alphaMode": "BLEND", "pbrMetallicRoughness": BLENDED}, (0.8,) * 3),
    "satin": ({"pbrMetallicRoughness": PLAIN | {"roughnessFactor": 0.3}, "extensions": CLEAR}, None),
}


def passed_by(scene: Scene) -> np.ndarray | None:
    """(3,) what the only material passes head-on; None where it is no pane."""
    (name,) = {o.material for o in scene.objects}
    terms = clear_terms(scene.materials[name])
    assert (panes_of(scene) == (name,)) == (terms is not None)
    return None if terms is None else np.array(transmittance(1.0, terms))


def check(found: np.ndarray | None, expected: tuple[float, ...] | None) -> None:
    assert (found is None) == (expected is None)
    if found is not None:
        assert found == pytest.approx(expected, abs=0.03)


@pytest.mark.parametrize("name", IN_MITSUBA)
def test_glass_of_mitsuba(tmp_path: Path, name: str) -> None:
    body, expected = IN_MITSUBA[name]
    path = tmp_path / "scene.xml"
    path.write_text(f'<scene version="3.0.0"><shape type="rectangle">{body}</shape></scene>')
    check(passed_by(load_scene(path)), expected)


@pytest.mark.parametrize("name", IN_GLTF)
def test_glass_of_gltf(tmp_path: Path, name: str) -> None:
    said, expected = IN_GLTF[name]
    check(passed_by(loaded(tmp_path, textured({"name": "m", "pbrMetallicRoughness": PLAIN} | said, []))), expected)


def test_glass_of_obj(tmp_path: Path) -> None:
    (tmp_path / "thing.mtl").write_text("newmtl pane\nKd .2 .2 .2\nd 0.1\nillum 4\nNi 1.5\nTf 1 .5 .5\n")
    path = tmp_path / "thing.obj"
    path.write_text(QUAD + "mtllib thing.mtl\nusemtl pane\nf 1/1/1 2/2/1 3/3/1 4/4/1\n")
    check(passed_by(load_scene(path)), (0.86, 0.43, 0.43))


def test_textures_that_spread_light_measured_glass_and_what_no_one_wears_are_no_panes() -> None:
    clear = Material(lobes=(Lobe(side="transmission", mx=0.003, my=0.003, k=0.9),))
    o = SceneObject("pane", patch((0, 0, 0), (1, 0, 0), (0, 1, 0)), "clear")
    scene = Scene("s", (o,), {"clear": clear, "spare": clear})
    assert panes_of(scene) == ("clear",)
    texel = Texture(np.ones((1, 1, 3), np.float16))
    for part, kept in (("specular", True), ("opacity", True), ("roughness", False), ("normal", False)):
        textured = Scene("s", (o,), {"clear": clear}, textures={"clear": MaterialTextures(**{part: texel})})
        assert bool(panes_of(textured)) == kept
    assert panes_of(Scene("s", (o,), {"clear": clear}, measured={"clear": Path("pane.bsdf")})) == ()
