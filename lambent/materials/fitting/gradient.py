"""The gradient search: least squares from several starts, first on few tuples, then on all that count.

Lobes are added one by one to the best model so far. A new lobe starts at several widths and at both ends of (r0,
alpha), whose optima are bimodal, and by splitting each existing lobe into a narrow and a wide one. Its coefficients are
solved on the residual of the others (subtracted and clamped); then all shapes and coefficients move together. The best
starts continue with more tuples. `fit` keeps the extra lobe only if it fits all tuples better.

Each descent is damped Gauss-Newton with exact derivatives. Coefficients enter as logarithms: they stay positive, and
ln k trades linearly against ln r0, which is poorly determined. L1 is minimised by reweighting: least squares with
weights 1/|residual| has the same minimum. Steps respect the bounds: an unknown that would leave its interval stops at
its end, and the rest of the step is solved again.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress
from lambent.materials.fitting.parameters import Box, to_search
from lambent.materials.fitting.problem import ALPHA, MU, NU, Candidate, KeptAlbedo, Mixture, Problem
from lambent.materials.fitting.scale import TINY, solve_coefficients

DAMPING = (1e-3, 1e7)  # initial and largest; shares of the normal matrix's diagonal
LEAST_RESIDUAL = 1e-3  # share of the transformed measurement (and of its mean) below which L1 is quadratic
LONGEST_STEP = 2.0  # of any logarithm: far from the optimum the model is not linear in it
K_SPAN = 14.0  # range of ln k in one minimisation, to either side
NOTHING = 1e-9  # a coefficient below this is 0
SHAPE_AXES = range(MU, ALPHA + 1)
COEFFICIENT = 4  # "axis" of unknowns that are ln k of a channel
DIFFUSE = -1  # "lobe" number of the diffuse coefficients: a model's terms are this one, then the lobes


@dataclass(frozen=True)
class Unknown:
    """One coordinate: ln mx, ln my, ln r0 or alpha of a lobe, or ln k of a lobe or of the diffuse term in a channel."""

    lobe: int
    axis: int
    channel: int
    start: float
    lo: float
    hi: float


@dataclass(frozen=True)
class Bounds:
    """Search space of one side's model: a box per lobe, and whether the diffuse coefficients are free."""

    boxes: Sequence[Box]
    diffuse_free: bool


def minimise(problem: Problem, bounds: Bounds, start: Mixture, steps: int, stop_share: float) -> tuple[Mixture, float]:
    """The model after at most `steps` descent steps from `start`, and its residual (`Problem.remaining`).

    Stops after a step that lowers the error by less than the share `stop_share`.
    """
    unknowns = _unknowns(bounds, start)
    error = problem.remaining(start)
    if not unknowns:
        return start, error
    x, lo, hi = (np.array([getattr(u, name) for u in unknowns]) for name in ("start", "lo", "hi"))
    current, (damping, most) = start, DAMPING
    for _ in range(steps):
        matrix, gradient = _normal_equations(problem, bounds, current, unknowns)
        before = error
        while damping < most:
            there = damped_step(matrix, gradient, damping, x, lo, hi)
            candidate = _moved(bounds, start, unknowns, there)
            reached = problem.remaining(candidate)
            if reached < error:
                x, error, current, damping = there, reached, candidate, max(damping / 10, 1e-9)
                break
            damping *= 10
        if before - error <= stop_share * before:
            break
    return current, error


def damped_step(matrix: Floats, gradient: Floats, damping: float, x: Floats, lo: Floats, hi: Floats) -> Floats:
    """End point of a damped step: the minimum of the damped quadratic within the bounds (active set)."""
    diagonal = np.diag(matrix)
    damped = matrix + damping * np.diag(np.maximum(diagonal, 1e-12 * diagonal.max() + 1e-300))
    least, most = np.maximum(lo - x, -LONGEST_STEP), np.minimum(hi - x, LONGEST_STEP)
    step = np.zeros_like(x)
    free = ~(((x <= lo) & (gradient < 0)) | ((x >= hi) & (gradient > 0)))
    while free.any():
        rest = gradient[free] - damped[np.ix_(free, ~free)] @ step[~free]
        step[free] = np.linalg.solve(damped[np.ix_(free, free)], rest)
        outside = free & ((step < least) | (step > most))
        if not outside.any():
            break
        step[outside] = np.clip(step[outside], least[outside], most[outside])
        free &= ~outside
    return np.asarray(np.clip(x + step, lo, hi))


