"""`fit`: accuracy and speed of fits to measured tables.

Without inputs it fits tables synthesised from the thesis's fitted materials (tables 3.1 and 3.2), whose parameters are
known, and retro-reflective tapes, with and without a retro lobe. With inputs it fits the given measured files; each fit
is judged by the metric it minimised, relative to the best Lambertian fit's error. Published parameters
(`--against FILE.fit`) are judged on the same tuples. Files with readings below zero are generated too, and their fits
compared with those of the clean files. Least squares and the thesis's grid search fit one lobe alternately, five times;
the other rows are least squares alone.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lambent.bench.scenes.below_zero import DARK, spoilt_tables
from lambent.bench.scenes.known_answers import KNOWN, setup_of
from lambent.bench.scenes.retro_tapes import TAPES, Tape
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.core.progress import Cancelled, Progress, silent
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.materials.fitting import gradient
from lambent.materials.fitting.account import lambertian_errors
from lambent.materials.fitting.fit import Search, fit
from lambent.materials.fitting.result import FitResult
from lambent.materials.measured.inspecting.metrics import errors_of
from lambent.materials.measured.inspecting.synthetic import synthesise
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable
from lambent.materials.measured.registry import load
from lambent.published import grid_search
from lambent.published.merl_fits import Published, read_fits

NAME = "fit"
METHODS: dict[str, Search] = {"grid": grid_search.fit_lobes, "gradient": gradient.fit_lobes}
ALBEDO_THETA_DEG = 30.0
KNOWN_METRIC = "l1"  # the thesis's
RETRO_METHODS = ("gradient, no retro lobe", "gradient, retro lobe")
METRICS = ("cuberoot", "log", "l2_ngan")
MODELS = (("beckmann", 1), ("beckmann", 2), ("beckmann", 3), ("ggx", 1), ("ggx", 2))


@dataclass(frozen=True)
class Effort:
    """Numbers of fitted tuples of a measured and of a synthesised table (None: all), and of repetitions.

    `methods` fit the synthesised tables of `known`; all methods fit measured tables, `runs` times if timed.
    """

    tuples: int | None = None
    known_tuples: int | None = None
    methods: tuple[str, ...] = tuple(METHODS)
    runs: int = 5
    known: tuple[Material, ...] = tuple(KNOWN.values())
    below_zero: bool = True  # whether to fit tables with readings below zero
    tapes: tuple[Tape, ...] = TAPES


FULL, QUICK = Effort(), Effort(6_000, 60_000, ("gradient",), 1)


@dataclass(frozen=True)
class Case:
    """One table and, if known, the material it was made from."""

    name: str
    table: MeasuredTable
    samples: MeasuredSamples
    truth: Material | None = None


def run(
    effort: Effort, inputs: Sequence[Path] = (), against: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Rows per file, metric, model, number of lobes and method."""
    published = {path.stem: read_fits(path) for path in against}
    if published and not inputs:
        raise UserError("published fits are compared with a measurement", field="--against", hint="add --input")
    rows: list[dict[str, Any]] = []
    sources: Sequence[Path | Material] = inputs or effort.known
    for done, source in enumerate(sources):
        case = _case(source, effort)
        progress(done, len(sources), case.name)
        rows += _known_rows(case, effort) if case.truth is not None else _measured_rows(case, effort)
        rows += _published_rows(case, published)
    if not inputs:
        rows += [row for tape in effort.tapes for row in _tape_rows(tape, effort)]
        if effort.below_zero:
            progress(len(sources), len(sources), "readings below zero")
            rows += _below_zero_rows(effort)
    progress(len(sources), len(sources), "done")
    return {"rows": rows, "summary": _summary(rows)}


def _case(source: Path | Material, effort: Effort) -> Case:
    if isinstance(source, Material):
        known = synthesise(source, setup_of(source))
        return Case(source.name, known, known.samples(effort.known_tuples), source)
    table = load(source)
    return Case(source.name, table, table.samples(effort.tuples))


