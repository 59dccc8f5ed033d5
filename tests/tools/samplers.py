"""The check of samplers as an assertion."""

from __future__ import annotations

from lambent.materials.checking.check import Scatters, check_sampler, sampler_failures


def assert_sampler(bsdf: Scatters, theta_deg: float, phi_deg: float, samples: int = 1_000_000) -> None:
    """Fail where samples do not follow the density for this wo, or do not give the albedo of quadrature."""
    found = sampler_failures((check_sampler(bsdf, theta_deg, phi_deg, samples=samples),))
    assert not found, "; ".join(found)