def _normal_equations(
    problem: Problem, bounds: Bounds, mixture: Mixture, unknowns: Sequence[Unknown]
) -> tuple[Floats, Floats]:
    """J^T W J (U, U) and J^T W r (U,), with r the transformed residual and J the model's derivative."""
    matrix, gradient = np.zeros((len(unknowns),) * 2), np.zeros(len(unknowns))
    for block in problem.blocks:
        metric, c = block.metric, block.c
        terms, slopes = _terms(block, mixture, c), _slopes(block, bounds, mixture)
        for channel, target in enumerate(block.target):
            parts = _coefficients(mixture, channel, c.dtype)[:, None] * terms
            model = parts.sum(axis=0)
            residual = target - metric.transform(model)
            w = reweighted(block, target, residual)
            if not metric.linear:
                parts *= metric.slope(model)
            here, rows = _rows(unknowns, channel, parts, slopes, c.dtype)
            weighted = rows * w
            matrix[np.ix_(here, here)] += weighted @ rows.T
            gradient[here] += weighted @ residual
    if problem.kept is not None:
        _add_albedos(problem.kept, bounds, mixture, unknowns, matrix, gradient)
    return matrix, gradient


def reweighted(block: Problem, target: Floats, residual: Floats) -> Floats:
    """(N,) weights of least squares: the metric's, for L1 divided by the residuals."""
    if block.metric.power != 1:
        return block.w
    size = np.abs(target)
    return np.asarray(block.w / np.maximum(np.abs(residual), LEAST_RESIDUAL * (size + size.mean()) + TINY))


def _add_albedos(
    kept: KeptAlbedo, bounds: Bounds, mixture: Mixture, unknowns: Sequence[Unknown], matrix: Floats, gradient: Floats
) -> None:
    """Likewise for the albedos that the model must match."""
    pairs = kept.pairs
    terms, slopes = _terms(pairs, mixture, 1.0), _slopes(pairs, bounds, mixture)
    weight = kept.weight / kept.albedo.shape[1] * 2 / pairs.metric.power  # L1's gradient lacks the 2 of squares
    for channel, (residual, by_albedo) in enumerate(zip(*kept.off(mixture), strict=True)):
        parts = _coefficients(mixture, channel, terms.dtype)[:, None] * terms
        here, rows = _rows(unknowns, channel, parts, slopes, parts.dtype)
        rows = kept.integral(rows) * by_albedo
        matrix[np.ix_(here, here)] += weight * rows @ rows.T
        gradient[here] += weight * rows @ residual


def _terms(problem: Problem, mixture: Mixture, cosine: Floats | float) -> Floats:
    """(1 + L, N) f in 1/sr, times a cosine, of the diffuse term and of every lobe with coefficient 1."""
    return np.stack(
        [cosine * problem.diffuse, *(cosine * problem.basis(lobe.shape, lobe.retro) for lobe in mixture.lobes)]
    )


def _coefficients(mixture: Mixture, channel: int, dtype: np.dtype[Any]) -> Floats:
    return np.array([mixture.diffuse[channel], *(lobe.k[channel] for lobe in mixture.lobes)], dtype=dtype)


def _slopes(problem: Problem, bounds: Bounds, mixture: Mixture) -> list[tuple[Floats, Floats, Floats, Floats]]:
    pairs = zip(bounds.boxes, mixture.lobes, strict=False)
    return [problem.log_derivatives(lobe.shape, box.tied, lobe.retro) for box, lobe in pairs]


def _rows(
    unknowns: Sequence[Unknown], channel: int, parts: Floats, slopes: Sequence[Sequence[Floats]], dtype: np.dtype[Any]
) -> tuple[list[int], Floats]:
    """Indices of the unknowns that affect a channel, and the derivatives (U, N) of its model by them."""
    here = [i for i, u in enumerate(unknowns) if u.axis != COEFFICIENT or u.channel == channel]
    rows = np.empty((len(here), parts.shape[1]), dtype=dtype)
    for row, i in zip(rows, here, strict=True):
        u = unknowns[i]
        if u.axis == COEFFICIENT:
            row[:] = parts[u.lobe + 1]
        else:
            np.multiply(parts[u.lobe + 1], slopes[u.lobe][u.axis], out=row)
    return here, rows


