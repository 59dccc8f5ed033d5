"""Rows of numbers below a line of names, as instruments and spreadsheets write them.

A missing value is NaN, a word such as N/A, or an empty cell between commas, semicolons or tabs. Decimal commas are read
where every row then has one number per column.
"""

from __future__ import annotations

import re
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats
from lambent.materials.measured.parts.text_numbers import has_decimal_commas, numbers, refuse_decimal_commas, shown

_MISSING = re.compile(
    rb"(?<![^\s,;])(?:n/?a|null|none|-{1,3}|-nan(?:\(ind\))?|[-+]?\d\.#\w+)(?![^\s,;])", re.IGNORECASE
)
_NOT_DECIMAL = re.compile(rb"\.|,(?!\d)|(?<!\d),")  # points, or commas that are no decimal ones
_BETWEEN = re.compile(rb"[,;]")
_CELLS = (b";", b",", b"\t")
_SHOWN_BYTES = 60  # of a faulty line


def rows_of(
    body: bytes, columns: int, path: Path, above: int = 0, *, wrapped: bool = False
) -> tuple[Floats, tuple[str, ...]]:
    """(N, columns) numbers, and notes on how they were read; a row per line unless `wrapped`, `above` lines before.

    Raises
    ------
    UserError
        If there are no rows, a row has another number of values or a word, or decimal commas leave it open where
        numbers end. The message names the line.
    """
    lines = body.split(b"\n")
    filled = [k for k, line in enumerate(lines) if line.strip(b" \t,;")]
    if not filled:
        raise UserError("has no rows", file=path)
    notes: tuple[str, ...] = ()
    if has_decimal_commas(body):
        if _NOT_DECIMAL.search(body) or not all(len(lines[k].replace(b";", b" ").split()) == columns for k in filled):
            refuse_decimal_commas(body, path)
        body, notes = body.replace(b",", b"."), ("decimal commas are read as points",)
        lines = body.split(b"\n")
    if wrapped:
        flat = numbers(_BETWEEN.sub(b" ", body), path)
        if len(flat) % columns:
            got = f"{len(flat)} numbers"
            raise UserError(
                "the last row does not have one value per column name",
                file=path,
                got=got,
                expected=f"{columns} per row",
            )
        return flat.reshape(-1, columns), notes
    wrong = [k for k in filled if len(_words(lines[k])) != columns]
    if wrong:
        filled_cells = _filled_cells(lines, filled, columns)
        if filled_cells is None:
            raise _wrong_row(lines[wrong[0]], above + wrong[0] + 1, columns, path)
        body = b"\n".join(filled_cells)
    try:
        flat = numbers(_BETWEEN.sub(b" ", body), path)
    except UserError:
        body = _MISSING.sub(b"nan", body)
        flat = _numbers_by_line(_BETWEEN.sub(b" ", body), path, above)
    return flat.reshape(-1, columns), notes


def _words(line: bytes) -> list[bytes]:
    return _BETWEEN.sub(b" ", line).split()


def _filled_cells(lines: list[bytes], filled: list[int], columns: int) -> list[bytes] | None:
    """The lines with NaN in empty cells; None unless one separator gives every row one cell per column."""
    for separator in _CELLS:
        if all(lines[k].count(separator) == columns - 1 for k in filled):
            return [separator.join(cell if cell.strip() else b"nan" for cell in lines[k].split(separator))
                    for k in filled]  # fmt: skip
    return None


def _wrong_row(line: bytes, number: int, columns: int, path: Path) -> UserError:
    got = f"{len(_words(line))}: {shown(line.strip()[:_SHOWN_BYTES])}"
    hint = "write nan where nothing was measured" if len(_words(line)) < columns else None
    message = "a row does not have one value per column name"
    return UserError(message, file=path, field=f"line {number}", got=got, expected=columns, hint=hint)


def _numbers_by_line(text: bytes, path: Path, above: int) -> Floats:
    """The numbers of a text; the error for a word names its line."""
    try:
        return numbers(text, path)
    except UserError as error:
        for k, line in enumerate(text.split(b"\n")):
            if not _are_numbers(line, path):
                raise UserError(error.message, file=path, field=f"line {above + k + 1}", got=error.got,
                                hint=error.hint) from error  # fmt: skip
        raise


def _are_numbers(line: bytes, path: Path) -> bool:
    try:
        numbers(line, path)
    except UserError:
        return False
    return True
