"""Fit the lobe model to a measured table: table in, material document and an honest account out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import sha256_of
from lambent.core.progress import Cancelled, Progress, silent
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.fitting import account, gradient, several
from lambent.materials.fitting.diffuse import diffuse_mode
from lambent.materials.fitting.grid import Schedule
from lambent.materials.fitting.least_squares import Bounds
from lambent.materials.fitting.metrics import Metric, errors_of, metric_named
from lambent.materials.fitting.parameters import (
    SHAPE,
    Box,
    Fixed,
    Ranges,
    Side,
    box_of,
    check,
    parameter,
    per_channel,
    scalar,
)
from lambent.materials.fitting.problem import Candidate, Distribution, Mixture, Problem, problem_of
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable

Floats = NDArray[np.floating]
Method = Literal["grid", "gradient"]
METHODS: tuple[Method, ...] = ("grid", "gradient")
DISTRIBUTIONS: dict[str, tuple[Distribution, ...]] = {
    "beckmann": ("beckmann",),
    "ggx": ("ggx",),
    "best": ("beckmann", "ggx"),
}
MAX_LOBES = 4
GAIN = 0.05  # share of E that one more lobe has to take off, where their number is not given
DARK = 1e-5  # a diffuse coefficient below this is none


@dataclass(frozen=True)
class FitResult:
    """A fitted material and how good it is.

    Attributes
    ----------
    material : Material
        With its provenance filled in.
    errors, lambertian_errors : dict of float
        Metric name -> E of the material, and of the best Lambertian surface under that metric.
    seconds : float
        Wall-clock time.
    warnings : tuple of str
        What the user should know before trusting the numbers.
    partial : bool
        Whether the fit was cancelled and this is the best it had.
    """

    material: Material
    errors: dict[str, float]
    lambertian_errors: dict[str, float]
    seconds: float
    warnings: tuple[str, ...]
    partial: bool


@dataclass(frozen=True)
class Task:
    """What is asked of a fit; see `fit`."""

    lobes: int
    gain: float  # share of E that another lobe has to take off; 0 where the number is given
    method: Method
    metric: Metric
    distributions: tuple[Distribution, ...]
    coupled: bool
    fix: Fixed
    ranges: Ranges
    schedule: Schedule
    seed: int


@dataclass(frozen=True)
class Found:
    """The models of one side with one lobe, two, ... that were finished, and the boxes their lobes were sought in."""

    problem: Problem
    boxes: tuple[Box, ...]
    models: list[Mixture]


def fit(
    table: MeasuredSamples | MeasuredTable,
    *,
    lobes: int | Literal["auto"] = 1,
    method: Method = "gradient",
    metric: str = "cuberoot",
    distribution: Literal["beckmann", "ggx", "best"] = "beckmann",
    coupled: bool = False,
    fix: Fixed | None = None,
    ranges: Ranges | None = None,
    gain: float = GAIN,
    schedule: Schedule | None = None,
    seed: int = 0,
    source: Path | None = None,
    progress: Progress = silent,
) -> FitResult:
    """Fit a diffuse term and `lobes` lobes per side (3.6).

    mx, my, r0 and alpha are shared by the channels; every coefficient is solved per channel.

    Parameters
    ----------
    table : MeasuredSamples or MeasuredTable
    lobes : int or "auto"
        1 to 4 per side; "auto" adds lobes while each takes at least `gain` off the error.
    method : "gradient" or "grid"
        Least squares from several starts, all lobes and the diffuse term jointly; or the thesis's hierarchical search,
        lobe by lobe, with kd and kt_d read off the histogram (3.4.1).
    metric : str
        What is minimised, one of `METRICS`; the result names E under all of them.
    distribution : "beckmann", "ggx" or "best"
        Of the microfacets; "best" fits either and keeps, per side, the one that leaves less.
    coupled : bool
        Whether the diffuse reflection falls as Fresnel reflection rises (`Material.kd_coupled`).
    fix, ranges : mapping, optional
        Parameter name -> value, or -> (lo, hi); names as in `parameters.known_parameters`.
    gain : float
        Share of E in (0, 1), for "auto".
    schedule : Schedule, optional
        Values per parameter and number of levels of the grid.
    seed : int
        Of the choice of tuples; the same seed gives the same material.
    source : Path, optional
        The measured file, to be hashed into the provenance.
    progress : Progress
        May raise `Cancelled` or KeyboardInterrupt: the best so far is returned, flagged partial.

    Raises
    ------
    UserError
        Unknown method, metric, distribution or parameter; impossible value; number of lobes out of range; a parameter
        of transmission for a table without any.
    """
    began = time.perf_counter()
    task = _task(lobes, gain, method, metric, distribution, coupled, fix or {}, ranges or {}, schedule, seed)
    samples = table if isinstance(table, MeasuredSamples) else table.samples()
    _check_sides(samples, task.fix, task.ranges)
    found: dict[Side, Found] = {}
    partial = False
    try:
        for side in _sides(samples):
            _fit_side(samples, side, task, progress, found)
    except (Cancelled, KeyboardInterrupt):
        partial = True
    material = Material(
        name=Path(samples.info.file).stem,
        kd=_diffuse_rgb("reflection", samples, task, found),
        kt_d=_diffuse_rgb("transmission", samples, task, found),
        kd_coupled=coupled,
        lobes=tuple(lobe for side, one in found.items() for lobe in _document_lobes(side, one, task)),
    )
    model = account.evaluate(material, samples)
    errors = errors_of(samples, model)
    kept = {side: (one.models[-1], one.boxes) for side, one in found.items() if one.models}
    warnings = (*account.warnings_of(samples, material, model, kept, task.metric.name), *_fewer(found, lobes))
    if partial:
        warnings = ("cancelled: the best found so far", *warnings)
    provenance = Provenance(
        source=samples.info.file,
        source_sha256=sha256_of(source) if source is not None else None,
        source_format=samples.info.format,
        method=f"{method}, {lobes} lobe(s) per side, seed {seed}",
        metric=task.metric.name,
        errors=errors,
        samples={"used": len(samples), **asdict(samples.left_out)},
        notes=(*samples.info.notes, *account.restrictions(task.fix, task.ranges), *_by_lobes(found), *warnings),
    )
    return FitResult(
        material.model_copy(update={"provenance": provenance}),
        errors,
        account.lambertian_errors(samples),
        time.perf_counter() - began,
        warnings,
        partial,
    )


def _task(
    lobes: int | Literal["auto"],
    gain: float,
    method: str,
    metric: str,
    distribution: str,
    coupled: bool,
    fix: Fixed,
    ranges: Ranges,
    schedule: Schedule | None,
    seed: int,
) -> Task:
    if method not in METHODS:
        hint = did_you_mean(method, METHODS)
        raise UserError("unknown method", field="method", got=method, expected=", ".join(METHODS), hint=hint)
    if distribution not in DISTRIBUTIONS:
        hint, known = did_you_mean(distribution, DISTRIBUTIONS), ", ".join(DISTRIBUTIONS)
        raise UserError("unknown distribution", field="distribution", got=distribution, expected=known, hint=hint)
    if not 0 < gain < 1:
        raise UserError("share out of range", field="gain", got=gain, expected="between 0 and 1")
    count = MAX_LOBES if lobes == "auto" else lobes
    if not 1 <= count <= MAX_LOBES:
        raise UserError("number of lobes out of range", field="lobes", got=lobes, expected=f"1 to {MAX_LOBES}, or auto")
    check(fix, ranges, count)
    return Task(
        count,
        gain if lobes == "auto" else 0.0,
        "grid" if method == "grid" else "gradient",
        metric_named(metric),
        DISTRIBUTIONS[distribution],
        coupled,
        fix,
        ranges,
        schedule or Schedule(),
        seed,
    )


def _fit_side(samples: MeasuredSamples, side: Side, task: Task, progress: Progress, found: dict[Side, Found]) -> None:
    """Put the side's models into `found`, also those that are finished when `progress` raises."""
    channels = samples.f.shape[1]
    boxes = tuple(box_of(side, i, samples.info.isotropic, channels, task.fix, task.ranges) for i in range(task.lobes))
    diffuse = _diffuse(samples, side, task.fix)
    problem = problem_of(samples, side, task.metric, task.distributions[0], task.coupled)
    for number, distribution in enumerate(task.distributions):
        one = Found(replace(problem, distribution=distribution), boxes, [])
        if number == 0:
            found[side] = one
        report = _part(progress, side, number, len(task.distributions))
        if task.method == "grid":
            several.fit_lobes(one.problem, boxes, diffuse, report, task.seed, task.schedule, task.gain, one.models)
        else:
            bounds = Bounds(boxes, ("kd" if side == "reflection" else "kt_d") not in task.fix)
            gradient.fit_lobes(one.problem, bounds, diffuse, report, task.seed, task.gain, one.models)
        one.models[:] = [_narrow_first(model, boxes) for model in one.models]
        if one.problem.remaining(one.models[-1]) < found[side].problem.remaining(found[side].models[-1]):
            found[side] = one