def _unknowns(bounds: Bounds, start: Mixture) -> list[Unknown]:
    """The free coordinates; coefficients that are 0 or fixed are left out."""
    unknowns = []
    for index, (box, lobe) in enumerate(zip(bounds.boxes, start.lobes, strict=False)):
        for axis in SHAPE_AXES:
            lo, hi = float(box.lo[axis]), float(box.hi[axis])
            if lo < hi and not (box.tied and axis == NU):
                unknowns.append(Unknown(index, axis, 0, float(np.clip(lobe.coordinates[axis], lo, hi)), lo, hi))
        for channel, (k, (least, most)) in enumerate(zip(lobe.k, box.k_limits, strict=True)):
            if k > 0 and least < most:
                unknowns.append(_coefficient(index, channel, float(k), least, most))
    if bounds.diffuse_free:
        for channel, k in enumerate(start.diffuse):
            if k > 0:
                unknowns.append(_coefficient(DIFFUSE, channel, float(k), 0.0, np.inf))
    return unknowns


def _coefficient(lobe: int, channel: int, k: float, least: float, most: float) -> Unknown:
    start = float(np.log(k))
    lo = max(start - K_SPAN, float(np.log(max(least, 1e-300))))
    hi = min(start + K_SPAN, float(np.log(most)))
    return Unknown(lobe, COEFFICIENT, channel, min(max(start, lo), hi), lo, hi)


def _moved(bounds: Bounds, start: Mixture, unknowns: Sequence[Unknown], x: Floats) -> Mixture:
    """The model with the unknowns at `x`."""
    diffuse = start.diffuse.astype(np.float64)
    lobes = [replace(lobe, coordinates=lobe.coordinates.copy(), k=lobe.k.astype(np.float64)) for lobe in start.lobes]
    for u, value in zip(unknowns, x, strict=True):
        if u.axis != COEFFICIENT:
            lobes[u.lobe].coordinates[u.axis] = value
            continue
        k = np.exp(value)
        (diffuse if u.lobe == DIFFUSE else lobes[u.lobe].k)[u.channel] = k if k > NOTHING else 0.0
    for box, lobe in zip(bounds.boxes, lobes, strict=False):
        if box.tied:
            lobe.coordinates[NU] = lobe.coordinates[MU]
    return Mixture(diffuse, tuple(lobes))


VALUES = (12_000, 60_000, 300_000)  # measured values (tuples times channels) in the three stages
KEPT = (3, 1)  # starts that continue to the second and to the third stage
STEPS = (30, 15, 30)
STOP_SHARE = (1e-3, 1e-4, 1e-6)
WIDTHS = (0.008, 0.03, 0.1, 0.3, 0.9)
MODES = ((0.015, 0.05), (0.9, 0.85))  # (r0, alpha) of the two kinds of optimum
RETRO_WIDTHS = (0.0025, *WIDTHS[:4])
RETRO_MODES = ((1.0, -1.5), (1.0, 0.3))
STRETCHED = ((0.03, 3.0), (0.03, 1 / 3), (0.12, 3.0), (0.12, 1 / 3))  # mean width and my/mx of anisotropic starts
SPLIT = 1.8  # a lobe is split into one narrower and one wider by this factor
LEAST_START = 1e-6  # a coefficient of 0 has no logarithm


