"""Angles that curves run over: known values, ranges, and precision in float32 near the mirror direction."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import components
from lambent.materials.factored.parametrisations import PARAMETRISATIONS, angle_of

DEG = np.pi / 180


def angle(name: str, wi: tuple[float, float], wo: tuple[float, float], stretch: float = 1.0) -> float:
    wi_, wo_ = (components(direction(theta * DEG, phi * DEG)) for theta, phi in (wi, wo))
    return float(angle_of(name, wi_, wo_, stretch) / DEG)


@pytest.mark.parametrize(
    ("name", "wi", "wo", "expected"),
    [
        ("theta_i", (25, 70), (50, 0), 25), ("theta_o", (25, 70), (50, 0), 50),
        ("theta_h", (30, 0), (50, 0), 40), ("theta_h", (30, 180), (50, 0), 10),
        ("theta_d", (30, 0), (50, 0), 10), ("theta_d", (30, 180), (50, 0), 40),
        ("theta_r", (30, 180), (50, 0), 20), ("theta_r", (30, 0), (50, 0), 80), ("theta_r", (80, 0), (80, 0), 160),
        ("slope_t", (30, 0), (50, 0), 40), ("slope_b", (30, 0), (50, 0), 0),
        ("slope_b", (30, 90), (50, 90), 40), ("gamma_t", (30, 0), (50, 0), 40), ("gamma_b", (30, 0), (50, 0), 0),
        ("gamma_t", (30, 45), (50, 45), np.degrees(np.arccos(np.sqrt(np.cos(40 * DEG))))),
    ],
)  # fmt: skip
def test_known_angles(name: str, wi: tuple[float, float], wo: tuple[float, float], expected: float) -> None:
    assert angle(name, wi, wo) == pytest.approx(expected, abs=1e-9)


def test_stretch_makes_circles_of_ellipses() -> None:
    """Half vectors on the ellipse tan = mx along t, my along b have one stretched theta_h."""
    mx, my = 0.1, 0.4
    along = direction(np.arctan(mx), 0.0)
    across = direction(np.arctan(my), np.pi / 2)
    found = [angle_of("theta_h", components(h), components(h), np.sqrt(my / mx)) for h in (along, across)]
    assert found[0] == pytest.approx(found[1])
    assert np.tan(found[0]) == pytest.approx(np.sqrt(mx * my))


@pytest.mark.parametrize("name", PARAMETRISATIONS)
def test_float32_is_precise_at_every_scale(name: str) -> None:
    """Half vectors and mirror directions off by 1e-5 to 1 rad: within 1e-6 rad of float64."""
    rng = np.random.default_rng(2)
    wo = direction(rng.uniform(0, 1.4, 20_000), rng.uniform(0, 2 * np.pi, 20_000))
    wi = wo * [-1, -1, 1] + rng.normal(size=(20_000, 3)) * 10 ** rng.uniform(-5, 0, (20_000, 1))
    wi[:, 2] = np.abs(wi[:, 2])
    wi = (wi / np.linalg.norm(wi, axis=1, keepdims=True)).astype(np.float32)
    wo = wo.astype(np.float32)
    single = [tuple(w[:, c] for c in range(3)) for w in (wi, wo)]
    double = [tuple(w[:, c].astype(float) for c in range(3)) for w in (wi, wo)]
    exact = angle_of(name, *double)
    assert np.abs(angle_of(name, *single) - exact).max() < 1e-6
    assert exact.min() >= 0
    assert exact.max() <= (np.pi if name == "theta_r" else np.pi / 2) + 1e-12
