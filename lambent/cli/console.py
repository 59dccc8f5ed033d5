"""Code shared by all commands: results on stdout, progress on stderr, parsing of sizes."""

from __future__ import annotations

import json
import logging
import sys
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal

import typer

import lambent
from lambent.api.progress import progress_bar as progress_bar
from lambent.core.errors import UserError
from lambent.core.plain import plain, printable

Between = Annotated[
    Literal["auto", "half_vector", "back_vector", "quadrilinear"],
    typer.Option(
        "--reconstruction",
        help="How a gonio table is interpolated between incident directions; auto measures which is best.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]

CreaseAngle = Annotated[
    float | None,
    typer.Option(
        "--crease-angle",
        min=0,
        max=180,
        help="Scenes: edges above this angle in degrees are hard, others smooth, where normals lean too far or are "
        "missing.",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace existing files, even the input.")]

Memory = Annotated[float | None, typer.Option(min=0, help="GPU memory for light fields, MB. [default: enough for all]")]
Cache = Annotated[
    str, typer.Option(help="Which maps are dropped first where memory is short: least-recent or adaptive.")
]
LEAST_RECENT = "least-recent"


def _version(value: bool) -> None:
    if value:
        typer.echo(lambent.__version__)
        raise typer.Exit


def options(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """The options of `lambent` itself."""


def show(result: Mapping[str, Any], text: str, as_json: bool) -> None:
    """Print the result of a command: `text` for people, `result` for machines."""
    typer.echo(json.dumps(plain(result), indent=1, allow_nan=False) if as_json else _lines(text))


def table(lines: Iterable[Iterable[str]]) -> str:
    """Rows of words in aligned columns."""
    rows = [tuple(map(printable, line)) for line in lines]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip()
                     for row in rows)  # fmt: skip


def words(value: object) -> str:
    """A float with four digits, anything else as text."""
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def metric_errors(errors: Mapping[str, float], share: Mapping[str, float]) -> str:
    """Table of errors under every metric: absolute, with unit, and as a share of the subject's norm."""
    from lambent.materials.measured.inspecting.metrics import METRICS

    rows = ((name, f"{value:.3g}", METRICS[name].unit, f"{share[name]:.2%}") for name, value in errors.items())
    return table([("error", "absolute", "unit", "relative"), *rows])


def parse_size(text: str, option: str = "--size") -> tuple[int, int]:
    """Parse an option's value such as "1280x720" to (width, height), pixels; `UserError` if malformed."""
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal() and 0 < int(width) <= 16384 and 0 < int(height) <= 16384):
        raise UserError(
            "cannot be read as a picture size", field=option, got=text, expected="WIDTHxHEIGHT, each 1 to 16384"
        )
    return int(width), int(height)


def say(text: str) -> None:
    """Print a line on stderr, outside of the result."""
    sys.stderr.write(_lines(text) + "\n")


def note(text: str) -> None:
    """Print what a picture took otherwise than asked."""
    say(f"note: {text}")


def log_to_stderr() -> None:
    """Print warnings of all packages as lines on stderr."""
    handler = logging.StreamHandler()
    handler.setFormatter(_LogLine("lambent: %(message)s"))
    logging.basicConfig(handlers=[handler], level=logging.WARNING)


class _LogLine(logging.Formatter):
    def format(self, record: logging.LogRecord) -> str:
        return _lines(super().format(record))


def _lines(text: str) -> str:
    """Make each line of a text `printable`, because it may contain names from files."""
    return "\n".join(map(printable, text.split("\n")))
