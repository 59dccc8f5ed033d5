"""`lambent bench`: the measurements of this project, on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Json, progress_bar, show, table, words


def command(
    name: Annotated[str, typer.Argument(help="Which one; an unknown name lists them.")],
    quick: Annotated[bool, typer.Option("--quick", help="The same rows at a smaller size, under a minute.")] = False,
    input_: Annotated[list[Path] | None, typer.Option("--input", help="Run it on your own file. Repeatable.")] = None,
    against: Annotated[
        list[Path] | None, typer.Option(help="Published parameters (.fit) to compare with (fit). Repeatable.")
    ] = None,
    settings: Annotated[
        int | None, typer.Option(help="Random settings of materials in each row (gi-edit), 20 unless --quick.")
    ] = None,
    reference: Annotated[
        list[Path] | None,
        typer.Option(help="Path traced pictures (.exr) of the input's first camera, equal in samples (equal-time)."),
    ] = None,
    json: Json = False,
) -> None:
    """Measure, and print the rows with the machine they were measured on.

    Example: lambent bench fit --quick --json
    """
    from lambent.bench.registry import run_bench

    with progress_bar() as progress:
        effort = "quick" if quick else "full"
        report = run_bench(
            name, effort, inputs=input_ or (), against=against or (), reference=reference or (), settings=settings,
            progress=progress,
        )  # fmt: skip
    names = list(dict.fromkeys(key for row in report["rows"] for key in row))
    rows = [names, *([words(row.get(key, "")) for key in names] for row in report["rows"])]
    summary = [(key, words(value)) for key, value in {**report["machine"], **report["summary"]}.items()]
    show(report, f"{table(rows)}\n\n{table(summary)}", json)
