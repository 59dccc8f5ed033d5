"""The numbers of written glTF, Mitsuba and MaterialX files, evaluated by their specifications, cost what is stated."""

from __future__ import annotations

import json
import math
import struct
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import Floats
from lambent.materials.document import Material
from lambent.materials.export import gltf, materialx, mitsuba
from lambent.materials.export.resampling.pairs import CHECK_LOG2, pairs_of
from tests.materials.export.by_hand.facets import Geometry, assert_costs
from tests.materials.export.export_materials import BRUSHED, FOIL, GOLD, PAPER, PLASTIC, VARNISH

MATERIALS = [PLASTIC, BRUSHED, GOLD, PAPER, VARNISH]


def named(material: Material) -> str:
    return material.name


def gltf_material(path: Path) -> dict[str, Any]:
    content = path.read_bytes()
    if path.suffix == ".glb":
        assert content[:4] == b"glTF" and struct.unpack_from("<2I", content, 4) == (2, len(content))
        (length,) = struct.unpack_from("<I", content, 12)
        content = content[20 : 20 + length]
    (material,) = json.loads(content)["materials"]
    return dict(material)


def gltf_f(written: dict[str, Any], geometry: Geometry) -> Floats:
    """f (N, 3) by appendix B of glTF 2.0 and the extensions' own texts."""
    pbr = written["pbrMetallicRoughness"]
    base, metallic, alpha = np.array(pbr["baseColorFactor"][:3]), pbr["metallicFactor"], pbr["roughnessFactor"] ** 2
    extensions = {k.removeprefix("KHR_materials_"): v for k, v in written.get("extensions", {}).items()}
    anisotropy = extensions.get("anisotropy", {})
    along, across = alpha + (1 - alpha) * anisotropy.get("anisotropyStrength", 0) ** 2, alpha
    rotation = anisotropy.get("anisotropyRotation", 0.0)
    assert rotation == 0 or math.isclose(rotation, math.pi / 2)
    axes = (across, along) if rotation else (along, across)
    ior, specular = extensions.get("ior", {}).get("ior", 1.5), extensions.get("specular", {})
    weight, tint = specular.get("specularFactor", 1), np.array(specular.get("specularColorFactor", [1, 1, 1]))
    transmission = extensions.get("transmission", {}).get("transmissionFactor", 0)
    through = extensions.get("diffuse_transmission", {})
    share = through.get("diffuseTransmissionFactor", 0)
    colour = np.array(through.get("diffuseTransmissionColorFactor", [1, 1, 1]))

    grazing = ((1 - geometry.cos_d) ** 5)[:, None]
    f0 = np.minimum(((ior - 1) / (ior + 1)) ** 2 * tint, 1)
    fresnel = f0 + (1 - f0) * grazing
    under = 1 - weight * fresnel.max(axis=1, keepdims=True)
    layer = geometry.ggx(*axes)[:, None]
    diffuse = (1 - transmission) * (1 - share) * base / np.pi
    near = (1 - metallic) * (under * diffuse + weight * fresnel * layer)
    near = near + metallic * (base + (1 - base) * grazing) * layer
    sheet = transmission * base * geometry.ggx(*axes, correlated=False)[:, None]
    far = (1 - metallic) * under * (sheet + (1 - transmission) * share * colour / np.pi)
    return np.asarray(np.where(geometry.far[:, None], far, near))


@pytest.mark.parametrize("material", [*MATERIALS, FOIL], ids=named)
def test_gltf(tmp_path: Path, material: Material) -> None:
    ending = ".glb" if material in (PAPER, FOIL) else ".gltf"
    path = tmp_path / f"a{ending}"
    cost = gltf.write(material, path)
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, gltf_f(gltf_material(path), Geometry(samples)), cost.share)


def texture(bsdf: ET.Element, name: str) -> Floats:
    (found,) = (one for one in bsdf.findall("texture") if one.get("name") == name)
    assert found.get("type") == "srgb" and found.find("boolean").get("value") == "true"
    return np.array([float(v) for v in found.find("rgb").get("value").split()])


def number(bsdf: ET.Element, name: str) -> float:
    (found,) = (one for one in bsdf if one.get("name") == name)
    return float(found.get("value", "nan"))


def mitsuba_f(bsdf: ET.Element, geometry: Geometry) -> Floats:
    """f (N, 3) of reflection by Mitsuba's manual; a conductor's Fresnel term from its complex amplitudes."""
    kind = bsdf.get("type")
    if kind == "twosided":
        return mitsuba_f(bsdf.find("bsdf"), geometry)
    if kind == "blendbsdf":
        weight = number(bsdf, "weight")
        first, second = (mitsuba_f(one, geometry) for one in bsdf.findall("bsdf"))
        return np.asarray((1 - weight) * first + weight * second)
    if kind == "diffuse":
        return np.tile(texture(bsdf, "reflectance") / np.pi, (len(geometry.cos_d), 1))
    assert kind == "roughconductor"
    alphas = number(bsdf, "alpha_u"), number(bsdf, "alpha_v")
    distribution = bsdf.find("string[@name='distribution']").get("value")
    facets = geometry.beckmann(*alphas) if distribution == "beckmann" else geometry.ggx(*alphas, correlated=False)
    n, cosine = complex(number(bsdf, "eta"), number(bsdf, "k")), geometry.cos_d
    inside = np.sqrt(n**2 - (1 - cosine**2))
    across, along = (cosine - inside) / (cosine + inside), (n**2 * cosine - inside) / (n**2 * cosine + inside)
    fresnel = (np.abs(across) ** 2 + np.abs(along) ** 2) / 2
    return np.asarray(texture(bsdf, "specular_reflectance") * (fresnel * facets)[:, None])


