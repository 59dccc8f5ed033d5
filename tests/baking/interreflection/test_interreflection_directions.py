"""First-bounce directions have the density that is said, on every side."""

from __future__ import annotations

from types import ModuleType

import numpy as np
import pytest

from lambent.baking.interreflection.directions import Sides, density, sampled
from lambent.core.geometry.directions import direction
from lambent.materials.checking.chi_square import chi_square
from tests.tools.in_mitsuba import vectors


@pytest.mark.parametrize(("through", "back"), [(0.0, 0.0), (0.3, 0.25), (1.0, 0.0)])
def test_chi_square(mi: ModuleType, through: float, back: float) -> None:
    wo, lobes = mi.Vector3f(direction(np.radians(30.0), np.radians(20.0)).tolist()), []
    sides = Sides(mi.Float(through), mi.Float(back))

    def directions(u: np.ndarray) -> np.ndarray:
        u_lobe = np.random.default_rng(len(lobes)).random(len(u))
        lobes.append(len(u))
        wi, pdf = sampled(wo, sides, mi.Float(u[:, 0]), mi.Float(u_lobe), mi.Point2f(u[:, 1:].T))
        assert np.allclose(pdf, np.where(np.array(pdf) > 0, density(wi, wo, sides), 0), rtol=1e-4)
        return np.where(np.array(pdf) > 0, np.array(wi), 0.0).T.astype(float)

    found = chi_square(directions, lambda w: np.array(density(vectors(w), wo, sides)), samples=100_000)
    assert found.p_value > 1e-4 and found.pdf_integral == pytest.approx(1, abs=0.01)
    z, count = found.cells[:, :2].mean(axis=1), found.observed[:-1]
    assert count[z < 0].sum() == pytest.approx(through * count.sum(), rel=0.02)
