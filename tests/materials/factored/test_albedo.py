"""Equivalent albedos: known answers, other integrators, and sharp lobes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.core.geometry.sequences import r2
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.albedo import albedo, term_albedo
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable
from lambent.materials.models import model_named


def test_a_diffuse_surface_has_its_colour() -> None:
    material = Material(kd=(0.5, 0.3, 0.2), kt_d=(0.1, 0.2, 0.3))
    assert albedo(of_material(material), "reflection") == pytest.approx([0.5, 0.3, 0.2], abs=1e-12)
    assert albedo(of_material(material), "transmission") == pytest.approx([0.1, 0.2, 0.3], abs=1e-12)


def test_a_blinn_lobe_of_exponent_0() -> None:
    """(e + 2) / 2 pi cos^e G / (4 cos cos), white: .5524 +- .0002 by Monte Carlo; Ben-Artzi 2007 has .56."""
    lobe = editable(model_named("cook-torrance")())
    constant = {name: Curve.constant() for name in lobe.curves}
    found = term_albedo(replace(lobe.terms[0], scale=(1 / np.pi,) * 3), constant)
    assert found == pytest.approx([0.5524] * 3, abs=1e-3)


@pytest.mark.parametrize(
    "lobe", [Lobe(mx=0.1, my=0.1, r0=0.5), Lobe(mx=0.1, my=0.3, r0=0.5), Lobe(mx=0.005, my=0.005, r0=0.9)], ids=str
)
def test_lobes_by_importance_sampling(lobe: Lobe) -> None:
    """The mean over cosine distributed viewers of what the lobe's own sampling finds."""
    u = r2(256)
    cosine, phi = np.sqrt(1 - u[:, 0]), 2 * np.pi * u[:, 1]
    wo = np.stack([np.sqrt(u[:, 0]) * np.cos(phi), np.sqrt(u[:, 0]) * np.sin(phi), cosine], axis=1)
    material = Material(kd=0.0, lobes=(lobe,))
    expected = MaterialBSDF(material).albedo(wo, 4096).mean(axis=0)
    assert albedo(of_material(material), "reflection") == pytest.approx(expected, rel=0.01)
