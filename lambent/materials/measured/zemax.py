"""Zemax / OpticStudio tabular BSDF text ("BSDF Data Interchange", Radiant Imaging): grids about the mirror direction.

Lines of keyword and value, `#` begins a comment: Source, Symmetry, SpectralContent, ScatterType, then SampleRotation,
AngleOfIncidence, ScatterAzimuth and ScatterRadial, each with a count and, on the next line, its angles in degrees.
Then, per channel (Monochrome, or TristimulusX, Y and Z), DataBegin, the blocks, DataEnd. A block is one sample rotation
(slow) and angle of incidence (fast): `TIS value`, then a line per azimuth with the BSDF (1/sr, no cosine) per radial
angle.

ScatterRadial is the angle from the direction of mirror reflection (BTDF: undeviated transmission), ScatterAzimuth the
angle about it, 0 towards the normal. Angles of incidence are given for this direction; their values are the same.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.parts.gonio_rows import SpecularGrid, specular_table
from lambent.materials.measured.parts.spectral import rgb_of_xyz
from lambent.materials.measured.parts.text_numbers import (
    angles_after,
    begins_with,
    counted,
    read_text,
    shown,
    without_comments,
)
from lambent.materials.measured.protocol import LARGEST_F
from lambent.materials.measured.tables.gonio import GonioTable
from lambent.materials.measured.tables.table import unmarked

NAME = "Zemax BSDF text"
BELOW_90_DEG = float(np.nextafter(90, 0))
LISTS = {
    "SampleRotation": (-360, 360),
    "AngleOfIncidence": (0, BELOW_90_DEG),
    "ScatterAzimuth": (0, 360),
    "ScatterRadial": (0, 180),
}
_WORDS = {
    "Symmetry": ("PlaneSymmetrical", "Asymmetrical", "Asymmetrical4D"),
    "SpectralContent": ("Monochrome", "XYZ"),
    "ScatterType": ("BRDF", "BTDF"),
}
_FIRST = re.compile(rb"\s*(?:Source\s+\w+\s+)?(?:Symmetry|SpectralContent|ScatterType|SampleRotation)\s")
_BLOCK = re.compile(rb"\bTIS\b", re.IGNORECASE)
_MOST_CHECKED = 16  # angles of incidence at which TIS is compared


def recognise(head: bytes, size: int) -> bool:
    """Whether the first words belong to the format."""
    return begins_with(_FIRST, head)


def read(path: Path) -> GonioTable:
    """The table of a Zemax BSDF file.

    Raises
    ------
    UserError
        A keyword is missing or unknown, the counts do not fit, an angle is outside its range, or nothing was measured
        for an incident direction.
    """
    text = without_comments(read_text(path))
    head, _, body = text.partition(b"DataBegin")
    words, lists = _header(head, path)
    if not body:
        raise UserError("has no DataBegin", file=path)
    shape = tuple(len(lists[name]) for name in LISTS)
    channels = 3 if words["SpectralContent"] == "XYZ" else 1
    parts = [part.partition(b"DataEnd")[0] for part in body.split(b"DataBegin")]
    if len(parts) != channels:
        expected = f"{channels} for {words['SpectralContent']}"
        raise UserError("wrong number of data sections", file=path, got=len(parts), expected=expected)
    read_parts = [_section(part, shape, path) for part in parts]
    values, tis = (np.stack(arrays, axis=-1) for arrays in zip(*read_parts, strict=True))
    return _table(values, tis, lists, words, path)


def _header(head: bytes, path: Path) -> tuple[dict[str, str], dict[str, Floats]]:
    """The keywords and the lists of angles above the data."""
    lists = {name: angles_after(name, low, high, head, path) for name, (low, high) in LISTS.items()}
    words: dict[str, str] = {}
    for name, choices in _WORDS.items():
        found = re.search(rb"\b" + name.encode() + rb"\s+(\w+)", head)
        got = shown(found[1]) if found else "nothing"
        same = next((word for word in choices if word.lower() == got.lower()), got)
        words[name] = known(name, same, choices, file=path, field=name)
    return words, lists


def _section(part: bytes, shape: tuple[int, ...], path: Path) -> tuple[Floats, Floats]:
    """(rotations, incidences, azimuths, radials) values and (rotations, incidences) TIS of one channel."""
    blocks = _BLOCK.split(part)
    if blocks[0].strip() or len(blocks) != shape[0] * shape[1] + 1:
        expected = f"{shape[0]} rotations x {shape[1]} angles of incidence, each after its TIS"
        raise UserError("wrong number of data blocks", file=path, got=len(blocks) - 1, expected=expected)
    whole = np.stack([_block(block, f"block {number}", shape, path) for number, block in enumerate(blocks[1:], 1)])
    return whole[:, 1:].reshape(shape), whole[:, 0].reshape(shape[:2])


def _block(text: bytes, field: str, shape: tuple[int, ...], path: Path) -> Floats:
    """TIS and the values of a block; without DataEnd, the next channel's name follows the last block."""
    text = re.sub(rb"\n\s*(?:Tristimulus\w*|Monochrome)\s*$", b"", text)
    return counted(text, (1 + shape[2] * shape[3],), path, field, "(TIS, azimuths x radial angles)")


def _table(values: Floats, tis: Floats, lists: dict[str, Floats], words: dict[str, str], path: Path) -> GonioTable:
    values, notes = _measured(values)
    if values.shape[-1] == 3:
        values, said = rgb_of_xyz(values)
        notes += said
    grid = SpecularGrid(*(lists[name] for name in LISTS))
    plane, far = words["Symmetry"] == "PlaneSymmetrical", words["ScatterType"] == "BTDF"
    table = specular_table(grid, values, path, NAME, far=far, mirrored=plane, notes=notes)
    return _with_tis(table, tis[np.argmin(grid.rotation % 360)])


def _measured(values: Floats) -> tuple[Floats, tuple[str, ...]]:
    """Values with NaN where a channel is 0, which writers of the format use for unmeasured directions."""
    with np.errstate(invalid="ignore"):
        empty = np.any(values == 0, axis=-1, keepdims=True)
        values = np.where(empty | (np.abs(values) > LARGEST_F), np.nan, unmarked(values))
    return values, ("a BSDF of exactly 0 counts as not measured",) if empty.any() else ()


def _with_tis(table: GonioTable, tis: Floats) -> GonioTable:
    """The table with a note comparing the file's total integrated scatter with the table's integral."""
    with np.errstate(over="ignore", invalid="ignore"):
        stated = tis[:_MOST_CHECKED].mean(axis=-1)
    wi = direction(np.radians(table.theta_i_deg[:_MOST_CHECKED]), np.radians(table.phi_i_deg[0]))
    measured = replace(table, reconstruction="quadrilinear")  # at measured directions all methods agree
    ours = (measured.transmissivity(wi) if table.transmitted else measured.reflectivity(wi)).mean(axis=-1)
    pairs = ", ".join(
        f"{s:.4f} ({o:.4f}) at {theta:g}" for s, o, theta in zip(stated, ours, table.theta_i_deg, strict=False)
    )
    return replace(table, notes=(*table.notes, f"TIS stated (and by integration of the table): {pairs} degrees"))
