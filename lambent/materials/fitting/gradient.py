"""Joint polish of all lobes of one side by bounded least squares."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lambent.materials.fitting.grid import Candidate
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import Problem
from lambent.materials.fitting.several import lobes_sum, remaining

Floats = NDArray[np.floating]

TUPLES = 8000
ROUNDING = 0.1  # share of the mean residual below which L1 is treated as quadratic
K_SPAN = 7.0  # ln k may move this far


def polish(problem: Problem, boxes: Sequence[Box], lobes: Sequence[Candidate], seed: int) -> list[Candidate]:
    """The lobes after a joint refinement of all shapes and coefficients; never worse than before on all tuples.

    The unknowns of a lobe are its free search coordinates (ln mx, ln my, ln r0, alpha) and ln k per channel.
    """
    from scipy.optimize import least_squares

    few = problem.thinned(TUPLES, seed)
    start, lo, hi = _pack(boxes, lobes)
    if len(start) == 0:
        return list(lobes)
    target = few.metric.transform(few.c * few.measured)
    root = few.w if few.metric.power == 1 else np.sqrt(few.w)

    def residual(x: Floats) -> Floats:
        model = few.background + lobes_sum(few, _unpack(boxes, lobes, x))
        return np.asarray((root * (few.metric.transform(few.c * model) - target)).ravel(), dtype=np.float64)

    typical = max(float(np.mean(np.abs(residual(start)))), 1e-30)  # the solver's tolerances expect residuals about 1
    solved = least_squares(
        lambda x: residual(x) / typical,
        start,
        bounds=(lo, hi),
        x_scale="jac",
        max_nfev=200,
        diff_step=1e-4,
        loss="soft_l1" if few.metric.power == 1 else "linear",
        f_scale=ROUNDING,
    )
    polished = _unpack(boxes, lobes, solved.x)
    return polished if remaining(problem, polished) < remaining(problem, lobes) else list(lobes)


def _free(box: Box) -> list[int]:
    axes = [axis for axis in range(4) if box.hi[axis] > box.lo[axis]]
    return [axis for axis in axes if not (box.tied and axis == 1)]


def _pack(boxes: Sequence[Box], lobes: Sequence[Candidate]) -> tuple[Floats, Floats, Floats]:
    """Unknowns of all lobes with their bounds; a coefficient of 0 or a fixed one is no unknown."""
    x: list[float] = []
    lo: list[float] = []
    hi: list[float] = []
    for box, lobe in zip(boxes, lobes, strict=True):
        for axis in _free(box):
            x.append(float(lobe.coordinates[axis]))
            lo.append(float(box.lo[axis]))
            hi.append(float(box.hi[axis]))
        for k, (least, most) in zip(lobe.k, box.k_limits, strict=True):
            if k > 0 and least < most:
                x.append(float(np.log(k)))
                lo.append(max(x[-1] - K_SPAN, float(np.log(max(least, 1e-300)))))
                hi.append(min(x[-1] + K_SPAN, float(np.log(most)) if np.isfinite(most) else np.inf))
    lo_all, hi_all = np.array(lo), np.array(hi)
    margin = 1e-9 * (hi_all - lo_all)
    return np.clip(np.array(x), lo_all + margin, hi_all - margin), lo_all, hi_all


def _unpack(boxes: Sequence[Box], lobes: Sequence[Candidate], x: Floats) -> list[Candidate]:
    values = iter(x)
    unpacked = []
    for box, lobe in zip(boxes, lobes, strict=True):
        coordinates, k = lobe.coordinates.copy(), lobe.k.astype(np.float64)
        for axis in _free(box):
            coordinates[axis] = next(values)
        if box.tied:
            coordinates[1] = coordinates[0]
        for channel, (least, most) in enumerate(box.k_limits):
            if k[channel] > 0 and least < most:
                k[channel] = np.exp(next(values))
        unpacked.append(replace(lobe, coordinates=coordinates, k=k))
    return unpacked
