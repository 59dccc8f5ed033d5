"""Plain columns of a gonio-photometer, read and written. docs/formats.md gives the format.

    # name: rough copper
    # symmetry: isotropic
    theta_i phi_i theta_o phi_o p_r p_g p_b
    5 0 0 0 0.0213 0.0175 0.0141

Degrees; theta_o > 90 is transmission; the name of the value columns says the quantity; nan or -1 is not measured.
"""

from __future__ import annotations

import codecs
import io
import re
from pathlib import Path
from typing import Literal

import numpy as np

from lambent.core.errors import UserError, did_you_mean
from lambent.core.files import atomic_path, read_bytes
from lambent.core.frames import Floats
from lambent.materials.measured.gonio import FORMAT, PHI_I_RANGE_DEG, GonioTable, Sheet, Symmetry

NAME = FORMAT
LIMIT_BYTES = 1 << 30
ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
Quantity = Literal["f", "f_cos", "p"]
QUANTITIES: tuple[Quantity, ...] = ("f", "f_cos", "p")
_HEADER_BYTES = 1 << 16
_DECIMALS = 5  # of the angles in degrees: closer directions are the same
_NOT_MEASURED = -1.0


def recognise(head: bytes, size: int) -> bool:
    """Whether the first line that is no comment names the four angles."""
    names = _names(head)
    return names is not None and tuple(names[:4]) == ANGLES


def _names(head: bytes) -> list[str] | None:
    for line in head.removeprefix(codecs.BOM_UTF8).splitlines():
        text = line.split(b"#")[0].strip()
        if text:
            return re.split(r"[\s,;]+", text.decode("utf-8", "replace").strip(",;"))
    return None


def read(path: Path) -> GonioTable:
    """The table of a gonio text file.

    Raises
    ------
    UserError
        Where a column or the symmetry is unknown, a row is broken, the directions do not form grids, or an incident
        direction has no measured value.
    """
    content = read_bytes(path, LIMIT_BYTES).removeprefix(codecs.BOM_UTF8)
    content = content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    names = _names(content[:_HEADER_BYTES])
    if names is None or tuple(names[:4]) != ANGLES:
        raise UserError("first line that is no comment must name the columns", file=path, expected=" ".join(ANGLES))
    quantity = _quantity(names[4:], path)
    rows = _rows(content, len(names), path)
    values = np.where(rows[:, 4:] == _NOT_MEASURED, np.nan, rows[:, 4:])
    if quantity != "f":
        cos_o = np.abs(np.cos(np.radians(rows[:, 2:3])))
        values = np.divide(values, cos_o, out=np.full_like(values, np.nan), where=cos_o > 1e-6)
    keys = _keys(content[:_HEADER_BYTES])
    return _table(rows[:, :4], values, quantity, keys, path)


def _quantity(columns: list[str], path: Path) -> Quantity:
    for quantity in QUANTITIES:
        if columns in ([quantity], [f"{quantity}_{c}" for c in "rgb"]):
            return quantity
    known = [*QUANTITIES, *(f"{quantity}_r {quantity}_g {quantity}_b" for quantity in QUANTITIES)]
    got = " ".join(columns) or "none"
    raise UserError("value columns do not say what they hold", file=path, got=got, expected=f"one of: {known}")