@pytest.mark.parametrize("material", [PLASTIC, BRUSHED, GOLD, VARNISH], ids=named)
def test_mitsuba(tmp_path: Path, material: Material) -> None:
    cost = mitsuba.write(material, tmp_path / "a.xml")
    (bsdf,) = ET.parse(tmp_path / "a.xml").getroot().findall("bsdf")
    assert bsdf.get("id") == "material"
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, mitsuba_f(bsdf, Geometry(samples)), cost.share)


@pytest.mark.parametrize("material", [PLASTIC, PAPER], ids=named)
def test_mitsuba_lights_the_side_that_is_looked_at(tmp_path: Path, material: Material) -> None:
    """Above all from before the ball, or from behind what transmits; the ball's pole, +z of a sphere, is up."""
    mitsuba.write(material, tmp_path / "a.xml")
    ball, lamp, *_ = ET.parse(tmp_path / "a.xml").getroot().findall("shape")
    eye = ET.parse(tmp_path / "a.xml").getroot().find("sensor/transform/lookat").get("origin")
    lamp_z, eye_z = (float(text.split(",")[2]) for text in (lamp.find("point").get("value"), eye))
    assert np.sign(lamp_z * eye_z) == (-1 if material.transmits else 1)
    turn = ball.find("transform/rotate")
    angle = np.radians(float(turn.get("angle")))
    np.testing.assert_allclose([float(turn.get("x")), -np.sin(angle)], [1, 1])  # about x, z becomes y


def test_mitsuba_thin_sheet(tmp_path: Path) -> None:
    """Diffuse on both sides: each part's colour times its share of the blend is the material's coefficient."""
    mitsuba.write(PAPER, tmp_path / "a.xml")
    (blend,) = ET.parse(tmp_path / "a.xml").getroot().findall("bsdf")
    near, far = blend.findall("bsdf")
    weight = number(blend, "weight")
    np.testing.assert_allclose((1 - weight) * texture(near.find("bsdf"), "reflectance"), 0.6, rtol=1e-4)
    assert far.get("type") == "principledthin" and number(far, "diff_trans") == 2
    np.testing.assert_allclose(weight * texture(far, "base_color"), 0.2, rtol=1e-4)


def inputs_of(node: ET.Element) -> dict[str, Floats]:
    """The numbers of a MaterialX node's inputs, by name."""
    numeric = (one for one in node if one.get("type") in ("float", "vector2", "color3"))
    return {one.get("name", ""): np.array([float(v) for v in one.get("value", "").split(",")]) for one in numeric}


def materialx_f(root: ET.Element, geometry: Geometry) -> Floats:
    """f (N, 3) of the document's nodes by their own definitions, added up."""
    near, far = np.zeros((2, len(geometry.cos_d), 3))
    grazing = ((1 - geometry.cos_d) ** 5)[:, None]
    for node in root:
        numbers = inputs_of(node)
        scatter = [one.get("value") for one in node if one.get("name") == "scatter_mode"]
        if node.tag == "oren_nayar_diffuse_bsdf":
            assert numbers["roughness"] == 0
            near += numbers["color"] / np.pi
        elif node.tag == "translucent_bsdf":
            far += numbers["color"] / np.pi
        elif node.tag == "generalized_schlick_bsdf":
            assert scatter == ["R"] and numbers["exponent"] == 5
            fresnel = numbers["color0"] + (numbers["color90"] - numbers["color0"]) * grazing
            near += fresnel * geometry.ggx(*numbers["roughness"])[:, None]
        elif node.tag == "dielectric_bsdf":
            assert scatter == ["T"]
            f0 = ((numbers["ior"] - 1) / (numbers["ior"] + 1)) ** 2
            far += numbers["tint"] * (1 - f0 - (1 - f0) * grazing) * geometry.ggx(*numbers["roughness"])[:, None]
    return np.asarray(np.where(geometry.far[:, None], far, near))


@pytest.mark.parametrize("material", [PLASTIC, BRUSHED, GOLD, FOIL, PAPER], ids=named)
def test_materialx(tmp_path: Path, material: Material) -> None:
    cost = materialx.write(material, tmp_path / "a.mtlx")
    samples = pairs_of(material, CHECK_LOG2, seed=1).samples
    assert_costs(samples, materialx_f(ET.parse(tmp_path / "a.mtlx").getroot(), Geometry(samples)), cost.share)
