"""Irradiance by the normal, against its integrals."""

from __future__ import annotations

import numpy as np

from lambent.baked.probes.irradiance import basis_of, irradiance_of
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize


def test_irradiance_of_a_cube_against_its_integral() -> None:
    w = normalize(face_directions(64))
    n = normalize(np.random.default_rng(0).normal(size=(50, 3)))
    even = irradiance_of(np.full((6, 16, 16, 3), 2.0))
    assert np.allclose(basis_of(n) @ even, 2 * np.pi, rtol=2e-3)
    a = normalize(np.array([1.0, 2.0, -2.0]))
    linear = irradiance_of(np.repeat((w @ a)[..., None], 3, axis=-1))  # L = a.w: E = 2 pi/3 a.n
    assert np.allclose(basis_of(n) @ linear, 2 * np.pi / 3 * (n @ a), atol=5e-3)
    squared = irradiance_of(np.repeat((w @ a)[..., None] ** 2, 3, axis=-1))  # E = pi/4 (1 + (a.n)^2)
    assert np.allclose(basis_of(n) @ squared, np.pi / 4 * (1 + (n @ a) ** 2), atol=5e-3)
