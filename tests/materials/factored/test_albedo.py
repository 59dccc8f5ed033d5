"""Equivalent albedos: known answers, other integrators, and sharp lobes."""

from __future__ import annotations

import tracemalloc
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
from lambent.materials.factored.terms import Editable
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
    expected = MaterialBSDF(material).albedo(wo, 16384).mean(axis=0)
    assert albedo(of_material(material), "reflection") == pytest.approx(expected, rel=0.01)


def test_edits_of_curves_and_colours_are_seen() -> None:
    """Linear in each curve; nothing is kept from the last one."""
    start = of_material(Material(kd=0.0, lobes=(Lobe(mx=0.2, my=0.2, r0=0.5),)))
    one = albedo(start, "reflection")
    name = start.terms[0].factors[0].curve
    doubled = start.with_curve(name, Curve(start.curves[name].values * (2.0, 1.0, 0.5)))
    assert albedo(doubled, "reflection") == pytest.approx(one * (2.0, 1.0, 0.5), rel=1e-9)
    tinted = Editable(start.name, (replace(start.terms[0], scale=(0.0, 1.0, 0.5)),), start.curves)
    assert albedo(tinted, "reflection") == pytest.approx(
        one * (0.0, 1.0, 0.5) / np.array(start.terms[0].scale), rel=1e-9
    )
    assert not albedo(start, "transmission").any()


def test_an_anisotropic_lobe_takes_no_more_memory_than_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight turns of both directions at once were 1.2 GB."""
    monkeypatch.setattr("lambent.materials.factored.albedo._made", {})
    brushed = of_material(Material(kd=0.0, lobes=(Lobe(mx=0.1, my=0.3, r0=0.5),)))
    tracemalloc.start()
    albedo(brushed, "reflection")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 300e6
