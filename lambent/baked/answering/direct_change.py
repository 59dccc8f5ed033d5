"""Indirect light after a change of direct light, as when a lamp moves.

Light is linear: I(changed) = I + s T (change), with T the patches' bounces and one gathering along all rays of points.
s is I over T (direct light before the change): of light that goes, nothing is left. For light that comes, s is 1 where
that is far from 1, as in the dark.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.answer import (
    MOST_EXCESS,
    Albedos,
    Answer,
    side_by_side,
    smoothed,
    solved,
    upsampled,
)
from lambent.baked.answering.rays import gathered
from lambent.core.arrays import Floats, sums_of

FAINT = 0.05  # of the mean indirect light: what is darker says nothing of what comes


def with_direct_change(
    answer: Answer, patch: NDArray[np.integer], albedos: Albedos, irradiance: Floats, change: Floats
) -> NDArray[np.float32]:
    """Irradiance (G, T, 3) of texels, but for the `change` itself, whose direct light changes by that (G, T, 3).

    `irradiance` (G, T, 3) is theirs before it, with direct light as baked, and `patch` (T,) are the texels' patches.
    """
    points, count = answer.points, len(answer.patches.material)
    before = carried(answer, albedos, points.direct, answer.patches.direct)
    more = carried(answer, albedos, _means(change, answer.sender, len(points.other)), _means(change, patch, count))
    indirect = irradiance - answer.direct
    known = before > FAINT * before.mean(axis=(1, 2), keepdims=True)
    scale = np.divide(indirect, before, out=np.ones_like(before), where=known)
    alike = np.abs(np.log(np.maximum(scale, 1e-6))) < np.log(MOST_EXCESS)
    scale = np.where((more > 0) & ~alike, 1, scale.clip(0))
    return np.asarray(answer.direct + np.maximum(indirect + scale * more, 0), np.float32)


def carried(answer: Answer, albedos: Albedos, at_points: Floats, at_patches: Floats) -> NDArray[np.float32]:
    """Indirect irradiance (G, T, 3) of texels by direct light, of any sign, of points (G, K, 3), patches (G, P, 3)."""
    points, bounced = answer.points, np.zeros_like(at_patches)
    for sign in (1, -1):  # light that is solved for is not negative
        direct = np.maximum(sign * at_patches, 0)
        if direct.any():
            bounced += sign * (solved(answer.patches, albedos, direct=direct).irradiance - direct)
    light = side_by_side(at_points + bounced[:, points.patch])
    reflected, transmitted = (
        np.pad(one, ((0, 0), (0, 1))).astype(np.float32)[points.material][:, None]
        for one in (albedos.reflected, albedos.transmitted)
    )
    crossing = (points.other != np.arange(len(points.other)))[:, None, None]
    sent = reflected * light + transmitted * crossing * light[points.other]
    return upsampled(smoothed(gathered(answer.rays, sent), answer.around), answer.near)


def _means(light: Floats, of: NDArray[np.integer], count: int) -> NDArray[np.float32]:
    """Means (G, count, 3) of light (G, n, 3) over those that belong to each number, `of` (n,); -1 is for none."""
    known = of >= 0
    number = np.maximum(np.bincount(of[known], minlength=count), 1)
    sums = [sums_of(group[known], of[known], count) for group in light]
    return np.asarray(np.array(sums) / number[:, None], np.float32)
