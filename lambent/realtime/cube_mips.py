"""MIP chains of cube maps: every level keeps the light of the one below.

A texel of a level is the mean of what it covers, weighted by solid angle, so the light over the sphere is the same on
every level. Neighbouring faces meet without a seam because the GPU filters cube maps across their edges.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import HALF_MAX

Floats = NDArray[np.floating]


def exact_solid_angles(n: int) -> Floats:
    """(n, n) exact solid angles in sr of one face's texels; the six faces sum to 4 pi."""
    edge = np.linspace(-1, 1, n + 1)
    s, t = np.meshgrid(edge, edge)
    corner = np.arctan2(s * t, np.sqrt(s * s + t * t + 1))
    return np.asarray(corner[1:, 1:] - corner[:-1, 1:] - corner[1:, :-1] + corner[:-1, :-1])


def halved(cube: Floats) -> Floats:
    """The next level, (6, m, m, C) with m = n // 2, of a cube map (6, n, n, C)."""
    n = cube.shape[1]
    m = n // 2
    if n % 2 == 0:
        omega = exact_solid_angles(n)[:, :, None].astype(cube.dtype)
        light = (cube * omega).reshape(6, m, 2, m, 2, -1).sum(axis=(2, 4))
        return np.asarray(light / omega.reshape(m, 2, m, 2, 1).sum(axis=(1, 3)))
    edges = np.linspace(0, n, m + 1)
    texel = np.arange(n)
    share = np.clip(np.minimum(edges[1:, None], texel + 1) - np.maximum(edges[:-1, None], texel), 0, 1)
    omega = exact_solid_angles(n)
    light = np.einsum("ij,fjkc,lk->filc", share, cube * omega[..., None], share, optimize=True)
    return np.asarray(light / (share @ omega @ share.T)[..., None], dtype=cube.dtype)


def mip_chain(cube: Floats) -> list[Floats]:
    """All levels, from (6, n, n, C) down to (6, 1, 1, C), float32."""
    levels = [np.asarray(cube, dtype=np.float32)]
    while levels[-1].shape[1] > 1:
        levels.append(halved(levels[-1]))
    return levels


def finite(array: Floats) -> tuple[Floats, int]:
    """`array` as float32 within the range of half floats, and how many values were not finite or negative.

    One NaN would spread over every level of a MIP chain; such texels become black.
    """
    values = np.asarray(array, dtype=np.float32)
    bad = ~np.isfinite(values) | (values < 0)
    return np.minimum(np.where(bad, 0, values), HALF_MAX), int(bad.sum())
