"""Checks of `lambent materials check` as assertions."""

from __future__ import annotations

import numpy as np

from lambent.materials.checking.check import (
    RECIPROCITY_LIMIT,
    Scatters,
    check_sampler,
    furnace,
    reciprocity_error,
    sampler_failures,
)


def assert_sampler(bsdf: Scatters, theta_deg: float, phi_deg: float, samples: int = 1_000_000) -> None:
    """Fail where samples do not follow the density for this wo, or do not give the albedo of quadrature."""
    found = sampler_failures((check_sampler(bsdf, theta_deg, phi_deg, samples=samples),))
    assert not found, "; ".join(found)


def assert_reciprocal(bsdf: Scatters) -> None:
    """Fail where swapping the directions changes f."""
    error = reciprocity_error(bsdf)
    assert error <= RECIPROCITY_LIMIT, f"swapping wi and wo changes f by up to {error:.2g} of its value"


def assert_passive(bsdf: Scatters, *, tolerance: float = 3e-3) -> None:
    """Fail where any direction up to 89 degrees returns more light than arrives."""
    highest, theta, phi = furnace(bsdf, samples=1 << 12).highest
    assert highest <= 1 + tolerance, f"albedo {highest:.4f} at theta {theta:g}, phi {phi:g} degrees"


def assert_lossless(bsdf: Scatters, *, tolerance: float = 3e-3) -> None:
    """Fail where any direction up to 89 degrees does not return all the light."""
    result = furnace(bsdf)
    t, p, c = np.unravel_index(int(np.argmax(np.abs(result.albedo - 1))), result.albedo.shape)
    value = result.albedo[t, p, c]
    assert abs(value - 1) <= tolerance, (
        f"albedo {value:.4f} at theta {result.theta_deg[t]:g}, phi {result.phi_deg[p]:g}"
    )
