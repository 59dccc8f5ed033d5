"""The hierarchical search of a fit (thesis 3.4.1), in the logarithms of mx, my and r0 and in alpha.

Several lobes: fit one, subtract, clamp at 0, fit the next, and refit in turn. One lobe: evaluate all combinations of n
equidistant values per free parameter, keep the best, and shrink every interval around it to 1/(n - 1) of its extent;
repeat for a given number of levels. Each candidate's coefficient is solved, not searched. A table with more than
`VALUES` measured values is thinned by importance sampling.

The box can lose the global optimum, as the thesis states: `materials.fitting.gradient` is never worse and far faster.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress
from lambent.materials.fitting.gradient import Bounds
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import ALPHA, MU, NU, R0, Candidate, Mixture, Problem
from lambent.materials.fitting.scale import Channel, solve_coefficients, solve_scale

NEGLIGIBLE = 1e-9  # f in 1/sr: tuples that no candidate reaches have the background alone
VALUES = 40_000  # measured values (tuples times channels)
FULL_STEPS = 40  # Gauss-Newton steps for the coefficients on all tuples
ROUNDS = 3  # of refitting every lobe in turn
STOP_SHARE = 0.01  # a round that lowers the error by less than this share is the last


@dataclass(frozen=True)
class Schedule:
    """n values per parameter at each of several levels."""

    n: int = 9
    levels: int = 5


def fit_lobes(
    problem: Problem, bounds: Bounds, diffuse: Floats, progress: Progress, seed: int, schedule: Schedule | None = None
) -> Iterator[Mixture]:
    """The model with one lobe, with two, ... one per box; a `search` of `materials.fitting.fit`."""
    boxes, schedule = bounds.boxes, schedule or Schedule()

    def refit(model: Mixture, index: int, finished: list[Candidate]) -> Mixture:
        """The model with lobe `index` fitted (again) to the remainder of the others."""

        def report(done: float, total: float, what: str) -> None:
            progress(done, total, f"lobe {index + 1}, {what}")

        others = Mixture(model.diffuse, model.lobes[:index] + model.lobes[index + 1 :])
        lobe = search(problem, others, boxes[index], report, finished, seed, schedule)
        exact = _with_exact_scale(problem, others, lobe, boxes[index])
        return Mixture(model.diffuse, (*model.lobes[:index], exact, *model.lobes[index + 1 :]))

    model = Mixture(diffuse)
    for count in range(1, len(boxes) + 1):
        finished: list[Candidate] = []
        try:
            model = refit(model, count - 1, finished)
        except BaseException:  # cancelled: use the last finished level if no lobe is finished
            if count == 1 and finished:
                yield Mixture(diffuse, (_with_exact_scale(problem, model, finished[-1], boxes[0]),))
            raise
        reached = problem.remaining(model)
        for _ in range(ROUNDS if count > 1 else 0):
            before, kept = reached, model
            for index in range(count):
                model = refit(model, index, [])
            reached = problem.remaining(model)
            if reached >= before:
                model, reached = kept, before
            if reached > (1 - STOP_SHARE) * before:
                break
        yield model


def search(
    problem: Problem,
    others: Mixture,
    box: Box,
    progress: Progress,
    finished: list[Candidate],
    seed: int,
    schedule: Schedule,
) -> Candidate:
    """The best lobe in `box` for the remainder of `others`; `finished` gets the best one of every finished level."""
    (few,) = problem.thinned([VALUES // len(problem.measured)], seed, [np.float32])
    channels, lo, hi = few.channels(others), box.lo, box.hi
    for level in range(schedule.levels):

        def report(share: float, level: int = level) -> None:
            progress(level + share, schedule.levels, f"level {level + 1} of {schedule.levels}")

        axes = [np.linspace(a, b, schedule.n) if b > a else np.array([a]) for a, b in zip(lo, hi, strict=True)]
        candidates = _evaluate(few, channels, box, axes, report)
        found = min(candidates, key=lambda pair: pair[1])[0]
        finished.append(found)
        extent = (hi - lo) / (schedule.n - 1)
        lo = np.maximum(found.coordinates - extent / 2, box.lo)
        hi = np.minimum(found.coordinates + extent / 2, box.hi)
    progress(schedule.levels, schedule.levels, "searched")
    return finished[-1]


def _evaluate(
    problem: Problem, channels: tuple[Channel, ...], box: Box, axes: list[Floats], report: Callable[[float], None]
) -> Iterator[tuple[Candidate, float]]:
    """All combinations of the values (ln mx, ln my, ln r0, alpha), with solved coefficients and residuals."""
    pairs = list(zip(axes[MU], axes[MU], strict=True) if box.tied else product(axes[MU], axes[NU]))
    combined = np.array(list(product(axes[R0], axes[ALPHA])))
    fresnel = problem.fresnel(np.exp(combined[:, 0]), box.retro).astype(problem.base.dtype)
    rest = fresnel * np.exp(-combined[:, 1:].astype(problem.base.dtype) * problem.log_cosines)
    highest = rest.max(axis=0)
    unexplained = [_losses(problem, channel) for channel in channels]
    for number, (log_mx, log_my) in enumerate(pairs):
        report(number / len(pairs))
        density = problem.density(np.exp(log_mx), np.exp(log_my), box.retro)
        reached = density * highest > NEGLIGIBLE
        basis = density[reached] * rest[:, reached]
        ks, totals = [], []
        for channel, loss, limits in zip(channels, unexplained, box.k_limits, strict=True):
            k, total = solve_scale(problem.metric, channel.at(reached), basis, limits)
            ks.append(k)
            totals.append(total + loss[~reached].sum())
        mean = np.mean(totals, axis=0)
        for row in range(len(combined)):
            coordinates = np.array([log_mx, log_my, *combined[row]])
            lobe = Candidate(coordinates, np.array([k[row] for k in ks], dtype=float), box.retro)
            yield lobe, float(mean[row])


def _losses(problem: Problem, channel: Channel) -> Floats:
    """Contribution of each tuple to the metric for a lobe of 0."""
    transform = problem.metric.transform
    difference = np.abs(transform(channel.c * channel.measured) - transform(channel.c * channel.background))
    return np.asarray(channel.w * difference**problem.metric.power)


def _with_exact_scale(problem: Problem, others: Mixture, lobe: Candidate, box: Box) -> Candidate:
    """The lobe with its coefficients solved on all tuples in float64."""
    basis = problem.basis(lobe.shape, lobe.retro)[None]
    k = solve_coefficients(problem.metric, problem.channels(others), basis, box.k_limits, FULL_STEPS)
    return Candidate(lobe.coordinates, k, lobe.retro)
