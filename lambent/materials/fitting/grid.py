"""The hierarchical search of one lobe (thesis 3.4.1), in the logarithms of mx, my and r0 and in alpha.

n equidistant values per free parameter; the best combination is kept; every interval shrinks to 1/(n - 1) of its
extent around it; repeated a given number of times. The coefficient of each candidate is solved, not searched. Of
a table with more than `VALUES` measured values an importance-sampled share is looked at.

Nothing keeps the global optimum in the box (the thesis says so): `gradient` is never worse and far quicker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import ALPHA, MU, NU, R0, Candidate, Mixture, Problem
from lambent.materials.fitting.scale import Channel, solve_scale

Floats = NDArray[np.floating]

NEGLIGIBLE = 1e-9  # f in 1/sr: tuples where no candidate reaches this are left to the background alone
VALUES = 40_000  # measured values (tuples times channels)
FULL_STEPS = 40  # Gauss-Newton steps for the coefficients on all tuples


@dataclass(frozen=True)
class Schedule:
    """n values per parameter at each of so many levels."""

    n: int = 9
    levels: int = 5


class Best:
    """The best candidate of the deepest level finished so far; what a cancelled search still has."""

    def __init__(self) -> None:
        self.candidate: Candidate | None = None


def search(
    problem: Problem, others: Mixture, box: Box, progress: Progress, best: Best, seed: int, schedule: Schedule
) -> Candidate:
    """Best lobe in `box` for what `others` leave; `best` follows the search and survives what `progress` raises."""
    (few,) = problem.thinned([VALUES // len(problem.measured)], seed, [np.float32])
    lo, hi = box.lo, box.hi
    for level in range(schedule.levels):

        def report(share: float, level: int = level) -> None:
            progress(level + share, schedule.levels, f"level {level + 1} of {schedule.levels}")

        candidates = _evaluate(few, few.channels(others), box, *_axes(lo, hi, box, schedule.n), report)
        found = min(candidates, key=lambda pair: pair[1])[0]
        best.candidate = found
        extent = (hi - lo) / (schedule.n - 1)
        lo = np.maximum(found.coordinates - extent / 2, box.lo)
        hi = np.minimum(found.coordinates + extent / 2, box.hi)
    progress(schedule.levels, schedule.levels, "searched")
    assert best.candidate is not None
    return best.candidate


def _axes(lo: Floats, hi: Floats, box: Box, n: int) -> tuple[list[tuple[float, float]], Floats, Floats]:
    """Pairs of (ln mx, ln my), and the values of r0 (logarithms) and alpha to be combined."""
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
    """Every combination of the pairs of slopes with r0 and alpha, its coefficient solved, and what it leaves."""
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
    """What each tuple adds to the metric where the lobe is 0."""
    transform = problem.metric.transform
    difference = np.abs(transform(channel.c * channel.measured) - transform(channel.c * channel.background))
    return np.asarray(channel.w * difference**problem.metric.power)


def with_exact_scale(problem: Problem, others: Mixture, lobe: Candidate, box: Box) -> Candidate:
    """The lobe with its coefficients solved on all tuples in float64."""
    basis = problem.basis(lobe.shape)[None]
    solved = [
        solve_scale(problem.metric, channel, basis, limits, FULL_STEPS)[0][0]
        for channel, limits in zip(problem.channels(others), box.k_limits, strict=True)
    ]
    return Candidate(lobe.coordinates, np.array(solved, dtype=float))
