"""Which pictures of a file hold sRGB colours, and which plain numbers: byte 188 is .503 of the light, or .737."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.scenes.loaders.load import load_scene
from tests.scenes.loaders.gltf.test_gltf import loaded, textured
from tests.scenes.loaders.mitsuba.test_scene_mitsuba import written
from tests.scenes.loaders.pictures import png
from tests.scenes.loaders.test_scene_obj import QUAD, parts_of

BYTE = 188
NUMBER = BYTE / 255
LIGHT = ((NUMBER + 0.055) / 1.055) ** 2.4  # IEC 61966-2-1


@pytest.fixture
def grey(tmp_path: Path) -> Path:
    png(tmp_path / "grey.png", np.full((2, 2, 4), (BYTE, BYTE, BYTE, BYTE)))
    return tmp_path


@pytest.mark.parametrize(("metallic", "expected"), [(0.0, 0.96 * LIGHT), (1.0, LIGHT)])
def test_base_colours_of_gltf_are_encoded(grey: Path, metallic: float, expected: float) -> None:
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": metallic}
    material = loaded(grey, textured({"name": "m", "pbrMetallicRoughness": pbr}, ["grey.png"])).materials["m"]
    found = material.lobes[0].r0 if metallic else material.kd
    assert found == pytest.approx((expected,) * 3, rel=2e-3)


def test_emission_of_gltf_is_encoded(grey: Path) -> None:
    look = {"name": "m", "emissiveFactor": [4, 2, 1], "emissiveTexture": {"index": 0}}
    scene = loaded(grey, textured(look, ["grey.png"]))
    assert scene.object("thing").emission == pytest.approx((4 * LIGHT, 2 * LIGHT, LIGHT), rel=2e-3)


def test_roughness_metal_and_alpha_of_gltf_are_numbers(grey: Path) -> None:
    """Roughness is green, metal blue; alpha is never encoded."""
    png(grey / "packed.png", np.full((1, 1, 3), (0, BYTE, 255)))
    look: dict[str, Any] = {"name": "m", "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 0}}}
    (lobe,) = loaded(grey, textured(look, ["packed.png"])).materials["m"].lobes
    assert lobe.mx == pytest.approx(NUMBER**2, rel=2e-3)
    png(grey / "packed.png", np.full((1, 1, 3), (0, 255, BYTE)))
    look["pbrMetallicRoughness"]["baseColorFactor"] = [1, 0, 0, 1]
    material = loaded(grey, textured(look, ["packed.png"])).materials["m"]
    assert material.kd[0] == pytest.approx(0.96 * (1 - NUMBER), rel=5e-3)
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    pane = {"name": "m", "alphaMode": "BLEND", "pbrMetallicRoughness": pbr}
    (through,) = loaded(grey, textured(pane, ["grey.png"])).materials["m"].transmission_lobes
    assert through.k == pytest.approx((1 - NUMBER,) * 3, rel=2e-3)


def test_specular_glossiness_is_encoded_but_for_its_alpha(grey: Path) -> None:
    older = {"diffuseTexture": {"index": 0}, "specularGlossinessTexture": {"index": 0}}
    look = {"name": "m", "extensions": {"KHR_materials_pbrSpecularGlossiness": older}}
    material = loaded(grey, textured(look, ["grey.png"])).materials["m"]
    assert material.lobes[0].r0 == pytest.approx((LIGHT,) * 3, rel=2e-3)
    assert material.kd == pytest.approx((LIGHT * (1 - LIGHT),) * 3, rel=2e-3)
    assert material.lobes[0].mx == pytest.approx((1 - NUMBER) ** 2, rel=5e-3)


def test_colours_of_a_material_library_are_encoded_and_numbers_not(grey: Path) -> None:
    png(grey / "opaque.png", np.full((2, 2, 3), BYTE))
    library = (
        "newmtl a\nKd 1 1 1\nmap_Kd opaque.png\nnewmtl b\nKe 4 2 1\nmap_Ke opaque.png\n"
        "newmtl c\nKd 1 1 1\nPm 1\nmap_Pr opaque.png\nnewmtl d\nmap_d opaque.png\n"
    )
    faces = "".join(f"usemtl {name}\nf 1/1 2/2 3/3\n" for name in "abcd")
    parts = parts_of(grey, QUAD + "mtllib thing.mtl\n" + faces, library)
    assert parts.materials["a"].kd == pytest.approx((LIGHT,) * 3, rel=2e-3)
    lamp = next(o for o in parts.objects if o.material == "b")
    assert lamp.emission == pytest.approx((4 * LIGHT, 2 * LIGHT, LIGHT), rel=2e-3)
    assert parts.materials["c"].lobes[0].mx == pytest.approx(NUMBER**2, rel=2e-3)
    mask = parts.textures["d"].opacity
    assert mask is not None and mask.texels == pytest.approx(NUMBER, rel=2e-3)


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        ("", LIGHT),
        ('<boolean name="raw" value="true"/>', NUMBER),
        ('<float name="gamma" value="1"/>', NUMBER),
        ('<float name="gamma" value="2"/>', NUMBER**2),
    ],
)
def test_bitmaps_of_mitsuba_are_what_they_say(grey: Path, said: str, expected: float) -> None:
    body = f"""<shape type="rectangle"><bsdf type="diffuse" id="m"><texture type="bitmap" name="reflectance">
        <string name="filename" value="grey.png"/>{said}</texture></bsdf></shape>"""
    assert load_scene(written(grey, body)).materials["m"].kd == pytest.approx((expected,) * 3, rel=2e-3)


def test_grey_of_sixteen_bits_keeps_its_range(tmp_path: Path) -> None:
    """65535 is white, and half of it half: 257 steps to a byte."""
    from PIL import Image

    Image.fromarray(np.full((2, 2), 257 * BYTE, np.uint16)).save(tmp_path / "deep.png")
    pbr = {"baseColorTexture": {"index": 0}, "metallicFactor": 0}
    material = loaded(tmp_path, textured({"name": "m", "pbrMetallicRoughness": pbr}, ["deep.png"])).materials["m"]
    assert material.kd == pytest.approx((0.96 * LIGHT,) * 3, rel=2e-3)
