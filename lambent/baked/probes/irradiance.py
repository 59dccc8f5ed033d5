"""Irradiance by normal from distant radiance, to second-order spherical harmonics (Ramamoorthi & Hanrahan 2001)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance

# E(n) is a sum over `basis_of` n (eq. 10). Each weight is the cosine lobe's coefficient times the square of the
# harmonic's norm.
WEIGHTS = np.array([1 / 4, 1 / 2, 1 / 2, 1 / 2, 15 / 16, 15 / 16, 5 / 64, 15 / 16, 15 / 64])


def basis_of(n: Floats) -> Floats:
    """(..., 9) products of the components of unit vectors, in the order of WEIGHTS."""
    x, y, z = n[..., 0], n[..., 1], n[..., 2]
    return np.stack([np.ones_like(x), x, y, z, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y], axis=-1)


def irradiance_from(w: Floats, flux: Floats) -> Floats:
    """Coefficients (9,), by `basis_of`, of irradiance by `flux` (K,), W/m^2 at normal incidence, from unit w (K, 3)."""
    return np.asarray(WEIGHTS * (flux @ basis_of(w)))


def irradiance_of(radiance: Floats) -> Floats:
    """Coefficients (9,), by `basis_of` normals, of the luminance of irradiance from a radiance cube (6, N, N, 3)."""
    return np.asarray(luminance(radiance.astype(float)).ravel() @ _weights_of_cube(radiance.shape[1]))


@lru_cache(maxsize=8)
def _weights_of_cube(n: int) -> Floats:
    """(6 n n, 9) what a texel's radiance contributes to each coefficient."""
    by_direction = WEIGHTS * basis_of(normalize(face_directions(n)))  # (6, n, n, 9)
    return np.asarray((by_direction * texel_solid_angles(n)[..., None]).reshape(-1, 9))
