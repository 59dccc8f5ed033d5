"""The hierarchical grid search of one lobe (thesis 3.4.1), in the logarithms of mx, my and r0 and in alpha.

n equidistant values per free parameter; the best is kept; every interval shrinks to 1/(n - 1) of its extent around it;
repeat. Three things keep it from getting stuck and make it practical on real tables:
- r0 and alpha are bimodal, so the first level keeps the best of each of the four (low, high) combinations of the two,
  and each is refined on its own;
- a best value on the face of a shrunken box moves the box before it shrinks further;
- the first levels look at a small, importance-sampled share of the tuples, later ones at more (`Problem.thinned`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.materials.fitting.parameters import Box, from_search
from lambent.materials.fitting.problem import Problem
from lambent.materials.fitting.scale import Channel, solve_scale

Floats = NDArray[np.floating]

NEGLIGIBLE = 1e-9  # f in 1/sr: tuples where no candidate reaches this are left to the background alone
MU, NU, R0, ALPHA = range(4)


@dataclass(frozen=True)
class Level:
    """One round: `n` values per parameter, judged on about `values` measured values (tuples times channels), `starts`
    candidates refined."""

    n: int
    values: int
    starts: int


SCHEDULE = (
    Level(9, 4500, 4),
    Level(5, 4500, 4),
    Level(5, 9000, 2),
    Level(3, 20000, 2),
    Level(3, 20000, 2),
    Level(3, 40000, 1),
    Level(3, 80000, 1),
)
MOVES = 12  # of a box at one level


@dataclass(frozen=True)
class Candidate:
    """A lobe with its coefficient per channel and what it leaves unexplained."""

    coordinates: Floats  # (4,) search coordinates
    k: Floats  # (C,)
    total: float  # the metric's sum over tuples, averaged over channels; comparable on the same tuples only

    @property
    def shape(self) -> Floats:
        """mx, my, r0, alpha."""
        return from_search(self.coordinates)


class Best:
    """The best candidate of the deepest level finished so far; what a cancelled search still has."""

    def __init__(self) -> None:
        self.candidate: Candidate | None = None


def search(
    problem: Problem, box: Box, progress: Progress, best: Best, seed: int, schedule: tuple[Level, ...] = SCHEDULE
) -> Candidate:
    """Best lobe in `box`; `best` follows the search, so that it survives a `Cancelled` from `progress`."""
    channels = len(problem.measured)
    rounds = 1 + sum(level.starts for level in schedule[1:])
    done = 0

    def step(what: str) -> None:
        nonlocal done
        done += 1
        progress(min(done, rounds), rounds, what)

    progress(0, rounds, "search")
    coarse = problem.thinned(schedule[0].values // channels, seed)
    first = list(_evaluate(coarse, box, *_axes(box.lo, box.hi, box, schedule[0].n)))
    best.candidate = min(first, key=_total)
    step("coarse grid")
    starts: list[tuple[Candidate, Floats]] = [
        (start, (box.hi - box.lo) / (schedule[0].n - 1)) for start in _corners(first, box)
    ]
    for depth, level in enumerate(schedule[1:], start=1):
        refined: list[tuple[Candidate, Floats]] = []
        thinned = problem.thinned(level.values // channels, seed)
        for start, extent in starts[: level.starts]:
            refined.append(_refine(thinned, box, start, extent, level.n))
            step(f"level {depth + 1} of {len(schedule)}")
        refined.sort(key=lambda pair: pair[0].total)
        best.candidate = refined[0][0]
        starts = refined
    return starts[0][0]


def _total(candidate: Candidate) -> float:
    return candidate.total


def _corners(candidates: list[Candidate], box: Box) -> list[Candidate]:
    """The best candidate of every (low, high) combination of r0 and alpha."""
    middle = (box.lo + box.hi) / 2
    found: dict[tuple[bool, bool], Candidate] = {}
    for candidate in candidates:
        key = (bool(candidate.coordinates[R0] > middle[R0]), bool(candidate.coordinates[ALPHA] > middle[ALPHA]))
        if key not in found or candidate.total < found[key].total:
            found[key] = candidate
    return list(found.values())


def _refine(problem: Problem, box: Box, start: Candidate, extent: Floats, n: int) -> tuple[Candidate, Floats]:
    """Best candidate around `start` and the extent for the next level."""
    current = start
    for _ in range(MOVES):
        lo = np.maximum(current.coordinates - extent / 2, box.lo)
        hi = np.minimum(current.coordinates + extent / 2, box.hi)
        found = min(_evaluate(problem, box, *_axes(lo, hi, box, n)), key=_total)
        at_face = ((found.coordinates <= lo) & (lo > box.lo)) | ((found.coordinates >= hi) & (hi < box.hi))
        current = found
        if not at_face.any():
            break
    return current, extent / (n - 1)


def _axes(lo: Floats, hi: Floats, box: Box, n: int) -> tuple[list[tuple[float, float]], Floats, Floats]:
    """Pairs of (ln mx, ln my), and the values of r0 (logarithms) and alpha to be combined."""
    values = [np.linspace(a, b, n) if b > a else np.array([a]) for a, b in zip(lo, hi, strict=True)]
    if box.tied:
        pairs = [(float(v), float(v)) for v in values[MU]]
    else:
        pairs = [(float(a), float(b)) for a, b in product(values[MU], values[NU])]
    return pairs, values[R0], values[ALPHA]


def _evaluate(
    problem: Problem, box: Box, pairs: list[tuple[float, float]], r0: Floats, alpha: Floats
) -> Iterator[Candidate]:
    """Every combination of the pairs of slopes with r0 and alpha, each with its solved coefficient."""
    combined = np.array(list(product(r0, alpha)))
    fresnel = problem.fresnel(np.exp(combined[:, 0])).astype(problem.base.dtype)
    rest = fresnel * np.exp(-combined[:, 1:].astype(problem.base.dtype) * problem.log_cosines)
    highest = rest.max(axis=0)
    channels = problem.channels
    unexplained = [_losses(problem, channel) for channel in channels]
    for log_mx, log_my in pairs:
        density = problem.distribution(np.exp(log_mx), np.exp(log_my))
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
            yield Candidate(coordinates, np.array([k[row] for k in ks]), float(mean[row]))


def _losses(problem: Problem, channel: Channel) -> Floats:
    """What each tuple adds to the metric where the lobe is 0."""
    transform = problem.metric.transform
    difference = np.abs(transform(channel.c * channel.measured) - transform(channel.c * channel.background))
    return np.asarray(channel.w * difference**problem.metric.power)
