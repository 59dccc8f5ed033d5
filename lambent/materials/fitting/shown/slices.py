"""E around the optimum of a fit (thesis figure 3.9): over two parameters of a lobe, with all others fixed.

Only the lobe's own coefficient is solved again at each point. A narrow round pit shows that the table determines both
parameters; a valley, that it determines only a combination of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.parameters import BOUNDS, RETRO_BOUNDS
from lambent.materials.fitting.problem import Problem, problem_of
from lambent.materials.fitting.scale import Channel, solve_scale
from lambent.materials.measured.inspecting.metrics import Metric
from lambent.materials.measured.protocol import MeasuredSamples

STEPS = 33  # along each axis
TUPLES = 6000
REACH = 4.0  # mx and my range from the optimum / REACH to the optimum x REACH
SOLVER_STEPS = 6


@dataclass(frozen=True)
class Slice:
    """E over two parameters of a lobe.

    Attributes
    ----------
    across, down : str
        Names of the parameters.
    x, y : (K,)
        Their values, in logarithmic steps except for alpha.
    error : (K, K)
        E in the metric's unit, rows along y; estimated from some of the tuples, so comparable only within a slice.
    best : (float, float)
        The lobe's own values.
    """

    across: str
    down: str
    x: Floats
    y: Floats
    error: Floats
    best: tuple[float, float]


def slices(
    samples: MeasuredSamples,
    material: Material,
    index: int,
    metric: Metric,
    *,
    steps: int = STEPS,
    progress: Progress = silent,
) -> list[Slice]:
    """The slices of lobe `index` of `material`: over (mx, my) and (r0, alpha).

    An isotropic table has one azimuth of wi and cannot distinguish mx from my: both vary together, and (m, alpha)
    replaces (mx, my). Where r0 cannot be separated from k (retro and transmission lobes) or is a curve, a roughness
    replaces r0.
    """
    lobe = material.lobes[index]
    problem, rest = _prepared(samples, material, index, metric)
    tied = samples.info.isotropic and lobe.mx == lobe.my
    return [_slice(problem, rest, lobe, plane, steps, progress) for plane in _planes(lobe, tied)]


def _planes(lobe: Lobe, tied: bool) -> list[tuple[str, str]]:
    """Pairs of parameters; m is mx and my at once."""
    roughness = "m" if tied else "mx"
    planes = [("m", "alpha") if tied else ("mx", "my")]
    last = ("r0" if lobe.mirrors and lobe.fresnel is None else roughness, "alpha")
    return planes if last in planes else [*planes, last]


def _axis(name: str, best: float, steps: int, retro: bool) -> Floats:
    low, high = (RETRO_BOUNDS if retro else BOUNDS)["mx" if name == "m" else name]
    if name == "alpha":
        return np.linspace(low, high, steps)
    if name.startswith("m"):
        low, high = max(low, best / REACH), min(high, best * REACH)
    return np.asarray(np.geomspace(min(low, max(best, 1e-4)), max(high, best), steps))


def _prepared(samples: MeasuredSamples, material: Material, index: int, metric: Metric) -> tuple[Problem, Floats]:
    """Some tuples of the lobe's side, and f (C, N) of all but the lobe at them."""
    lobe = material.lobes[index]
    retro = any(other.retro for other in material.lobes) and lobe.side == "reflection"
    problem = problem_of(samples, lobe.side, metric, lobe.distribution, material.kd_coupled, retro)
    problem = problem.thinned([TUPLES], 0, [np.float64])[0]
    channels = len(problem.measured)
    diffuse = np.array(material.kd if lobe.side == "reflection" else material.kt_d)[:channels]
    rest = diffuse[:, None] * problem.diffuse
    for number, other in enumerate(material.lobes):
        if number != index and other.side == lobe.side:
            rest = rest + np.array(other.k)[:channels, None] * problem.of(other)
    return problem, rest


def _slice(problem: Problem, rest: Floats, lobe: Lobe, plane: tuple[str, str], steps: int, progress: Progress) -> Slice:
    across, down = plane
    own = {"mx": lobe.mx, "my": lobe.my, "r0": float(np.mean(lobe.r0)), "alpha": lobe.alpha, "m": lobe.mx}
    x, y = (_axis(name, own[name], steps, lobe.retro) for name in plane)
    error = np.empty((len(y), len(x)))
    for row in tracked(range(len(y)), progress, f"error over {across} and {down}"):
        value = y[row]
        basis = np.stack([problem.of(_changed(lobe, {down: float(value), across: float(v)})) for v in x], axis=1)
        totals = np.zeros(len(x))
        for measured, background, of_channel in zip(problem.measured, rest, basis, strict=True):
            channel = Channel(measured, background, problem.w, problem.c)
            totals += solve_scale(problem.metric, channel, of_channel, steps=SOLVER_STEPS)[1]
        error[row] = (totals / len(rest)) ** (1 / problem.metric.power)
    return Slice(across, down, x, y, error, (own[across], own[down]))


def _changed(lobe: Lobe, values: dict[str, float]) -> Lobe:
    """The lobe with the named numbers; m is both roughnesses, r0 that of all channels."""
    numbers = {name: values[name] for name in ("mx", "my", "alpha") if name in values}
    if "m" in values:
        numbers |= {"mx": values["m"], "my": values["m"]}
    r0 = {"r0": (values["r0"],) * 3} if "r0" in values else {}
    return lobe.model_copy(update=numbers | r0)
