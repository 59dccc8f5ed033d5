"""Several lobes on one side: fit one, subtract, clamp at 0, fit the next, and refit in turn (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.materials.fitting.grid import Best, Candidate, search
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import Problem
from lambent.materials.fitting.scale import solve_scale

Floats = NDArray[np.floating]

ROUNDS = 3  # of refitting every lobe in turn
STOP_SHARE = 0.01  # a round that lowers the error by less than this share is the last
FULL_STEPS = 40  # Gauss-Newton steps for the coefficients on all tuples


def fit_lobes(problem: Problem, boxes: Sequence[Box], progress: Progress, seed: int, found: list[Candidate]) -> None:
    """Fit one lobe per box, in place in `found`, which holds the best so far when `progress` raises."""
    for index, box in enumerate(boxes):
        _fit_one(problem, box, index, progress, seed, found)
    if len(boxes) == 1:
        return
    error = remaining(problem, found)
    for _ in range(ROUNDS):
        before, kept = error, list(found)
        for index, box in enumerate(boxes):
            _fit_one(problem, box, index, progress, seed, found)
        error = remaining(problem, found)
        if error >= before:
            found[:] = kept
        if error > (1 - STOP_SHARE) * before:
            return


def _fit_one(problem: Problem, box: Box, index: int, progress: Progress, seed: int, found: list[Candidate]) -> None:
    """(Re)fit lobe `index` to what the other lobes leave."""
    others = [lobe for i, lobe in enumerate(found) if i != index]
    rest = np.maximum(problem.measured - lobes_sum(problem, others), problem.background) if others else problem.measured
    target = problem.against(rest, problem.background)
    best = Best()
    try:
        search(target, box, _of_lobe(progress, index), best, seed)
    finally:
        if best.candidate is not None:
            found[index : index + 1] = [with_exact_scale(target, best.candidate, box)]


def _of_lobe(progress: Progress, index: int) -> Progress:
    def report(done: float, total: float, what: str) -> None:
        progress(done, total, f"lobe {index + 1}, {what}")

    return report


def lobes_sum(problem: Problem, lobes: Sequence[Candidate]) -> Floats:
    """(C, N) f of the lobes together."""
    total = np.zeros_like(problem.measured)
    for lobe in lobes:
        total += lobe.k[:, None] * problem.basis(lobe.shape)
    return total


def remaining(problem: Problem, lobes: Sequence[Candidate]) -> float:
    """The metric's sum over all tuples, averaged over channels, that background and lobes leave."""
    model = problem.background + lobes_sum(problem, lobes)
    transform: Callable[[Floats], Floats] = problem.metric.transform
    difference = np.abs(transform(problem.c * problem.measured) - transform(problem.c * model))
    return float(np.mean(difference**problem.metric.power @ problem.w))


def with_exact_scale(problem: Problem, lobe: Candidate, box: Box) -> Candidate:
    """The lobe with its coefficients solved on all tuples in float64."""
    basis = problem.basis(lobe.shape)[None]
    solved = [
        solve_scale(problem.metric, channel, basis, limits, FULL_STEPS)
        for channel, limits in zip(problem.channels, box.k_limits, strict=True)
    ]
    k = np.array([float(k[0]) for k, _ in solved])
    return replace(lobe, k=k, total=float(np.mean([total[0] for _, total in solved])))
