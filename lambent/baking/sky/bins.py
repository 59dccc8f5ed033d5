"""Bins of directions of equal solid angle, with the light of an environment in them.

There are ROWS x COLUMNS coarse bins: rows of equal height along an axis, columns about it. The axis is an uncommon one,
because bins at its poles are slender wedges. Each bin is divided into SUB x SUB parts; bins with something small and
bright, a sun or a lamp, into FINE x FINE. The caller chooses a bin (`sky.guide`). Within it a row of parts, then a part
of the row, is drawn in proportion to luminance by alias tables (Walker 1977), and a direction uniformly.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.sky.daylight import radiance_from
from lambent.core.arrays import Floats, Indices
from lambent.core.light.colour import luminance

ROWS, COLUMNS = 16, 32
BINS = ROWS * COLUMNS
BIN_SR = 4 * np.pi / BINS
SUB, FINE = 16, 128  # parts along each side of a bin
MOST_FINE, SPIKY = 16, 0.02  # number of fine bins, and share of the variance above which a bin becomes one
SUPERSAMPLES = 4  # per part and axis
AXES = np.array([[0.6, 0.48, 0.64], [0.0, 0.8, -0.6], [-0.8, 0.36, 0.48]])  # of the grid, in its own order; orthonormal
FLOOR = 0.05  # relative to a bin's mean: no part is left out


class SkyBins:
    """An environment's luminance by bin, and directions within a bin.

    luminance (BINS,) is the mean of each bin, W/(sr m^2).
    """

    def __init__(self, emitter: Any) -> None:
        every = np.arange(BINS)
        mean, square = _moments_of_parts(emitter, every, SUB)
        self.luminance = mean.mean(axis=1)
        fine = _spiky(mean, square)
        side = np.full(BINS, SUB)
        side[fine] = FINE
        parts = dict(zip(every, mean, strict=True))
        if len(fine):
            parts |= dict(zip(fine, _moments_of_parts(emitter, fine, FINE)[0], strict=True))
            self.luminance[fine] = [parts[number].mean() for number in fine]
        shares = [_shares(parts[number]).reshape(n, n) for number, n in zip(every, side, strict=True)]
        self._side = mi.UInt32(side.astype(np.uint32))
        self._first_row = mi.UInt32((np.cumsum(side) - side).astype(np.uint32))
        self._first_part = mi.UInt32((np.cumsum(side**2) - side**2).astype(np.uint32))
        self._rows = _Alias([share.sum(axis=1)[None] for share in shares])
        self._columns = _Alias([share / share.sum(axis=1)[:, None] for share in shares])
        density = np.concatenate([share.ravel() * share.size / BIN_SR for share in shares])
        self._density = mi.Float(density.astype(np.float32))

    def direction(self, number: Any, u: Any) -> Any:
        """Unit directions within bins (mi.UInt32), from u (mi.Point2f); `find` has their density."""
        side, first = dr.gather(mi.UInt32, self._side, number), dr.gather(mi.UInt32, self._first_part, number)
        r, v = self._rows.draw(dr.gather(mi.UInt32, self._first_row, number), side, u.y)
        c, h = self._columns.draw(first + r * side, side, u.x)
        size = dr.rcp(mi.Float(side))
        y = 1 - 2 / ROWS * (mi.Float(number // COLUMNS) + (mi.Float(r) + v) * size)
        phi = 2 * dr.pi / COLUMNS * (mi.Float(number % COLUMNS) + (mi.Float(c) + h) * size)
        across = dr.safe_sqrt(1 - y * y)
        sine, cosine = dr.sincos(phi)
        return _turned((across * cosine, y, across * sine), AXES.T)

    def find(self, w: Any) -> tuple[Any, Any]:
        """The bins (mi.UInt32) of unit directions w, and the density of `direction` there, sr^-1."""
        w = _turned((w.x, w.y, w.z), AXES)
        turn = dr.atan2(w.z, w.x) / (2 * dr.pi)
        turn = dr.select(turn < 0, turn + 1, turn)
        down, along = (1 - w.y) / 2 * ROWS, turn * COLUMNS
        row = dr.clip(mi.Int32(down), 0, ROWS - 1)
        column = dr.clip(mi.Int32(along), 0, COLUMNS - 1)
        number = mi.UInt32(row * COLUMNS + column)
        side = dr.gather(mi.UInt32, self._side, number)
        r = dr.clip(mi.Int32((down - mi.Float(row)) * mi.Float(side)), 0, mi.Int32(side) - 1)
        c = dr.clip(mi.Int32((along - mi.Float(column)) * mi.Float(side)), 0, mi.Int32(side) - 1)
        place = dr.gather(mi.UInt32, self._first_part, number) + mi.UInt32(r) * side + mi.UInt32(c)
        return number, dr.gather(mi.Float, self._density, place)


class _Alias:
    """Alias tables of many distributions, concatenated in one array: those of each group (B, K) in turn."""

    def __init__(self, groups: list[Floats]) -> None:
        sizes = np.array([group.shape[1] for group in groups])
        tables: list[Any] = [None] * len(groups)
        for size in set(sizes.tolist()):  # all of one size at once
            same = np.flatnonzero(sizes == size)
            ends = np.cumsum([len(groups[i]) for i in same])[:-1]
            found = alias_tables(np.concatenate([groups[i] for i in same]))
            for i, *table in zip(same.tolist(), *(np.split(side, ends) for side in found), strict=True):
                tables[i] = table
        self._keep = mi.Float(np.concatenate([keep.ravel() for keep, _ in tables]))
        self._other = mi.UInt32(np.concatenate([other.ravel() for _, other in tables]))

    def draw(self, first: Any, size: Any, u: Any) -> tuple[Any, Any]:
        """A place of the distribution of `size` places that begins at `first`, and u rescaled to [0, 1)."""
        scaled = u * mi.Float(size)
        place = dr.minimum(mi.UInt32(scaled), size - 1)
        rest = scaled - mi.Float(place)
        keep = dr.gather(mi.Float, self._keep, first + place)
        other = dr.gather(mi.UInt32, self._other, first + place)
        stay = rest < keep
        rest = dr.select(stay, rest / dr.maximum(keep, 1e-9), (rest - keep) / dr.maximum(1 - keep, 1e-9))
        return dr.select(stay, place, other), dr.clip(rest, 0, dr.one_minus_epsilon(mi.Float))


def alias_tables(shares: Floats) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Alias tables (B, K) of B distributions (B, K): the share each place keeps, and the place that gets the rest."""
    count, size = shares.shape
    left = shares * size
    keep, other = np.ones((count, size)), np.tile(np.arange(size), (count, 1))
    every = np.arange(count)
    waiting = np.ones((count, size), bool)
    for _ in range(size - 1):  # the largest remaining place fills the smallest, which is then done
        low = np.where(waiting, left, np.inf).argmin(axis=1)
        high = np.where(waiting, left, -np.inf).argmax(axis=1)
        keep[every, low] = np.minimum(left[every, low], 1)
        other[every, low] = high
        left[every, high] -= 1 - keep[every, low]
        waiting[every, low] = False
    return keep.astype(np.float32), other.astype(np.uint32)


