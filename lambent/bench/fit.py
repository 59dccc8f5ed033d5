"""`fit`: how well and how fast measured tables become lobes.

Without inputs: tables synthesised from the thesis's fitted materials (tables 3.1 and 3.2), whose answers are known.
With inputs: the caller's measured files, each fit judged by the metric it was fitted under, as a share of the best
Lambertian surface's error; with published parameters (`--against FILE.fit`) theirs on the same tuples beside it.
Both methods fit one lobe in turn, five times; the other rows are least squares alone.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lambent.bench.known_answers import KNOWN, setup_of
from lambent.core.directions import direction
from lambent.core.errors import UserError
from lambent.core.progress import Cancelled, Progress
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.materials.fitting.account import lambertian_errors
from lambent.materials.fitting.fit import METHODS, FitResult, Method, fit
from lambent.materials.fitting.metrics import errors_of
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable
from lambent.materials.measured.registry import load
from lambent.materials.measured.synthetic import synthesise
from lambent.materials.models.published import Published, read_fits

NAME = "fit"
RUNS = 5
QUICK_TUPLES = 6_000
ALBEDO_THETA_DEG = 30.0
KNOWN_METRIC = "l1"  # the thesis's
METRICS = ("cuberoot", "log", "l2_ngan")
MODELS = (("beckmann", 1), ("beckmann", 2), ("beckmann", 3), ("ggx", 1), ("ggx", 2))


@dataclass(frozen=True)
class Case:
    """One table and the material it was made from, where that is known."""

    name: str
    table: MeasuredTable
    samples: MeasuredSamples
    truth: Material | None = None


def run(quick: bool, inputs: Sequence[Path], progress: Progress, against: Sequence[Path] = ()) -> dict[str, Any]:
    """Rows per file, metric, model, number of lobes and method."""
    published = {path.stem: read_fits(path) for path in against}
    if published and not inputs:
        raise UserError("published fits have to be held against a measurement", field="--against", hint="add --input")
    rows: list[dict[str, Any]] = []
    cases = [path for path in inputs] or list(KNOWN.values())
    for done, source in enumerate(cases):
        case = _case(source, quick)
        progress(done, len(cases), case.name)
        rows += _known_rows(case, quick) if case.truth is not None else _measured_rows(case, quick)
        rows += _published_rows(case, published)
    progress(len(cases), len(cases), "done")
    return {"rows": rows, "summary": _summary(rows)}


def _case(source: Path | Material, quick: bool) -> Case:
    if isinstance(source, Material):
        table: MeasuredTable = synthesise(source, setup_of(source))
        return Case(source.name, table, table.samples(10 * QUICK_TUPLES if quick else None), source)
    table = load(source)
    return Case(source.name, table, table.samples(QUICK_TUPLES if quick else None))


def _known_rows(case: Case, quick: bool) -> Iterator[dict[str, Any]]:
    assert case.truth is not None
    lobes = len(case.truth.reflection_lobes)
    for method in ("gradient",) if quick else METHODS:
        row = _row(case, method, *_timed(case, method, KNOWN_METRIC, "beckmann", lobes))
        truth = MaterialBSDF(case.truth).eval(case.samples.wi, case.samples.wo)
        row["error_of_truth"] = errors_of(case.samples, truth)[KNOWN_METRIC]
        row["parameters"] = _compared(row.pop("material"), case.truth)
        yield row


def _measured_rows(case: Case, quick: bool) -> Iterator[dict[str, Any]]:
    for metric in METRICS:
        seconds: dict[Method, list[float]] = {method: [] for method in METHODS}
        results: dict[Method, FitResult] = {}
        for _ in range(RUNS if metric == METRICS[0] and not quick else 1):
            for method in METHODS:
                results[method], (once,) = _timed(case, method, metric, "beckmann", 1)
                seconds[method].append(once)
        for method in METHODS:
            yield _without_material(_row(case, method, results[method], seconds[method]))
        for distribution, lobes in MODELS[1:]:
            yield _without_material(_row(case, "gradient", *_timed(case, "gradient", metric, distribution, lobes)))


def _timed(case: Case, method: Method, metric: str, distribution: Any, lobes: int) -> tuple[FitResult, list[float]]:
    result = fit(case.samples, lobes=lobes, method=method, metric=metric, distribution=distribution)
    if result.partial:
        raise Cancelled
    return result, [result.seconds]


def _row(case: Case, method: str, result: FitResult, seconds: list[float]) -> dict[str, Any]:
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
        "material": result.material,
    }


def _without_material(row: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in row.items() if key != "material"}


def _published_rows(case: Case, published: dict[str, dict[str, Published]]) -> Iterator[dict[str, Any]]:
    """The published parameters of the material that the file is named after, under every metric."""
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
    """What can be recovered, by name; of a transmission lobe only the product kt (1 - r0) can."""
    values = {"kd": material.kd[0]}
    for number, lobe in enumerate(material.reflection_lobes, 1):
        shape = {"ks": lobe.k[0], "mx": lobe.mx, "my": lobe.my, "r0": lobe.r0[0], "alpha": lobe.alpha}
        values |= {name if number == 1 else f"{name}_{number}": value for name, value in shape.items()}
    for lobe in material.transmission_lobes:
        through = lobe.k[0] * (1 - lobe.r0[0])
        values |= {"kt (1 - r0)": through, "t_mx": lobe.mx, "t_my": lobe.my, "t_alpha": lobe.alpha}
    return values


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Largest deviation from a known parameter, geometric mean of the shares per model, what beats what."""
    known = [row for row in rows if "parameters" in row and row["method"] == "gradient"]
    summary: dict[str, Any] = {}
    if known:
        pairs = [p for row in known for p in row["parameters"]]
        summary["largest_deviation"] = max(abs((p["found"] or 0.0) / p["true"] - 1) for p in pairs)
        summary["l1_over_truth"] = max(row["error"]["l1"] / row["error_of_truth"] for row in known)
    for metric in METRICS:
        for distribution, lobes in MODELS:
            shares = [row["share"] for row in _of(rows, "gradient", metric, distribution, lobes)]
            if shares:
                summary[f"share_{metric}_{distribution}_{lobes}"] = statistics.geometric_mean(shares)
    pairs = [
        (grid, gradient)
        for metric in METRICS
        for grid in _of(rows, "grid", metric, "beckmann", 1)
        for gradient in _of(rows, "gradient", metric, "beckmann", 1)
        if grid["file"] == gradient["file"]
    ]
    if pairs:
        summary["gradient_over_grid_error_max"] = max(b["share"] / a["share"] for a, b in pairs)
        summary["grid_over_gradient_seconds_min"] = min(a["seconds"] / b["seconds"] for a, b in pairs)
    return summary | _against_published(rows)


def _against_published(rows: list[dict[str, Any]]) -> dict[str, Any]:
    ratios = [
        ours["share"] / theirs["share"]
        for theirs in rows
        if theirs["method"].startswith("published")
        for ours in _of(rows, "gradient", theirs["metric"], "beckmann", 1)
        if ours["file"] == theirs["file"]
    ]
    if not ratios:
        return {}
    return {
        "published_compared": len(ratios),
        "published_beaten": sum(ratio < 1 for ratio in ratios),
        "ours_over_published_max": max(ratios),
        "ours_over_published": statistics.geometric_mean(ratios),
    }


def _of(rows: list[dict[str, Any]], method: str, metric: str, distribution: str, lobes: int) -> list[dict[str, Any]]:
    wanted = {"method": method, "metric": metric, "distribution": distribution, "lobes": lobes}
    return [row for row in rows if "parameters" not in row and all(row[key] == value for key, value in wanted.items())]
