"""Edited materials in the path tracer: unedited they are their documents; samples have the density that is said."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material
from tests.tools.checks import assert_sampler
from tests.tools.in_mitsuba import InMitsuba, f_cos

SATIN = Material(kd=(0.4, 0.3, 0.2), lobes=(Lobe(mx=0.3, my=0.15, r0=0.5, k=(0.9, 0.5, 0.3)),))
CURTAIN = Material(kd=0.2, kt_d=0.4, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5, side="transmission"),))
BEADS = Material(kd=0.1, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5, retro=True),))


def plugin(material: Material, edited: Any = None) -> Any:
    import mitsuba as mi

    from lambent.baking.bsdfs.edited_plugin import edited_dict

    return mi.load_dict(edited_dict(material, edited or of_material(material)))


@pytest.mark.parametrize(("material", "theta_deg"), [(SATIN, 62.0), (CURTAIN, 153.0), (BEADS, 62.0)],
                         ids=["satin", "curtain", "beads"])  # fmt: skip
def test_it_scatters_as_its_document_and_samples_follow_the_density(
    mi: Any, material: Material, theta_deg: float
) -> None:
    from lambent.baking.bsdfs.material_plugin import material_dict

    made = plugin(material)
    pairs = normalize(np.random.default_rng(0).normal(size=(2, 4096, 3)))
    found, known = f_cos(made, *pairs), f_cos(material_dict(material), *pairs)
    assert np.abs(found - known).max() < 2e-3 * known.max() and known.any()
    assert_sampler(InMitsuba(made), theta_deg, -18.0, samples=400_000)


def test_curves_that_no_document_has(mi: Any) -> None:
    """Its values are those of the terms, steps and all."""
    start, rng = of_material(SATIN), np.random.default_rng(2)
    name = start.terms[1].factors[0].curve
    edited = start.with_curve(name, Curve(np.repeat(rng.random((65, 3)), 64, axis=0)[: 4096 + 1]))
    wi, wo = normalize(rng.normal(size=(2, 4096, 3)))
    wi[:, 2], wo[:, 2] = np.abs(wi[:, 2]), np.abs(wo[:, 2])
    found, expected = f_cos(plugin(SATIN, edited), wi, wo), edited.eval(wi, wo) * wi[:, 2:]
    assert np.mean(np.abs(found - expected).max(axis=1) > 1e-3 * expected.max()) < 0.01  # at the steps' edges
