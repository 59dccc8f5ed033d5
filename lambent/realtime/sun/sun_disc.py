"""Cube maps without the sun's disc, which each pixel adds by itself, as far as it sees it (`sun_light` of shade.wgsl).

Texels about the sun that are brighter than any white surface in its light show the disc, in part at least: they get the
median of the ring around them. A probe in the shade shows none, and stays as it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lambent.baked.probes.irradiance import irradiance_from
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import face_directions, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.core.plain import Triple
from lambent.realtime.light.baked import Probe
from lambent.store.contract import SunRecord

REACH_TEXELS = 2.5  # beyond twice the disc's radius: what bakes and linear look-ups spread it over
RING_TEXELS = 3.0  # around that, the sky behind the disc


@dataclass(frozen=True, eq=False)
class Spot:
    """Texels (K,) of a flattened cube map that a sun may show in, and those (R,) around them.

    w (K, 3) and omega (K,) are the texels' unit directions and solid angles.
    """

    texels: NDArray[np.intp]
    ring: NDArray[np.intp]
    w: Floats
    omega: Floats


@lru_cache(8)
def spot_of(direction: Triple, radius_rad: float, n: int) -> Spot:
    """Where a sun may show in a cube map of n x n faces."""
    w = normalize(face_directions(n)).reshape(-1, 3)
    away = 2 * np.arcsin(np.clip(np.linalg.norm(w - np.asarray(direction), axis=1) / 2, 0, 1))
    reach = 2 * radius_rad + REACH_TEXELS * 2 / n
    texels = np.flatnonzero(away < reach)
    ring = np.flatnonzero((away >= reach) & (away < reach + RING_TEXELS * 2 / n))
    return Spot(texels, ring, w[texels], np.tile(texel_solid_angles(n).ravel(), 6)[texels])


def without_sun(probe: Probe, sun: SunRecord | None, unit: float = 1.0) -> Probe:
    """A probe, and the sky of its light field, without the sun's disc; the same where they show none.

    The light of all is in units of `unit` W/(sr m^2), the probe's `irradiance` is not.
    """
    if sun is None:
        return probe
    if probe.sky is not None:
        probe = replace(probe, sky=sky_without(probe.sky, sun))
    spot = spot_of(sun.direction, sun.radius_rad, probe.radiance.shape[1])
    excess = _excess(probe.radiance, sun, spot)
    if not excess.any():
        return probe
    gone = irradiance_from(spot.w, luminance(excess) * spot.omega) * unit
    irradiance = tuple(float(value) for value in np.array(probe.irradiance) - gone) if probe.irradiance else ()
    return replace(probe, radiance=_less(probe.radiance, excess, spot), irradiance=irradiance)


def sky_without(sky: Floats, sun: SunRecord) -> Floats:
    """A cube map (6, N, N, 3) without the sun's disc."""
    spot = spot_of(sun.direction, sun.radius_rad, sky.shape[1])
    return _less(sky, _excess(sky, sun, spot), spot)


def _excess(cube: Floats, sun: SunRecord, spot: Spot) -> Floats:
    """(K, 3) radiance of the disc in the texels of its spot."""
    flat = np.nan_to_num(cube, nan=0.0).reshape(-1, 3)
    found = flat[spot.texels].astype(float)
    shows = luminance(found) > luminance(np.asarray(sun.irradiance)) / np.pi
    behind = np.median(flat[spot.ring], axis=0) if len(spot.ring) else np.zeros(3)
    return np.where(shows[:, None], np.maximum(found - behind, 0), 0)


def _less(cube: Floats, excess: Floats, spot: Spot) -> Floats:
    rest = np.nan_to_num(cube, nan=0.0).reshape(-1, 3)
    rest[spot.texels] -= excess.astype(rest.dtype)
    return rest.reshape(cube.shape)