def middles() -> Floats:
    """(BINS, 3) unit directions of the bins' centres."""
    return _directions(np.arange(BINS), 1, 0.5, 0.5).reshape(-1, 3)


def _directions(bins: Indices, side: int, r: float, c: float) -> Floats:
    """Unit directions (n, side * side, 3) of places (r, c), in [0, 1], within the parts of bins."""
    row, column = np.divmod(np.arange(side * side), side)
    y = 1 - 2 / ROWS * ((bins // COLUMNS)[:, None] + (row + r) / side)
    phi = 2 * np.pi / COLUMNS * ((bins % COLUMNS)[:, None] + (column + c) / side)
    across = np.sqrt(np.maximum(1 - y * y, 0))
    return np.asarray(np.stack([across * np.cos(phi), y, across * np.sin(phi)], axis=-1) @ AXES)


def _turned(w: tuple[Any, Any, Any], axes: Floats) -> Any:
    return mi.Vector3f(*(sum(float(a) * x for a, x in zip(row, w, strict=True)) for row in axes))


def _moments_of_parts(emitter: Any, bins: Indices, side: int) -> tuple[Floats, Floats]:
    """(n, side * side) mean luminance of the parts of bins, and mean squared luminance."""
    mean, square = np.zeros((2, len(bins), side * side))
    offsets = (np.arange(SUPERSAMPLES) + 0.5) / SUPERSAMPLES
    for r in offsets:
        for c in offsets:
            w = _directions(bins, side, r, c).reshape(-1, 3)
            found = luminance(radiance_from(emitter, w).astype(float)).reshape(mean.shape)
            mean, square = mean + found, square + found**2
    return mean / SUPERSAMPLES**2, square / SUPERSAMPLES**2


def _shares(luminances: Floats) -> Floats:
    """Share of a bin's samples per part."""
    raised = luminances + FLOOR * luminances.mean()
    return raised / raised.sum() if raised.any() else np.full(len(raised), 1 / len(raised))


def _spiky(mean: Floats, square: Floats) -> Indices:
    """Bins with light smaller than a part, for which uniform sampling of parts would cost most."""
    cost = np.divide(square, mean, out=np.zeros_like(mean), where=mean > 0).sum(axis=1) - mean.sum(axis=1)
    cost /= max(float(mean.sum()), 1e-30)
    worst = np.argsort(-cost, kind="stable")[:MOST_FINE]
    return np.sort(worst[cost[worst] > SPIKY])
