"""Procedural interiors: radiance from windows, lamps and walls of rooms, seen from one point.

They light scenes without any file. A ray from the point hits one wall of a box; windows are parts of walls. Window
panes and lamps are small and bright, as in captured environments: they show as highlights and cast shadows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize

Mask = NDArray[np.bool_]

_WINDOWS = (-5.2, -1.6, 2.0)  # z of those in the gallery


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


INTERIORS: Mapping[str, Callable[[Floats], Floats]] = {"gallery": gallery, "nave": nave, "studio": studio}


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
