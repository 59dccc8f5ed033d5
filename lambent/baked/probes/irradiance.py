"""Irradiance by normal from distant radiance, to second-order spherical harmonics (Ramamoorthi & Hanrahan 2001).

Within a volume, the points of a light field store irradiance by normal (Greger et al. 1998, "The irradiance volume").
Between points it is interpolated with Shepard's weights in the form of Franke and Little. These vanish at the first
point left out, which makes the interpolation continuous.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from lambent.baked.light_fields.light_field import LightField
from lambent.core.arrays import Floats
from lambent.core.geometry import octahedral
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance

# E(n) is a sum over `basis_of` n (eq. 10). Each weight is the cosine lobe's coefficient times the square of the
# harmonic's norm.
WEIGHTS = np.array([1 / 4, 1 / 2, 1 / 2, 1 / 2, 15 / 16, 15 / 16, 5 / 64, 15 / 16, 15 / 64])
NEAREST = 12  # points of a volume that count at a place
MAPS_AT_ONCE = 64


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


class IrradianceVolume:
    """Irradiance within the volume of a light field."""

    def __init__(self, field: LightField) -> None:
        from scipy.spatial import cKDTree

        side = field.radiance.shape[1]
        by_normal = basis_of(octahedral.texel_directions(side)) * octahedral.texel_solid_angles(side)[..., None]
        some = range(0, field.radiance.shape[0], MAPS_AT_ONCE)
        maps = [_summed(field.radiance[i : i + MAPS_AT_ONCE], by_normal.reshape(-1, 9)) for i in some]
        self._by_normal: Floats = WEIGHTS[:, None] * np.concatenate(maps)
        self._tree = cKDTree(field.points)

    def at(self, x: Floats, n: Floats) -> Floats:
        """(k, 3) irradiance, W/m^2, at places x (k, 3) with unit normals n (k, 3)."""
        count = len(self._by_normal)
        distance, point = self._tree.query(x, min(NEAREST + 1, count))
        distance, point = distance.reshape(len(x), -1), point.reshape(len(x), -1)
        reach = distance[:, -1:] * (1 if count > NEAREST else 2) + 1e-9
        weight = (np.maximum(reach - distance, 0) / (reach * np.maximum(distance, 1e-9))) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        by_normal = np.einsum("kj,kjbc->kbc", weight, self._by_normal[point])
        return np.asarray(np.maximum(np.einsum("kb,kbc->kc", basis_of(n), by_normal), 0))


def _summed(maps: Floats, flux: Floats) -> Floats:
    """Coefficients (P, 9, 3) of maps (P, E, E, 3)."""
    return np.asarray(np.einsum("pkc,kb->pbc", maps.reshape(len(maps), -1, 3).astype(float), flux, optimize=True))
