"""Procedural surroundings, by name, as lat-long images of linear radiance: interiors and gardens seen from one point.

They light scenes without any file. Rooms: a ray from the point hits one wall of a box; windows are parts of walls.
Window panes and lamps are small and bright, as in captured environments: they show as highlights and cast shadows.
Gardens: a sky with sun and clouds, trees and a lawn; noise is a sum of plane waves over the unit sphere, without seams
or poles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions

HEIGHT, SAMPLES = 384, 2  # rows of an image; samples per texel and axis
Mask = NDArray[np.bool_]

_WINDOWS = (-5.2, -1.6, 2.0)  # z of those in the gallery
SUN = normalize(np.array([0.62, 0.5, 0.52]))
SUN_RADIUS_DEG, SUN_RADIANCE = 1.3, np.array([16_000.0, 13_000.0, 9_200.0])  # larger than real, with the same light
EYE_M = 1.2  # height of the point over the lawn
LEAVES = np.array([[0.10, 0.22, 0.03], [0.30, 0.34, 0.04], [0.62, 0.24, 0.02], [0.52, 0.07, 0.02], [0.06, 0.13, 0.05]])


def gallery(w: Floats) -> Floats:
    """Radiance (..., 3) from directions (..., 3): a hall with tall windows, a sunlit skylight and a chandelier."""
    p, wall = _walls(w, low=(-5.0, -1.2, -8.0), high=(6.0, 5.0, 7.0))
    x, y, z = np.moveaxis(p, -1, 0)
    height = (y + 1.2) / 6.2
    panel = _stripes(np.where(wall // 2 == 0, z, x), 2.4, 0.16) | _stripes(y - 0.2, 20.0, 0.1)
    light = _colour(np.where(panel, 0.2, 0.32) * (0.35 + 0.65 * height), (1.0, 0.8, 0.58))
    pools = sum(np.exp(-((x + 2.2) ** 2) / 3.0 - (z - c - 0.8) ** 2 / 0.9) for c in _WINDOWS)
    light = np.where((wall == 2)[..., None], _colour(0.035 + 0.16 * pools, (1.0, 0.66, 0.42)), light)
    beams = np.where(_stripes(z, 1.5, 0.3), 0.2, 0.42)
    light = np.where((wall == 3)[..., None], _colour(beams, (1.0, 0.88, 0.72)), light)
    sky = _colour(np.where(y < 0.9, 11.0, 16.0 + 9.0 * y), (0.82, 0.94, 1.12))
    for centre in _WINDOWS:
        pane = (wall == 0) & _arch(z - centre, y, 0.85, -0.2, 2.9)
        light = np.where((pane & ~_stripes(z - centre, 0.57, 0.05) & ~_stripes(y, 0.62, 0.05))[..., None], sky, light)
    door = (wall == 4) & _arch(x - 1.6, y, 0.7, -1.2, 1.6)
    light = np.where((door & ~_stripes(x - 1.6, 0.7, 0.07))[..., None], _colour(14.0, (1.0, 0.78, 0.48)), light)
    light = _lamps(light, w, [(0.72, 0.64, -0.28)], 3.2, (820.0, 740.0, 620.0))
    ring = [(0.42 * np.cos(a) - 0.25, 0.8, 0.42 * np.sin(a) - 0.35) for a in np.arange(8) * np.pi / 4]
    return _lamps(light, w, ring, 0.9, (190.0, 130.0, 70.0))


def nave(w: Floats) -> Floats:
    """Radiance (..., 3) from directions (..., 3): a dark church with coloured lancets, a rose window and candles."""
    p, wall = _walls(w, low=(-6.0, -1.5, -16.0), high=(6.0, 11.0, 12.0))
    x, y, z = np.moveaxis(p, -1, 0)
    height = (y + 1.5) / 12.5
    stone = np.where(_stripes(np.where(wall // 2 == 0, z, x), 3.0, 0.6), 0.1, 0.06) * (1.2 - 0.7 * height)
    light = _colour(stone, (1.0, 0.72, 0.42))
    glow = np.exp(-(x**2) / 0.08 - (z + 2.0) ** 2 / 0.12)[..., None] * [0.16, 0.2, 0.34]
    light = np.where((wall == 2)[..., None], 0.01 + glow, light)
    light = np.where(
        (wall == 3)[..., None], _colour(np.where(_stripes(z, 3.0, 0.5), 0.06, 0.025), (1, 0.7, 0.4)), light
    )
    number = np.round(z / 3.0 - 0.5)  # of the lancets of both sides, 3 m apart
    across = z - 3.0 * (number + 0.5)
    pane = (wall // 2 == 0) & _arch(across, y, 0.55, 3.0, 7.0)
    tint = np.stack([1.0 + 0.6 * np.sin(5 * y + number + c) * np.sin(9 * across + c) for c in (0, 2, 4)], axis=-1)
    glass = tint * [0.75, 0.85, 1.3] * np.where(x < 0, 12.0, 5.0)[..., None]
    light = np.where((pane & ~_stripes(y, 0.8, 0.08))[..., None], glass, light)
    radius, turn = np.hypot(x, y - 6.2), np.arctan2(y - 6.2, x)
    petals = (wall == 4) & (radius < 2.6) & (np.abs(np.sin(6 * turn)) > 0.22) & (np.abs(radius - 1.1) > 0.12)
    rose = np.stack([1 + 0.5 * np.sin(3 * radius + 6 * turn + c) for c in (0.0, 4.2, 2.1)], -1) * [24.0, 19.0, 21.0]
    light = np.where(petals[..., None], rose, light)
    for centre in (-2.2, 0.0, 2.2):  # bright windows above the altar
        pane = (wall == 5) & _arch(x - centre, y, 0.6, 2.2, 6.2 - 0.5 * abs(centre))
        light = np.where((pane & ~_stripes(y, 1.0, 0.1))[..., None], _colour(42.0, (1.0, 0.9, 0.74)), light)
    candles = [(s * 0.75, 0.22 + 0.1 * k, -0.62 + 0.24 * k) for s in (-1, 1) for k in range(3)]
    light = _lamps(light, w, candles, 0.8, (330.0, 190.0, 75.0))
    return _lamps(light, w, [(-0.78, 0.6, 0.1)], 2.2, (1500.0, 1320.0, 1050.0))


def studio(w: Floats) -> Floats:
    """Radiance (..., 3) from directions (..., 3): a dim room, one spotlight that casts hard shadows, a panel."""
    p, wall = _walls(w, low=(-3.0, -1.0, -3.0), high=(3.0, 2.5, 3.0))
    x, y, z = np.moveaxis(p, -1, 0)
    light = _colour(np.where(wall == 2, 0.05, 0.07 + 0.05 * (y + 1.0)), (1.0, 0.95, 0.9))
    panel = (wall == 0) & (np.abs(z - 0.4) < 1.2) & (np.abs(y - 0.9) < 0.7)
    light = np.where(panel[..., None], _colour(6.0 + 0 * x, (0.85, 0.95, 1.1)), light)
    return _lamps(light, w, [(0.72, 0.58, -0.38)], 2.4, (2200.0, 2000.0, 1750.0))


def _walls(w: Floats, low: ArrayLike, high: ArrayLike) -> tuple[Floats, NDArray[np.integer]]:
    """Points (..., 3) where rays from the origin leave a box, and its sides: 0 to 5 for -x, +x, -y, +y, -z, +z."""
    w = np.where(np.abs(w) < 1e-12, -1e-12, w)
    distance = np.where(w > 0, high, low) / w
    axis = np.argmin(distance, axis=-1)
    t = np.take_along_axis(distance, axis[..., None], axis=-1)
    return w * t, 2 * axis + (np.take_along_axis(w, axis[..., None], axis=-1)[..., 0] > 0)


def _arch(across: Floats, y: Floats, half: float, bottom: float, spring: float) -> Mask:
    """Whether points lie in a window with a round arch above the height `spring`."""
    return (y > bottom) & np.where(y < spring, np.abs(across) < half, np.hypot(across, y - spring) < half)


def _stripes(x: Floats, period: float, wide: float) -> Mask:
    """Whether points lie in stripes of width `wide` about the multiples of `period`."""
    return np.asarray(np.abs(x - period * np.round(x / period)) < wide / 2)


def _colour(values: ArrayLike, colour: ArrayLike) -> Floats:
    """Values (...), or a single value, as (..., 3)."""
    return np.asarray(np.asarray(values, float)[..., None] * np.asarray(colour, float))


def _lamps(light: Floats, w: Floats, towards: ArrayLike, radius_deg: float, radiance: ArrayLike) -> Floats:
    """`light` with round lamps in the directions `towards`."""
    closest = (w @ normalize(np.array(towards, float)).T).max(axis=-1)
    return np.where((closest > np.cos(np.radians(radius_deg)))[..., None], np.asarray(radiance, float), light)


def park(w: Floats) -> Floats:
    """Radiance (..., 3) from directions (..., 3): a park in autumn, in the late afternoon."""
    light = _sky(w)
    far = np.asarray(normalize(w * (1, 0, 1) + (1e-9, 0, 0)))  # the direction along the ground
    light = _hills(light, w, far)
    light = _trees(light, w, far, seed=5, height=0.13, clumps=9.0, shade=0.75)
    light = _trees(light, w, far, seed=11, height=0.24, clumps=5.0, shade=1.0)
    return np.where(w[..., 1:2] < 0, _lawn(w), light)


def _sky(w: Floats) -> Floats:
    """Blue overhead, pale at the horizon and about the sun, with lit clouds."""
    up, to_sun = np.maximum(w[..., 1:2], 0.0), np.clip(w @ SUN, -1, 1)[..., None]
    pale = np.exp(-4.5 * up)
    sky = pale * [5.2, 5.0, 4.6] + (1 - pale) * [0.9, 1.9, 4.2]
    sky = sky + np.exp(-9.0 * (1 - to_sun)) * [3.2, 2.4, 1.5] + np.exp(-90.0 * (1 - to_sun)) * [14.0, 10.0, 6.0]
    above = w * (1, 0, 1) / (up + 0.18)  # a cloud layer, hit farther away at lower elevation
    body = _noise(above, 1, 3.4) + 0.6 * _noise(above, 2, 9.0) + 0.35 * _noise(above, 3, 24.0)
    cover = np.clip((body - 0.45) / 1.1, 0, 1) * np.clip(up / 0.06, 0, 1)
    lit = 3.6 + 4.4 * np.clip(1.6 - body, 0, 1) + 7.0 * np.exp(-6.0 * (1 - to_sun))
    sky = sky * (1 - cover) + cover * lit * [1.0, 0.95, 0.88]
    return np.where(to_sun > np.cos(np.radians(SUN_RADIUS_DEG)), SUN_RADIANCE, sky)


def _hills(light: Floats, w: Floats, far: Floats) -> Floats:
    """Blue hills on the horizon, and a white house before them."""
    crest = 0.075 + 0.03 * _noise(far, 21, 3.0) + 0.006 * _noise(far, 22, 14.0)
    haze = np.clip(w[..., 1:2] / 0.1, 0, 1)
    light = np.where(w[..., 1:2] < crest, (1 - haze) * [2.2, 2.3, 2.5] + haze * [0.75, 1.0, 1.35], light)
    across, forth = w @ np.array([0.8, 0, 0.6]), w @ np.array([0.6, 0, -0.8])
    x, y = across / np.maximum(forth, 1e-3), w[..., 1] / np.maximum(forth, 1e-3)
    house = (forth > 0) & (np.abs(x) < 0.17) & (y < 0.16)
    window = (np.abs((x / 0.068) % 1 - 0.5) < 0.17) & (np.abs((y / 0.075 + 0.1) % 1 - 0.55) < 0.24)
    roof = (forth > 0) & (y >= 0.16) & (y < 0.25 - 0.45 * np.maximum(np.abs(x) - 0.05, 0)) & (np.abs(x) < 0.2)
    light = np.where(house[..., None], np.where(window[..., None], [0.3, 0.4, 0.55], [5.6, 5.0, 4.1]), light)
    return np.where(roof[..., None], [1.5, 0.42, 0.25], light)


def _trees(light: Floats, w: Floats, far: Floats, seed: int, height: float, clumps: float, shade: float) -> Floats:
    """A row of trees with gaps, its leaves of several colours, brighter where the sun falls on it."""
    outline = _noise(far, seed, clumps) + 0.35 * _noise(far, seed + 1, 4 * clumps)
    leaf = _noise(w, seed + 2, 55.0) + 0.7 * _noise(w, seed + 3, 130.0)
    top = height * np.clip(0.45 + 0.75 * outline, -1.0, 2.0) + 0.007 * leaf
    kind = np.clip((_noise(far, seed + 4, 0.8 * clumps) + 1.6) / 3.2, 0, 0.999)[..., 0] * (len(LEAVES) - 1)
    low = np.floor(kind).astype(int)
    share = np.clip(3 * (kind - low) - 1, 0, 1)[..., None]
    colour = LEAVES[low] * (1 - share) + LEAVES[low + 1] * share
    facing = 0.5 - 0.5 * (far @ normalize(SUN * (1, 0, 1)))[..., None]
    depth = np.clip(w[..., 1:2] / np.maximum(top, 1e-3), 0, 1)  # darker towards the foot
    lit = (0.35 + 5.5 * facing) * (0.25 + 0.75 * depth) * np.clip(0.75 + 0.4 * leaf, 0.12, 2.0)
    through = 3.0 * (1 - facing) * depth * np.clip(leaf, 0, 2)  # against the sun, leaves glow
    return np.where(w[..., 1:2] < top, shade * colour * (lit + through), light)


def _lawn(w: Floats) -> Floats:
    """Mown in stripes, with a gravel path and beds of flowers."""
    at = w / np.maximum(-w[..., 1:2], 0.01) * EYE_M
    x, z = at[..., 0], at[..., 2]
    near = np.clip(-w[..., 1:2] / 0.06, 0, 1)
    stripe = np.where(np.floor(z / 1.6) % 2 == 0, 0.82, 1.18)[..., None]
    blades = 1 + 0.25 * near * _noise(at, 31, 9.0)
    light = np.array([1.0, 1.5, 0.28]) * (1 + (stripe - 1) * near) * blades
    bend = x - 3.5 - 2.0 * np.sin(z / 5)
    light = np.where((np.abs(bend) < 0.9)[..., None], np.array([3.0, 2.7, 2.2]) * (1 + 0.1 * blades), light)
    radius, turn = np.hypot(x, z), np.arctan2(z, x)
    bed = (radius > 7) & (radius < 9) & (np.sin(3 * turn) > 0.35)
    tint = 0.5 + 0.5 * np.cos(_noise(at, 33, 1.7) * 2.5 + np.array([0.0, 2.4, 4.0]))
    return np.asarray(np.where(bed[..., None], tint * [3.2, 0.9, 2.2] + [0.1, 0.25, 0.05], light))


def _noise(p: Floats, seed: int, frequency: float) -> Floats:
    """(..., 1) smooth noise of standard deviation 1 at points (..., 3); `frequency` in radians per unit."""
    waves, rng = 12, np.random.default_rng(seed)
    towards = normalize(rng.normal(size=(waves, 3))) * frequency * rng.uniform(0.55, 1.3, (waves, 1))
    phase = rng.uniform(0, 2 * np.pi, waves)
    single = p.astype(np.float32)  # a third of the time, and as smooth
    total = np.zeros(p.shape[:-1], np.float32)
    for k, offset in zip(towards.astype(np.float32), phase.astype(np.float32), strict=True):
        total += np.cos(single @ k + offset)
    return np.asarray(total * np.sqrt(2 / waves), np.float64)[..., None]


COMPUTED: Mapping[str, Callable[[Floats], Floats]] = {"gallery": gallery, "nave": nave, "studio": studio, "park": park}


@cache
def lat_long_image(name: str) -> NDArray[np.float32]:
    """(HEIGHT, 2 HEIGHT, 3) radiance in W/(sr m^2) of surroundings of `COMPUTED`; see `core.geometry.latlong`."""
    height, width = HEIGHT * SAMPLES, 2 * HEIGHT * SAMPLES
    fine = COMPUTED[name](lat_long_directions(height, width))
    return np.asarray(fine.reshape(HEIGHT, SAMPLES, 2 * HEIGHT, SAMPLES, 3).mean(axis=(1, 3)), np.float32)