def fit_lobes(problem: Problem, bounds: Bounds, diffuse: Floats, progress: Progress, seed: int) -> Iterator[Mixture]:
    """Yield the best model with one lobe, with two lobes, ... up to the number of boxes.

    If `progress` raises before the first, the best model so far is yielded before the exception.

    Parameters
    ----------
    diffuse : (C,)
        Start values of the diffuse coefficients, or their fixed values.
    """
    channels = len(problem.measured)
    stages = problem.thinned([v // channels for v in VALUES], seed, (np.float32,) * 3)
    model = Mixture(np.maximum(diffuse, LEAST_START) if bounds.diffuse_free else diffuse)
    for count in range(1, len(bounds.boxes) + 1):
        best: list[Mixture] = []
        try:
            _descend(stages, bounds, list(_starts(stages[0], bounds, model)), progress, count, best)
        except BaseException:
            if count == 1 and best:
                yield best[0]
            raise
        model = best[0]
        yield model


def _descend(
    stages: Sequence[Problem], bounds: Bounds, starts: list[Mixture], progress: Progress, lobe: int, best: list[Mixture]
) -> None:
    """Put the results of all starts, best first, into `best`, which is valid at any time."""
    rounds, lobes, done = len(starts) + sum(KEPT), len(bounds.boxes), 0
    alive = starts
    for stage, kept, steps, stop in zip(stages, (len(starts), *KEPT), STEPS, STOP_SHARE, strict=True):
        ends = []
        for start in alive[:kept]:
            progress((lobe - 1) * rounds + done, lobes * rounds, f"lobe {lobe}, {len(stage)} tuples")
            ends.append(minimise(stage, bounds, start, steps, stop))
            best[:] = _distinct(ends)
            done += 1
        alive = list(best)
    progress(lobe * rounds, lobes * rounds, f"lobe {lobe}")


def _distinct(ends: Sequence[tuple[Mixture, float]]) -> list[Mixture]:
    """The models, best first, without repeated optima."""
    kept: list[tuple[Mixture, float]] = []
    for model, error in sorted(ends, key=lambda end: end[1]):
        if all(abs(error - other) > 1e-3 * other for _, other in kept):
            kept.append((model, error))
    return [model for model, _ in kept]


def _starts(problem: Problem, bounds: Bounds, model: Mixture) -> Iterator[Mixture]:
    """Start models with one more lobe."""
    box = bounds.boxes[len(model.lobes)]
    for mx, my, (r0, alpha) in _shapes(box):
        coordinates = np.clip(to_search(np.array([mx, my, r0, alpha])), box.lo, box.hi)
        lobe = Candidate(coordinates, np.zeros(0), box.retro)
        basis = problem.basis(lobe.shape, lobe.retro)[None]
        k = solve_coefficients(problem.metric, problem.channels(model), basis, box.k_limits)
        yield _positive(bounds, model, replace(lobe, k=_within(k, box)))
    for index, lobe in enumerate(model.lobes):
        if lobe.retro != box.retro:
            continue
        narrow, wide = (_widened(lobe, scale, b) for scale, b in ((1 / SPLIT, bounds.boxes[index]), (SPLIT, box)))
        others = list(model.lobes)
        others[index] = narrow
        yield _positive(bounds, replace(model, lobes=tuple(others)), wide)


def _shapes(box: Box) -> Iterator[tuple[float, float, tuple[float, float]]]:
    widths, modes = (RETRO_WIDTHS, RETRO_MODES) if box.retro else (WIDTHS, MODES)
    for m, mode in product(widths, modes):
        yield m, m, mode
    if not box.tied:
        for (m, ratio), mode in product(STRETCHED, modes):
            yield m / np.sqrt(ratio), m * np.sqrt(ratio), mode


def _widened(lobe: Candidate, scale: float, box: Box) -> Candidate:
    coordinates = lobe.coordinates.copy()
    coordinates[[MU, NU]] += np.log(scale)
    return Candidate(np.clip(coordinates, box.lo, box.hi), _within(lobe.k / 2, box), lobe.retro)


def _within(k: Floats, box: Box) -> Floats:
    least, most = np.array(box.k_limits).T
    return np.clip(np.maximum(k, LEAST_START), least, most)


def _positive(bounds: Bounds, model: Mixture, lobe: Candidate) -> Mixture:
    """The model with the added lobe; coefficients of 0 become free again."""
    lobes = [replace(one, k=_within(one.k, box)) for box, one in zip(bounds.boxes, model.lobes, strict=False)]
    diffuse = np.maximum(model.diffuse, LEAST_START) if bounds.diffuse_free else model.diffuse
    return Mixture(diffuse, (*lobes, lobe))
