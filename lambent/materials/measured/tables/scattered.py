"""Isotropic tables of ungridded measurements, looked up by moving least squares over the nearest of them."""

from __future__ import annotations

from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from lambent.core.arrays import Flags, Indices
from lambent.core.geometry.directions import Floats, direction
from lambent.core.geometry.sequences import radical_inverse
from lambent.materials.measured.merl import half_difference_angles
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect
from lambent.materials.measured.tables.table import ReflectionTable, sensible

NEIGHBOURS = 16
_SLOPE_PENALTY = 1e-4  # of the plane, per radius of the neighbourhood: keeps it flat if the data are on a line
_DARK = 0.05  # share of the median f added before the logarithm: darker values count as equal
_ASIDE = 0.7  # .65 = 3/8 sqrt(3) in a corner of the space of pairs that is measured evenly
_PEAK_RAD = 0.1  # theta_h within which distances count most
_POINTS_PER_TUPLE, _WEIGHT_POINTS = 90, (1 << 12, 1 << 18)  # of the Monte Carlo weights, and their bounds


class ScatteredTable(ReflectionTable):
    """Isotropic reflection at scattered directions.

    `eval` fits log(f + dark) of the 16 nearest tuples as linear in theta_h, cos theta_d and phi_d, weighted by
    (1 - d^2)^2 / d^2 with d the distance relative to the 16th (Shepard's interpolation with local planes; Franke &
    Nielson 1980). The plane may deviate from the weighted mean of log(f + dark) by 1 - d^2 of the distance to any of
    the 16. So f reproduces the measured value at a tuple, stays within the range of the 16, and is continuous when
    another tuple replaces the 16th.

    Parameters
    ----------
    wi, wo : (N, 3)
    f : (N, 3)
        1/sr; NaN where not measured, negative as measured.
    """

    QUERIES_AT_ONCE: ClassVar[int] = 1 << 11

    def __init__(self, wi: Floats, wo: Floats, f: Floats, info: TableInfo) -> None:
        self._wi, self._wo, self._f, self.info = wi, wo, f, info
        self._usable = sensible(f)

    @cached_property
    def _tree(self) -> Any:  # scipy is imported on demand
        from scipy.spatial import cKDTree

        return cKDTree(_place(self._wi[self._usable], self._wo[self._usable]))

    @cached_property
    def _variables(self) -> Floats:
        return _variables(self._wi[self._usable], self._wo[self._usable])

    def _nearest(self, place: Floats) -> tuple[Floats, Indices]:
        """Distances and indices (N, K) of the nearest usable tuples, nearest first."""
        k = min(NEIGHBOURS, self._tree.n)
        distance, index = self._tree.query(place, k=list(range(1, k + 1)))
        return distance, index

    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        values = np.maximum(self._f[self._usable], 0)
        dark = max(_DARK * float(np.median(values)), 1e-9)
        distance, index = self._nearest(_place(wi, wo))
        d = distance / np.maximum(distance[:, -1:] * (1 + 1e-3), 1e-9)
        fade = 1 - d**2
        weight = fade**2 / np.maximum(d, 1e-6) ** 2
        weight /= weight.sum(axis=1, keepdims=True)
        offset = self._variables[index] - _variables(wi, wo)[:, None]
        spread = (fade[..., None] * offset**2).sum(axis=1, keepdims=True) / fade.sum(axis=1)[:, None, None]
        offset /= np.sqrt(spread) + 1e-12
        columns = np.concatenate([np.ones((*d.shape, 1)), offset], axis=-1)
        weighed = np.swapaxes(columns * weight[..., None], 1, 2)
        normal = weighed @ columns + np.diag([0.0, *[_SLOPE_PENALTY] * 3])
        near = values[index]
        height = np.log(near + dark)
        plane = np.linalg.solve(normal, weighed @ height)[:, 0]
        mean = (weight[..., None] * height).sum(axis=1)
        reach = fade[..., None] * (height - mean[:, None])  # largest deviation from the mean that each tuple allows
        bounded = mean + (plane - mean).clip(np.minimum(reach.min(axis=1), 0), np.maximum(reach.max(axis=1), 0))
        return np.asarray((np.exp(bounded) - dark).clip(near.min(axis=1), near.max(axis=1)))  # against rounding errors

    @cached_property
    def lowest_cosine(self) -> float:
        """cos theta of the measured direction nearest to grazing, for the light or the viewer."""
        return float(min(self._wi[self._usable, 2].min(), self._wo[self._usable, 2].min()))

    def extrapolates(self, wi: Floats, wo: Floats) -> Flags:
        """(...) whether no tuples surround the pairs wi, wo (..., 3).

        That is, one direction is nearer to grazing than any measured, or the 16 nearest tuples are all to one side:
        their mean is further away than _ASIDE of the distance to the 16th.
        """
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        place = _place(wi.reshape(-1, 3), wo.reshape(-1, 3))
        distance, index = self._nearest(place)
        aside = np.linalg.norm(self._tree.data[index].mean(axis=1) - place, axis=1) > _ASIDE * distance[:, -1]
        low = np.minimum(wi[..., 2], wo[..., 2]) < self.lowest_cosine
        return np.asarray(aside.reshape(wi.shape[:-1]) | low)

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The file's tuples; the weight is the part of d_wi d_wo nearest to each, in sr^2."""
        from scipy.spatial import cKDTree

        count = int(np.clip(_POINTS_PER_TUPLE * len(self._f), *_WEIGHT_POINTS))
        k = np.arange(count)
        u = np.stack([radical_inverse(k, base) for base in (2, 3, 5)])
        wi, wo = direction(np.arccos(u[0]), 0.0), direction(np.arccos(u[1]), 2 * np.pi * u[2])
        _, nearest = cKDTree(_place(self._wi, self._wo)).query(_place(wi, wo))
        weight = np.bincount(nearest, minlength=len(self._f)) * ((2 * np.pi) ** 2 / count)
        not_measured = np.asarray(np.isnan(self._f).any(axis=1))
        return collect(self._wi, self._wo, self._f, weight, self.info, not_measured, max_count)


def _place(wi: Floats, wo: Floats) -> Floats:
    """(..., 3) point of a pair whose Euclidean distance follows theta_h (stretched near 0), theta_d and phi_d."""
    theta_h, theta_d, folded = _angles(wi, wo)
    stretched = np.arcsinh(theta_h / _PEAK_RAD) / np.arcsinh(np.pi / 2 / _PEAK_RAD)
    return np.stack([stretched, theta_d * 2 / np.pi, folded / 2], axis=-1)


def _variables(wi: Floats, wo: Floats) -> Floats:
    """(..., 3) variables in which log f is linear; cos theta_d, because f is even in theta_d."""
    theta_h, theta_d, folded = _angles(wi, wo)
    return np.stack([theta_h, np.cos(theta_d), folded], axis=-1)


def _angles(wi: Floats, wo: Floats) -> tuple[Floats, Floats, Floats]:
    """theta_h and theta_d, and phi_d in [0, 1], folded by reciprocity and the mirror symmetry of isotropic materials.

    phi_d is scaled by the circumference of its circle, which is small for theta_h or theta_d near 0.
    """
    theta_h, theta_d, phi_d = half_difference_angles(wi, wo)
    return theta_h, theta_d, np.minimum(phi_d, np.pi - phi_d) * (2 / np.pi) * np.sin(theta_h) * np.sin(theta_d)
