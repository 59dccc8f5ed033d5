"""A one-page HTML report of a fit: measurement, material, errors, plots and previews."""

from __future__ import annotations

import io
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.extras import needing_extras
from lambent.core.inputs import sha256_of
from lambent.core.pictures.images import to_bytes
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.account import PEAK_SHARE, evaluate, peak_share
from lambent.materials.fitting.result import FitResult
from lambent.materials.fitting.shown import plot
from lambent.materials.fitting.shown.incidence import Incidence, incidences
from lambent.materials.fitting.shown.slices import slices
from lambent.materials.measured.inspecting.metrics import METRICS, Metric
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable, negative_readings
from lambent.report import page
from lambent.scenes.scene import Environment

DPI, DENSITY = 150, 1.5  # plots are finer than their size on the page, for print and high-density displays
STORED = {
    "f": "f, the BSDF without a cosine, 1/sr",
    "f_cos": "f |cos theta_o|, 1/sr",
    "p": "the transfer probability p = f |cos theta_o|, 1/sr",
}
REASONS = {
    "shadowed": "marked as not measured, or hidden by the device",
    "not_finite": "not a number, infinite, or absurdly large or negative",
    "grazing": "theta_i or theta_o beyond 84°, where devices see their own errors",
}
MEANINGS = (
    ("k", "coefficient", "1, linear RGB"),
    ("mx", "roughness along the brushing direction", "slope"),
    ("my", "roughness across it", "slope"),
    ("r0", "Fresnel reflectance at normal incidence", "1"),
    ("alpha", "exponent of the cosines: increase at grazing angles", "1"),
)
DISTRIBUTIONS = {"beckmann": "Beckmann", "ggx": "GGX", "curve": "curve"}
EYE_LIKE = ("cuberoot", "log")


def report(
    table: MeasuredTable,
    samples: MeasuredSamples,
    result: FitResult,
    *,
    source: Path | None = None,
    environment: Environment | None = None,
    progress: Progress = silent,
) -> str:
    """Report a fit as one self-contained HTML page.

    Parameters
    ----------
    table, samples, result
        A measurement, its samples, and the result of `fit` on them.
    source : Path, optional
        The measured file, for its hash.
    environment : Environment, optional
        Lighting of the previews; daylight by default.

    Raises
    ------
    UserError
        If the environment cannot be read. Without a working path tracer, the report omits the previews and states why.
    """
    material, metric = result.material, _metric(result.material)
    body = [
        page.heading(samples.info.file, 1),
        page.paragraph(_lead(result, metric), "lead"),
        *([page.note("Before trusting the numbers", result.warnings)] if result.warnings else []),
        *_previews(table, material, environment, progress),
        *_measurement(table, samples, source),
        *_parameters(material),
        *_errors(samples, result, metric),
        *_albedos(result),
        *_plots(samples, material, metric, progress),
        page.footer(_colophon(result)),
    ]
    return page.page(f"{samples.info.file}: fit", body)


def _metric(material: Material) -> Metric:
    chosen = material.provenance.metric if material.provenance is not None else None
    return METRICS[chosen] if chosen in METRICS else METRICS["cuberoot"]


def _lead(result: FitResult, metric: Metric) -> str:
    material = result.material
    sides = (
        ("reflection", material.reflection_lobes, material.kd),
        ("transmission", material.transmission_lobes, material.kt_d),
    )
    parts = [_counted(lobes, side) for side, lobes, _ in sides if lobes]
    parts += [f"diffuse {side}" for side, _, rgb in sides if any(rgb)]
    found = " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts) or "no scattering"
    share = f"{_share(result, metric.name):.2f} of the best Lambertian surface's"
    return f"Fitted with {found}. Its error under the {metric.name} metric is {share}."


def _share(result: FitResult, metric: str) -> float:
    """Error relative to the best Lambertian fit's."""
    return result.errors[metric] / max(result.lambertian_errors[metric], 1e-300)


def _counted(lobes: tuple[Lobe, ...], side: str) -> str:
    kinds = {lobe.distribution for lobe in lobes}
    kind = f"{DISTRIBUTIONS[kinds.pop()]} " if len(kinds) == 1 else ""
    return f"one {kind}lobe of {side}" if len(lobes) == 1 else f"{len(lobes)} {kind}lobes of {side}"


