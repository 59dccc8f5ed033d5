"""Find the reader of a measured file by its content, or say what an unread format is and what to do.

A reader is a module of this package that has `NAME` (str), `recognise(head: bytes, size: int) -> bool` and
`read(path: Path) -> MeasuredTable`, or one of the `FORMATS` of a module. File suffixes are ignored: three formats share
`.bsdf`.
"""

from __future__ import annotations

import dataclasses
import os
import re
import sys
from functools import cache
from pathlib import Path
from typing import Literal, Protocol

from lambent.core.discovery import modules_in
from lambent.core.errors import UserError
from lambent.core.inputs import foreign_bytes, open_input
from lambent.core.plain import is_number, printable
from lambent.materials.measured.parts.text_numbers import HINT_QUANTITY, UTF16, is_utf16, shown
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.gonio import AUTO, GonioTable, Reconstruction

_HEAD_BYTES = 4096
_LEAST_NUMBERS = 5  # of a row of columns without names
_FEWEST_NUMBERS = 3  # of one below names: two angles and a value
_SHOWN = 80  # characters of names
_TEXT_EXPORT = "export it as Zemax BSDF, ASTM E1392 or plain columns with named angles"
_SHEET_EXPORT = f"save its sheet of measurements as CSV or tab-separated text, and {HINT_QUANTITY}"
_KINDS = (
    ("ALTA binary", rb"#FORMAT[ \t]+binary", "convert it to ALTA text: data2data without `format binary`"),
    ("SPEOS (OPTIS) BSDF", rb"OPTIS\s*-[^\n]*surface file", _TEXT_EXPORT),
    ("Surface Scattering Distribution Data (SSDD)", rb"(?m)^DATA_TYPE[ \t]+(?:brdf|btdf|specular_\w+)\b",
     "export it from BSDF Processor as Integra DDR or DDT"),
    ("NVIDIA MDL measured BSDF (MBSDF)", rb"NVIDIA ARC MBSDF", "load the measurement that it was made of"),
    ("VIAVI, RPC Photonics or Light Tec text with columns of its own",
     rb"(?i:\bVIAVI\b|RPC[ _-]Photonics|Engineered Diffuser|Light[ -]?Tec\b)|\bED[CSLF]\d?-\d",
     "take the same specimen's Zemax BSDF file (.bsdf), or name the columns: theta_i phi_i theta_o phi_o f"),
    ("Excel workbook (.xls)", rb"\A\xd0\xcf\x11\xe0", _SHEET_EXPORT),
    ("Excel workbook (.xlsx)", rb"(?s)\APK\x03\x04.*?(?:\[Content_Types\]\.xml|xl/)", _SHEET_EXPORT),
    ("HDF5 or MATLAB 7.3", rb"\A\x89HDF\r\n", _TEXT_EXPORT),
    ("ZIP archive", rb"\APK\x03\x04", "unpack it, and load the file inside"),
    ("gzip archive", rb"\A\x1f\x8b", "unpack it, and load the file inside"),
)  # fmt: skip


def kind_of(head: bytes) -> tuple[str, str] | None:
    """Format of a file that begins with `head`, and advice on it; None if unknown."""
    begin = head[:_HEAD_BYTES]
    found = next(((name, remedy) for name, signature, remedy in _KINDS if re.search(signature, begin)), None)
    row = re.match(r"(?:\s*(?:[#%]|//)[^\n]*\n)*\s*([^\n]*)", shown(begin))
    words = re.split(r"[\s;]+|,\s+", row[1].strip()) if row else []
    if found is None and len(words) >= _LEAST_NUMBERS and all(is_number(word.replace(",", ".")) for word in words):
        return "columns without names", HINT_QUANTITY
    if found is None and row and (names := _names_above_numbers(row[1], shown(begin)[row.end() :])):
        return f"columns with names that are not known ({names})", HINT_QUANTITY
    return found