def _rows(content: bytes, columns: int, path: Path) -> Floats:
    """(N, columns) numbers below the line of names; infinities become NaN."""
    lines = io.BytesIO(content)
    line = next(line for line in lines if line.split(b"#")[0].strip())
    start = lines.tell()
    if not re.search(rb"^[^\S\n]*[^#\s]", content[start:], re.MULTILINE):
        raise UserError("holds no rows", file=path)
    text = io.TextIOWrapper(lines, encoding="utf-8")
    delimiter = next((mark for mark in (",", ";") if mark.encode() in line), None)
    try:
        rows = np.loadtxt(text, delimiter=delimiter, ndmin=2)
    except ValueError as error:
        raise UserError(f"a row is broken ({str(error).splitlines()[0]})", file=path) from error
    if rows.shape[1] != columns:
        raise UserError(
            "a row has another number of columns than names", file=path, got=rows.shape[1], expected=columns
        )
    if not np.isfinite(rows[:, :4]).all() or (rows[:, [0, 2]] < 0).any() or (rows[:, 0] >= 90).any():
        raise UserError("an angle is outside its range", file=path, expected="theta_i in [0, 90), theta_o in [0, 180]")
    if (rows[:, 2] > 180).any() or (np.abs(rows[:, [1, 3]]) > 3600).any():
        raise UserError("an angle is outside its range", file=path, expected="degrees, theta_o in [0, 180]")
    rows[np.isinf(rows)] = np.nan
    return rows


def _keys(head: bytes) -> dict[str, str]:
    """The `# key: value` comments."""
    found = re.findall(rb"^#[^\S\n]*(\w+):[^\S\n]*(\S[^\n]*?)\s*$", head, re.MULTILINE)
    return {key.decode(): value.decode("utf-8", "replace") for key, value in found}


def _symmetry(keys: dict[str, str], phi_i_deg: Floats, path: Path) -> tuple[Symmetry, tuple[str, ...]]:
    """The symmetry named, or else the one that the phi_i span, with a note that says so."""
    span = phi_i_deg[-1] - phi_i_deg[0]
    if "symmetry" not in keys:
        spanned: Symmetry = next(name for name, whole in PHI_I_RANGE_DEG.items() if span <= whole)
        return spanned, (f"symmetry not stated, taken as {spanned} from phi_i",)
    named = keys["symmetry"]
    if named not in PHI_I_RANGE_DEG:
        hint = did_you_mean(named, PHI_I_RANGE_DEG)
        known = ", ".join(PHI_I_RANGE_DEG)
        raise UserError("unknown symmetry", file=path, field="symmetry", got=named, expected=known, hint=hint)
    symmetry = named
    if span > PHI_I_RANGE_DEG[symmetry]:
        got = f"phi_i from {phi_i_deg[0]:g} to {phi_i_deg[-1]:g}"
        expected = f"a span of at most {PHI_I_RANGE_DEG[symmetry]:g} degrees"
        raise UserError("phi_i spans more than the symmetry", file=path, field=symmetry, got=got, expected=expected)
    return symmetry, ()


def _table(angles_deg: Floats, f: Floats, quantity: Quantity, keys: dict[str, str], path: Path) -> GonioTable:
    angles = np.round(angles_deg, _DECIMALS)
    theta_i, phi_i = np.unique(angles[:, 0]), np.unique(angles[:, 1])
    symmetry, notes = _symmetry(keys, phi_i, path)
    if symmetry == "isotropic":
        angles[:, 3] -= phi_i[0]
        phi_i = np.zeros(1)
    far = angles[:, 2] > 90
    angles[far, 2] = np.round(180 - angles[far, 2], _DECIMALS)
    angles[:, 3] = np.round(angles[:, 3] % 360, _DECIMALS) % 360
    incident = np.searchsorted(theta_i, angles[:, 0]) * len(phi_i)
    incident += np.searchsorted(phi_i, angles[:, 1]) if len(phi_i) > 1 else 0
    sides: list[tuple[tuple[Sheet, ...], ...]] = []
    for side in (~far, far):
        order = np.flatnonzero(side)
        order = order[np.lexsort((angles[order, 3], angles[order, 2], incident[order]))]
        found, starts = np.unique(incident[order], return_index=True)
        if len(found) == 0:
            sides.append(())
            continue
        if len(found) != len(theta_i) * len(phi_i):
            expected = f"{len(theta_i)} theta_i x {len(phi_i)} phi_i, on either side the same"
            raise UserError("incident directions do not form a grid", file=path, got=len(found), expected=expected)
        parts = [_sheet(angles[rows], f[rows], symmetry, path) for rows in np.split(order, starts[1:])]
        sides.append(tuple(tuple(parts[k : k + len(phi_i)]) for k in range(0, len(parts), len(phi_i))))
    return GonioTable(
        name=keys.get("name", Path(path).stem),
        file=Path(path).name,
        theta_i_deg=theta_i,
        phi_i_deg=phi_i,
        reflected=sides[0],
        transmitted=sides[1],
        symmetry=symmetry,
        stored=quantity,
        notes=notes,
    )