def _narrow_first(model: Mixture, boxes: Sequence[Box]) -> Mixture:
    """The lobes by their roughness, where the user's restrictions do not tell them apart."""
    alike = all(np.array_equal((box.lo, box.hi), (boxes[0].lo, boxes[0].hi)) for box in boxes)
    alike = alike and all(box.k_limits == boxes[0].k_limits for box in boxes)
    return replace(model, lobes=tuple(sorted(model.lobes, key=_area))) if alike else model


def _area(lobe: Candidate) -> float:
    mx, my, _, _ = lobe.shape
    return float(mx * my)


def _part(progress: Progress, side: Side, number: int, parts: int) -> Progress:
    """Progress of one distribution of a side."""

    def report(done: float, total: float, what: str) -> None:
        progress(done / total + number, parts, f"{side}: {what}")

    return report


def _check_sides(samples: MeasuredSamples, fix: Fixed, ranges: Ranges) -> None:
    """Raise `UserError` where a restriction is about transmission and the table has none."""
    far = [name for name in [*fix, *ranges] if name.startswith("t_") or name.startswith("kt")]
    if far and not samples.transmitted.any():
        raise UserError("the table does not transmit", file=samples.info.file, field=far[0])


def _sides(samples: MeasuredSamples) -> Sequence[Side]:
    far = samples.transmitted
    sides: list[Side] = []
    if not far.all():
        sides.append("reflection")
    if far.any():
        sides.append("transmission")
    return sides


