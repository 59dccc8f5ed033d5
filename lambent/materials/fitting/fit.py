"""Fit the lobe model to a measured table: table in, material document with its errors and warnings out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.inputs import sha256_of
from lambent.core.plain import Triple, triple
from lambent.core.progress import Cancelled, Progress, silent
from lambent.materials.document import Distribution, Kind, Lobe, Material, Provenance, Side
from lambent.materials.fitting import account, gradient, parameters
from lambent.materials.fitting.account import Curve
from lambent.materials.fitting.choices import DISTRIBUTION, MAX_LOBES, DistributionChoice, Lobes
from lambent.materials.fitting.curves import DARK, CurveFit, fit_curve
from lambent.materials.fitting.gradient import Bounds
from lambent.materials.fitting.parameters import BOUNDS, RETRO_BOUNDS, SHAPE, Box, Fixed, Ranges, parameter
from lambent.materials.fitting.problem import Candidate, Found, Mixture, Problem, problem_of
from lambent.materials.fitting.result import FitResult, by_lobes, fewer
from lambent.materials.fitting.scale import diffuse_mode
from lambent.materials.measured.inspecting.inspection import towards_light
from lambent.materials.measured.inspecting.metrics import Metric, errors_of, metric_named
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable

Search = Callable[[Problem, Bounds, Floats, Progress, int], Iterator[Mixture]]
"""A search for the model with one lobe, two, ...; arguments as in `gradient.fit_lobes`."""
DISTRIBUTIONS: dict[str, tuple[Distribution, ...]] = {
    "beckmann": ("beckmann",),
    "ggx": ("ggx",),
    "best": ("beckmann", "ggx"),
}
CURVED = ("kd", "kt_d", "alpha", "t_alpha", "kr", "r_mx", "r_my", "r_r0", "r_alpha")  # names with a curve lobe
GAIN = 0.05  # share of E that another lobe must remove if the number of lobes is "auto"
RETRO_RATIO = 2.0  # median of f near the light over that beside it, above which a retro lobe is tried
RETRO_GAIN = 0.1  # share of E that a retro lobe must remove to be taken


@dataclass(frozen=True)
class Task:
    """The checked arguments of `fit`."""

    lobes: int
    gain: float  # share of E that another lobe must remove; 0 for a fixed number of lobes
    search: Search
    metric: Metric
    distributions: tuple[Distribution, ...]
    coupled: bool
    fix: Fixed
    ranges: Ranges
    seed: int
    kept: dict[Side, Curve]  # albedos that the model must match
    retro: bool | None = None
    bends_kd: bool = True


def fit(
    table: MeasuredSamples | MeasuredTable,
    *,
    lobes: Lobes = 1,
    metric: str = "cuberoot",
    distribution: DistributionChoice = DISTRIBUTION,
    coupled: bool = False,
    fix: Fixed | None = None,
    ranges: Ranges | None = None,
    retro: bool | None = None,
    gain: float = GAIN,
    whole: MeasuredTable | None = None,
    keep_albedo: bool = False,
    bends_kd: bool = True,
    search: Search = gradient.fit_lobes,
    seed: int = 0,
    source: Path | None = None,
    progress: Progress = silent,
) -> FitResult:
    """Fit a diffuse term and `lobes` lobes per side (3.6), and a retro-reflective lobe if the table shows one.

    Channels share mx, my, r0 and alpha; every coefficient is solved per channel.

    Parameters
    ----------
    table : MeasuredSamples or MeasuredTable
    lobes : int, "curve" or "auto"
        1 to 4 per side; "curve" is one lobe whose density and Fresnel reflectance are curves. "auto" adds lobes while
        each removes at least the share `gain` of the error, and takes a curve lobe instead if its error is smaller on
        tuples held out, which its many numbers have not seen.
    metric : str
        The metric to minimise, one of `METRICS`; the result has E under all of them.
    distribution : "beckmann", "ggx" or "best"
        Of the microfacets; "best" fits either and keeps the better one per side.
    coupled : bool
        Whether the diffuse reflection falls as Fresnel reflection rises (`Material.kd_coupled`).
    fix, ranges : mapping, optional
        Parameter name -> value, or -> (lo, hi); names as in `parameters.known_parameters`.
    retro : bool, optional
        Whether to fit a retro-reflective lobe as well. By default it is tried if tuples near the light are RETRO_RATIO
        times as bright as beside it, or if `fix` or `ranges` names one of its parameters; it is kept if it removes at
        least the share RETRO_GAIN of the error.
    gain : float
        Share of E in (0, 1), for "auto".
    whole : MeasuredTable, optional
        The table of the tuples, for its albedos; by default `table`, if that is a MeasuredTable.
    keep_albedo : bool
        Whether the albedo over theta_i must match the table's, per channel (`account.KEEP`).
    bends_kd : bool
        Whether the diffuse reflection of a curve lobe's material may get a curve; not if `coupled`.
    search : callable
        The method; by default least squares from several starts, all lobes and the diffuse term jointly.
    seed : int
        Seed for choosing tuples; the same seed gives the same material.
    source : Path, optional
        The measured file, whose hash goes into the provenance.
    progress : Progress
        May raise `Cancelled` or KeyboardInterrupt: the best so far is returned, flagged partial.

    Raises
    ------
    UserError
        Unknown metric, distribution or parameter; invalid value; number of lobes out of range; a transmission
        parameter for a table without transmission; `keep_albedo` without a table.
    """
    began = time.perf_counter()
    fix, ranges = fix or {}, ranges or {}
    count = lobes if isinstance(lobes, int) else MAX_LOBES if lobes == "auto" else 1
    whole = table if isinstance(table, MeasuredTable) else whole
    _check(count, gain, distribution)
    if keep_albedo and whole is None:
        raise UserError("needs a whole table", field="keep_albedo", got="tuples")
    parameters.check(fix, ranges, count)
    _check_curve(lobes, fix, ranges, keep_albedo)
    curves_too = lobes == "curve" or (lobes == "auto" and not keep_albedo and {*fix, *ranges} <= {*CURVED})
    share = gain if lobes == "auto" else 0.0
    kinds = DISTRIBUTIONS["best" if lobes == "curve" else distribution]
    samples = table if isinstance(table, MeasuredSamples) else table.samples()
    curves = account.curves_of(whole, samples) if whole is not None else {}
    kept = curves if keep_albedo else {}
    task = Task(count, share, search, metric_named(metric), kinds, coupled, fix, ranges, seed, kept, retro, bends_kd)
    far = [name for name in [*fix, *ranges] if name.startswith(("t_", "kt"))]
    if far and not samples.transmitted.any():
        raise UserError("the table does not transmit", file=samples.info.file, field=far[0])
    found: dict[Side, Found] = {}
    curved: dict[Side, CurveFit] = {}
    partial, tried = False, list[str]()
    try:
        for side in samples.sides:
            returns = side == "reflection" and _may_return(samples, task)
            parts = 1 + returns + curves_too
            _fit_side(samples, side, task, _part_of(progress, 0, parts), found)
            if returns:
                other: dict[Side, Found] = {}
                _fit_side(samples, side, task, _part_of(progress, 1, parts), other, retro=True)
                tried.append(_choose(found, other, task))
            if curves_too and _mirrors(found[side]) and any(found[side].models[0].lobes[-1].k > 0):
                one = _curve_of(found[side], side, task, _part_of(progress, parts - 1, parts))
                taken, said = _worth(one, found[side], lobes)
                tried.append(f"{side}: {said}")
                if taken:
                    curved[side] = one
    except (Cancelled, KeyboardInterrupt):
        partial = True
    material = Material(
        name=Path(samples.info.file).stem,
        kd=_diffuse_rgb("reflection", samples, task, found, curved),
        kt_d=_diffuse_rgb("transmission", samples, task, found, curved),
        kd_coupled=coupled,
        kd_curve=curved["reflection"].kd_curve if "reflection" in curved else None,
        lobes=tuple(lobe for side in found for lobe in _lobes_of(side, found[side], curved.get(side), task.fix)),
    )
    model = account.evaluate(material, samples)
    errors = errors_of(samples, model)
    fitted = {side: one for side, one in found.items() if one.models and side not in curved}
    compared = account.compare(curves, material)
    warnings = (
        *account.warnings_of(samples, material, model, fitted, task.metric.name),
        *(one.warning(keep_albedo) for one in compared if one.doubtful),
        *fewer(found, lobes),
    )
    if partial:
        warnings = ("cancelled: best result so far", *warnings)
    how = "gradient" if search is gradient.fit_lobes else "another search"
    provenance = Provenance(
        source=samples.info.file,
        source_sha256=sha256_of(source) if source is not None else None,
        source_format=samples.info.format,
        method=f"{how}, {lobes} lobe(s) per side, seed {seed}" + (", albedo kept" if keep_albedo else ""),
        metric=task.metric.name,
        errors=errors,
        samples=samples.counts,
        notes=(
            *samples.info.notes,
            *account.below_zero(samples, task.metric),
            *account.restrictions(task.fix, task.ranges),
            *by_lobes(found),
            *tried,
            *warnings,
        ),
    )
    material = material.model_copy(update={"provenance": provenance})
    lambertian = account.lambertian_errors(samples)
    seconds = time.perf_counter() - began
    return FitResult(material, errors, lambertian, seconds, warnings, partial, tuple(tried), compared)


def _check(lobes: int, gain: float, distribution: str) -> None:
    known("distribution", distribution, DISTRIBUTIONS, field="distribution")
    if not 0 < gain < 1:
        raise UserError("share out of range", field="gain", got=gain, expected="between 0 and 1")
    if not 1 <= lobes <= MAX_LOBES:
        raise UserError("number of lobes out of range", field="lobes", got=lobes, expected=f"1 to {MAX_LOBES}, or auto")


def _check_curve(lobes: Lobes, fix: Fixed, ranges: Ranges, keep_albedo: bool) -> None:
    """Raise `UserError` for restrictions that a curve lobe cannot keep."""
    if lobes != "curve":
        return
    if keep_albedo:
        raise UserError("constrains lobes with numbers", field="keep_albedo", got="a curve lobe", hint="leave it out")
    for name in {*fix, *ranges} - {*CURVED}:
        raise UserError("is no number of a curve lobe", field=name, expected=", ".join(CURVED))


def _mirrors(found: Found) -> bool:
    """Whether a lobe of a side's models is about the mirror direction, or straight on, where a curve can take over."""
    return any(not lobe.retro for model in found.models for lobe in model.lobes)