def _known_rows(case: Case, effort: Effort) -> Iterator[dict[str, Any]]:
    assert case.truth is not None
    truth = errors_of(case.samples, MaterialBSDF(case.truth).eval(case.samples.wi, case.samples.wo))
    for method in effort.methods:
        result = _fitted(case, method, KNOWN_METRIC, "beckmann", len(case.truth.reflection_lobes))
        compared = {"parameters": _compared(result.material, case.truth)}
        yield _row(case, method, [result]) | {"error_of_truth": truth[KNOWN_METRIC]} | compared


def _tape_rows(tape: Tape, effort: Effort) -> Iterator[dict[str, Any]]:
    """A retro-reflector fitted without a retro lobe, then with one."""
    table = tape.measured()
    case = Case(tape.name, table, table.samples(effort.known_tuples))
    for retro, method in enumerate(RETRO_METHODS):
        yield _row(case, method, [fit(case.samples, metric=METRICS[0], retro=bool(retro))])


def _measured_rows(case: Case, effort: Effort) -> Iterator[dict[str, Any]]:
    for metric in METRICS:
        turns = range(effort.runs if metric == METRICS[0] else 1)
        results = [{method: _fitted(case, method, metric, *MODELS[0]) for method in METHODS} for _ in turns]
        for method in METHODS:
            yield _row(case, method, [turn[method] for turn in results])
        for model in MODELS[1:]:
            yield _row(case, "gradient", [_fitted(case, "gradient", metric, *model)])


def _below_zero_rows(effort: Effort) -> Iterator[dict[str, Any]]:
    """Changes of the albedo at 30 degrees due to readings below zero: bright channels (relative), and dark one."""
    wi = direction(np.radians(ALBEDO_THETA_DEG), 0.0)
    for spoilt in spoilt_tables():
        for metric in (KNOWN_METRIC, *METRICS):
            found = {}
            for what, table in {"clean": spoilt.clean, **spoilt.changed}.items():
                case = Case(f"{spoilt.name}, {what}", table, table.samples(effort.tuples))
                result = _fitted(case, "gradient", metric, *MODELS[0])
                found[what] = MaterialBSDF(result.material).albedo(wi)
                change = found[what] / found["clean"] - 1
                yield _row(case, "gradient", [result]) | {
                    "below_zero": case.samples.below_zero,
                    "albedo_change": float(np.abs(np.delete(change, DARK)).max()),
                    "dark_albedo_change": float(found[what][DARK] - found["clean"][DARK]),
                }


def _fitted(case: Case, method: str, metric: str, distribution: Any, lobes: int) -> FitResult:
    result = fit(case.samples, lobes=lobes, search=METHODS[method], metric=metric, distribution=distribution)
    if result.partial:
        raise Cancelled
    return result


def _row(case: Case, method: str, results: Sequence[FitResult]) -> dict[str, Any]:
    """The last of several fits that differ only in time."""
    result, seconds = results[-1], [result.seconds for result in results]
    wi = direction(np.radians(ALBEDO_THETA_DEG), 0.0)
    provenance = result.material.provenance
    assert provenance is not None and provenance.metric is not None
    lobes = result.material.reflection_lobes or result.material.lobes
    return {
        "file": case.name,
        "tuples": len(case.samples),
        "method": method,
        "distribution": lobes[0].distribution if lobes else "none",
        "lobes": len(lobes),
        "metric": provenance.metric,
        "seconds": statistics.median(seconds),
        "seconds_min": min(seconds),
        "seconds_max": max(seconds),
        "share": result.errors[provenance.metric] / result.lambertian_errors[provenance.metric],
        "error": result.errors,
        "error_lambertian": result.lambertian_errors,
        "albedo_measured": float(case.table.albedo(wi).mean()),
        "albedo_model": float(MaterialBSDF(result.material).albedo(wi).mean()),
    }