def _diffuse(samples: MeasuredSamples, side: Side, fix: Fixed) -> Floats:
    """kd or kt_d (C,) from the mode of the side's values, or as the user fixed it."""
    name = "kd" if side == "reflection" else "kt_d"
    channels = samples.f.shape[1]
    if name in fix:
        return np.array(per_channel(fix[name], channels))
    here = samples.transmitted if side == "transmission" else ~samples.transmitted
    weight = samples.weight[here] * np.abs(samples.wo[here, 2])
    return np.array([diffuse_mode(samples.f[here, c], weight) for c in range(channels)])


def _diffuse_rgb(
    side: Side, samples: MeasuredSamples, task: Task, found: dict[Side, Found]
) -> tuple[float, float, float]:
    """kd or kt_d of the model found, of the histogram where the fit did not get so far."""
    if side in found and found[side].models:
        diffuse = found[side].models[-1].diffuse
        return _rgb(np.where(diffuse < DARK, 0.0, diffuse) if task.method == "gradient" else diffuse)
    return _rgb(_diffuse(samples, side, task.fix))


def _document_lobes(side: Side, found: Found, task: Task) -> list[Lobe]:
    """The lobes as a document holds them."""
    lobes = found.models[-1].lobes if found.models else ()
    return [_lobe(side, i, lobe, found.problem.distribution, task.fix) for i, lobe in enumerate(lobes)]


def _lobe(side: Side, index: int, candidate: Candidate, distribution: Distribution, fix: Fixed) -> Lobe:
    mx, my, r0, alpha = (
        scalar(fix[parameter(side, base, index)], base) if parameter(side, base, index) in fix else float(value)
        for base, value in zip(SHAPE, candidate.shape, strict=True)
    )
    if side == "transmission" and r0 < 2e-6:
        r0 = 0.0
    return Lobe(
        side=side,
        distribution=distribution,
        k=_rgb(candidate.k),
        mx=mx,
        my=my,
        r0=(r0, r0, r0),
        alpha=min(max(alpha, 0.0), 1.0),
    )


def _rgb(values: Floats) -> tuple[float, float, float]:
    red, green, blue = (float(v) for v in (values if len(values) == 3 else np.repeat(values, 3)))
    return red, green, blue


def _errors_by_lobes(found: Found) -> list[float]:
    """E of the side alone, with one lobe, two, ..."""
    return [found.problem.remaining(model) ** (1 / found.problem.metric.power) for model in found.models]


def _by_lobes(found: dict[Side, Found]) -> list[str]:
    lines = []
    for side, one in found.items():
        if len(one.models) > 1:
            errors = ", ".join(f"{error:.4g}" for error in _errors_by_lobes(one))
            lines.append(f"{side}: {one.problem.metric.name} error {errors} with 1 to {len(one.models)} lobes")
    return lines


def _fewer(found: dict[Side, Found], lobes: int | Literal["auto"]) -> list[str]:
    return [
        f"{side}: {len(one.models)} lobe(s); another one explains nothing more"
        for side, one in found.items()
        if lobes != "auto" and 0 < len(one.models) < lobes
    ]
