"""The modern search: least squares from several starts, on few tuples first, then on all that count.

One lobe after another is added to the best model so far: a new lobe is started at several widths, at either end of
(r0, alpha), which are bimodal, and by splitting each lobe there is into a narrow and a wide one. Its coefficients are
solved on what the others leave (subtracted and clamped); then every shape and coefficient moves at once. The best
starts go on with more tuples. The model with one lobe more is kept only where it explains all tuples better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.materials.fitting.least_squares import Bounds, minimise
from lambent.materials.fitting.parameters import Box, to_search
from lambent.materials.fitting.problem import MU, NU, Candidate, Mixture, Problem
from lambent.materials.fitting.scale import solve_scale

Floats = NDArray[np.floating]

VALUES = (12_000, 60_000, 300_000)  # measured values (tuples times channels) that the three stages look at
KEPT = (3, 1)  # starts that go on to the second and to the third stage
STEPS = (30, 15, 30)
STOP_SHARE = (1e-3, 1e-4, 1e-6)
WIDTHS = (0.008, 0.03, 0.1, 0.3, 0.9)
MODES = ((0.015, 0.05), (0.9, 0.85))  # (r0, alpha) of the two kinds of optimum
STRETCHED = ((0.03, 3.0), (0.03, 1 / 3), (0.12, 3.0), (0.12, 1 / 3))  # mean width and my/mx of anisotropic starts
SPLIT = 1.8  # a lobe is split into one so much narrower and one so much wider
LEAST_START = 1e-6  # a coefficient of 0 has no logarithm to move


def fit_lobes(
    problem: Problem,
    bounds: Bounds,
    diffuse: Floats,
    progress: Progress,
    seed: int,
    gain: float,
    found: list[Mixture],
) -> None:
    """Append to `found` the best model with one lobe, two lobes, ... as many as there are boxes.

    Parameters
    ----------
    diffuse : (C,)
        Where the diffuse coefficients start, or their values where they are given.
    gain : float
        Share of E that another lobe has to take off; where it does not, the search ends early.
    found : list
        Is what is finished when `progress` raises.
    """
    channels = len(problem.measured)
    stages = problem.thinned([v // channels for v in VALUES], seed, (np.float32,) * 3)
    model = Mixture(np.maximum(diffuse, LEAST_START) if bounds.diffuse_free else diffuse)
    error = np.inf
    for count in range(1, len(bounds.boxes) + 1):
        candidates = list(_starts(stages[0], bounds, model))
        ranked = _descend(stages, bounds, candidates, progress, count, found)
        reached = problem.remaining(ranked)
        if reached >= error * (1 - gain) ** problem.metric.power:
            return
        found.append(ranked)
        model, error = ranked, reached


def _descend(
    stages: Sequence[Problem],
    bounds: Bounds,
    starts: Sequence[Mixture],
    progress: Progress,
    lobe: int,
    found: list[Mixture],
) -> Mixture:
    """The best end of all starts; where `progress` raises and nothing is in `found` yet, the best so far goes there."""
    rounds, lobes = len(starts) + sum(KEPT), len(bounds.boxes)
    done = 0
    alive = list(starts)
    ends: list[tuple[Mixture, float]] = []
    try:
        for stage, kept, steps, stop in zip(stages, (len(starts), *KEPT), STEPS, STOP_SHARE, strict=True):
            ends = []
            for start in alive[:kept]:
                progress((lobe - 1) * rounds + done, lobes * rounds, f"lobe {lobe}, {len(stage)} tuples")
                ends.append(minimise(stage, bounds, start, steps, stop))
                done += 1
            alive = _distinct(ends)
        progress(lobe * rounds, lobes * rounds, f"lobe {lobe}")
    except BaseException:
        if not found and done:
            found.append((_distinct(ends) or alive)[0])
        raise
    return alive[0]


def _distinct(ends: Sequence[tuple[Mixture, float]]) -> list[Mixture]:
    """The models, best first, without those that are the same optimum again."""
    kept: list[tuple[Mixture, float]] = []
    for model, error in sorted(ends, key=lambda end: end[1]):
        if all(abs(error - other) > 1e-3 * other for _, other in kept):
            kept.append((model, error))
    return [model for model, _ in kept]


def _starts(problem: Problem, bounds: Bounds, model: Mixture) -> Iterator[Mixture]:
    """The model with one lobe more, in several ways."""
    box = bounds.boxes[len(model.lobes)]
    for mx, my, (r0, alpha) in _shapes(box):
        coordinates = np.clip(to_search(np.array([mx, my, r0, alpha])), box.lo, box.hi)
        basis = problem.basis(Candidate(coordinates, np.zeros(0)).shape)[None]
        k = [
            solve_scale(problem.metric, channel, basis, limits)[0][0]
            for channel, limits in zip(problem.channels(model), box.k_limits, strict=True)
        ]
        yield _positive(bounds, model, Candidate(coordinates, _within(np.array(k, dtype=float), box)))
    for index, lobe in enumerate(model.lobes):
        narrow, wide = (_widened(lobe, scale, b) for scale, b in ((1 / SPLIT, bounds.boxes[index]), (SPLIT, box)))
        others = list(model.lobes)
        others[index] = narrow
        yield _positive(bounds, replace(model, lobes=tuple(others)), wide)


def _shapes(box: Box) -> Iterator[tuple[float, float, tuple[float, float]]]:
    for m, mode in product(WIDTHS, MODES):
        yield m, m, mode
    if not box.tied:
        for (m, ratio), mode in product(STRETCHED, MODES):
            yield m / np.sqrt(ratio), m * np.sqrt(ratio), mode


def _widened(lobe: Candidate, scale: float, box: Box) -> Candidate:
    coordinates = lobe.coordinates.copy()
    coordinates[[MU, NU]] += np.log(scale)
    return Candidate(np.clip(coordinates, box.lo, box.hi), _within(lobe.k / 2, box))


def _within(k: Floats, box: Box) -> Floats:
    least, most = np.array(box.k_limits).T
    return np.clip(np.maximum(k, LEAST_START), least, most)


def _positive(bounds: Bounds, model: Mixture, lobe: Candidate) -> Mixture:
    """The model with the lobe; what is 0 of it may move again."""
    lobes = [replace(one, k=_within(one.k, box)) for box, one in zip(bounds.boxes, model.lobes, strict=False)]
    diffuse = np.maximum(model.diffuse, LEAST_START) if bounds.diffuse_free else model.diffuse
    return Mixture(diffuse, (*lobes, lobe))
