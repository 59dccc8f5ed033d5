"""Plain columns from other programs: angles and values, below a line of names in one of many conventions.

    # measured 2025-03-04
    theta_in, phi_in, theta_out, phi_out, BRDF
    30, 0, 10, 180, 0.041

The line of names may be a comment. Angles are in degrees unless a name says (rad). A file that does not name its
quantity is refused, because f and f cos theta_o look alike. Lambent's own stricter format is in gonio_text.py.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats, direction
from lambent.core.errors import UserError
from lambent.core.plain import is_number
from lambent.materials.measured import gonio_text
from lambent.materials.measured.gonio_rows import LONGEST_NAME, check_angles, quantity_of, table_of, to_f
from lambent.materials.measured.protocol import MeasuredTable, Quantity
from lambent.materials.measured.scattered import ScatteredTable
from lambent.materials.measured.spectral import rgb_of_measured, rgb_of_xyz
from lambent.materials.measured.table import isotropic_brdf, require_values, sensible, unmarked, usable_values
from lambent.materials.measured.text_numbers import (
    head_text,
    numbers,
    read_text,
    refuse_decimal_commas,
    shown,
    without_comments,
)

NAME = "plain columns"
HINT_QUANTITY = "name the columns in the first line: theta_i phi_i theta_o phi_o, then f, f_cos or p"
_OUT = ("o", "out", "s", "r", "scat", "refl", "v", "view", "e")
_IN = ("i", "in", "inc", "l", "light", "incident")
_WAVELENGTH = re.compile(r"(\d+(?:\.\d+)?)_?nm$", re.IGNORECASE)
_SEPARATORS = re.compile(r"[\s,;]+")
_BEFORE_UNIT = re.compile(r"\s+(?=[(\[])")  # "theta_i (deg)" is one name
_LEAST_NUMBERS = 5
_SCATTERED = 4  # fewer outgoing directions per incident one do not form a grid


@dataclass(frozen=True)
class Layout:
    """Contents of the columns.

    Attributes
    ----------
    angles : dict of int
        theta_i, phi_i, theta_o, phi_o or dphi -> column.
    values : tuple of int
        The value columns.
    quantity : {"f", "f_cos", "p"}, optional
        None if no name gives it.
    kind : str
        grey, rgb, xyz or spectra.
    wavelengths_nm : tuple of float
        Of spectra.
    """

    angles: dict[str, int]
    values: tuple[int, ...]
    quantity: Quantity | None
    kind: str
    wavelengths_nm: tuple[float, ...] = ()
    radians: bool = False


def recognise(head: bytes, size: int) -> bool:
    """Whether the first line names angles and values, or the first two have equally many numbers, at least five."""
    text = head_text(head)
    if text is None or gonio_text.recognise(head, size):
        return False
    names, body = _split(text)
    if names is not None:
        return True
    first = [_SEPARATORS.split(line.strip()) for line in shown(body[: 1 << 12]).split("\n")]
    first = [words for words in first if words != [""]][:2]
    same = len({len(words) for words in first}) == 1 and len(first[0]) >= _LEAST_NUMBERS
    return same and all(is_number(word) for words in first for word in words)


def read(path: Path) -> MeasuredTable:
    """The table of a file of columns.

    Raises
    ------
    UserError
        No name gives the quantity of the values, a row is broken, an angle is outside its range, or the incident
        directions neither form a grid nor are scattered.
    """
    names, body = _split(read_text(path))
    if names is None:
        refuse_decimal_commas(body, path)
        first = shown(body.strip().split(b"\n")[0])
        got = f"{len(_SEPARATORS.split(first.strip()))} columns without names"
        raise UserError("the columns have no names", file=path, got=got, hint=HINT_QUANTITY)
    layout = layout_of(names, path)
    if layout.quantity is None:
        got = ", ".join(names[column] for column in layout.values)
        raise UserError("quantity of the value columns is not stated", file=path, got=got, hint=HINT_QUANTITY)
    rows = rows_of(body, len(names), path)
    notes = ("angles are in radians",) if layout.radians else ()
    return assemble(rows, layout, 0.0, path, NAME, Path(path).stem, notes)


def _split(text: bytes) -> tuple[list[str] | None, bytes]:
    """The column names, if a line gives them, and the rows below."""
    named: list[str] | None = None
    at = 0
    while at < len(text):
        end = text.find(b"\n", at)
        end = len(text) if end < 0 else end
        line = text[at:end].strip()
        comment = line.startswith((b"#", b"%", b"//"))
        if line:
            words = _SEPARATORS.split(_BEFORE_UNIT.sub("", shown(line.lstrip(b"#%/")).strip(" \t,;")))
            angles = {_angle(word) for word in words}
            if {"theta_i", "theta_o"} <= angles and len(words) > 2:
                named = words
            if not comment:
                is_names = named is words
                return named, without_comments(text[end + 1 if is_names else at :])
        at = end + 1
    return None, b""


def layout_of(names: list[str], path: Path) -> Layout:
    """The contents of columns with these names.

    Raises
    ------
    UserError
        If an angle is missing or named twice, or a value column is unknown.
    """
    angles: dict[str, int] = {}
    for column, name in enumerate(names):
        angle = _angle(name)
        if angle is not None and angles.setdefault(angle, column) != column:
            raise UserError("two columns hold the same angle", file=path, field=name)
    for needed in ("theta_i", "theta_o"):
        if needed not in angles:
            raise UserError("a column is missing", file=path, field=needed, got=" ".join(names))
    radians = any("rad" in re.split(r"[^a-z]+", names[column].lower()) for column in angles.values())
    columns = tuple(column for column in range(len(names)) if column not in angles.values())
    words = [names[column].lower() for column in columns]
    nm = [_WAVELENGTH.search(word) for word in words]
    if len(words) > 1 and all(nm):
        wavelengths = tuple(float(found[1]) for found in nm if found)
        return Layout(angles, columns, quantity_of(_WAVELENGTH.sub("", words[0])), "spectra", wavelengths, radians)
    if len(words) == 1:
        return Layout(angles, columns, quantity_of(words[0]), "grey", (), radians)
    for kind in ("rgb", "xyz"):
        named = [re.fullmatch(rf"(?:(.*)_)?{channel}", word) for word, channel in zip(words, kind, strict=False)]
        stems = {found[1] or "" for found in named if found}
        if len(words) == 3 and all(named) and len(stems) == 1:
            return Layout(angles, columns, quantity_of(stems.pop()), kind, (), radians)
    expected = "one column, three (r g b or x y z), or one per wavelength (such as 550nm)"
    raise UserError("unknown value columns", file=path, got=" ".join(words) or "none", expected=expected)


def _angle(name: str) -> str | None:
    """theta_i, phi_i, theta_o, phi_o or dphi, if `name` is a common name for it."""
    if len(name) > LONGEST_NAME:
        return None
    word = re.sub(r"\(.*?\)|\[.*?\]|_?(?:deg|rad)$", "", name.lower()).replace("-", "_").strip("_")
    if word in ("dphi", "delta_phi", "phi_diff", "deltaphi"):
        return "dphi"
    found = re.fullmatch(r"(theta|phi)_?([a-z]+)", word)
    if found is None:
        return None
    side = "i" if found[2] in _IN else "o" if found[2] in _OUT else None
    return f"{found[1]}_{side}" if side else None


def rows_of(body: bytes, columns: int, path: Path) -> Floats:
    """(N, columns) numbers, separated by blanks, commas or semicolons.

    Raises
    ------
    UserError
        If there are no rows, a row has another number of values, or numbers have decimal commas.
    """
    refuse_decimal_commas(body, path)
    flat = numbers(re.sub(rb"[,;]", b" ", body), path)
    lines = sum(1 for line in body.split(b"\n") if line.strip(b" \t,;"))
    if lines == 0:
        raise UserError("has no rows", file=path)
    if len(flat) != lines * columns:
        got = f"{len(flat)} numbers in {lines} rows"
        raise UserError("a row does not have one value per column name", file=path, got=got, expected=columns)
    return flat.reshape(-1, columns)


def assemble(
    rows: Floats,
    layout: Layout,
    phi_i_deg: float,
    path: Path,
    reader: str,
    name: str,
    notes: tuple[str, ...],
    *,
    gridded: bool = True,
) -> MeasuredTable:
    """A gonio table if the incident directions form a grid, else a scattered one.

    Parameters
    ----------
    phi_i_deg : float
        Used if no column has phi_i. A theta_o without a phi_o is in the plane of incidence, positive ahead of the
        normal, in the mirror direction.
    gridded : bool
        False for a format without columns for the light, where a grid would be coincidence.
    """
    angles = _degrees(rows, layout, phi_i_deg)
    check_angles(angles, path)
    if not layout.radians and angles[:, 2].max(initial=0.0) <= np.pi / 2 and angles[:, 2].max(initial=0.0) > 0.5:
        raise UserError(
            "angles seem to be radians", file=path, got=f"theta_o up to {angles[:, 2].max():.3g}",
            hint="add (rad) to the names of their columns",
        )  # fmt: skip
    f, said = _values(rows[:, list(layout.values)], layout)
    f = to_f(f, layout.quantity or "f", angles[:, 2])
    require_values(f, usable_values(f), path)
    if "phi_i" not in layout.angles:
        notes += (f"phi_i not stated, taken as {phi_i_deg:g}",)
    incident = np.unique(np.round(angles[:, :2], 5), axis=0)
    few = len(incident) * _SCATTERED > len(rows)
    if (few or not gridded) and not (angles[:, 2] > 90).any():
        notes += ("incident directions form no grid: the material is taken as isotropic",)
        wi, wo = (direction(*np.radians(angles[:, k : k + 2].T)) for k in (0, 2))
        if f.shape[1] == 1:
            f = np.repeat(f, 3, axis=1)
        info = isotropic_brdf(path, reader, {"samples": len(rows)}, notes + said)
        return ScatteredTable(wi, wo, f, info)
    return table_of(angles, f, path, reader, name, stored=layout.quantity or "f", notes=notes + said)


def _degrees(rows: Floats, layout: Layout, phi_i_deg: float) -> Floats:
    """(N, 4) theta_i, phi_i, theta_o, phi_o."""
    unit = 180 / np.pi if layout.radians else 1.0
    with np.errstate(over="ignore"):
        given = {name: rows[:, column] * unit for name, column in layout.angles.items()}
    theta_i, theta_o = given["theta_i"], given["theta_o"]
    phi_i = given.get("phi_i", np.full(len(rows), phi_i_deg))
    phi_o = phi_i + given["dphi"] if "dphi" in given else given.get("phi_o", phi_i + 180)
    behind = theta_o < 0
    return np.stack([theta_i, phi_i, np.abs(theta_o), phi_o + np.where(behind, 180, 0)], axis=1)


def _values(values: Floats, layout: Layout) -> tuple[Floats, tuple[str, ...]]:
    """(N, 1 or 3) grey or linear RGB; NaN if not finite or marked as not measured."""
    values = unmarked(np.where(np.isfinite(values), values, np.nan))
    if layout.kind == "xyz":
        return rgb_of_xyz(values)
    if layout.kind == "spectra":
        order = np.argsort(layout.wavelengths_nm, kind="stable")
        return rgb_of_measured(values[:, order], sensible(values), np.array(layout.wavelengths_nm)[order])
    return values, ()
