"""`lambent convert`: a measurement or material in another tool's format, and what that costs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lambent.cli.console import Json, progress_bar, show, table
from lambent.core.errors import UserError

if TYPE_CHECKING:
    from lambent.materials.export.contract import Cost, Subject, Writer


def command(
    file: Annotated[Path, typer.Argument(help="Measured table in any format, or material document (.json).")],
    output: Annotated[Path, typer.Argument(help="File to write; its ending says the format.")],
    as_: Annotated[str | None, typer.Option("--as", help="Format, where the ending does not say it.")] = None,
    json: Json = False,
) -> None:
    """Write a measurement or material in another format, and say what was lost and how far the file is off.

    Example: lambent convert chrome.binary chrome.bsdf --as rgl
    """
    from lambent.materials.export.registry import writer_for

    writer = writer_for(output, as_)
    _check_places(file, output)
    subject = subject_of(file)
    _check_kind(subject, writer, file)
    with progress_bar() as progress:
        cost = writer.write(subject, output, progress)
        if not cost.errors:
            cost = _compared(subject, output, cost)
    facts = {"written": output, "format": writer.NAME, "lost": cost.lost, "errors": cost.errors, "share": cost.share}
    show(facts, describe(output, writer, cost), json)


def subject_of(file: Path) -> Subject:
    """The material of a JSON document, or the table of a measured file."""
    from lambent.materials import measured
    from lambent.materials.document import load_material

    try:
        with file.open("rb") as stream:
            head = stream.read(64)
    except OSError as error:
        raise UserError(f"cannot be read ({error.strerror})", file=file) from error
    return load_material(file) if head.removeprefix(b"\xef\xbb\xbf").lstrip().startswith(b"{") else measured.load(file)


def _check_places(file: Path, output: Path) -> None:
    """`UserError` where the output is the input, or has no folder to be in."""
    if output.is_dir():
        raise UserError("is a folder", file=output)
    if not output.parent.is_dir():
        raise UserError("folder does not exist", file=output.parent)
    if output.exists() and file.exists() and output.samefile(file):
        raise UserError("output is the input", file=output, hint="write to another file")


def _check_kind(subject: Subject, writer: Writer, file: Path) -> None:
    from lambent.materials.document import Material

    kind = "material" if isinstance(subject, Material) else "table"
    if kind not in writer.TAKES:
        hint = f"fit it first: lambent fit {file} -o material.json" if kind == "table" else None
        raise UserError(f"{writer.NAME} takes no {kind}", file=file, hint=hint)


def _compared(subject: Subject, output: Path, cost: Cost) -> Cost:
    """The cost with the errors of the file read back, where it is of a format that is read."""
    from lambent.materials.export.resampled import read_back
    from lambent.materials.measured.registry import is_known

    return read_back(subject, output, cost.lost) if is_known(output) else cost


def describe(output: Path, writer: Writer, cost: Cost) -> str:
    """What was written, lost, and the errors, absolute and as shares of the subject's own size."""
    from lambent.materials.fitting.metrics import METRICS

    lines = [f"{output}: {writer.NAME}", *(f"lost: {what}" for what in cost.lost)]
    if not cost.lost:
        lines.append("lost: nothing but what the errors say")
    if cost.errors:
        rows: list[tuple[str, ...]] = [("error", "absolute", "unit", "of its size")]
        rows += [(name, f"{value:.3g}", _unit(METRICS, name), f"{cost.share.get(name, 0.0):.2%}")
                 for name, value in cost.errors.items()]  # fmt: skip
        lines += ["", table(rows)]
    return "\n".join(lines)


def _unit(metrics: Any, name: str) -> str:
    return metrics[name].unit if name in metrics else ""
