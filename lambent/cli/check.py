"""`lambent check`: is a material, a model or a table physical, and does its sampler draw what its density says."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Json, progress_bar, show, table
from lambent.core.errors import UserError, did_you_mean

if TYPE_CHECKING:
    from lambent.materials.check import CheckReport, Furnace, SamplerCheck
    from lambent.materials.check_table import TableReport
    from lambent.materials.document import Material
    from lambent.materials.measured.protocol import MeasuredTable
    from lambent.materials.models.model import Model
    from lambent.materials.normalise import Normalisation


def command(
    subject: Annotated[str, typer.Argument(help="Material document, measured file, or the name of a model.")],
    values: Annotated[
        list[str] | None, typer.Option("--set", help="Parameter of a model: NAME=VALUE or NAME=R,G,B; repeatable.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same report.")] = 0,
    normalise: Annotated[
        bool, typer.Option("--normalise", help="Write a document's energy-safe version instead: alpha lowered, then k.")
    ] = False,
    output: Annotated[Path | None, typer.Option("-o", help="With --normalise: document to write (.json).")] = None,
    json: Json = False,
) -> None:
    """Check reciprocity, energy, and the sampler by chi-square and hemisphere integrals.

    Of a measured table the percentages are reported, and what no device explains fails.
    The exit code is 1 when the check fails.

    --normalise says what changed and by how much; where no direction returns more than arrives, nothing is written.

    Example: lambent check brushed.json

    Example: lambent check brushed.json --normalise -o brushed-safe.json

    Example: lambent check ward --set mx=0.05 --set my=0.3
    """
    from lambent.materials.check import check
    from lambent.materials.check_table import check_table
    from lambent.materials.document import Material
    from lambent.materials.models.model import Model

    report: CheckReport | TableReport
    if normalise or output is not None:
        _normalise(subject, values or [], normalise, output, seed, json)
        return
    found = _subject(subject, values or [])
    with progress_bar() as progress:
        if isinstance(found, Material | Model):
            report = check(found, seed=seed, progress=progress)
            text = describe(report)
        else:
            report = check_table(found, seed=seed, progress=progress)
            text = describe_table(report)
    show(report.to_json(), text, json)
    if not report.passed:
        raise typer.Exit(1)


def _normalise(subject: str, values: list[str], asked: bool, output: Path | None, seed: int, json: bool) -> None:
    """Write the energy-safe version of a material document, where it needs one."""
    from lambent.core.images import check_writable
    from lambent.materials.document import Material
    from lambent.materials.models.model import Model
    from lambent.materials.normalise import normalisation

    if not asked or output is None:
        lacks = "-o is" if output is None else "--normalise is"
        raise UserError("--normalise and -o go together", hint=f"{lacks} missing: --normalise -o OUT.json")
    check_writable(output, (".json",))
    found = _subject(subject, values)
    if not isinstance(found, Material):
        hint = None if isinstance(found, Model) else f"fit it first: lambent fit {subject} -o material.json"
        kind = "a model" if isinstance(found, Model) else "a table"
        got, file = (subject, None) if isinstance(found, Model) else (None, subject)
        raise UserError(f"only material documents can be normalised, not {kind}", file=file, got=got, hint=hint)
    with progress_bar() as progress:
        done = normalisation(found, seed, progress)
    if done.needed:
        done.after.save(output)
    facts = done.to_json() | {"written": output if done.needed else None}
    show(facts, describe_normalisation(done, output), json)


def _subject(name: str, values: list[str]) -> Material | MeasuredTable | Model:
    """The material or table of a file, or the model of that name; a file goes before a model."""
    from lambent.cli.convert import subject_of
    from lambent.materials.models import models

    if Path(name).exists():
        if values:
            raise UserError("only models take --set", file=name, got=values[0])
        return subject_of(Path(name))
    known = models()
    if name not in known:
        expected = f"a file, or a model: {', '.join(known)}"
        raise UserError("neither a file nor a model", got=name, expected=expected, hint=did_you_mean(name, known))
    return known[name](**dict(_value(text) for text in values))


def _value(text: str) -> tuple[str, object]:
    """("ks", [.1, .2, .3]) of "ks=.1,.2,.3"."""
    name, equals, numbers = text.partition("=")
    try:
        value = [float(number) for number in numbers.split(",")]
    except ValueError:
        value = []
    if not (name and equals and value):
        raise UserError("not a parameter", field="--set", got=text, expected="NAME=VALUE or NAME=R,G,B")
    return name.strip(), value if len(value) > 1 else value[0]


def describe(report: CheckReport) -> str:
    """What was measured, then what is wrong with it, then the verdict."""
    rows = [("reciprocity", f"largest relative change {report.reciprocity_error:.1e}")]
    rows += _energy_rows(report.furnace) + _sampler_rows(report.sampler)
    return _with_verdict(rows, report)


def describe_table(report: TableReport) -> str:
    """The same of a table."""
    rows = [
        ("reciprocity", f"swapping wi and wo changes {report.reciprocity_share:.1%} of the light"),
        ("in the path tracer", f"what it looks up deviates by {report.resampling_share:.1%} of the light"),
    ]
    rows += _energy_rows(report.furnace)
    rows += [
        (f"albedo at {one.theta_deg:g} deg", f"{one.from_table:.4f} by the table, {one.quadrature:.4f} by quadrature")
        for one in report.integrals
    ]
    return _with_verdict(rows + _sampler_rows(report.sampler), report)


def describe_normalisation(done: Normalisation, output: Path) -> str:
    """What changed, by how much under the metrics, and what was written."""
    from lambent.materials.fitting.metrics import METRICS

    where = "highest albedo {:.4f} at theta {:g} deg, phi {:g} deg"
    if not done.needed:
        return f"{where.format(*done.highest[0])}: nothing exceeds 1, nothing written"
    rows: list[tuple[str, ...]] = [("changed", "before", "after")]
    rows += [(name, _shown(was), _shown(now)) for name, (was, now) in done.changed.items()]
    rows.append(("highest albedo", *(f"{albedo:.4f} at theta {theta:g} deg" for albedo, theta, _ in done.highest)))
    errors: list[tuple[str, ...]] = [("error", "absolute", "unit", "of its size")]
    errors += [(name, f"{value:.3g}", METRICS[name].unit, f"{done.share[name]:.2%}")
               for name, value in done.errors.items()]  # fmt: skip
    return f"{table(rows)}\n\n{table(errors)}\n\n{output}: written"


def _shown(value: float | tuple[float, ...]) -> str:
    return " ".join(f"{number:.4g}" for number in (value if isinstance(value, tuple) else (value,)))


def _energy_rows(furnace: Furnace) -> list[tuple[str, ...]]:
    albedo, theta_deg, phi_deg = furnace.highest
    return [
        ("mean albedo", " ".join(f"{value:.4f}" for value in furnace.mean_albedo)),
        ("highest albedo", f"{albedo:.4f} at theta {theta_deg:g} deg, phi {phi_deg:g} deg"),
    ]


def _sampler_rows(sampler: tuple[SamplerCheck, ...]) -> list[tuple[str, ...]]:
    return [
        (f"sampler at {one.theta_deg:g} deg", f"chi-square p {one.p_value:.3f}, density integrates to "
         f"{one.pdf_integral:.4f}, albedo {one.albedo_sampled:.4f} (quadrature {one.albedo_quadrature:.4f})")
        for one in sampler
    ]  # fmt: skip


def _with_verdict(rows: list[tuple[str, ...]], report: CheckReport | TableReport) -> str:
    lines = [table(rows), *(f"warning: {text}" for text in report.warnings), *(f"FAILED: {t}" for t in report.failures)]
    return "\n".join([*lines, "passed" if report.passed else "not passed"])
