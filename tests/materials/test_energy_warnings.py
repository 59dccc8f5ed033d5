"""Every energy warning comes well below twice the light that arrives."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF, more_than_arrives
from lambent.materials.fitting.fit import fit
from tests.materials.fitting.known_answers import FEW, PAINT, grey


@pytest.mark.parametrize(("albedo", "warned"), [(0.9, False), (1.0, False), (1.005, False), (1.02, True), (1.5, True)])
def test_two_per_cent_more_than_arrives_are_too_many(albedo: float, warned: bool) -> None:
    assert more_than_arrives(np.array([0.2, albedo])).tolist() == [False, warned]


@pytest.mark.parametrize(("kd", "warned"), [(0.5, False), (1.0, True)])
def test_a_fit_says_that_it_returns_more_than_arrives(kd: float, warned: bool) -> None:
    result = fit(grey(PAINT, FEW), fix={"kd": kd, "ks": 0.7, "mx": 0.15, "r0": 0.06, "alpha": 0.0})
    theta = np.radians([0.0, 45.0, 80.0])
    highest = MaterialBSDF(result.material).albedo(direction(theta, 0.0)).max()
    assert 1.02 < highest < 1.5 if warned else highest < 0.99
    assert any("scatters more light than it receives" in line for line in result.warnings) is warned
