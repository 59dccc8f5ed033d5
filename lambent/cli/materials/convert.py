"""`lambent convert`: a measurement or material in another tool's format, with its losses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Between, Force, Json, metric_errors, progress_bar, show
from lambent.core.errors import UserError
from lambent.core.inputs import read_head

if TYPE_CHECKING:
    from lambent.materials.export.contract import Cost, Subject, Writer


def command(
    file: Annotated[Path, typer.Argument(help="Measured table in any format, or material document (.json).")],
    output: Annotated[Path, typer.Argument(help="File to write; its ending selects the format.")],
    as_: Annotated[str | None, typer.Option("--as", help="Format, where the ending fits several.")] = None,
    reconstruction: Between = "auto",
    force: Force = False,
    json: Json = False,
) -> None:
    """Write a measurement or material in another format; print what is lost and how large the errors are.

    Example: lambent convert chrome.binary chrome.bsdf --as rgl
    """
    from lambent.core.outputs import check_output
    from lambent.materials.export.contract import writer_for
    from lambent.materials.export.resampling.resampled import read_back
    from lambent.materials.measured.registry import is_known

    writer = writer_for(output, as_)
    check_output(output, force=force, inputs=[file])
    subject = subject_of(file, reconstruction)
    _check_kind(subject, writer, file)
    with progress_bar() as progress:
        cost = writer.write(subject, output, progress)
        if not cost.errors and is_known(output):
            cost = read_back(subject, output, cost.lost)
    facts = {"written": output, "format": writer.NAME, "lost": cost.lost, "errors": cost.errors, "share": cost.share}
    facts |= {"light": cost.light, "verdict": cost.verdict.word, "reason": cost.verdict.reason}
    show(facts, describe(output, writer, cost), json)


def subject_of(file: Path, reconstruction: Between = "auto") -> Subject:
    """The material of a JSON document, or the table of a measured file."""
    from lambent.materials import measured
    from lambent.materials.document import is_document, load_material

    if not is_document(read_head(file, 64)):
        return measured.load(file, reconstruction)
    if reconstruction != "auto":
        raise UserError("applies to measured tables only", file=file, field="--reconstruction")
    return load_material(file)


def _check_kind(subject: Subject, writer: Writer, file: Path) -> None:
    from lambent.materials.document import Material

    kind = "material" if isinstance(subject, Material) else "table"
    if kind not in writer.TAKES:
        hint = f"fit it first: lambent fit {file} -o material.json" if kind == "table" else None
        raise UserError(f"is a {kind}, which {writer.NAME} cannot hold", file=file, hint=hint)


def describe(output: Path, writer: Writer, cost: Cost) -> str:
    """The file, its losses, its errors (absolute and relative), and the verdict."""
    losses = cost.lost or ("nothing beyond the errors below",)
    lines = [f"{output}: {writer.NAME}", *(f"lost: {loss}" for loss in losses)]
    if cost.errors:
        lines += ["", metric_errors(cost.errors, cost.share)]
    lines += ["", f"verdict: {cost.verdict}"]
    return "\n".join(lines)