def _every_other_is_nul(head: bytes) -> bool:
    """Whether a file begins as text of ASCII characters of two bytes, without a byte order mark."""
    begin = head[: 2 * _SHOWN]
    return len(begin) > 2 and any(not any(begin[k::2]) and all(begin[1 - k :: 2]) for k in (0, 1))


def _names_above_numbers(line: str, below: str) -> str:
    """A line of words, if a row of numbers follows it; otherwise nothing."""
    row = re.match(r"\s*([^\n]*)\n", below)
    words = re.split(r"[\s,;]+", row[1].strip(" \t,;\r")) if row else []
    fits = len(words) >= _FEWEST_NUMBERS and all(is_number(word) for word in words)
    return printable(line.strip()[:_SHOWN]) if fits else ""


HEAD_BYTES = 1 << 16


class Reader(Protocol):
    """Interface of a format's module."""

    NAME: str

    def recognise(self, head: bytes, size: int) -> bool:
        """Whether a file of `size` bytes that begins with `head` claims to be of this format."""
        ...

    def read(self, path: Path) -> MeasuredTable:
        """The table, or a `UserError`."""
        ...


@cache
def readers() -> tuple[Reader, ...]:
    """All readers in the package, by name."""
    package = sys.modules[__name__.rpartition(".")[0]]  # imports this module, so importing it would be circular
    found: list[Reader] = [*modules_in(package, having="recognise").values()]
    found += [reader for module in modules_in(package, having="FORMATS").values() for reader in module.FORMATS]
    return tuple(sorted(found, key=lambda reader: reader.NAME))


def load(path: Path | str, reconstruction: Reconstruction | Literal["auto"] = AUTO) -> MeasuredTable:
    """Read a measured material of any known format.

    `reconstruction` selects the look-up of a gonio table between its incident directions, see gonio.py.

    Raises
    ------
    UserError
        If the file is missing, of no known format, or broken; or if `reconstruction` is given for another kind of
        table.
    """
    path = Path(path)
    head, size = _head(path)
    reader = _reader_of(head, size, path)
    if reader is not None:
        with foreign_bytes(reader.NAME, path):
            table = reader.read(path)
        if reconstruction == AUTO:
            return table
        if not isinstance(table, GonioTable):
            raise UserError(f"does not apply to {reader.NAME}", file=path, field="reconstruction")
        return dataclasses.replace(table, reconstruction=reconstruction)
    if head.startswith(UTF16) or _every_other_is_nul(head):
        raise is_utf16(path)
    if (kind := kind_of(head)) is not None:
        raise UserError(f"is {kind[0]}, which is not supported", file=path, hint=kind[1])
    known = ", ".join(reader.NAME for reader in readers())
    raise UserError("unknown format of measured material", file=path, expected=f"one of: {known}")


def is_known(path: Path | str) -> bool:
    """Whether some reader recognises the file, damaged or not; raises `UserError` like `load`."""
    path = Path(path)
    return _reader_of(*_head(path), path) is not None


def claims(head: bytes, path: Path) -> bool:
    """Whether some reader recognises a file that begins with `head`, without a fault."""
    try:
        return _reader_of(head, path.stat().st_size, path) is not None
    except UserError:
        return False


def _head(path: Path) -> tuple[bytes, int]:
    """The first bytes of a file and its size; raises `UserError` if it cannot be read."""
    with open_input(path) as file:
        head, size = file.read(HEAD_BYTES), os.fstat(file.fileno()).st_size
    if not head.strip() and size <= HEAD_BYTES:
        raise UserError("file is empty", file=path)
    return head, size


def _reader_of(head: bytes, size: int, path: Path) -> Reader | None:
    """The first reader that claims the file; without one, raise the first reader's error, if any."""
    failed: UserError | None = None
    for reader in readers():
        try:
            with foreign_bytes(reader.NAME, path):
                if reader.recognise(head, size):
                    return reader
        except UserError as error:  # another reader may still claim the file
            failed = failed or error
    if failed is not None:
        raise failed
    return None