def _previews(
    table: MeasuredTable, material: Material, environment: Environment | None, progress: Progress
) -> list[str]:
    """The two preview balls and their difference, or the reason why they are missing."""
    try:
        with needing_extras():
            from lambent.baking.engine import engine

            engine()
    except UserError as error:
        return [page.note("No previews", [f"The measurement and the model are not shown on a ball: {error}"])]
    from lambent.baking.reference.material_preview import DAYLIGHT, preview

    seen = preview(table, material, environment or DAYLIGHT, progress=progress)
    file = getattr(environment, "file", None)
    name = "another sky" if file is None else Path(file).name
    where = "under a clear sky" if environment is None else f"in {name}"
    lamp = ", a lamp behind its front half" if seen.lamp else ""
    brushed = ", brushed along its circles of latitude" if not table.info.isotropic else ""
    figures = seen.figures
    words = (
        f"Over the ball: PSNR {figures['psnr_db']:.1f} dB, FLIP {figures['flip_mean']:.3f} on average and "
        f"{figures['flip_worst_tile']:.3f} in the worst tile of 16 x 16 pixels (0: no difference a viewer sees, 1: the "
        f"largest)."
    )
    flip = f"FLIP difference in false colour; mean {figures['flip_mean']:.3f}."
    balls = [
        page.picture(_cut_out(picture, seen.ball), description, caption)
        for picture, description, caption in (
            (seen.measured, "A ball that wears the measured table.", "Measured"),
            (seen.model, "The same ball with the fitted material.", "Model"),
            (seen.difference, flip, "Difference: FLIP, black none, yellow-white the largest"),
        )
    ]
    about = (
        f"A ball {where}{lamp}{brushed}; path traced, {seen.spp} samples per pixel, the same in both, not denoised, "
        "one exposure."
    )
    return [page.row(balls), page.paragraph(words), page.paragraph(about, "soft")]


def _cut_out(picture: Floats, ball: Flags) -> bytes:
    """PNG of an encoded image, transparent outside the ball."""
    from PIL import Image

    rgba = np.concatenate([to_bytes(picture), np.where(ball, 255, 0).astype(np.uint8)[..., None]], axis=-1)
    stream = io.BytesIO()
    Image.fromarray(rgba).save(stream, format="PNG", optimize=True)
    return stream.getvalue()


def _measurement(table: MeasuredTable, samples: MeasuredSamples, source: Path | None) -> list[str]:
    info, left_out = samples.info, samples.left_out
    total = len(samples) + left_out.total
    rows = [
        ("Specimen", getattr(table, "name", None) or Path(info.file).stem),
        ("File", info.file),
        ("Format", info.format),
        ("Holds", STORED[info.stored]),
        ("Channels", "3, linear RGB (Rec.709)" if info.channels == 3 else "1, grey"),
        ("Symmetry", "isotropic" if info.isotropic else "anisotropic"),
        ("Sides", "reflection and transmission" if info.transmits else "reflection"),
        ("Dimensions", ", ".join(f"{name} {size}" for name, size in info.sizes.items()) or "not gridded"),
        ("Measurements used", f"{len(samples):,} of {total:,} ({100 * len(samples) / total:.1f} %)"),
    ]
    if source is not None:
        rows.append(("SHA-256", sha256_of(source)))
    body = [page.heading("The measurement"), page.facts(rows)]
    gone = [
        (reason.replace("_", " "), f"{count:,}", f"{100 * count / total:.2f} %", REASONS[reason])
        for reason in REASONS
        if (count := getattr(left_out, reason))
    ]
    if gone:
        head = ("Left out", "tuples", "share", "why")
        body.append(
            page.table(head, gone, numbers=(1, 2), caption="Each tuple is counted once, under the first reason.")
        )
    else:
        body.append(page.paragraph("Nothing was left out."))
    if negative := negative_readings(samples):
        body.append(page.paragraph(f"{negative}. The fit keeps them; pictures use 0."))
    return [*body, page.bullets(info.notes)] if info.notes else body


def _parameters(material: Material) -> list[str]:
    body = [page.heading("The material")]
    diffuse = [("kd", "diffuse reflection", _rgb(material.kd), "1, linear RGB")]
    if material.transmits:
        diffuse.append(("kt_d", "diffuse transmission", _rgb(material.kt_d), "1, linear RGB"))
    body.append(page.table(("parameter", "meaning", "value", "unit"), diffuse))
    if material.lobes:
        names = [f"lobe {number}" for number in range(1, len(material.lobes) + 1)]
        rows = [
            ("side", "", *(lobe.side for lobe in material.lobes), ""),
            ("distribution", "", *(DISTRIBUTIONS[lobe.distribution] for lobe in material.lobes), ""),
        ]
        for name, meaning, unit in MEANINGS:
            values = [getattr(lobe, name) for lobe in material.lobes]
            rows.append((name, meaning, *(_rgb(v) if isinstance(v, tuple) else f"{v:.4f}" for v in values), unit))
        body.append(page.table(("parameter", "meaning", *names, "unit"), rows))
        body.append(page.paragraph(_extents(material), "soft"))
    return body


def _extents(material: Material) -> str:
    tilts = [np.degrees(np.arctan([lobe.mx, lobe.my])) for lobe in material.lobes]
    widths = [f"lobe {number}: {x:.1f}° x {y:.1f}°" for number, (x, y) in enumerate(tilts, 1)]
    return f"A slope m is a facet tilted by atan m, along and across the brushing direction: {'; '.join(widths)}."


def _rgb(values: tuple[float, float, float]) -> str:
    words = [f"{value:.4f}" for value in values]
    return words[0] if len(set(words)) == 1 else " ".join(words)


