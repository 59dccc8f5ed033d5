"""Find lamps in a cube map: connected bright texels.

A lamp is brighter than `BRIGHT` times the mean of all directions and holds at least `LEAST_SHARE` of the light. It is
removed, its texels get the median of the ring around them, and the search repeats: for fainter lamps, and for lamps
inside regions too large for one, such as the sun in a bright sky. Large lamps are cut until all are small relative to
wide lobes; the sun is first separated from the window it shines through.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats, components
from lambent.core.geometry.cubemap import directions_at, texel_solid_angles
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance

BRIGHT = (2.0, 2.0, 4.0, 8.0)  # multiples of the remaining mean, one per search
LEAST_SHARE = 0.001  # of all light
LARGEST_SR = 1.0  # of a lamp before cutting; a bright half of the sky is larger and not a lamp
MOST = 32
CONTRAST = 16.0  # brightest texel over the median of a lamp, above which the two are separated: the sun in a window
LEAST_RADIUS = 0.06  # lamps above are cut in two while there are fewer than `MOST`
CUT_INSTEAD = 8.0  # a lamp this many times as bright as the faintest is cut, and the faintest dropped
RING = 3  # width in texels of the ring around a lamp whose median replaces it
CORNER = 12**-0.5  # four points at -+ this share of a texel have the variance of its area


@dataclass(frozen=True, eq=False)
class Lamp:
    """Part of a cube map (6, N, N, 3): flattened indices `texels` (K,), and their `excess` (K, 3) over `rest`.

    `flux` (K, 3) is excess times solid angle, in W/m^2 on a surface that faces it. `radius_rad` is sqrt(2) times the
    larger standard deviation of directions: the rms radius of a round lamp.
    """

    texels: NDArray[np.intp]
    excess: Floats
    flux: Floats
    radius_rad: float

    @cached_property
    def power(self) -> float:
        """Luminance of its flux."""
        return float(luminance(self.flux).sum())


def find_lamps(cube: Floats) -> list[Lamp]:
    """The brightest lamps of a cube map (6, N, N, 3) of finite values >= 0; at most `MOST`, smallest first."""
    n = cube.shape[1]
    omega = np.tile(texel_solid_angles(n).ravel(), 6)
    rest = cube.reshape(-1, 3).astype(np.float64)
    total = float(luminance(rest) @ omega)
    lamps: list[Lamp] = []
    for times in BRIGHT if n > 1 else ():
        found = _search(rest, omega, n, total, times)
        for lamp in found:
            rest[lamp.texels] -= lamp.excess
        lamps += found
    lamps = sorted(lamps, key=lambda lamp: -lamp.power)[:MOST]
    while large := max((lamp for lamp in lamps if lamp.radius_rad > LEAST_RADIUS), key=_worth_cutting, default=None):
        if len(lamps) == MOST:
            if large.power < CUT_INSTEAD * lamps[-1].power:
                break
            lamps.pop()
        lamps.remove(large)
        lamps = sorted([*lamps, *_halves(large, omega, n)], key=lambda lamp: -lamp.power)
    return sorted(lamps, key=lambda lamp: lamp.radius_rad)


def _worth_cutting(lamp: Lamp) -> float:
    return lamp.power * lamp.radius_rad


def _halves(lamp: Lamp, omega: Floats, n: int) -> list[Lamp]:
    """Cut a lamp in two: the brightest part from the rest if they differ much, else at its middle across its length."""
    bright = luminance(lamp.excess)
    peak, median = float(bright.max()), float(np.median(bright))
    if peak > CONTRAST * median:
        first = bright > np.sqrt(peak * median)
    else:
        w = corners(n)[lamp.texels].mean(axis=1)
        mean, covariance = moments(w, luminance(lamp.flux))
        first = (w - mean) @ np.linalg.eigh(covariance)[1][:, -1] < 0
    return [_lamp(lamp.texels[part], lamp.excess[part], omega, n) for part in (first, ~first)]


def _lamp(texels: NDArray[np.intp], excess: Floats, omega: Floats, n: int) -> Lamp:
    flux = excess * omega[texels, None]
    return Lamp(texels, excess, flux, _radius(texels, flux, n))


def _search(rest: Floats, omega: Floats, n: int, total: float, times: float) -> list[Lamp]:
    """Lamps in radiance `rest` (6 N N, 3): at least `times` as bright as its mean."""
    bright = luminance(rest)
    light = bright * omega
    at = np.flatnonzero(bright > times * light.sum() / (4 * np.pi))
    beside = neighbours(n)
    place = np.full(len(rest), -1)
    place[at] = np.arange(len(at))
    row, column = np.repeat(np.arange(len(at)), 4), place[beside[at]].ravel()
    joined = column >= 0
    label = components(np.column_stack([row[joined], column[joined]]), len(at))
    share = np.bincount(label, light[at])
    brightest = np.argsort(-share, kind="stable")[:MOST]
    found = []
    for number in brightest[share[brightest] >= LEAST_SHARE * total]:
        texels = at[label == number]
        excess = np.maximum(rest[texels] - _around(rest, texels, place, beside), 0)
        if excess.any() and omega[texels].sum() < LARGEST_SR:
            found.append(_lamp(texels, excess, omega, n))
    return found


def _around(rest: Floats, texels: NDArray[np.intp], bright: NDArray[np.intp], beside: NDArray[np.intp]) -> Floats:
    """(3,) median of the ring of dim texels around `texels`; 0 without a ring."""
    ring = np.zeros(len(rest), bool)
    ring[texels] = True
    reached = texels
    for _ in range(RING):
        reached = beside[reached].ravel()
        reached = reached[~ring[reached]]
        ring[reached] = True
    ring[texels] = False
    ring &= bright < 0
    return np.median(rest[ring], axis=0) if ring.any() else np.zeros(3)


def _radius(texels: NDArray[np.intp], flux: Floats, n: int) -> float:
    w = corners(n)[texels].reshape(-1, 3)
    return float(np.sqrt(2 * np.linalg.eigvalsh(moments(w, np.repeat(luminance(flux), 4))[1])[-1]))


def moments(points: Floats, weight: Floats) -> tuple[Floats, Floats]:
    """Mean (3,) and covariance (3, 3) of points (M, 3) with weights (M,)."""
    weight = weight / weight.sum()
    mean = weight @ points
    about = points - mean
    return mean, (about * weight[:, None]).T @ about


@lru_cache(4)
def corners(n: int) -> Floats:
    """(6 n n, 4, 3) unit directions of four points of each texel, with the variance of its area."""
    step = np.array([[-CORNER, -CORNER], [-CORNER, CORNER], [CORNER, -CORNER], [CORNER, CORNER]]) / n
    row, column = np.indices((n, n)).reshape(2, -1, 1)
    s, t = ((place + 0.5) / n * 2 - 1 + step[:, k] for k, place in enumerate((column, row)))
    faces = [directions_at(np.full(s.shape, face), s, t) for face in range(6)]
    return normalize(np.concatenate(faces))


@lru_cache(4)
def neighbours(n: int) -> NDArray[np.intp]:
    """(6 n n, 4) texels to the left, right, top and bottom of each, across the edges of the faces."""
    index = np.arange(6 * n * n).reshape(6, n, n)
    wide = np.pad(index, ((0, 0), (1, 1), (1, 1)))
    row, column = np.nonzero(np.pad(np.zeros((n, n), bool), 1, constant_values=True))
    place = (np.stack([column, row]) - 0.5) / n * 2 - 1
    for face in range(6):
        wide[face, row, column] = texel_at(directions_at(np.full(len(row), face), *place), n)
    middle = slice(1, -1)
    sides = (wide[:, middle, :-2], wide[:, middle, 2:], wide[:, :-2, middle], wide[:, 2:, middle])
    return np.stack([side.ravel() for side in sides], axis=-1)


def texel_at(w: Floats, n: int) -> NDArray[np.intp]:
    """(...) flattened texel index of directions (..., 3) in a cube map of n x n faces."""
    axis = np.abs(w).argmax(axis=-1)
    major = np.take_along_axis(w, axis[..., None], -1)[..., 0]
    face = 2 * axis + (major < 0)
    x, y, z = np.moveaxis(w / np.abs(major)[..., None], -1, 0)
    s = np.choose(face, [-z, z, x, x, x, -x])
    t = np.choose(face, [-y, -y, z, -z, -y, -y])
    row, column = (np.clip(np.floor((np.stack([t, s]) + 1) / 2 * n), 0, n - 1)).astype(np.intp)
    return np.asarray((face * n + row) * n + column)
