"""Warp of the unit square by a tabulated density with two parameters, and its inverse.

Dupuy & Jakob 2018, "An adaptive parameterization for efficient material acquisition and rendering", section 4: the
density is bilinear between nodes; the row is drawn from its marginal and the column from its conditional distribution.
Values, marginals and conditionals of neighbouring parameters are interpolated separately, as in the renderers that
define the format; f depends on the order of these steps.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.materials.measured.tables.table import bracket


class Corners:
    """Slices of a two-parameter table around each query, and their weights: (N, 4) each."""

    def __init__(self, nodes: tuple[Floats, Floats], at: tuple[Floats, Floats]) -> None:
        (i0, i1, u), (j0, j1, v) = (bracket(n, x) for n, x in zip(nodes, at, strict=True))
        columns = len(nodes[1])
        self.slices = np.stack([i0 * columns + j0, i0 * columns + j1, i1 * columns + j0, i1 * columns + j1], axis=-1)
        self.weights = np.stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v], axis=-1)

    def blend(self, table: Floats, *index: Indices) -> Floats:
        """table (slices, ...) at (slice, *index), blended over the four corners: (N, ...)."""
        extra = table.ndim - 1 - len(index)
        parts = [table[(self.slices[:, k], *index)] * _rising(self.weights[:, k], extra) for k in range(4)]
        return np.asarray(sum(parts[1:], parts[0]))


def _rising(weight: Floats, dimensions: int) -> Floats:
    """The array with `dimensions` more axes of size 1."""
    return weight.reshape(weight.shape + (1,) * dimensions)


def _cell(shape: tuple[int, ...], xy: Floats) -> tuple[Indices, Indices, Floats, Floats]:
    """(column, row, x, y): the cell of a (rows, columns) grid of nodes with xy (N, 2), and the place in it."""
    scaled = xy.clip(0, 1) * (shape[1] - 1, shape[0] - 1)
    column = scaled[:, 0].astype(np.int64).clip(0, shape[1] - 2)
    row = scaled[:, 1].astype(np.int64).clip(0, shape[0] - 2)
    return column, row, scaled[:, 0] - column, scaled[:, 1] - row


def bilinear(table: Floats, corners: Corners, xy: Floats) -> Floats:
    """table (slices, rows, columns, ...) interpolated at xy (N, 2) in [0, 1]^2, x along the columns."""
    column, row, x, y = _cell(table.shape[1:3], xy)
    extra = table.ndim - 3
    x, y = _rising(x, extra), _rising(y, extra)
    low = corners.blend(table, row, column) * (1 - x) + corners.blend(table, row, column + 1) * x
    high = corners.blend(table, row + 1, column) * (1 - x) + corners.blend(table, row + 1, column + 1) * x
    return np.asarray(low * (1 - y) + high * y)


class Warp:
    """Density on the unit square per slice, normalised to 1; `sample` and `invert` are mutual inverses.

    Parameters
    ----------
    density : (slices, rows, columns) >= 0, each slice with a positive sum
    """

    def __init__(self, density: Floats) -> None:
        values = density.astype(np.float64)
        rows, columns = values.shape[1:]
        conditional = np.cumsum((values[:, :, :-1] + values[:, :, 1:]) / (2 * (columns - 1)), axis=2)
        row_mass = conditional[:, :, -1]
        marginal = np.cumsum((row_mass[:, :-1] + row_mass[:, 1:]) / (2 * (rows - 1)), axis=1)
        total = marginal[:, -1]
        self.density = values / total[:, None, None]
        # A leading zero: entry k is the mass before cell k.
        self.conditional = np.pad(conditional / total[:, None, None], ((0, 0), (0, 0), (1, 0)))
        self.marginal = np.pad(marginal / total[:, None], ((0, 0), (1, 0)))

    def invert(self, corners: Corners, xy: Floats) -> tuple[Floats, Floats]:
        """The uniform point (N, 2) that `sample` warps to xy (N, 2), and the density (N,) there."""
        rows, columns = self.density.shape[1:]
        column, row, x, y = _cell((rows, columns), xy)
        c0, c1 = (self._between_rows(corners, self.density, row, y, column + k) for k in (0, 1))
        last = np.full_like(column, columns - 1)
        r0, r1 = (corners.blend(self.conditional, row + k, last) for k in (0, 1))
        before = self._between_rows(corners, self.conditional, row, y, column)
        mass = r0 * (1 - y) + r1 * y
        u = np.divide(before + _integral(x, c0, c1) / (columns - 1), mass, out=np.zeros_like(mass), where=mass > 0)
        v = corners.blend(self.marginal, row) + _integral(y, r0, r1) / (rows - 1)
        return np.stack([u, v], axis=-1), c0 * (1 - x) + c1 * x

    def sample(self, corners: Corners, uv: Floats) -> tuple[Floats, Floats]:
        """The point (N, 2) that the uniform point uv (N, 2) is warped to, and the density (N,) there."""
        rows, columns = self.density.shape[1:]
        uv = uv.clip(1e-7, 1 - 1e-7)
        row = _last_not_above(corners.blend(self.marginal), uv[:, 1])
        last = np.full_like(row, columns - 1)
        r0, r1 = (corners.blend(self.conditional, row + k, last) for k in (0, 1))
        y = _solve((uv[:, 1] - corners.blend(self.marginal, row)) * (rows - 1), r0, r1)
        target = uv[:, 0] * (r0 * (1 - y) + r1 * y)
        lines = [corners.blend(self.conditional, row + k) for k in (0, 1)]
        column = _last_not_above(lines[0] * (1 - y[:, None]) + lines[1] * y[:, None], target)
        before = self._between_rows(corners, self.conditional, row, y, column)
        c0, c1 = (self._between_rows(corners, self.density, row, y, column + k) for k in (0, 1))
        x = _solve((target - before) * (columns - 1), c0, c1)
        point = np.stack([(column + x) / (columns - 1), (row + y) / (rows - 1)], axis=-1)
        return point, c0 * (1 - x) + c1 * x

    @staticmethod
    def _between_rows(corners: Corners, table: Floats, row: Indices, y: Floats, column: Indices) -> Floats:
        low, high = corners.blend(table, row, column), corners.blend(table, row + 1, column)
        return np.asarray(low * (1 - y) + high * y)


def _integral(x: Floats, v0: Floats, v1: Floats) -> Floats:
    """Integral from 0 to x of the segment that runs from v0 to v1 over [0, 1]."""
    return np.asarray(x * (v0 + (v1 - v0) * x / 2))


def _solve(mass: Floats, v0: Floats, v1: Floats) -> Floats:
    """x in [0, 1] at which `_integral` is `mass`, in the form that does not cancel for v0 near v1."""
    root = np.sqrt(np.maximum(v0 * v0 + 2 * mass * (v1 - v0), 0))
    denominator = v0 + root
    x: Floats = np.divide(2 * mass, denominator, out=np.zeros_like(mass), where=denominator > 0)
    return x.clip(0, 1)


def _last_not_above(cumulative: Floats, target: Floats) -> Indices:
    """Per line of `cumulative` (N, K + 1), the cell 0..K-1 in which `target` (N,) falls."""
    below = (cumulative[:, 1:-1] < target[:, None]).sum(axis=1)
    return np.asarray(below, dtype=np.int64)
