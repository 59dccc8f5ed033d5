"""`lambent fit`: measured data to material."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from lambent.cli.console import Between, Force, Json, note, show, table, words
from lambent.core.errors import UserError
from lambent.materials.fitting.choices import DISTRIBUTION, DistributionChoice

if TYPE_CHECKING:
    from lambent.materials.document import Material
    from lambent.materials.fitting.result import FitResult
    from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable

UNITS = {"mx": "slope", "my": "slope", "r0": "reflectance at normal incidence", "alpha": "exponent"}


def command(
    file: Annotated[Path, typer.Argument(help="Measured table, in any format `lambent inspect` knows.")],
    lobes: Annotated[
        str,
        typer.Option(
            help="Lobes per side: 1 to 4; curve, one lobe shaped by curves; or auto, which adds lobes as long as each "
            "cuts the error by --gain, and takes a curve lobe where that is better."
        ),
    ] = "1",
    metric: Annotated[str, typer.Option(help="Error to minimise: l1, l2_ngan, cuberoot or log.")] = "cuberoot",
    distribution: Annotated[
        DistributionChoice, typer.Option(help="Microfacet distribution: ggx has long tails; best tries both.")
    ] = DISTRIBUTION,
    coupled: Annotated[
        bool, typer.Option("--coupled", help="Diffuse reflection falls as Fresnel reflection rises.")
    ] = False,
    keep_albedo: Annotated[
        bool, typer.Option("--keep-albedo", help="Constrain the albedo at every angle of incidence to the table's.")
    ] = False,
    retro: Annotated[
        bool | None,
        typer.Option("--retro/--no-retro", help="Fit a retro-reflective lobe; by default where the table shows one."),
    ] = None,
    gain: Annotated[float, typer.Option(help="Least share of the error that another lobe must remove (auto).")] = 0.05,
    fix: Annotated[list[str] | None, typer.Option(help="Fix a parameter: r0=.05 or kd=.1,.2,.3. Repeatable.")] = None,
    range_: Annotated[
        list[str] | None, typer.Option("--range", help="Bound a parameter to lo:hi, as in mx=.05:.3. Repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same material.")] = 0,
    output: Annotated[Path | None, typer.Option("-o", help="Write the material document (.json).")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Plot table and fit: X.png gives X_polar.png, X_in_plane.png and X_albedo.png.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a full report of the fit as one page (.html), with previews.")
    ] = None,
    environment: Annotated[
        Path | None,
        typer.Option(help="Lat-long image (.hdr, .exr) that lights the report's previews. [default: daylight]"),
    ] = None,
    reconstruction: Between = "auto",
    force: Force = False,
    json: Json = False,
) -> None:
    """Fit a diffuse term and lobes to a measured material.

    Example: lambent fit brushed.bsdf --lobes auto -o brushed.json --report brushed.html
    """
    from lambent.api.tables import Table
    from lambent.core.outputs import check_output
    from lambent.materials.fitting.account import below_zero
    from lambent.materials.fitting.parameters import parse_fix, parse_ranges
    from lambent.materials.fitting.shown.plot import plot_files
    from lambent.materials.measured.inspecting.metrics import METRICS

    inputs = [file, *([] if environment is None else [environment])]
    plotted = () if plot is None else (plot, *plot_files(plot.parent, plot.stem))
    for written, suffix in ((output, ".json"), *((one, ".png") for one in plotted), (report, ".html")):
        if written is not None:
            check_output(written, (suffix,), force=force or written == plot, inputs=inputs)
    if environment is not None:
        _check_environment(environment, report)
    count, fixed, ranges = _count(lobes), parse_fix(fix or ()), parse_ranges(range_ or ())
    table_of_file = Table.read(file, reconstruction)
    fit = table_of_file.fit(
        count, metric=metric, distribution=distribution, coupled=coupled, keep_albedo=keep_albedo, retro=retro,
        gain=gain, fix=fixed, ranges=ranges, seed=seed, progress=True,
    )  # fmt: skip
    result, samples = fit.result, table_of_file.samples
    if output is not None:
        fit.material.save(output)
    plots = fit.plots(plot.parent, plot.stem) if plot is not None else []
    if report is not None:
        fit.report(report, environment=environment, progress=True)
    for warning in (*samples.info.notes, *result.notes, *below_zero(samples, METRICS[metric]), *result.warnings):
        note(warning)
    figures = ("errors", "lambertian_errors", "seconds", "partial", "warnings")
    facts = {"material": result.material.model_dump(mode="json"), **{key: getattr(result, key) for key in figures}}
    facts |= {"albedos": [one.to_json() for one in result.albedos]}
    gone = left_out(table_of_file.table, samples)
    facts |= {"tuples": {"used": len(samples), "left_out": gone}}
    text = f"{describe(result)}\n\n{describe_tuples(len(samples), gone)}\n\n{result.seconds:.1f} s"
    show({**facts, "written": output, "plots": plots, "report": report}, text, json)
    if result.partial:
        raise typer.Exit(130)


def _check_environment(file: Path, report: Path | None) -> None:
    """Raise `UserError` for an unusable image before the fit."""
    from lambent.core.pictures.images import read_image

    if report is None:
        raise UserError("lights the previews of a report only", field="--environment", hint="add --report PAGE.html")
    read_image(file)


def _count(lobes: str) -> int | Literal["auto", "curve"]:
    if lobes in ("auto", "curve"):
        return "auto" if lobes == "auto" else "curve"
    if not lobes.isdecimal():
        expected = "1 to 4, curve or auto"
        raise UserError("cannot be read as a number of lobes", field="--lobes", got=lobes, expected=expected)
    return int(lobes)


def describe(result: FitResult) -> str:
    """Parameters with units, errors beside those of a Lambertian surface, and the albedo where it is furthest off."""
    from lambent.materials.measured.inspecting.metrics import METRICS

    rows = [("error", "fit", "Lambertian", "unit")]
    for name, value in result.errors.items():
        rows.append((name, words(value), words(result.lambertian_errors[name]), METRICS[name].unit))
    albedos = "".join(f"\n{one}" for one in result.albedos)
    return f"{parameters(result.material)}\n\n{table(rows)}{albedos}"


def left_out(measurement: MeasuredTable, samples: MeasuredSamples) -> dict[str, int]:
    """Numbers of tuples that the fit did not use, by the reason in words."""
    from lambent.materials.measured.lbnl_xml import LbnlTable
    from lambent.report.fit_report import REASONS

    counts = {why: getattr(samples.left_out, name) for name, why in REASONS.items()}
    if isinstance(measurement, LbnlTable):
        counts["light from -z, the other side of the sheet"] = measurement.tuples_from_behind
    return {why: count for why, count in counts.items() if count}


def describe_tuples(used: int, left_out: dict[str, int]) -> str:
    """Numbers of tuples used and left out."""
    gone = [(f"{count}", f"left out: {why}") for why, count in left_out.items()]
    return table([(f"{used}", "tuples fitted"), *(gone or [("0", "left out")])])


def parameters(material: Material) -> str:
    """The material's numbers, one line each, with their units."""
    rows = [("kd", _rgb(material.kd), "RGB"), ("kt_d", _rgb(material.kt_d), "RGB")]
    for number, lobe in enumerate(material.lobes, 1):
        rows.append((f"lobe {number}", lobe.kind, lobe.distribution))
        rows.append(("  k", _rgb(lobe.k), "RGB"))
        for name, unit in UNITS.items():
            value = getattr(lobe, name)
            rows.append((f"  {name}", _rgb(value) if isinstance(value, tuple) else f"{value:.4f}", unit))
    return table(rows)


def _rgb(values: tuple[float, ...]) -> str:
    return " ".join(f"{value:.4f}" for value in values)