def _curve_of(found: Found, side: Side, task: Task, progress: Progress) -> CurveFit:
    """The side's curve lobe, from its models with one lobe and with all of them."""
    models = [model for model in found.models if any(not lobe.retro for lobe in model.lobes)]
    box = next(box for box in found.boxes if not box.retro)
    free = ("kd" if side == "reflection" else "kt_d") not in task.fix
    may_bend_kd = side == "reflection" and not task.coupled and task.bends_kd
    return fit_curve(
        found.problem, [models[0], *models[1:][-1:]], box, task.seed, progress,
        diffuse_free=free, may_bend_kd=may_bend_kd,
    )  # fmt: skip


def _worth(curve: CurveFit, found: Found, lobes: Lobes) -> tuple[bool, str]:
    """Whether the curve lobe replaces the lobes, and why in words."""
    ratio = curve.held_out / max(curve.lobes_held_out, 1e-300)
    taken = lobes == "curve" or ratio < 1
    said = f"a curve lobe has {ratio:.2f} times the error of {found.mirroring} lobe(s) on tuples held out"
    return taken, said + ("" if lobes == "curve" else " (taken)" if taken else " (not taken)")


def _may_return(samples: MeasuredSamples, task: Task) -> bool:
    """Whether to try a retro-reflective lobe."""
    if task.retro is not None:
        return task.retro
    asked = any(parameters.is_of_retro(name) for name in [*task.fix, *task.ranges])
    return asked or towards_light(samples) > RETRO_RATIO


