"""The numbers of a written MaterialX document, evaluated by the nodes' own definitions, are those that were fitted."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from lambent.materials.document import Material
from lambent.materials.export.materialx import TOOL, likeness, write
from lambent.materials.export.pairs import CHECK_LOG2, Pairs, pairs_of
from tests.materials.export.export_materials import BRUSHED, FOIL, GOLD, PAPER, PLASTIC
from tests.materials.export.facets_by_hand import assert_costs


def inputs_of(node: ET.Element) -> dict[str, np.ndarray]:
    """The numbers of a node's inputs, by name."""
    numeric = (one for one in node if one.get("type") in ("float", "vector2", "color3"))
    return {one.get("name", ""): np.array([float(v) for v in one.get("value", "").split(",")]) for one in numeric}


def facets(pairs: Pairs, alpha: np.ndarray) -> np.ndarray:
    """D G / (4 cos_i cos_o) of GGX, height-correlated (Heitz 2014, eqs 71, 72, 85, 99); `alpha` along x and y."""
    wi, wo, h = (np.stack(w, axis=-1) for w in (pairs.wi, pairs.wo, pairs.h))
    ax, ay = alpha
    d = 1 / (np.pi * ax * ay * ((h[:, 0] / ax) ** 2 + (h[:, 1] / ay) ** 2 + h[:, 2] ** 2) ** 2)
    masked = [np.sqrt((ax * w[:, 0]) ** 2 + (ay * w[:, 1]) ** 2 + w[:, 2] ** 2) / w[:, 2] for w in (wi, wo)]
    return d / (2 * (masked[0] + masked[1]) * wi[:, 2] * wo[:, 2])


def written_f(path: Path, pairs: Pairs) -> np.ndarray:
    """f (N, 3) of the document's nodes, added up."""
    f = np.zeros((len(pairs), 3))
    far, cos_d = pairs.far, np.sum(np.multiply(pairs.wo, pairs.h), axis=0)[:, None]
    for node in ET.parse(path).getroot():
        numbers = inputs_of(node)
        if node.tag == "oren_nayar_diffuse_bsdf":
            assert numbers["roughness"] == 0
            f[~far] += numbers["color"] / np.pi
        elif node.tag == "translucent_bsdf":
            f[far] += numbers["color"] / np.pi
        elif node.tag == "generalized_schlick_bsdf":
            reflected = (numbers["color90"] - numbers["color0"]) * (1 - cos_d) ** numbers["exponent"]
            f[~far] += ((numbers["color0"] + reflected) * facets(pairs, numbers["roughness"])[:, None])[~far]
        elif node.tag == "dielectric_bsdf":
            f0 = ((numbers["ior"] - 1) / (numbers["ior"] + 1)) ** 2
            through = numbers["tint"] * (1 - f0 - (1 - f0) * (1 - cos_d) ** 5)
            f[far] += (through * facets(pairs, numbers["roughness"])[:, None])[far]
    return f


@pytest.mark.parametrize("material", [PLASTIC, BRUSHED, GOLD, FOIL, PAPER], ids=lambda material: material.name)
def test_the_file_holds_the_numbers_that_were_fitted(tmp_path: Path, material: Material) -> None:
    write(material, tmp_path / "a.mtlx")
    found, _ = likeness(material)
    pairs = pairs_of(material, 9, 1)
    kd, kt_d = (np.broadcast_to(colour, 3) / np.pi for colour in (found.kd, found.kt_d))
    expected = np.where(pairs.far[:, None], kt_d, kd) + sum(TOOL.eval(pairs, part) for part in found.parts)
    np.testing.assert_allclose(written_f(tmp_path / "a.mtlx", pairs), expected, rtol=1e-5, atol=1e-7)
    assert expected.max() > 0.1


def test_roughness_is_the_slope_itself(tmp_path: Path) -> None:
    """GGX's alpha, along the tangent first: a square root of it would be three times as much."""
    write(GOLD, tmp_path / "gold.mtlx")
    write(FOIL, tmp_path / "foil.mtlx")
    kind = "generalized_schlick_bsdf"
    for name, material in {"gold": GOLD, "foil": FOIL}.items():
        (written,) = (inputs_of(node)["roughness"] for node in ET.parse(tmp_path / f"{name}.mtlx").getroot().iter(kind))
        np.testing.assert_allclose(written, (material.lobes[0].mx, material.lobes[0].my), rtol=0.15)


@pytest.mark.parametrize("material", [PLASTIC, BRUSHED, GOLD, FOIL, PAPER], ids=lambda material: material.name)
def test_the_file_costs_what_is_stated(tmp_path: Path, material: Material) -> None:
    cost = write(material, tmp_path / "a.mtlx")
    pairs = pairs_of(material, CHECK_LOG2, seed=1)
    assert_costs(pairs.samples, written_f(tmp_path / "a.mtlx", pairs), cost.share)
    for kind, mode in {"generalized_schlick_bsdf": "R", "dielectric_bsdf": "T"}.items():
        for node in ET.parse(tmp_path / "a.mtlx").getroot().iter(kind):
            (scatter,) = (one.get("value") for one in node if one.get("name") == "scatter_mode")
            assert scatter == mode
            assert mode == "T" or inputs_of(node)["exponent"] == 5  # Schlick's
