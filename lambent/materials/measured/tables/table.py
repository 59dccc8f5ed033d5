"""Shared by the tables of all formats: interpolation, hole filling, rejection of empty files."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.errors import UserError
from lambent.materials.measured.protocol import LARGEST_F, MeasuredTable, TableInfo

MARKS = (-1.0, -99.0, -999.0, -9999.0)  # "not measured"; any other negative number is a reading


class ReflectionTable(MeasuredTable):
    """Base of three-channel tables of reflection alone; f is 0 where wi or wo is below the surface."""

    QUERIES_AT_ONCE: ClassVar[int] = 1 << 17

    @abstractmethod
    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 3) of directions (N, 3) above the surface."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr; 0 where wi or wo is below the surface."""
        return on_flat_pairs(self._eval_flat, wi, wo)

    def _eval_flat(self, wi: Floats, wo: Floats) -> Floats:
        f = np.zeros((len(wi), 3))
        above = np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0))
        for start in range(0, len(above), self.QUERIES_AT_ONCE):
            part = above[start : start + self.QUERIES_AT_ONCE]
            f[part] = self._eval_above(wi[part], wo[part])
        return f


def on_flat_pairs(evaluate: Callable[[Floats, Floats], Floats], wi: Floats, wo: Floats) -> Floats:
    """f (..., C) for wi, wo (..., 3) of a function that takes pairs (N, 3)."""
    wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
    f = evaluate(wi.reshape(-1, 3), wo.reshape(-1, 3))
    return f.reshape(*wi.shape[:-1], f.shape[-1])


def isotropic_brdf(path: Path, reader: str, sizes: dict[str, int], notes: tuple[str, ...]) -> TableInfo:
    """Metadata of a file that holds f of an opaque isotropic material, as linear RGB."""
    return TableInfo(Path(path).name, reader, True, False, 3, "f", sizes, notes)


def mirrored_to_range(wi: Floats, wo: Floats, sign: float, *, quadrant: bool) -> tuple[Floats, Floats]:
    """The pair (N, 3), mirrored to give wi.y this sign: turned by 180 degrees, or in x and y for a quadrant."""
    flip_y = np.where(wi[:, 1] * sign < 0, -1.0, 1.0)
    flip_x = np.where(wi[:, 0] * sign < 0, -1.0, 1.0) if quadrant else flip_y
    flip = np.stack([flip_x, flip_y, np.ones_like(flip_y)], axis=-1)
    return wi * flip, wo * flip


def bracket(nodes: Floats, x: Floats) -> tuple[Indices, Indices, Floats]:
    """Indices of the nodes around x and the share of the upper one; x is clamped to the nodes, which increase."""
    if len(nodes) == 1:
        zero = np.zeros(x.shape, dtype=np.int64)
        return zero, zero, np.zeros(x.shape)
    low = (np.searchsorted(nodes, x, side="right") - 1).clip(0, len(nodes) - 2)
    return low, low + 1, ((x - nodes[low]) / (nodes[low + 1] - nodes[low])).clip(0, 1)


def sensible(values: Floats) -> Flags:
    """(...) whether all channels of values (..., C) are finite and possible for a surface."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.isfinite(values) & (np.abs(values) <= LARGEST_F)).all(axis=-1))


def usable_values(values: Floats) -> Flags:
    """(...) whether all channels of values (..., C) are finite and one of them is not negative."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.isfinite(values).all(axis=-1) & (values >= 0).any(axis=-1))


def unmarked(values: Floats) -> Floats:
    """`values` of a text file with the customary marks for "not measured" replaced by NaN."""
    return np.where(np.isin(values, MARKS), np.nan, values)


def fill_holes(values: Floats, measured: Flags, periodic_axis: int | None = None) -> Floats:
    """`values` (grid..., C) with every unmeasured cell set to the nearest measured one, counted in cells.

    Parameters
    ----------
    values : (grid..., C)
    measured : (grid...) bool, with at least one True
    periodic_axis : int, optional
        Axis of the grid that wraps round.
    """
    if measured.all():
        return values
    from scipy.ndimage import distance_transform_edt

    axis = periodic_axis
    pad = [(0, 0)] * measured.ndim
    if axis is not None:
        pad[axis] = (measured.shape[axis] // 2,) * 2
    padded = np.pad(~measured, pad, mode="wrap")
    nearest = distance_transform_edt(padded, return_distances=False, return_indices=True)
    if axis is not None:
        inner = [slice(None)] * measured.ndim
        inner[axis] = slice(pad[axis][0], pad[axis][0] + measured.shape[axis])
        nearest = nearest[(slice(None), *inner)]
        nearest[axis] = (nearest[axis] - pad[axis][0]) % measured.shape[axis]
    return np.asarray(values[tuple(nearest)])


def require_values(values: Floats, measured: Flags, file: Path | str) -> None:
    """Raise `UserError` if no cell of values (grid..., C) was measured; the message counts the values found."""
    if measured.any():
        return
    with np.errstate(invalid="ignore"):
        finite, negative = np.isfinite(values) & (values <= LARGEST_F), int((values < 0).sum())
    got = f"{values.size} values, {int((~finite).sum())} not finite or beyond {LARGEST_F:g} /sr, {negative} negative"
    raise UserError("has no measured value", file=file, got=got)