def _choose(found: dict[Side, Found], other: dict[Side, Found], task: Task) -> str:
    """Put the model with a retro lobe into `found` if clearly better or requested; the choice in words."""
    without, with_it = found["reflection"].error, other["reflection"].error
    share = 1 - with_it / without if without > 0 else 0.0
    taken = task.retro is True or share >= RETRO_GAIN
    if taken:
        found["reflection"] = other["reflection"]
    verdict = "added" if taken else f"not added: less than {RETRO_GAIN:.0%}"
    return f"a retro-reflective lobe removes {share:.1%} of the {task.metric.name} error ({verdict})"


def _part_of(progress: Progress, part: int, parts: int) -> Progress:
    """Progress of one of several equal parts."""
    return lambda done, total, what: progress(part + done / total, parts, what)


def _fit_side(
    samples: MeasuredSamples,
    side: Side,
    task: Task,
    progress: Progress,
    found: dict[Side, Found],
    retro: bool = False,
) -> None:
    """Put the side's models into `found`, even if `progress` raises later; `retro` adds a retro lobe."""
    channels = samples.f.shape[1]
    kinds: list[tuple[Kind, int]] = [("retro", 0)] if retro else []
    kinds += [(side, i) for i in range(task.lobes)]
    boxes = tuple(
        parameters.box_of(kind, i, samples.info.isotropic, channels, task.fix, task.ranges) for kind, i in kinds
    )
    diffuse = _diffuse(samples, side, task.fix)
    problem = problem_of(samples, side, task.metric, task.distributions[0], task.coupled, retro)
    for number, distribution in enumerate(task.distributions):
        own = replace(problem, distribution=distribution)
        one = Found(account.keep(task.kept[side], own, task.coupled) if task.kept else own, boxes, [])
        if number == 0:
            found[side] = one

        def report(done: float, total: float, what: str, number: int = number) -> None:
            progress(done / total + number, len(task.distributions), f"{side}: {what}")

        bounds = Bounds(boxes, ("kd" if side == "reflection" else "kt_d") not in task.fix)
        error = np.inf
        for model in task.search(one.problem, bounds, diffuse, report, task.seed):
            reached = one.problem.remaining(model)
            if reached >= error * (1 - task.gain) ** task.metric.power:
                break
            one.models.append(model)
            error = reached
        one.models[:] = [_narrow_first(model, boxes) for model in one.models]
        if one.problem.remaining(one.models[-1]) < found[side].problem.remaining(found[side].models[-1]):
            found[side] = one