def _published_rows(case: Case, published: dict[str, dict[str, Published]]) -> Iterator[dict[str, Any]]:
    """Published parameters of the material that the file is named after, under every metric."""
    stem = Path(case.name).stem
    found = {source: fits[stem] for source, fits in published.items() if stem in fits}
    if not found:
        return
    lambertian = lambertian_errors(case.samples)
    for source, model in found.items():
        errors = errors_of(case.samples, model.eval(case.samples.wi, case.samples.wo))
        for metric in METRICS:
            yield {
                "file": case.name,
                "tuples": len(case.samples),
                "method": f"published: {source}",
                "distribution": model.model,
                "lobes": 1,
                "metric": metric,
                "share": errors[metric] / lambertian[metric],
                "error": errors,
                "error_lambertian": lambertian,
            }


def _compared(found: Material, truth: Material) -> list[dict[str, Any]]:
    one, other = _parameters(found), _parameters(truth)
    return [{"parameter": name, "true": true, "found": one.get(name)} for name, true in other.items()]


def _parameters(material: Material) -> dict[str, float]:
    """The recoverable parameters by name; for a transmission lobe only the product kt (1 - r0)."""
    values = {"kd": material.kd[0]}
    for number, lobe in enumerate(material.reflection_lobes, 1):
        shape = {"ks": lobe.k[0], "mx": lobe.mx, "my": lobe.my, "r0": lobe.r0[0], "alpha": lobe.alpha}
        values |= {name if number == 1 else f"{name}_{number}": value for name, value in shape.items()}
    for lobe in material.transmission_lobes:
        through = lobe.k[0] * (1 - lobe.r0[0])
        values |= {"kt (1 - r0)": through, "t_mx": lobe.mx, "t_my": lobe.my, "t_alpha": lobe.alpha}
    return values


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Largest deviation from a known parameter, geometric mean of the shares per model, comparison of both methods."""
    known = [row for row in rows if "parameters" in row and row["method"] == "gradient"]
    spoilt = [row for row in rows if "below_zero" in row]
    measured = [row for row in rows if "parameters" not in row and "below_zero" not in row]
    summary: dict[str, Any] = {}
    if spoilt:
        summary["below_zero_albedo_change"] = max(row["albedo_change"] for row in spoilt)
    if known:
        parameters = [p for row in known for p in row["parameters"]]
        summary["largest_deviation"] = max(abs((p["found"] or 0.0) / p["true"] - 1) for p in parameters)
        summary["l1_over_truth"] = max(row["error"]["l1"] / row["error_of_truth"] for row in known)
    without, with_it = ([row["share"] for row in rows if row["method"] == method] for method in RETRO_METHODS)
    if without:
        summary["retro_over_no_retro_max"] = max(a / b for a, b in zip(with_it, without, strict=True))
    for metric in METRICS:
        for distribution, lobes in MODELS:
            of_model = {"method": "gradient", "metric": metric, "distribution": distribution, "lobes": lobes}
            shares = [row["share"] for row in measured if row.items() >= of_model.items()]
            if shares:
                summary[f"share_{metric}_{distribution}_{lobes}"] = statistics.geometric_mean(shares)
    pairs = _beside_ours(measured, "grid")
    if pairs:
        summary["gradient_over_grid_error_max"] = max(ours["share"] / grid["share"] for grid, ours in pairs)
        summary["grid_over_gradient_seconds_min"] = min(grid["seconds"] / ours["seconds"] for grid, ours in pairs)
    ratios = [ours["share"] / theirs["share"] for theirs, ours in _beside_ours(measured, "published")]
    if ratios:
        summary["published_compared"], summary["published_beaten"] = len(ratios), sum(ratio < 1 for ratio in ratios)
        summary["ours_over_published_max"] = max(ratios)
        summary["ours_over_published"] = statistics.geometric_mean(ratios)
    return summary


def _beside_ours(rows: list[dict[str, Any]], method: str) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Rows of a method, each paired with the least squares row of the same file and metric, with one lobe."""
    keys = ("file", "metric", "method", "distribution", "lobes")
    ours = {tuple(row[key] for key in keys): row for row in reversed(rows)}  # a second lobe may have vanished
    both = ((row, ours.get((row["file"], row["metric"], "gradient", *MODELS[0]))) for row in rows)
    return [(row, one) for row, one in both if one is not None and row["method"].startswith(method)]
