"""Joint polish of the lobes of one side: damped Gauss-Newton steps with exact derivatives.

The grid search judges its candidates on a share of the tuples and along the axes; ks and r0 trade against each other
almost freely, so that it ends up to 4 % from the best pair of the whole table. L1 is minimised by reweighting: least
squares with weights 1/|residual| has the same minimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lambent.materials.fitting.grid import ALPHA, MU, NU, R0, Candidate
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import Problem
from lambent.materials.fitting.scale import TINY
from lambent.materials.fitting.several import remaining

Floats = NDArray[np.floating]

VALUES = 600_000  # tuples times channels; of a larger table an importance-sampled share is taken
STEPS = 40
STOP_SHARE = 1e-7  # a step that lowers the error by less than this share is the last
DAMPING = (1e-4, 1e6)  # at the start, and where no step downwards is left; shares of the normal matrix's diagonal
LEAST_RESIDUAL = 1e-3  # share of the transformed measurement (and of its mean) below which L1 is quadratic
K_SPAN = 7.0  # ln k may move this far
COEFFICIENT = 4  # "axis" of an unknown that is ln k of a channel


@dataclass(frozen=True)
class Unknown:
    """One coordinate of the polish: ln mx, ln my, ln r0 or alpha of a lobe, or its ln k in one channel."""

    lobe: int
    axis: int
    channel: int
    start: float
    lo: float
    hi: float


def polish(problem: Problem, boxes: Sequence[Box], lobes: Sequence[Candidate], seed: int) -> list[Candidate]:
    """The lobes after a joint refinement of all shapes and coefficients; never worse than before on all tuples."""
    unknowns = _unknowns(boxes, lobes)
    if not unknowns:
        return list(lobes)
    few = problem.thinned(VALUES // len(problem.measured), seed)
    x, lo, hi = (np.array([getattr(u, name) for u in unknowns]) for name in ("start", "lo", "hi"))
    x = np.clip(x, lo, hi)
    error = remaining(few, _moved(boxes, lobes, unknowns, x))
    damping, most = DAMPING
    for _ in range(STEPS):
        matrix, gradient = _normal_equations(few, boxes, _moved(boxes, lobes, unknowns, x), unknowns)
        before = error
        while damping < most:
            there = _step(matrix, gradient, damping, x, lo, hi)
            reached = remaining(few, _moved(boxes, lobes, unknowns, there))
            if reached < error:
                x, error, damping = there, reached, damping / 10
                break
            damping *= 10
        if before - error <= STOP_SHARE * before:
            break
    polished = _moved(boxes, lobes, unknowns, x)
    return polished if remaining(problem, polished) < remaining(problem, lobes) else list(lobes)


def _step(matrix: Floats, gradient: Floats, damping: float, x: Floats, lo: Floats, hi: Floats) -> Floats:
    """Where a damped step ends; unknowns that the gradient presses against a bound stay there."""
    free = ~(((x <= lo) & (gradient < 0)) | ((x >= hi) & (gradient > 0)))
    if not free.any():
        return x
    part = matrix[np.ix_(free, free)]
    diagonal = np.maximum(np.diag(part), 1e-12 * np.diag(matrix).max() + 1e-300)
    moved = x.copy()
    moved[free] += np.linalg.solve(part + damping * np.diag(diagonal), gradient[free])
    return np.clip(moved, lo, hi)


def _normal_equations(
    problem: Problem, boxes: Sequence[Box], lobes: Sequence[Candidate], unknowns: Sequence[Unknown]
) -> tuple[Floats, Floats]:
    """J^T W J (U, U) and J^T W r (U,), with r the transformed residual and J the model's derivative."""
    shapes = [
        (problem.basis(lobe.shape), _log_derivatives(problem, box, lobe))
        for box, lobe in zip(boxes, lobes, strict=True)
    ]
    matrix, gradient = np.zeros((len(unknowns),) * 2), np.zeros(len(unknowns))
    metric, c = problem.metric, problem.c
    for channel, (measured, background) in enumerate(zip(problem.measured, problem.background, strict=True)):
        parts = [c * lobe.k[channel] * basis for lobe, (basis, _) in zip(lobes, shapes, strict=True)]
        model = c * background + np.sum(parts, axis=0)
        target = metric.transform(c * measured)
        residual = target - metric.transform(model)
        w = problem.w
        if metric.power == 1:
            size = np.abs(target)
            w = w / np.maximum(np.abs(residual), LEAST_RESIDUAL * (size + size.mean()) + TINY)
        slope = metric.slope(model)
        here = [i for i, u in enumerate(unknowns) if u.axis != COEFFICIENT or u.channel == channel]
        rows = np.empty((len(here), len(c)))
        for row, i in zip(rows, here, strict=True):
            u = unknowns[i]
            np.multiply(slope, parts[u.lobe], out=row)
            if u.axis != COEFFICIENT:
                row *= shapes[u.lobe][1][u.axis]
        weighted = rows * w
        matrix[np.ix_(here, here)] += weighted @ rows.T
        gradient[here] += weighted @ residual
    return matrix, gradient


def _log_derivatives(problem: Problem, box: Box, lobe: Candidate) -> dict[int, Floats]:
    """Axis -> (N,) derivative of ln f of the lobe by that search coordinate."""
    mx, my, r0, _ = (float(v) for v in lobe.shape)
    by_mx = 2 * problem.slope_x2 / (mx * mx) - 1
    by_my = 2 * problem.slope_y2 / (my * my) - 1
    sign = 1 if problem.side == "reflection" else -1
    by_r0 = sign * r0 * (1 - problem.schlick) / np.maximum(problem.fresnel(np.array(r0)), 1e-30)
    return {MU: by_mx + by_my if box.tied else by_mx, NU: by_my, R0: by_r0, ALPHA: -problem.log_cosines}


def _unknowns(boxes: Sequence[Box], lobes: Sequence[Candidate]) -> list[Unknown]:
    """What may move of all lobes; a coefficient of 0 or a fixed one is no unknown."""
    unknowns = []
    for index, (box, lobe) in enumerate(zip(boxes, lobes, strict=True)):
        for axis in range(COEFFICIENT):
            lo, hi = float(box.lo[axis]), float(box.hi[axis])
            if lo < hi and not (box.tied and axis == NU):
                unknowns.append(Unknown(index, axis, 0, float(lobe.coordinates[axis]), lo, hi))
        for channel, (k, (least, most)) in enumerate(zip(lobe.k, box.k_limits, strict=True)):
            if k > 0 and least < most:
                start = float(np.log(k))
                lo = max(start - K_SPAN, float(np.log(max(least, 1e-300))))
                hi = min(start + K_SPAN, float(np.log(most)))
                unknowns.append(Unknown(index, COEFFICIENT, channel, start, lo, hi))
    return unknowns


def _moved(boxes: Sequence[Box], lobes: Sequence[Candidate], unknowns: Sequence[Unknown], x: Floats) -> list[Candidate]:
    """The lobes with the unknowns at `x`."""
    moved = [replace(lobe, coordinates=lobe.coordinates.copy(), k=lobe.k.astype(np.float64)) for lobe in lobes]
    for u, value in zip(unknowns, x, strict=True):
        if u.axis == COEFFICIENT:
            moved[u.lobe].k[u.channel] = np.exp(value)
        else:
            moved[u.lobe].coordinates[u.axis] = value
    for box, lobe in zip(boxes, moved, strict=True):
        if box.tied:
            lobe.coordinates[NU] = lobe.coordinates[MU]
    return moved
