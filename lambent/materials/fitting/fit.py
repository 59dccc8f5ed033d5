"""Fit the lobe model to a measured table: table in, material document and an honest account out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import sha256_of
from lambent.core.progress import Cancelled, Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material, Provenance
from lambent.materials.fitting import account
from lambent.materials.fitting.diffuse import diffuse_mode
from lambent.materials.fitting.gradient import polish
from lambent.materials.fitting.grid import Candidate
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
from lambent.materials.fitting.problem import problem_of
from lambent.materials.fitting.several import fit_lobes
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable

Floats = NDArray[np.floating]
Method = Literal["grid", "gradient"]
METHODS: tuple[Method, ...] = ("grid", "gradient")
MAX_LOBES = 4


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


def fit(
    table: MeasuredSamples | MeasuredTable,
    *,
    lobes: int = 1,
    method: Method = "grid",
    metric: str = "cuberoot",
    fix: Fixed | None = None,
    ranges: Ranges | None = None,
    seed: int = 0,
    source: Path | None = None,
    progress: Progress = silent,
) -> FitResult:
    """Fit a diffuse term and `lobes` lobes per side (3.6).

    kd (and kt_d on the far side of a table that transmits) are read off the histogram, never searched; the coefficient
    of a lobe is solved for each candidate; mx, my, r0 and alpha are searched and shared by the channels.

    Parameters
    ----------
    table : MeasuredSamples or MeasuredTable
    lobes : int
        1 to 4 per side.
    method : "grid" or "gradient"
        The thesis's hierarchical search, or the same followed by a joint least-squares polish of all lobes. A lobe
        that is alone is polished in either case.
    metric : str
        What is minimised, one of `METRICS`; the result names E under all of them.
    fix, ranges : mapping, optional
        Parameter name -> value, or -> (lo, hi); names as in `parameters.known_parameters`.
    seed : int
        Of the choice of tuples for the first levels; the same seed gives the same material.
    source : Path, optional
        The measured file, to be hashed into the provenance.
    progress : Progress
        May raise `Cancelled` or KeyboardInterrupt: the best so far is returned, flagged partial.

    Raises
    ------
    UserError
        Unknown method, metric or parameter; impossible value; number of lobes out of range; a parameter of transmission
        for a table without any.
    """
    began = time.perf_counter()
    fix, ranges = fix or {}, ranges or {}
    chosen = _check(lobes, method, metric, fix, ranges)
    samples = table if isinstance(table, MeasuredSamples) else table.samples()
    _check_sides(samples, fix, ranges)
    channels = samples.f.shape[1]
    kd, kt_d = (_diffuse(samples, side, fix) for side in ("reflection", "transmission"))
    background = np.where(samples.transmitted[:, None], kt_d / np.pi, kd / np.pi)
    found: dict[Side, list[Candidate]] = {}
    boxes: dict[Side, list[Box]] = {}
    partial = False
    try:
        for side in _sides(samples):
            found[side] = []
            boxes[side] = [box_of(side, i, samples.info.isotropic, channels, fix, ranges) for i in range(lobes)]
            problem = problem_of(samples, side, chosen, background)
            fit_lobes(problem, boxes[side], _named(progress, side), seed, found[side])
            if method == "gradient" or lobes == 1:
                found[side][:] = polish(problem, boxes[side], found[side], seed)
    except (Cancelled, KeyboardInterrupt):
        partial = True
    material = Material(
        name=Path(samples.info.file).stem,
        kd=_rgb(kd),
        kt_d=_rgb(kt_d),
        lobes=tuple(
            _lobe(side, i, candidate, fix) for side, several in found.items() for i, candidate in enumerate(several)
        ),
    )
    model = MaterialBSDF(material).eval(samples.wi, samples.wo)[:, :channels]
    errors = errors_of(samples, model)
    warnings = account.warnings_of(samples, material, model, found, boxes, chosen.name)
    if partial:
        warnings = ("cancelled: the best found so far", *warnings)
    provenance = Provenance(
        source=samples.info.file,
        source_sha256=sha256_of(source) if source is not None else None,
        source_format=samples.info.format,
        method=f"{method}, {lobes} lobe(s) per side, seed {seed}",
        metric=chosen.name,
        errors=errors,
        samples={"used": len(samples), **asdict(samples.left_out)},
        notes=(*samples.info.notes, *account.restrictions(fix, ranges), *warnings),
    )
    return FitResult(
        material.model_copy(update={"provenance": provenance}),
        errors,
        account.lambertian_errors(samples),
        time.perf_counter() - began,
        warnings,
        partial,
    )


def _check(lobes: int, method: str, metric: str, fix: Fixed, ranges: Ranges) -> Metric:
    if method not in METHODS:
        hint = did_you_mean(method, METHODS)
        raise UserError("unknown method", field="method", got=method, expected=", ".join(METHODS), hint=hint)
    if not 1 <= lobes <= MAX_LOBES:
        raise UserError("number of lobes out of range", field="lobes", got=lobes, expected=f"1 to {MAX_LOBES}")
    check(fix, ranges, lobes)
    return metric_named(metric)


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


def _named(progress: Progress, side: str) -> Progress:
    def report(done: float, total: float, what: str) -> None:
        progress(done, total, f"{side}: {what}")

    return report


def _lobe(side: Side, index: int, candidate: Candidate, fix: Fixed) -> Lobe:
    mx, my, r0, alpha = (
        scalar(fix[parameter(side, base, index)], base) if parameter(side, base, index) in fix else float(value)
        for base, value in zip(SHAPE, candidate.shape, strict=True)
    )
    if side == "transmission" and r0 < 2e-6:
        r0 = 0.0
    return Lobe(side=side, k=_rgb(candidate.k), mx=mx, my=my, r0=(r0, r0, r0), alpha=min(alpha, 1.0))


def _rgb(values: Floats) -> tuple[float, float, float]:
    red, green, blue = (float(v) for v in (values if len(values) == 3 else np.repeat(values, 3)))
    return red, green, blue
