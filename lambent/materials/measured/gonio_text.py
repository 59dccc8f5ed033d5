"""Lambent's own text format of gonio-photometer tables, read and written; docs/formats.md describes it.

    # name: rough copper
    # symmetry: isotropic
    theta_i phi_i theta_o phi_o p_r p_g p_b
    5 0 0 0 0.0213 0.0175 0.0141

Angles are in degrees; theta_o > 90 is transmission. The names of the value columns give the quantity. nan, or exactly
-1, -99, -999 or -9999, marks a value that was not measured.
"""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats, angles
from lambent.core.errors import UserError
from lambent.core.files import atomic_path
from lambent.materials.measured.gonio import FORMAT, AnySheet, GonioTable
from lambent.materials.measured.gonio_rows import QUANTITIES, check_angles, quantity_of, table_of, to_f
from lambent.materials.measured.protocol import Quantity
from lambent.materials.measured.sheets import Sheet
from lambent.materials.measured.table import unmarked
from lambent.materials.measured.text_numbers import HINT_DECIMAL_COMMA, has_decimal_commas, plain_text, read_text, shown

NAME = FORMAT
ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
_VALUE_COLUMNS = [[q] for q in QUANTITIES] + [[f"{q}_{channel}" for channel in "rgb"] for q in QUANTITIES]
_HEADER_BYTES = 1 << 16


def recognise(head: bytes, size: int) -> bool:
    """Whether the first uncommented line names the four angles, and no quantity by another name (BRDF, f_x)."""
    names = _names(head)
    if names is None or tuple(names[:4]) != ANGLES:
        return False
    values = names[4:]
    if values in _VALUE_COLUMNS or len(values) not in (1, 3):
        return True
    return quantity_of(re.sub(r"_[rgbxyz]$", "", values[0].lower()) if len(values) == 3 else values[0]) is None


def _names(head: bytes) -> list[str] | None:
    for line in plain_text(head).split(b"\n"):
        text = line.split(b"#")[0].strip()
        if text:
            return re.split(r"[\s,;]+", shown(text).strip(",;"))
    return None


def read(path: Path) -> GonioTable:
    """The table of a gonio text file.

    Raises
    ------
    UserError
        A column or the symmetry is unknown, a row is broken, the incident directions do not form a grid, or one of
        them has no measured value.
    """
    content = read_text(path)
    names = _names(content[:_HEADER_BYTES])
    if names is None or tuple(names[:4]) != ANGLES:
        raise UserError("first line that is not a comment must name the columns", file=path, expected=" ".join(ANGLES))
    if names[4:] not in _VALUE_COLUMNS:
        known, got = [" ".join(columns) for columns in _VALUE_COLUMNS], " ".join(names[4:]) or "none"
        raise UserError("quantity of the value columns is not stated", file=path, got=got, expected=f"one of: {known}")
    quantity = QUANTITIES[_VALUE_COLUMNS.index(names[4:]) % len(QUANTITIES)]
    rows = _rows(content, len(names), path)
    f, keys = to_f(unmarked(rows[:, 4:]), quantity, rows[:, 2]), _keys(content[:_HEADER_BYTES])
    name = keys.get("name", Path(path).stem)
    return table_of(rows[:, :4], f, path, NAME, name, stored=quantity, named=keys.get("symmetry"))


def _rows(content: bytes, columns: int, path: Path) -> Floats:
    """(N, columns) numbers below the line of names; infinities become NaN."""
    lines = io.BytesIO(content)
    line = next(line for line in lines if line.split(b"#")[0].strip())
    start = lines.tell()
    if not re.search(rb"^[^\S\n]*[^#\s]", content[start:], re.MULTILINE):
        raise UserError("has no rows", file=path)
    text = io.TextIOWrapper(lines, encoding="utf-8")
    delimiter = next((mark for mark in (",", ";") if mark.encode() in line), None)
    try:
        rows = np.loadtxt(text, delimiter=delimiter, ndmin=2)
    except ValueError as error:
        hint = HINT_DECIMAL_COMMA if has_decimal_commas(content) else None
        raise UserError(f"a row is malformed ({str(error).splitlines()[0]})", file=path, hint=hint) from error
    if rows.shape[1] != columns:
        got = rows.shape[1]
        raise UserError("a row does not have one value per column name", file=path, got=got, expected=columns)
    check_angles(rows[:, :4], path)
    rows[np.isinf(rows)] = np.nan
    return rows


def _keys(head: bytes) -> dict[str, str]:
    """The `# key: value` comments."""
    found = re.findall(rb"^#[^\S\n]*(\w+):[^\S\n]*(\S[^\n]*?)\s*$", head, re.MULTILINE)
    return {key.decode(): shown(value) for key, value in found}


def write_gonio(path: Path, table: GonioTable, quantity: Quantity = "p") -> None:
    """Write `table` as gonio text, atomically, with six significant digits of the values.

    Parameters
    ----------
    quantity : {"f", "f_cos", "p"}
        f_cos and p both hold f |cos theta_o|, in 1/sr.
    """
    channels = ("",) if table.info.channels == 1 else ("_r", "_g", "_b")
    names = " ".join([*ANGLES, *(quantity + channel for channel in channels)])
    formats = ["%.8g"] * len(ANGLES) + ["%.6g"] * len(channels)
    with atomic_path(Path(path)) as beside, beside.open("w", encoding="utf-8", errors="backslashreplace") as file:
        file.write(f"# name: {table.name}\n# symmetry: {table.symmetry}\n{names}\n")
        for entry in table.entries():
            np.savetxt(file, _columns(*entry, quantity), fmt=formats)


def _columns(theta_i_deg: float, phi_i_deg: float, sheet: AnySheet, far: bool, quantity: Quantity) -> Floats:
    if isinstance(sheet, Sheet) and sheet.frame is None:  # keeps phi where theta is 0
        theta, phi = (grid.ravel() for grid in np.meshgrid(sheet.theta_deg, sheet.phi_deg, indexing="ij"))
    else:
        theta, phi = (np.degrees(angle) for angle in angles(sheet.directions))
    kept = sheet.measured & (theta <= 90)
    theta, phi, values = theta[kept], phi[kept], sheet.values[kept]
    if quantity != "f":
        values = values * np.cos(np.radians(theta))[:, None]
    fixed = np.broadcast_to((theta_i_deg, phi_i_deg), (len(theta), 2))
    return np.column_stack([fixed, 180 - theta if far else theta, phi, values])
