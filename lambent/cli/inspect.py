"""`lambent inspect`: the kind of a file, and a summary of its contents."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import typer

from lambent.cli.console import Between, CreaseAngle, Force, Json, show, table, words
from lambent.core.errors import UserError
from lambent.core.plain import first_of, plain

Facts = dict[str, Any]
MOST = 60  # names of objects; --json has all


def command(
    file: Annotated[
        str, typer.Argument(help="Measured table, material, luminaire, scene, store, image; or builtin:room.")
    ],
    plot: Annotated[Path | None, typer.Option(help="Plot a table, material or luminaire (.png, .pdf, .svg).")] = None,
    reconstruction: Between = "auto",
    crease_angle: CreaseAngle = None,
    force: Force = False,
    json: Json = False,
) -> None:
    """Describe a file of Lambent or of another tool: format, dimensions, symmetry, albedo, faults.

    Example: lambent inspect brushed.bsdf --plot brushed.png
    """
    from lambent.api.reading import read

    if plot is not None:
        from lambent.core.outputs import check_output

        check_output(plot, (".png", ".pdf", ".svg"), force=force, inputs=[file])
    found = read(file, reconstruction=reconstruction, crease_deg=crease_angle)
    if plot is not None:
        if not hasattr(found, "plot"):
            raise UserError("applies to tables, materials and luminaires only", file=file, field="--plot")
        found.plot(plot)
    facts = plain(found.facts())
    prose = ["\n- ".join([f"\n\n{name}", *value]) for name, value in facts.items() if _is_prose(value)]
    show(facts, table(_rows(facts)) + "".join(prose), json)


def _rows(facts: Facts, indent: str = "") -> Iterator[tuple[str, str]]:
    """(name, words) of every non-empty fact; nested facts are indented."""
    for name, value in facts.items():
        label = indent + name
        if isinstance(value, dict) and value:
            yield label, ""
            yield from _rows(value, indent + "  ")
        elif value not in ([], {}, None) and not _is_prose(value):
            yield label, _words(value)


def _is_prose(value: Any) -> bool:
    """Whether a fact is a list of sentences, which are printed below the table."""
    return isinstance(value, list) and bool(value) and all(isinstance(item, str) and " " in item for item in value)


def _words(value: Any) -> str:
    if not isinstance(value, list):
        return words(value)
    if len(value) > MOST and isinstance(value[0], str):
        return first_of(value, MOST)
    nested = any(isinstance(item, list) for item in value)
    return ("; " if nested else " " if isinstance(value[0], float) else ", ").join(map(_words, value))