def _narrow_first(model: Mixture, boxes: Sequence[Box]) -> Mixture:
    """The model with its lobes sorted by roughness, retro first, if the user's restrictions are the same for all."""
    boxes = [box for box in boxes if not box.retro]
    alike = all(np.array_equal((box.lo, box.hi), (boxes[0].lo, boxes[0].hi)) for box in boxes)
    alike = alike and all(box.k_limits == boxes[0].k_limits for box in boxes)
    by_area = sorted(model.lobes, key=lambda lobe: (not lobe.retro, float(lobe.shape[0] * lobe.shape[1])))
    return replace(model, lobes=tuple(by_area)) if alike else model


def _diffuse(samples: MeasuredSamples, side: Side, fix: Fixed) -> Floats:
    """kd or kt_d (C,) from the mode of the side's values, or fixed by the user."""
    name = "kd" if side == "reflection" else "kt_d"
    channels = samples.f.shape[1]
    if name in fix:
        return np.array(parameters.per_channel(fix[name], channels))
    here = samples.on(side)
    weight = samples.weight[here] * np.abs(samples.wo[here, 2])
    return np.array([diffuse_mode(samples.f[here, c], weight) for c in range(channels)])


def _diffuse_rgb(
    side: Side, samples: MeasuredSamples, task: Task, found: dict[Side, Found], curved: dict[Side, CurveFit]
) -> Triple:
    """kd or kt_d of the fitted model, or of the histogram if the fit has none."""
    if side in curved:
        return _rgb(np.where(curved[side].diffuse < DARK, 0.0, curved[side].diffuse))
    if side in found and found[side].models:
        diffuse = found[side].models[-1].diffuse
        return _rgb(np.where(diffuse < DARK, 0.0, diffuse))
    return _rgb(_diffuse(samples, side, task.fix))


def _lobes_of(side: Side, found: Found, curve: CurveFit | None, fix: Fixed) -> Iterator[Lobe]:
    """The lobes of a side in the form of a document: those found, or a curve lobe for all but the retro lobe."""
    if not found.models:
        return
    lobes = found.models[-1].lobes
    if curve is not None:
        yield curve.lobe
        lobes = tuple(one for one in lobes if one.retro)
    yield from _lobes(side, lobes, found.problem.distribution, fix)


def _lobes(side: Side, candidates: Sequence[Candidate], distribution: Distribution, fix: Fixed) -> Iterator[Lobe]:
    """The lobes of a side in the form of a document, the retro-reflective one last."""
    mirroring = (one for one in candidates if not one.retro)
    yield from (_lobe(side, i, one, distribution, fix) for i, one in enumerate(mirroring))
    yield from (_lobe("retro", 0, one, distribution, fix) for one in candidates if one.retro)


def _lobe(kind: Kind, index: int, candidate: Candidate, distribution: Distribution, fix: Fixed) -> Lobe:
    """The lobe in the form of a document."""
    names = [parameter(kind, base, index) for base in SHAPE]
    mx, my, r0, alpha = (
        parameters.scalar(fix[name], base) if name in fix else float(value)
        for name, base, value in zip(names, SHAPE, candidate.shape, strict=True)
    )
    if kind == "transmission" and r0 < 2e-6:
        r0 = 0.0
    least, most = (RETRO_BOUNDS if kind == "retro" else BOUNDS)["alpha"]
    side: Side = "transmission" if kind == "transmission" else "reflection"
    return Lobe(
        side=side, retro=kind == "retro", distribution=distribution, k=_rgb(candidate.k), mx=mx, my=my,
        r0=(r0, r0, r0), alpha=min(max(alpha, least), most),
    )  # fmt: skip


def _rgb(values: Floats) -> Triple:
    return triple(np.broadcast_to(values, 3))
