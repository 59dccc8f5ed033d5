"""Procedural gardens: radiance of a sky with sun and clouds, of trees and of a lawn, seen from one point.

Noise is a sum of plane waves over the unit sphere, without seams or poles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize

SUN = normalize(np.array([0.62, 0.5, 0.52]))
SUN_RADIUS_DEG, SUN_RADIANCE = 1.3, np.array([16_000.0, 13_000.0, 9_200.0])  # larger than real, with the same light
EYE_M = 1.2  # height of the point over the lawn
LEAVES = np.array([[0.10, 0.22, 0.03], [0.30, 0.34, 0.04], [0.62, 0.24, 0.02], [0.52, 0.07, 0.02], [0.06, 0.13, 0.05]])


def park(w: Floats) -> Floats:
    """Radiance (..., 3) from directions (..., 3): a park in autumn, in the late afternoon."""
    light = _sky(w)
    far = np.asarray(normalize(w * (1, 0, 1) + (1e-9, 0, 0)))  # the direction along the ground
    light = _hills(light, w, far)
    light = _trees(light, w, far, seed=5, height=0.13, clumps=9.0, shade=0.75)
    light = _trees(light, w, far, seed=11, height=0.24, clumps=5.0, shade=1.0)
    return np.where(w[..., 1:2] < 0, _lawn(w), light)


GARDENS: Mapping[str, Callable[[Floats], Floats]] = {"park": park}


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
