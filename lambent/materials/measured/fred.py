"""FRED tabulated BSDF text: any outgoing directions per direction of mirror reflection.

    type bsdf_data
    format angles=deg bsdf=value scale=1
    30 0
    0 0 0.0204
    5 10 0.0239

A line of two numbers begins a block: theta and phi of the *specular* direction, so that the light is at phi + 180. A
line of three is a measurement: theta and phi from the normal, not from the specular direction, and the BSDF in 1/sr
without a cosine. A negative theta is on the other side of the normal. `angles=sin` gives direction cosines (x, y) in
place of both angles, `bsdf=log` the decimal logarithm; every BSDF is multiplied by `scale`.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.errors import UserError
from lambent.core.plain import is_number
from lambent.materials.measured.parts.gonio_rows import check_angles, table_of
from lambent.materials.measured.parts.text_numbers import begins_with, numbers, read_text, shown, without_comments
from lambent.materials.measured.tables.gonio import GonioTable
from lambent.materials.measured.tables.table import unmarked

NAME = "FRED BSDF text"
_FIRST = re.compile(rb"\s*type\s+bsdf_data\b", re.IGNORECASE)
_FORMAT = re.compile(rb"\s*type\s+bsdf_data[^\n]*\n\s*format([^\n]*)\n", re.IGNORECASE)
_KNOWN = {"angles": ("deg", "sin"), "bsdf": ("value", "log")}


def recognise(head: bytes, size: int) -> bool:
    """Whether the first line is the format's."""
    return begins_with(_FIRST, head)


def read(path: Path) -> GonioTable:
    """The table of a FRED file.

    Raises
    ------
    UserError
        The second line is not understood, a line has neither two nor three numbers, an angle is outside its range, or
        the incident directions do not form a grid.
    """
    text = without_comments(read_text(path))
    found = _FORMAT.match(text)
    if found is None:
        raise UserError("second line must give the format", file=path, expected="format angles=deg bsdf=value scale=1")
    units, scale = _options(found[1], path)
    blocks, rows, block_of = _lines(text[found.end() :], path)
    incident, outgoing = _angles(blocks, units["angles"], path), _angles(rows[:, :2], units["angles"], path)
    angles = np.concatenate([incident[block_of] + (0, 180), outgoing], axis=1)
    check_angles(angles, path)
    with np.errstate(over="ignore", invalid="ignore"):
        f = (10 ** rows[:, 2:] if units["bsdf"] == "log" else unmarked(rows[:, 2:])) * scale
    f = np.where(np.isfinite(f), f, np.nan)
    return table_of(angles, f, path, NAME, Path(path).stem)


def _options(words: bytes, path: Path) -> tuple[dict[str, str], float]:
    """The units of angles and BSDF, and the scale."""
    given = dict(re.findall(r"(\w+)\s*=\s*(\S+)", shown(words).lower()))
    for name, known in _KNOWN.items():
        if given.get(name) not in known:
            raise UserError("is unknown", file=path, field=name, got=given.get(name), expected=f"one of: {known}")
    scale = float(text) if is_number(text := given.get("scale", "1")) else np.nan
    if not (np.isfinite(scale) and scale > 0):
        raise UserError("is not a positive number", file=path, field="scale", got=given.get("scale"))
    return given, scale


def _lines(body: bytes, path: Path) -> tuple[Floats, Floats, Indices]:
    """(B, 2) blocks, (N, 3) measurements, and (N,) the block of each."""
    body = re.sub(rb"[,;]", b" ", body) if re.search(rb"\d\s*;|\d,\s", body) else body
    flat = numbers(body, path)
    per_line = np.array([len(line.split()) for line in body.split(b"\n")], dtype=np.int64)
    per_line = per_line[per_line > 0]
    odd = np.flatnonzero((per_line != 2) & (per_line != 3))
    if len(odd):
        got = f"{per_line[odd[0]]} numbers in line {odd[0] + 3}"
        raise UserError(
            "wrong number of values in a line", file=path, got=got, expected="2 (a block begins) or 3 (a measurement)"
        )
    if (per_line == 3).sum() == 0 or per_line[0] != 2:
        raise UserError("has no block with measurements", file=path)
    starts = np.cumsum(per_line) - per_line
    blocks, rows = (flat[starts[per_line == count, None] + np.arange(count)] for count in (2, 3))
    return blocks, rows, np.cumsum(per_line == 2)[per_line == 3] - 1


def _angles(pairs: Floats, unit: str, path: Path) -> Floats:
    """(N, 2) theta >= 0 and phi in degrees."""
    if unit == "sin":
        radius = np.hypot(pairs[:, 0], pairs[:, 1])
        if not (radius <= 1 + 1e-6).all():
            raise UserError("direction cosines exceed 1", file=path, got=float(radius.max()))
        theta = np.degrees(np.arcsin(radius.clip(0, 1)))
        return np.stack([theta, np.degrees(np.arctan2(pairs[:, 1], pairs[:, 0]))], axis=1)
    return np.stack([np.abs(pairs[:, 0]), pairs[:, 1] + np.where(pairs[:, 0] < 0, 180, 0)], axis=1)
