"""The hierarchical search (thesis 3.4.1), in the logarithms of mx, my and r0 and in alpha.

Several lobes: fit one, subtract, clamp at 0, fit the next, and refit in turn. One lobe: of n equidistant values per
free parameter the best combination is kept, and every interval shrinks around it to 1/(n - 1) of its extent; this
repeats a given number of times. Each candidate's coefficient is solved, not searched. A table with more than `VALUES`
measured values is thinned by importance sampling.

The box can lose the global optimum (the thesis says so): `gradient` is never worse and far quicker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import ALPHA, MU, NU, R0, Candidate, Mixture, Problem
from lambent.materials.fitting.scale import Channel, solve_coefficients, solve_scale

NEGLIGIBLE = 1e-9  # f in 1/sr: tuples where no candidate reaches it have the background alone
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
    problem: Problem,
    boxes: Sequence[Box],
    diffuse: Floats,
    progress: Progress,
    seed: int,
    schedule: Schedule,
    gain: float,
    found: list[Mixture],
) -> None:
    """Append to `found` the model with one lobe, two, ... one per box; see `gradient.fit_lobes`."""

    def refit(model: Mixture, index: int, box: Box) -> Mixture:
        """The model with lobe `index` fitted (again) to the remainder of the others."""
        others = Mixture(model.diffuse, model.lobes[:index] + model.lobes[index + 1 :])

        def report(done: float, total: float, what: str) -> None:
            progress(done, total, f"lobe {index + 1}, {what}")

        finished: list[Candidate] = []
        try:
            lobe = search(problem, others, box, report, finished, seed, schedule)
        except BaseException:  # cancelled: without a finished lobe, that of the last finished level counts
            if finished and not found:
                found.append(Mixture(model.diffuse, (_with_exact_scale(problem, others, finished[-1], box),)))
            raise
        exact = _with_exact_scale(problem, others, lobe, box)
        return Mixture(model.diffuse, (*model.lobes[:index], exact, *model.lobes[index + 1 :]))

    model = Mixture(diffuse)
    error = np.inf
    for count, box in enumerate(boxes, start=1):
        model = refit(model, count - 1, box)
        reached = problem.remaining(model)
        for _ in range(ROUNDS if count > 1 else 0):
            before, kept = reached, model
            for index, one in enumerate(boxes[:count]):
                model = refit(model, index, one)
            reached = problem.remaining(model)
            if reached >= before:
                model, reached = kept, before
            if reached > (1 - STOP_SHARE) * before:
                break
        if reached >= error * (1 - gain) ** problem.metric.power:
            return
        if len(found) < count:
            found.append(model)
        found[count - 1], error = model, reached


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
    lo, hi = box.lo, box.hi
    for level in range(schedule.levels):

        def report(share: float, level: int = level) -> None:
            progress(level + share, schedule.levels, f"level {level + 1} of {schedule.levels}")

        candidates = _evaluate(few, few.channels(others), box, *_axes(lo, hi, box, schedule.n), report)
        found = min(candidates, key=lambda pair: pair[1])[0]
        finished.append(found)
        extent = (hi - lo) / (schedule.n - 1)
        lo = np.maximum(found.coordinates - extent / 2, box.lo)
        hi = np.minimum(found.coordinates + extent / 2, box.hi)
    progress(schedule.levels, schedule.levels, "searched")
    return finished[-1]


def _axes(lo: Floats, hi: Floats, box: Box, n: int) -> tuple[list[tuple[float, float]], Floats, Floats]:
    """Pairs of (ln mx, ln my), and the values of ln r0 and alpha to combine."""
    values = [np.linspace(a, b, n) if b > a else np.array([a]) for a, b in zip(lo, hi, strict=True)]
    if box.tied:
        pairs = [(float(v), float(v)) for v in values[MU]]
    else:
        pairs = [(float(a), float(b)) for a, b in product(values[MU], values[NU])]
    return pairs, values[R0], values[ALPHA]


def _evaluate(
    problem: Problem,
    channels: tuple[Channel, ...],
    box: Box,
    pairs: list[tuple[float, float]],
    r0: Floats,
    alpha: Floats,
    report: Callable[[float], None],
) -> Iterator[tuple[Candidate, float]]:
    """Every combination of the pairs of slopes with r0 and alpha, with its coefficient solved, and its remainder."""
    combined = np.array(list(product(r0, alpha)))
    fresnel = problem.fresnel(np.exp(combined[:, 0])).astype(problem.base.dtype)
    rest = fresnel * np.exp(-combined[:, 1:].astype(problem.base.dtype) * problem.log_cosines)
    highest = rest.max(axis=0)
    unexplained = [_losses(problem, channel) for channel in channels]
    for number, (log_mx, log_my) in enumerate(pairs):
        report(number / len(pairs))
        density = problem.density(np.exp(log_mx), np.exp(log_my))
        reached = density * highest > NEGLIGIBLE
        basis = density[reached] * rest[:, reached]
        ks, totals = [], []
        for channel, loss, limits in zip(channels, unexplained, box.k_limits, strict=True):
            part = Channel(
                channel.measured[reached], channel.background[reached], channel.w[reached], channel.c[reached]
            )
            k, total = solve_scale(problem.metric, part, basis, limits)
            ks.append(k)
            totals.append(total + loss[~reached].sum())
        mean = np.mean(totals, axis=0)
        for row in range(len(combined)):
            coordinates = np.array([log_mx, log_my, *combined[row]])
            yield Candidate(coordinates, np.array([k[row] for k in ks], dtype=float)), float(mean[row])


def _losses(problem: Problem, channel: Channel) -> Floats:
    """Contribution of each tuple to the metric where the lobe is 0."""
    transform = problem.metric.transform
    difference = np.abs(transform(channel.c * channel.measured) - transform(channel.c * channel.background))
    return np.asarray(channel.w * difference**problem.metric.power)


def _with_exact_scale(problem: Problem, others: Mixture, lobe: Candidate, box: Box) -> Candidate:
    """The lobe with its coefficients solved on all tuples in float64."""
    basis = problem.basis(lobe.shape)[None]
    k = solve_coefficients(problem.metric, problem.channels(others), basis, box.k_limits, FULL_STEPS)
    return Candidate(lobe.coordinates, k)
