"""`lambent check`: whether a material, model or table is physical, and its sampler follows its density."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lambent.cli.console import Between, Force, Json, metric_errors, progress_bar, show, table, words
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.materials.checking.check import CheckReport
    from lambent.materials.checking.check_table import TableReport
    from lambent.materials.checking.normalise import Normalisation


def command(
    subject: Annotated[str, typer.Argument(help="Material document, measured file, or the name of a model.")],
    values: Annotated[
        list[str] | None, typer.Option("--set", help="Parameter of a model: NAME=VALUE or NAME=R,G,B. Repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same report.")] = 0,
    normalise: Annotated[
        bool, typer.Option("--normalise", help="Write an energy-conserving version of a document: lower alpha, then k.")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", help="With --normalise: material document to write (.json).")
    ] = None,
    reconstruction: Between = "auto",
    force: Force = False,
    json: Json = False,
) -> None:
    """Check reciprocity, energy, and the sampler by chi-square and hemisphere integrals.

    A measured table fails only for faults that no measuring device explains; other deviations are reported in per cent.
    The exit code is 1 when the check fails.

    --normalise prints what changed and by how much; it writes nothing where the material already conserves energy.

    Example: lambent check brushed.json

    Example: lambent check brushed.json --normalise -o brushed-safe.json

    Example: lambent check ward --set mx=0.05 --set my=0.3
    """
    from lambent.api.checking import check

    if normalise or output is not None:
        _normalise(subject, values or [], normalise, output, seed, force, json)
        return
    given = dict(_value(text) for text in values or [])
    report = check(subject, seed=seed, reconstruction=reconstruction, progress=True, **given)
    show(report.to_json(), describe(report), json)
    if not report.passed:
        raise typer.Exit(1)


def _normalise(
    subject: str, values: list[str], asked: bool, output: Path | None, seed: int, force: bool, json: bool
) -> None:
    """Write the energy-conserving version of a material document, if it needs one."""
    from lambent.api.materials import Material
    from lambent.api.reading import read
    from lambent.core.outputs import check_output
    from lambent.materials.checking.normalise import normalisation

    if not asked or output is None:
        lacking = "-o" if output is None else "--normalise"
        raise UserError("is missing", field=lacking, hint="use both: --normalise -o OUT.json")
    if values:
        raise UserError("only a model takes parameters", file=subject, field="--set", got=values[0])
    check_output(output, (".json",), force=force, inputs=[subject])
    found = read(subject)
    if not isinstance(found, Material):
        what, hint = found.facts()["is"], f"fit it first: lambent fit {subject} -o material.json"
        raise UserError(f"is a {what}; only a material document can be normalised", file=subject, hint=hint)
    with progress_bar() as progress:
        done = normalisation(found.document, seed, progress)
    if done.needed:
        done.after.save(output)
    facts = done.to_json() | {"written": output if done.needed else None}
    show(facts, describe_normalisation(done, output), json)


def _value(text: str) -> tuple[str, Any]:
    """Parse "ks=.1,.2,.3" to ("ks", [.1, .2, .3])."""
    name, equals, numbers = text.partition("=")
    try:
        value = [float(number) for number in numbers.split(",")]
    except ValueError:
        value = []
    if not (name and equals and value):
        raise UserError("cannot be read as a parameter", field="--set", got=text, expected="NAME=VALUE or NAME=R,G,B")
    return name.strip(), value if len(value) > 1 else value[0]


def describe(report: CheckReport | TableReport) -> str:
    """The figures, then the faults, then the verdict."""
    from lambent.materials.checking.check import CheckReport

    energy = report.furnace
    albedo, theta_deg, phi_deg = energy.highest
    if isinstance(report, CheckReport):
        rows, integrals = [("reciprocity", f"largest relative change {report.reciprocity_error:.1e}")], []
    else:
        rows = [
            ("reciprocity", f"swapping wi and wo changes {report.reciprocity_share:.1%} of the light"),
            (
                "in the path tracer",
                f"its look-up deviates from the table by {report.resampling_share:.1%} of the light",
            ),
        ]
        integrals = [
            (f"albedo at {i.theta_deg:g} deg", f"{i.from_table:.4f} from the table, {i.quadrature:.4f} by quadrature")
            for i in report.integrals
        ]
        if report.negative_readings:
            rows.append(("readings below zero", f"{report.negative_readings}; drawn as 0"))
    sampler = [
        (f"sampler at {one.theta_deg:g} deg", f"chi-square p {one.p_value:.3f}, density integrates to "
         f"{one.pdf_integral:.4f}, albedo {one.albedo_sampled:.4f} (quadrature {one.albedo_quadrature:.4f})")
        for one in report.sampler
    ]  # fmt: skip
    rows += [
        ("mean albedo", " ".join(f"{value:.4f}" for value in energy.mean_albedo)),
        ("highest albedo", f"{albedo:.4f} at theta {theta_deg:g} deg, phi {phi_deg:g} deg"),
        *integrals,
        *sampler,
    ]
    faults = [*(f"warning: {text}" for text in report.warnings), *(f"FAILED: {text}" for text in report.failures)]
    return "\n".join([table(rows), *faults, "passed" if report.passed else "failed"])


def describe_normalisation(done: Normalisation, output: Path) -> str:
    """The changes, their errors under every metric, and the written file."""
    if not done.needed:
        where = "highest albedo {:.4f} at theta {:g} deg, phi {:g} deg".format(*done.highest[0])
        return f"{where}: no albedo exceeds 1, nothing written"
    rows = [
        ("changed", "before", "after"),
        *((name, _numbers(was), _numbers(now)) for name, (was, now) in done.changed.items()),
        ("highest albedo", *(f"{albedo:.4f} at theta {theta:g} deg" for albedo, theta, _ in done.highest)),
    ]
    return f"{table(rows)}\n\n{metric_errors(done.errors, done.share)}\n\n{output}: written"


def _numbers(value: float | tuple[float, ...]) -> str:
    return " ".join(map(words, value if isinstance(value, tuple) else (value,)))
