"""The gradient search: least squares from several starts, first on few tuples, then on all that count.

Lobes are added one by one to the best model so far. A new lobe starts at several widths and at both ends of (r0,
alpha), whose optima are bimodal, and by splitting each existing lobe into a narrow and a wide one. Its coefficients are
solved on the residual of the others (subtracted and clamped); then all shapes and coefficients move together. The best
starts continue with more tuples. `fit` keeps the extra lobe only if it fits all tuples better.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress
from lambent.materials.fitting.least_squares import Bounds, minimise
from lambent.materials.fitting.parameters import Box, to_search
from lambent.materials.fitting.problem import MU, NU, Candidate, Mixture, Problem
from lambent.materials.fitting.scale import solve_coefficients

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