def _errors(samples: MeasuredSamples, result: FitResult, metric: Metric) -> list[str]:
    rows = []
    for name, error in result.errors.items():
        lambertian = result.lambertian_errors[name]
        ratio = f"{error / lambertian:.3f}" if lambertian > 0 else "n/a"
        rows.append((name, f"{error:.4g}", f"{lambertian:.4g}", ratio, METRICS[name].unit, METRICS[name].source))
    head = ("metric", "this fit", "best Lambertian", "ratio", "unit", "source")
    caption = f"The search minimised {metric.name}; every metric has a Lambertian surface of its own to compare with."
    chosen = list(result.errors).index(metric.name)
    table = page.table(head, rows, numbers=(1, 2, 3), chosen=chosen, caption=caption)
    return [page.heading("Errors"), table, *map(page.paragraph, _judgement(samples, result, metric))]


def _albedos(result: FitResult) -> list[str]:
    """Albedo of the fit and of the whole table."""
    if not result.albedos:
        return []
    rows = []
    for one in result.albedos:
        for theta in np.unique(one.theta_deg):
            table, fit = (float(albedo[one.theta_deg == theta].mean()) for albedo in (one.table, one.fit))
            ratio = f"{fit / table:.2f}" if table > 0 else "n/a"
            rows.append((one.side, f"{theta:g}°", f"{table:.3f}", f"{fit:.3f}", ratio))
    head = ("side", "angle of incidence", "table", "this fit", "ratio")
    caption = "Of the whole table with its gaps filled, as far as it was measured; means over channels and phi_i."
    body = [page.heading("Albedo"), page.table(head, rows, numbers=(1, 2, 3, 4), caption=caption)]
    return [*body, *(page.paragraph(f"{str(one).capitalize()}.") for one in result.albedos)]


def _judgement(samples: MeasuredSamples, result: FitResult, metric: Metric) -> list[str]:
    """Known weaknesses of this kind of fit, and their size here."""
    peak = peak_share(samples, evaluate(result.material, samples))
    reached = f"model reaches {peak:.2f} of the measured peak (the brightest {PEAK_SHARE:.1%} of the tuples)."
    undershoots = "Fits under the cube root weigh errors as eyes do and undershoot peaks: here"
    lines = [f"{undershoots} the {reached}" if metric.name == "cuberoot" else f"The {reached}"]
    if metric.name not in EYE_LIKE:
        shares = " and ".join(f"{_share(result, name):.2f} under {name}" for name in EYE_LIKE)
        lines.append(
            f"A fit that minimises {metric.name} follows the peaks and is often poor by perceptual metrics: "
            f"here it keeps {shares} of the Lambertian surface's error."
        )
    compare = (
        "Compare errors, not parameters, between fits: r0, alpha and the coefficient can compensate for one another."
    )
    return [*lines, compare]


def _plots(samples: MeasuredSamples, material: Material, metric: Metric, progress: Progress) -> list[str]:
    gathered = incidences(samples)
    if gathered:
        body = [page.heading("By direction"), *_direction_plots(samples, material, gathered)]
    else:
        body = [page.paragraph("No incident direction holds enough tuples for plots by direction.")]
    if material.lobes:
        words = (
            "The error around the fit, over two parameters of a lobe. A round pit: the measurement determines both. "
            "A valley: it determines a combination of them, and all points along the valley look much the same."
        )
        body += [page.heading("How well the parameters are determined"), page.paragraph(words)]
    for index, lobe in enumerate(material.lobes):
        drawn = slices(samples, material, index, metric, progress=progress)
        name = f"lobe {index + 1}, {lobe.side}"
        planes = " and ".join(f"{one.across} and {one.down}" for one in drawn)
        body.append(_figure(plot.error_slices(drawn, metric, name), f"Contours of the error of {name} over {planes}."))
    return body


def _direction_plots(samples: MeasuredSamples, material: Material, gathered: list[Incidence]) -> list[str]:
    return [
        _figure(
            plot.polar_matrix(gathered, material, samples.info.transmits),
            "Hemispheres of scattered light for each incident direction, measured and model.",
            "Each disk is the hemisphere seen from above: the normal in the middle, the horizon at the rim, the source "
            "at the top.",
        ),
        _figure(
            plot.in_plane(gathered, material),
            "Curves of the transfer probability in the plane of incidence, measured and model.",
            "Light scattered in the plane of incidence. Negative angles are on the source's side.",
        ),
        _figure(
            plot.albedo(gathered, material),
            "Albedo over the angle of incidence, measured and model.",
            "Returned light as a share of the incident light. Above 1 a material would return more than it receives.",
        ),
    ]


def _figure(figure: Any, description: str, caption: str = "") -> str:
    stream = io.BytesIO()
    figure.savefig(stream, dpi=DPI, format="png")
    return page.picture(stream.getvalue(), description, caption, density=DENSITY, paper=True)


def _colophon(result: FitResult) -> str:
    provenance = result.material.provenance
    how = provenance.method if provenance is not None else None
    parts = [f"Lambent {version('lambent')}", *([how] if how else []), f"fitted in {result.seconds:.1f} s"]
    return ", ".join([*parts, *(["cancelled before its end"] if result.partial else [])]) + "."