def _sheet(angles_deg: Floats, f: Floats, symmetry: Symmetry, path: Path) -> Sheet:
    """The sorted rows of one incident direction and side as a grid."""
    theta, phi = np.unique(angles_deg[:, 2]), np.unique(angles_deg[:, 3])
    where = f"theta_i {angles_deg[0, 0]:g}, phi_i {angles_deg[0, 1]:g}"
    if len(angles_deg) != len(theta) * len(phi):
        got = f"{len(angles_deg)} rows of {len(theta)} theta_o and {len(phi)} phi_o"
        raise UserError("outgoing directions do not form a grid", file=path, field=where, got=got)
    grid = angles_deg.reshape(len(theta), len(phi), 4)
    if (grid[..., 2] != theta[:, None]).any() or (grid[..., 3] != phi).any():
        raise UserError("outgoing directions do not form a grid", file=path, field=where, got="a direction twice")
    values = f.reshape(len(theta), len(phi), -1)
    if not np.isfinite(values).all(axis=-1).any():
        raise UserError("no value was measured for an incident direction", file=path, field=where)
    if symmetry == "isotropic" and len(phi) > 1 and phi[-1] <= 180:
        inner = (phi > 0) & (phi < 180)  # half a turn measured: the other half mirrors it
        phi = np.concatenate([phi, 360 - phi[inner][::-1]])
        values = np.concatenate([values, values[:, inner][:, ::-1]], axis=1)
    return Sheet(theta, phi, values)


def write_gonio(path: Path, table: GonioTable, quantity: Quantity = "p") -> None:
    """Write `table` as gonio text with the quantity asked for, atomically; six significant digits of the values.

    Parameters
    ----------
    path : Path
    table : GonioTable
    quantity : {"f", "f_cos", "p"}
        f_cos and p both hold f |cos theta_o|, in 1/sr.
    """
    channels = ("",) if table.info.channels == 1 else ("_r", "_g", "_b")
    names = " ".join([*ANGLES, *(quantity + channel for channel in channels)])
    formats = ["%.8g"] * len(ANGLES) + ["%.6g"] * len(channels)
    with atomic_path(Path(path)) as beside, beside.open("w", encoding="utf-8") as file:
        file.write(f"# name: {table.name}\n# symmetry: {table.symmetry}\n{names}\n")
        for sheets, far in ((table.reflected, False), (table.transmitted, True)):
            for theta_i, row in zip(table.theta_i_deg, sheets, strict=False):
                for phi_i, sheet in zip(table.phi_i_deg, row, strict=True):
                    np.savetxt(file, _columns(theta_i, phi_i, sheet, far, quantity), fmt=formats)


def _columns(theta_i_deg: float, phi_i_deg: float, sheet: Sheet, far: bool, quantity: Quantity) -> Floats:
    theta, phi = (a.ravel() for a in np.meshgrid(sheet.theta_deg, sheet.phi_deg, indexing="ij"))
    values = sheet.f.reshape(len(theta), -1)
    if quantity != "f":
        values = values * np.cos(np.radians(theta))[:, None]
    fixed = np.broadcast_to((theta_i_deg, phi_i_deg), (len(theta), 2))
    return np.column_stack([fixed, 180 - theta if far else theta, phi, values])
