"""White furnace: what comes back from a surface in uniform light of radiance 1."""

from __future__ import annotations

import numpy as np

from lambent.materials.checking.check import Scatters, furnace


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
