"""MIP chains of cube maps: every level holds the same light.

A texel of a level is the mean over its area, weighted by solid angle, so the integral over the sphere is the same on
every level. Faces meet without a seam because the GPU filters cube maps across their edges.

Interpolation between texels of a plain level shows the texels: a small lamp looks square, and brightest at the centre
of a texel. Smooth levels are blurred once more, over `SMOOTH_AREA` times the area, and the look-up reads a level finer
by the same factor: the blur keeps its size and is nearly round. It gains 2.5 dB
(docs/decisions/samples-of-a-lobe.md).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import directions_at, sample, texel_solid_angles
from lambent.core.light.colour import HALF_MAX

BLUR = (1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16)  # along rows and columns: variance 1 texel^2
# Variance of a look-up in texel^2 per axis: box 1/12, linear interpolation 1/6, blur 1.
SMOOTH_AREA = 5.0
FAINT = 1e-4  # of the mean light of a cube map, added to both sides of a ratio: dark texels count as unchanged


def halved(cube: Floats) -> Floats:
    """The next level, (6, m, m, C) with m = n // 2, of a cube map (6, n, n, C)."""
    n = cube.shape[1]
    m = n // 2
    if n % 2 == 0:
        omega = texel_solid_angles(n)[:, :, None].astype(cube.dtype)
        return np.asarray(_four_texels(cube * omega) / _four_texels(omega[None]))
    share, omega = overlaps(n, m), texel_solid_angles(n)
    light = np.einsum("ij,fjkc,lk->filc", share, cube * omega[..., None], share, optimize=True)
    return np.asarray(light / (share @ omega @ share.T)[..., None], dtype=cube.dtype)


def _four_texels(values: Floats) -> Floats:
    """(F, n / 2, n / 2, C) sums of two by two texels of values (F, n, n, C)."""
    rows = values[:, ::2] + values[:, 1::2]
    return np.asarray(rows[:, :, ::2] + rows[:, :, 1::2])


def overlaps(n: int, m: int) -> Floats:
    """(m, n) share of each of n texels along a row that lies in each of m."""
    edges, texel = np.linspace(0, n, m + 1), np.arange(n)
    return np.asarray(np.clip(np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel), 0, 1))


def mip_chain(cube: Floats) -> list[Floats]:
    """All levels, from (6, n, n, C) down to (6, 1, 1, C), float32."""
    levels = [np.asarray(cube, dtype=np.float32)]
    while levels[-1].shape[1] > 1:
        levels.append(halved(levels[-1]))
    return levels


def light_change(now: Floats, before: Floats) -> list[Floats]:
    """MIP levels of the ratio of a probe's light `now` to its light `before`, (6, N, N, 3) each.

    Relighting multiplies the maps of a light field by this ratio, read in the direction of each ray's hit point. The
    ratio is 1 where the probe saw almost no light.
    """
    faint = FAINT * float(np.mean(before)) + 1e-30
    return [(a + faint) / (b + faint) for a, b in zip(mip_chain(now), mip_chain(before), strict=True)]


def smooth_chain(cube: Floats) -> list[Floats]:
    """`mip_chain` with every level but the first blurred across the faces' edges; constants stay as they are."""
    first, *rest = mip_chain(cube)
    return [first, *(blurred(level) for level in rest)]


def blurred(cube: Floats) -> Floats:
    """(6, n, n, C) convolved with `BLUR` along rows and columns."""
    n, reach = cube.shape[1], len(BLUR) // 2
    wide: Any = _with_border(cube, reach)
    rows: Any = sum(weight * wide[:, k : k + n] for k, weight in enumerate(BLUR))
    return np.asarray(sum(weight * rows[:, :, k : k + n] for k, weight in enumerate(BLUR)), np.float32)


def _with_border(cube: Floats, by: int) -> Floats:
    """Every face padded by `by` texels on all sides from the neighbouring faces."""
    n = cube.shape[1]
    wide = np.pad(cube, ((0, 0), (by, by), (by, by), (0, 0)))
    row, column, w = _border(n, by)
    wide[:, row, column] = sample(cube, w)
    return wide


@lru_cache(16)
def _border(n: int, by: int) -> tuple[NDArray[np.intp], NDArray[np.intp], Floats]:
    """Row and column (K,) of the texels `by` wide around a face, and their directions (6, K, 3) from every face."""
    row, column = np.nonzero(np.pad(np.zeros((n, n), bool), by, constant_values=True))
    s, t = (np.stack([column, row]) - by + 0.5) / n * 2 - 1
    return row, column, np.stack([directions_at(np.full(len(row), face), s, t) for face in range(6)])


def finite(array: Floats) -> tuple[Floats, int]:
    """`array` as float32 within the range of half floats, and how many values were not finite or negative.

    One NaN would spread over every level of a MIP chain; such texels become black.
    """
    values = np.asarray(array, dtype=np.float32)
    bad = ~np.isfinite(values) | (values < 0)
    return np.minimum(np.where(bad, 0, values), HALF_MAX), int(bad.sum())
