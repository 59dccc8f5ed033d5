"""Several lobes by the grid: fit one, subtract, clamp at 0, fit the next, and refit in turn (thesis 3.4.1)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.materials.fitting.grid import Best, Schedule, search, with_exact_scale
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import Mixture, Problem

Floats = NDArray[np.floating]

ROUNDS = 3  # of refitting every lobe in turn
STOP_SHARE = 0.01  # a round that lowers the error by less than this share is the last


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
    model = Mixture(diffuse)
    error = np.inf
    for count, box in enumerate(boxes, start=1):
        model = _refit(problem, model, count - 1, box, progress, seed, schedule, found)
        reached = problem.remaining(model)
        for _ in range(ROUNDS if count > 1 else 0):
            before, kept = reached, model
            for index, one in enumerate(boxes[:count]):
                model = _refit(problem, model, index, one, progress, seed, schedule, found)
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


def _refit(
    problem: Problem,
    model: Mixture,
    index: int,
    box: Box,
    progress: Progress,
    seed: int,
    schedule: Schedule,
    found: list[Mixture],
) -> Mixture:
    """The model with lobe `index` fitted (again) to what the others leave."""
    others = Mixture(model.diffuse, model.lobes[:index] + model.lobes[index + 1 :])

    def report(done: float, total: float, what: str) -> None:
        progress(done, total, f"lobe {index + 1}, {what}")

    best = Best()
    try:
        lobe = search(problem, others, box, report, best, seed, schedule)
    except BaseException:  # cancelled: the level that is finished counts, where there is no lobe yet
        if best.candidate is not None and not found:
            found.append(Mixture(model.diffuse, (with_exact_scale(problem, others, best.candidate, box),)))
        raise
    exact = with_exact_scale(problem, others, lobe, box)
    return Mixture(model.diffuse, (*model.lobes[:index], exact, *model.lobes[index + 1 :]))
