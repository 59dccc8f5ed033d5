"""`lambent convert`: a measurement or material in another tool's format, with its losses."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from lambent.cli.console import Between, Force, Json, metric_errors, show

if TYPE_CHECKING:
    from lambent.materials.export.contract import Cost, Writer


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
    from lambent.api.converting import convert
    from lambent.core.outputs import check_output
    from lambent.materials.export.contract import writer_for

    writer = writer_for(output, as_)
    check_output(output, force=force, inputs=[file])
    cost = convert(file, output, as_=as_, reconstruction=reconstruction, progress=True)
    facts = {"written": output, "format": writer.NAME, "lost": cost.lost, "errors": cost.errors, "share": cost.share}
    facts |= {"light": cost.light, "verdict": cost.verdict.word, "reason": cost.verdict.reason}
    show(facts, describe(output, writer, cost), json)


def describe(output: Path, writer: Writer, cost: Cost) -> str:
    """The file, its losses, its errors (absolute and relative), and the verdict."""
    losses = cost.lost or ("nothing beyond the errors below",)
    lines = [f"{output}: {writer.NAME}", *(f"lost: {loss}" for loss in losses)]
    if cost.errors:
        lines += ["", metric_errors(cost.errors, cost.share)]
    lines += ["", f"verdict: {cost.verdict}"]
    return "\n".join(lines)
