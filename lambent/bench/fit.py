"""`fit`: how well and how fast measured tables become lobes.

Without inputs: tables synthesised from the thesis's fitted materials (tables 3.1 and 3.2), whose answers are known.
With inputs: the caller's measured files, whose errors stand beside those of the best Lambertian surface.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.frames import direction
from lambent.core.progress import Cancelled, Progress
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.fit import METHODS, FitResult, Method, fit
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable
from lambent.materials.measured.registry import load
from lambent.materials.measured.synthetic import synthesise

NAME = "fit"
RUNS = 5
QUICK_TUPLES = 6_000
ALBEDO_THETA_DEG = 30.0
KNOWN_METRIC = "l1"  # the thesis's


def _grey(value: float) -> tuple[float, float, float]:
    return value, value, value


ALANOD = Material(
    name="alanod",
    kd=_grey(0.003),
    lobes=(Lobe(k=_grey(0.9), mx=0.11, my=0.072, r0=_grey(0.89), alpha=0.43),),
)
FOIL = Material(
    name="foil",
    kd=_grey(0.76),
    lobes=(
        Lobe(k=_grey(0.78), mx=0.124, my=0.136, r0=_grey(0.029), alpha=0.5),
        Lobe(side="transmission", k=_grey(0.67), mx=0.25, my=0.17, r0=_grey(0.75), alpha=0.6),
    ),
)


def run(quick: bool, inputs: Sequence[Path], progress: Progress) -> dict[str, Any]:
    """Rows per file, method and number of lobes; known-answer tables carry true and found parameters."""
    tables: list[tuple[str, MeasuredTable, Material | None]] = [(path.name, load(path), None) for path in inputs]
    if not inputs:
        tables = [(material.name, synthesise(material), material) for material in (ALANOD, FOIL)]
    rows = []
    cases = [(table, lobes) for table in tables for lobes in ((1,) if quick else (1, 2))]
    for done, ((name, table, truth), lobes) in enumerate(cases):
        progress(done, len(cases), f"{name}, {lobes} lobe(s)")
        samples = table.samples(QUICK_TUPLES if quick else None)
        for method, result, seconds in _alternated(samples, lobes, truth, 1 if quick else RUNS):
            rows.append(_row(name, method, lobes, table, result, seconds, truth))
    progress(len(cases), len(cases), "done")
    return {"rows": rows, "summary": _summary(rows)}


def _alternated(
    samples: MeasuredSamples, lobes: int, truth: Material | None, runs: int
) -> Iterator[tuple[Method, FitResult, list[float]]]:
    """Each method's result and its times, the methods taken in turn."""
    seconds: dict[Method, list[float]] = {method: [] for method in METHODS}
    results: dict[Method, FitResult] = {}
    metric = KNOWN_METRIC if truth is not None else "cuberoot"
    for _ in range(runs):
        for method in METHODS:
            results[method] = fit(samples, lobes=lobes, method=method, metric=metric)
            if results[method].partial:
                raise Cancelled
            seconds[method].append(results[method].seconds)
    for method in METHODS:
        yield method, results[method], seconds[method]


def _row(
    name: str,
    method: Method,
    lobes: int,
    table: MeasuredTable,
    result: FitResult,
    seconds: list[float],
    truth: Material | None,
) -> dict[str, Any]:
    wi = direction(np.radians(ALBEDO_THETA_DEG), 0.0)
    row: dict[str, Any] = {
        "file": name,
        "method": method,
        "lobes": lobes,
        "metric": result.material.provenance.metric if result.material.provenance else None,
        "seconds": statistics.median(seconds),
        "seconds_min": min(seconds),
        "seconds_max": max(seconds),
        "error": result.errors,
        "error_lambertian": result.lambertian_errors,
        "albedo_measured": float(table.albedo(wi).mean()),
        "albedo_model": float(MaterialBSDF(result.material).albedo(wi).mean()),
    }
    if truth is not None and lobes == 1:
        row["parameters"] = [
            {"parameter": parameter, "true": true, "found": _parameters(result.material)[parameter]}
            for parameter, true in _parameters(truth).items()
        ]
    return row


def _parameters(material: Material) -> dict[str, float]:
    """What can be recovered, by name; of a transmission lobe only the product kt (1 - r0) can."""
    values = {"kd": material.kd[0]}
    for lobe in material.reflection_lobes:
        values |= {"ks": lobe.k[0], "mx": lobe.mx, "my": lobe.my, "r0": lobe.r0[0], "alpha": lobe.alpha}
    for lobe in material.transmission_lobes:
        through = lobe.k[0] * (1 - lobe.r0[0])
        values |= {"kt (1 - r0)": through, "t_mx": lobe.mx, "t_my": lobe.my, "t_alpha": lobe.alpha}
    return values


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Largest deviation of a known parameter, and the mean share of the Lambertian's error per number of lobes."""
    deviations = [abs(p["found"] / p["true"] - 1) for row in rows for p in row.get("parameters", [])]
    shares = {
        f"cuberoot_share_{lobes}": statistics.fmean(
            row["error"]["cuberoot"] / row["error_lambertian"]["cuberoot"] for row in rows if row["lobes"] == lobes
        )
        for lobes in sorted({row["lobes"] for row in rows})
    }
    return shares | ({"largest_deviation": max(deviations)} if deviations else {})
