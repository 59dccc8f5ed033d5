"""Irradiance within a volume, from the maps of a light field's points (Greger et al. 1998, "The irradiance volume").

Each point stores irradiance by normal, computed from its map, to second-order spherical harmonics. Between points it is
interpolated with Shepard's weights in the form of Franke and Little. These vanish at the first point left out, which
makes the interpolation continuous.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from lambent.baked.light_fields.light_field import LightField, Maps
from lambent.baked.probes.irradiance import WEIGHTS, basis_of
from lambent.core.arrays import Floats
from lambent.core.geometry.octahedral import texel_directions, texel_solid_angles

NEAREST = 12
MAPS_AT_ONCE = 64


class IrradianceVolume:
    """Irradiance within the volume of a light field."""

    def __init__(self, field: LightField) -> None:
        from scipy.spatial import cKDTree

        side = field.radiance.shape[1]
        flux = (basis_of(texel_directions(side)) * texel_solid_angles(side)[..., None]).reshape(-1, 9)
        maps = np.concatenate([_summed(some, flux) for some in _parts(field.radiance)])
        self._by_normal: Floats = WEIGHTS[:, None] * maps
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


def _parts(maps: Maps) -> Iterator[Floats]:
    for i in range(0, maps.shape[0], MAPS_AT_ONCE):
        yield maps[i : i + MAPS_AT_ONCE]


def _summed(maps: Floats, flux: Floats) -> Floats:
    """Coefficients (P, 9, 3) of maps (P, E, E, 3)."""
    return np.asarray(np.einsum("pkc,kb->pbc", maps.reshape(len(maps), -1, 3).astype(float), flux, optimize=True))
