"""Texel sizes of the parts of a scene, chosen by viewers' distance.

A texel of size s at distance d covers s/d of a view. With A_i the area of a part, s_i its texel size and W_i the
integral of 1/d over the directions in which viewers see it, the mean of s/d over all views is proportional to the sum
of s_i W_i. For a given number of texels, the sum of A_i / s_i^2, it is minimal if 1 / s_i^2 is proportional to
(W_i / A_i)^(2/3). That would favour rooms, and give little to the furniture that casts their shadows, so SOFTER lies
between it and equal texels. No part takes much more than its visible share, as a plain to the horizon would.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.scenes.scene import Scene

SOFTER = 1 / 3  # replaces 2/3
SPREAD = 2.5  # size of texels of unseen parts relative to a typical texel, and bound for seen ones either way
AT_MOST = 1.5  # a part's share of texels relative to its visible share, at most
UNSEEN = 0.1  # share of the texels for parts that are hardly seen, by area
COARSE = 4.0  # ratio to the target size of a texel that is worth a warning
NOTABLE = 0.01  # visible share below which an object gets no warning
WARNINGS = 5


@dataclass(frozen=True)
class Views:
    """What viewers see of N parts: `weight` is W/A in 1/m^3, `share` the visible share, both (N,)."""

    weight: Floats
    share: Floats


def sizes_seen(areas_m2: Floats, scales: Floats, views: Views, texels: int) -> Floats:
    """Texel size of each part in metres (N,), for `texels` texels in total; `scales` are `light_map_scale`."""
    density = views.weight**SOFTER
    order = np.argsort(density)
    middle = order[np.searchsorted(np.cumsum(views.share[order]), views.share.sum() / 2).clip(0, len(order) - 1)]
    typical = density[middle]
    wanted = np.clip(density, typical / SPREAD**2, typical * SPREAD**2) * areas_m2 * scales**2
    most = np.maximum(AT_MOST * views.share, UNSEEN * areas_m2 / areas_m2.sum()) * scales**2 * texels
    low, high = 0.0, texels / wanted[wanted > 0].min()
    for _ in range(100):
        factor = (low + high) / 2
        low, high = (factor, high) if np.minimum(factor * wanted, most).sum() < texels else (low, factor)
    return np.asarray(np.sqrt(areas_m2 / np.maximum(np.minimum(low * wanted, most), 1e-9)))


def coarse_objects(scene: Scene, owner: Indices, size_m: Floats, distance_m: Floats) -> list[str]:
    """Warnings for objects on which most looks meet much larger texels, for their distance, than other looks.

    For each look of a viewer, `owner` (M,) is the number of the object it meets, `size_m` the texel size there, and
    `distance_m` the distance.
    """
    if not len(owner):
        return []
    typical = float(np.median(size_m / distance_m))
    found = []
    for number in np.unique(owner):
        mine = np.flatnonzero(owner == number)
        times = size_m[mine] / distance_m[mine] / typical
        middle = mine[np.argsort(times)[len(mine) // 2]]
        needed = typical * distance_m[middle]
        if len(mine) >= NOTABLE * len(owner) and size_m[middle] > COARSE * needed:
            found.append((len(mine), scene.objects[number].name, size_m[middle], distance_m[middle], needed))
    return [
        f"{name}: its texels in the light map are {_metres(size)} wide; where it is seen from {_metres(away)}, "
        f"{_metres(needed)} would match the rest: cut it into a near and a far object, or set light_map_scale = "
        f"{size / needed:.2g} under [objects.{name}] of a scene.toml"
        for _, name, size, away, needed in sorted(found, reverse=True)[:WARNINGS]
    ]


def _metres(length: float) -> str:
    return f"{length:.2g} m" if length < 10 else f"{length:.0f} m"
