"""glTF's material extensions as lobes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.sequences import cosine_hemisphere, hammersley
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.scenes.loaders.surfaces.material_builder import masking
from tests.scenes.loaders.gltf.test_gltf import loaded, textured
from tests.scenes.loaders.pictures import png


def test_specular_has_a_weight_and_a_colour(tmp_path: Path) -> None:
    """KHR_materials_specular: the weight holds at grazing incidence too; the base loses its highest channel."""
    plain = {"metallicFactor": 0, "roughnessFactor": 0.3}

    def seen(**said: Any) -> Material:
        look = {"name": "m", "pbrMetallicRoughness": plain, "extensions": {"KHR_materials_specular": said}}
        return loaded(tmp_path, textured(look, [])).materials["m"]

    grazing = np.array([np.sin(np.radians(85)), 0, np.cos(np.radians(85))])
    dull, half = seen(specularFactor=0), seen(specularFactor=0.5)
    assert MaterialBSDF(dull).albedo(grazing) == pytest.approx((1, 1, 1), abs=1e-6) and not dull.kd_coupled
    assert half.lobes[0].r0 == pytest.approx((0.04,) * 3)
    assert half.lobes[0].k == pytest.approx((0.5 * masking(0.09, 0.09, "ggx")[1],) * 3)
    tinted = seen(specularColorFactor=[5, 1, 1])
    assert tinted.lobes[0].r0 == pytest.approx((0.2, 0.04, 0.04)) and tinted.kd == pytest.approx((0.8,) * 3)


@pytest.mark.parametrize("roughness", [0.5, 0.7, 1.0])
def test_rough_surfaces_keep_their_colour_towards_grazing(tmp_path: Path, roughness: float) -> None:
    """glTF's diffuse term is the colour times 1 - F at the half vector, whose mean falls by 2 % up to 88 degrees."""

    def bsdf(colour: float) -> MaterialBSDF:
        look = {"metallicFactor": 0, "roughnessFactor": roughness, "baseColorFactor": [colour] * 3 + [1]}
        return MaterialBSDF(loaded(tmp_path, textured({"name": "m", "pbrMetallicRoughness": look}, [])).materials["m"])

    wi = cosine_hemisphere(hammersley(4096))
    for theta_deg in (0, 60, 80, 88):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
        theirs = 0.5 * np.mean(1 - (0.04 + 0.96 * (1 - half @ wo) ** 5))
        ours = bsdf(0.5).albedo(wo).max() - bsdf(0.0).albedo(wo).max()
        assert ours == pytest.approx(theirs, abs=0.015)
    wo = np.array([np.sin(np.radians(85)), 0, np.cos(np.radians(85))])
    assert bsdf(1.0).albedo(wo).max() <= 1.03, "white paint gives back no more than it gets"


def test_coats_take_from_what_is_below(tmp_path: Path) -> None:
    """A smooth mirror below a clear coat returns no more than arrives, up to 75 degrees; a tenth more up to 82."""
    coat = {"KHR_materials_clearcoat": {"clearcoatFactor": 1}}
    look = {"name": "m", "pbrMetallicRoughness": {"roughnessFactor": 0.1}, "extensions": coat}
    bsdf = MaterialBSDF(loaded(tmp_path, textured(look, [])).materials["m"])
    for theta_deg, most in ((0, 1.001), (45, 1.001), (75, 1.001), (82, 1.1)):
        wo = np.array([np.sin(np.radians(theta_deg)), 0, np.cos(np.radians(theta_deg))])
        assert 0.8 < bsdf.albedo(wo).max() <= most


def test_leaves_volumes_and_what_is_not_read(tmp_path: Path) -> None:
    leaf = {"diffuseTransmissionFactor": 0.25, "diffuseTransmissionColorFactor": [0.1, 0.8, 0.2]}
    more = {"KHR_materials_diffuse_transmission": leaf, "KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1]}}
    look = {"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": more}
    scene = loaded(tmp_path, textured(look, []))
    material = scene.materials["m"]
    assert material.kd == pytest.approx((0.72,) * 3) and material.kt_d == pytest.approx((0.024, 0.192, 0.048))
    assert "material m: ignored: KHR_materials_sheen" in scene.warnings
    volume = {"thicknessFactor": 2, "attenuationDistance": 1, "attenuationColor": [0.5, 0.9, 1]}
    glass: dict[str, Any] = {"KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": volume}
    look = {"name": "m", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0}, "extensions": glass}
    (through,) = loaded(tmp_path, textured(look, [])).materials["m"].transmission_lobes
    assert through.k == pytest.approx((0.25, 0.81, 1), rel=1e-3)
    png(tmp_path / "through.png", [[[255, 0, 255], [0, 0, 255]]])
    glass["KHR_materials_transmission"]["transmissionTexture"] = {"index": 0}
    (through,) = loaded(tmp_path, textured(look, ["through.png"])).materials["m"].transmission_lobes
    assert through.k == pytest.approx((0.125, 0.405, 0.5), rel=1e-3)


def test_specular_glossiness(tmp_path: Path) -> None:
    """The archived extension alone; where metallic-roughness is written beside it, that holds."""
    png(tmp_path / "gloss.png", [[[255, 255, 255, 255], [188, 188, 188, 128]]])
    older = {"diffuseFactor": [0.8, 0.4, 0.2, 1], "specularFactor": [0.5, 0.5, 0.5], "glossinessFactor": 0.8}
    look: dict[str, Any] = {"name": "m", "extensions": {"KHR_materials_pbrSpecularGlossiness": older}}
    material = loaded(tmp_path, textured(look, [])).materials["m"]
    assert material.kd == pytest.approx((0.4, 0.2, 0.1)) and material.lobes[0].mx == pytest.approx(0.04)
    assert material.lobes[0].r0 == pytest.approx((0.5,) * 3)
    both = look | {"pbrMetallicRoughness": {"metallicFactor": 0}}
    assert loaded(tmp_path, textured(both, [])).materials["m"].kd == pytest.approx((0.96,) * 3)
    older["specularGlossinessTexture"] = {"index": 0}
    scene = loaded(tmp_path, textured(look, ["gloss.png"]))
    roughness = scene.textures["m"].roughness
    assert roughness is not None and scene.textures["m"].specular is not None
    slopes = scene.materials["m"].lobes[0].mx * roughness.texels[0, :, 0]
    assert slopes == pytest.approx([0.04, (1 - 0.8 * 128 / 255) ** 2], rel=5e-3)
