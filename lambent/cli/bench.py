"""`lambent bench`: the measurements of this project, on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lambent.cli.console import Json, progress_bar, show, table, words


def command(
    name: Annotated[str, typer.Argument(help="Name of the bench; an unknown name lists all.")],
    quick: Annotated[bool, typer.Option("--quick", help="The same rows at a smaller size, under a minute.")] = False,
    input_: Annotated[list[Path] | None, typer.Option("--input", help="Measure your own file. Repeatable.")] = None,
    against: Annotated[
        list[Path] | None, typer.Option(help="Bench fit: published parameters (.fit) to compare with. Repeatable.")
    ] = None,
    settings: Annotated[
        int | None, typer.Option(help="Bench gi-edit: random material settings per row, 20 unless --quick.")
    ] = None,
    reference: Annotated[
        list[Path] | None,
        typer.Option(
            help="Benches equal-time, accumulate: path traced .exr of the input's first camera, equal in samples."
        ),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", help="Bench card: file of finished rows, which a later run continues. [default: card.json]"),
    ] = None,
    json: Json = False,
) -> None:
    """Run a bench and print its rows and the machine.

    Example: lambent bench fit --quick --json

    Example: lambent bench card -o card.json
    """
    from lambent.bench.registry import run_bench

    with progress_bar() as progress:
        effort = "quick" if quick else "full"
        report = run_bench(
            name, effort, inputs=input_ or (), against=against or (), reference=reference or (), settings=settings,
            output=output, progress=progress,
        )  # fmt: skip
    names = list(dict.fromkeys(key for row in report["rows"] for key in row))
    rows = [names, *([words("" if row.get(key) is None else row[key]) for key in names] for row in report["rows"])]
    summary = [(key, words(value)) for key, value in {**report["machine"], **report["summary"]}.items()]
    show(report, f"{table(rows)}\n\n{table(summary)}", json)
