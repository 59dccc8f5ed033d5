"""One reader for texts of columns: angles and values below a line of names.

    # name: rough copper
    # symmetry: isotropic
    theta_i phi_i theta_o phi_o p_r p_g p_b
    5 0 0 0 0.0213 0.0175 0.0141

`FORMATS` describes each format: where it has its names and its keys, the unit of its angles, the azimuth of the light
and the quantity that is meant where nothing states them.

- Gonio text is Lambent's own (docs/formats.md), with `# key: value` comments, and that of other programs, whose names
  have many spellings and may be a comment. A file that does not name its quantity is refused, because f and f cos
  theta_o look alike.
- ASTM E1392-96 (angle resolved optical scatter) has keywords in capitals, then VARS with the names. The reader follows
  the files in circulation (Cornell's .astm, and those libbsdf and ALTA read): values are the BRDF unless the name says
  cosine-corrected (CCBRDF, f_cos). The standard does not fix the unit of the angles: they are radians if no theta
  exceeds pi/2. Without a column for phi_i it is 180 degrees, so that phi_s = 0 lies ahead, in the mirror direction.
- Cornell gonioreflectometer text, as pbrt-v2 reads it, names nothing: the number of wavelengths, these in nm, then per
  measurement the four angles in radians and f of an isotropic BRDF per wavelength. Rows may be wrapped.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lambent.core.ceilings import CORNELL_BYTES, MEASURED_BYTES, WAVELENGTHS
from lambent.core.errors import UserError
from lambent.core.geometry.directions import Floats, direction
from lambent.materials.measured.parts.gonio_rows import LONGEST_NAME, check_angles, quantity_of, table_of, to_f
from lambent.materials.measured.parts.spectral import rgb_of_measured, rgb_of_xyz
from lambent.materials.measured.parts.text_numbers import (
    HINT_PERCENT,
    HINT_QUANTITY,
    HINT_SPECTRAL,
    head_text,
    read_text,
    shown,
    without_comments,
)
from lambent.materials.measured.parts.text_rows import rows_of
from lambent.materials.measured.protocol import MeasuredTable, Quantity
from lambent.materials.measured.tables.gonio import FORMAT
from lambent.materials.measured.tables.scattered import ScatteredTable
from lambent.materials.measured.tables.table import isotropic_brdf, require_values, sensible, unmarked, usable_values

_OWN = re.compile(r"theta_i phi_i theta_o phi_o (?:(?:f|f_cos|p)|(f|f_cos|p)_r \1_g \1_b)")  # surely degrees on a grid
_OUT = ("o", "out", "s", "r", "scat", "refl", "v", "view", "e")
_IN = ("i", "in", "inc", "l", "light", "incident")
_WAVELENGTH = re.compile(r"[(\[@]?(\d+\.?\d*)_?nm[)\]]?$", re.IGNORECASE)
_ANGLES = re.compile(r"(theta|zenith|phi|azimuth|az|elevation|elev|el)_?([a-z]+)")
_LIKE = {"zenith": "theta", "azimuth": "phi", "az": "phi"} | dict.fromkeys(("elevation", "elev", "el"), "theta")
_SEPARATORS = re.compile(r"[\s,;]+")
_BEFORE_UNIT = re.compile(r"(?<!\s)\s+(?=[(\[])")  # "theta_i (deg)" is one name
_OTHER_COMMENTS = re.compile(rb"^[ \t]*(?:%|//)[^\n]*", re.MULTILINE)
_COMMENT_KEY = re.compile(rb"^#[^\S\n]*(\w+):[^\S\n]*(\S[^\n]*)", re.MULTILINE)
_VARS = re.compile(rb"^[ \t]*VARS[ \t=:]+([^\n]*)\n?", re.MULTILINE | re.IGNORECASE)
_KEYWORD = re.compile(rb"^[ \t]*([A-Z][A-Z0-9_]*)(?:[ \t]*[=:])?[ \t]+(\S[^\n]*)", re.MULTILINE)
_HEAD_BYTES = 1 << 16  # of a file, in which keys are sought
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
    phi_i_deg : float
        Used if no column has phi_i. A theta_o without a phi_o is in the plane of incidence, positive ahead of the
        normal, in the mirror direction.
    symmetry : str, optional
        As the file names it.
    gridded : bool, optional
        Whether the incident directions form a grid; None if the rows decide.
    raised : tuple of str
        theta_i and theta_o, where a column has the elevation above the surface.
    """

    angles: dict[str, int]
    values: tuple[int, ...]
    quantity: Quantity | None
    kind: str
    wavelengths_nm: tuple[float, ...] = ()
    radians: bool = False
    phi_i_deg: float = 0.0
    symmetry: str | None = None
    gridded: bool | None = None
    raised: tuple[str, ...] = ()

    @classmethod
    def absolute(cls, quantity: Quantity, kind: str, values: int, wavelengths_nm: tuple[float, ...] = ()) -> Layout:
        """The layout of theta_i, phi_i, theta_o and phi_o in degrees, then this many values."""
        places = {"theta_i": 0, "phi_i": 1, "theta_o": 2, "phi_o": 3}
        return cls(places, tuple(range(4, 4 + values)), quantity, kind, wavelengths_nm)


@dataclass(frozen=True)
class Heading:
    """Names of the columns, keys and their values, and the text of the rows below."""

    names: list[str]
    keys: dict[str, str]
    body: bytes


@dataclass(frozen=True)
class ColumnText:
    """Description of a format, and its reader.

    Attributes
    ----------
    heading : callable
        The heading of a text, or None if no line names the angles.
    name_key, count_key : str
        Keys of the specimen's name and of the number of rows.
    phi_i_deg : float
        See `Layout`.
    quantity : {"f"}, optional
        Where no name gives it; without one, such a file is refused.
    unit_by_range : bool
        Whether angles are radians if no theta exceeds pi/2.
    scattered : bool
        Whether incident directions form no grid.
    wrapped : bool
        Whether a row may end on another line.
    """

    NAME: str
    heading: Callable[[bytes], Heading | None]
    name_key: str
    count_key: str = ""
    phi_i_deg: float = 0.0
    quantity: Quantity | None = None
    unit_by_range: bool = False
    scattered: bool = False
    wrapped: bool = False
    limit_bytes: int = MEASURED_BYTES

    def recognise(self, head: bytes, size: int) -> bool:
        """Whether the head of a file names the angles."""
        text = head_text(head)
        return text is not None and self.heading(text) is not None

    def read(self, path: Path) -> MeasuredTable:
        """The table of a file.

        Raises
        ------
        UserError
            A column is unknown, no name gives the quantity of the values, a row is broken, an angle is outside its
            range, or the incident directions neither form a grid nor are scattered.
        """
        text = read_text(path, self.limit_bytes)
        heading = self.heading(text)
        if heading is None:
            raise UserError("the columns have no names", file=path, hint=HINT_QUANTITY)
        layout = layout_of(heading.names, path)
        quantity = layout.quantity or self.quantity
        if quantity is None:
            got = ", ".join(heading.names[column] for column in layout.values)
            hint = HINT_SPECTRAL if layout.wavelengths_nm else HINT_QUANTITY
            raise UserError("quantity of the value columns is not stated", file=path, got=got, hint=hint)
        above = text.count(b"\n") - heading.body.count(b"\n")
        rows, said = rows_of(heading.body, len(heading.names), path, above, wrapped=self.wrapped)
        stated = heading.keys.get(self.count_key)
        if stated is not None and stated.split()[0] != str(len(rows)):
            expected = f"{len(rows)}, the number of rows"
            raise UserError("wrong number of tuples", file=path, field=self.count_key, got=stated, expected=expected)
        radians, notes = layout.radians, ("angles are in radians",) if layout.radians else ()
        if self.unit_by_range:
            theta = np.abs(rows[:, [layout.angles["theta_i"], layout.angles["theta_o"]]])
            radians |= bool(theta[np.isfinite(theta)].max(initial=0.0) <= np.pi / 2 + 1e-3)
            notes = (f"angles are taken as {'radians' if radians else 'degrees'}, by their range",)
        name = heading.keys.get(self.name_key, "").strip("\"' ") or Path(path).stem
        symmetry, own = heading.keys.get("symmetry"), _OWN.fullmatch(" ".join(heading.names)) is not None
        gridded = False if self.scattered else own or None
        layout = replace(layout, quantity=quantity, radians=radians, phi_i_deg=self.phi_i_deg)
        return assemble(rows, replace(layout, symmetry=symmetry, gridded=gridded), path, self.NAME, name, notes + said)


def _of_gonio_text(text: bytes) -> Heading | None:
    """The last names before the rows, in a comment or not; None without any."""
    keys = {key.decode(): shown(value.rstrip()) for key, value in _COMMENT_KEY.findall(text[:_HEAD_BYTES])}
    named: list[str] | None = None
    at = 0
    while at < len(text):
        end = text.find(b"\n", at)
        end = len(text) if end < 0 else end
        line = text[at:end].strip()
        comment = line.startswith((b"#", b"%", b"//"))
        if line:
            line = line.lstrip(b"#%/") if comment else line.split(b"#")[0]
            words = _SEPARATORS.split(_BEFORE_UNIT.sub("", shown(line).strip(" \t,;")))
            if {"theta_i", "theta_o"} <= {_angle(word) for word in words} and len(words) > 2:
                named = words
            if not comment:
                body = without_comments(text[end + 1 if named is words else at :])
                body = _OTHER_COMMENTS.sub(b"", body) if b"%" in body or b"//" in body else body
                return Heading(named, keys, body) if named else None
        at = end + 1
    return None


def _of_astm(text: bytes) -> Heading | None:
    """The names in a line VARS; None without one."""
    text = without_comments(text)
    names = (b"theta_?i", b"theta_?s")
    lines = _VARS.finditer(text)
    found = next((line for line in lines if all(re.search(n, line[1], re.IGNORECASE) for n in names)), None)
    if found is None:
        return None
    keys = {key.decode(): shown(value.rstrip()) for key, value in _KEYWORD.findall(text[: found.start()])}
    return Heading([name for name in _SEPARATORS.split(shown(found[1])) if name], keys, text[found.end() :])


def _of_cornell(text: bytes) -> Heading | None:
    """The wavelengths as names of columns; None unless the first number counts them and they are those of light."""
    text = without_comments(text)
    try:
        count, *some = (float(word) for word in text.split(maxsplit=4)[:4])
    except ValueError:
        return None
    if not (some and 1 <= count <= WAVELENGTHS.most and count.is_integer()):
        return None
    some = some[: int(count)]
    found = re.match(rb"(?:\s*+\S++){%d}" % (1 + int(count)), text)
    if found is None or some != sorted(set(some)) or not all(100 <= wavelength <= 5000 for wavelength in some):
        return None
    angles = [f"{name}(rad)" for name in ("theta_i", "phi_i", "theta_o", "phi_o")]
    return Heading([*angles, *(f"{word}nm" for word in shown(found[0]).split()[1:])], {}, text[found.end() :])


FORMATS = (
    ColumnText("ASTM E1392", _of_astm, "SAMPLE_NAME", "NUM_POINTS", 180.0, "f", unit_by_range=True),
    ColumnText(FORMAT, _of_gonio_text, "name"),
    ColumnText(
        "Cornell / pbrt-v2 text", _of_cornell, "", quantity="f", scattered=True, wrapped=True, limit_bytes=CORNELL_BYTES
    ),
)


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
    raised = tuple(name for name, column in angles.items() if names[column].lower().startswith("el"))
    words = [names[column].lower() for column in columns]
    if percent := [word for word in words if "%" in word or "percent" in word]:
        raise UserError("values are in percent", file=path, field=percent[0], expected="1/sr", hint=HINT_PERCENT)
    nm = [_WAVELENGTH.search(word) if len(word) <= LONGEST_NAME else None for word in words]
    wavelengths = tuple(float(found[1]) for found in nm if found)
    if words and all(nm):
        kind = "spectra" if len(words) > 1 else "grey"
        quantity = quantity_of(_WAVELENGTH.sub("", words[0]))
        return Layout(angles, columns, quantity, kind, wavelengths, radians, raised=raised)
    if len(words) == 1:
        return Layout(angles, columns, quantity_of(words[0]), "grey", (), radians, raised=raised)
    for kind in ("rgb", "xyz"):
        named = [re.fullmatch(rf"(?:(.*)_)?{channel}", word) for word, channel in zip(words, kind, strict=False)]
        stems = {found[1] or "" for found in named if found}
        if len(words) == 3 and all(named) and len(stems) == 1:
            return Layout(angles, columns, quantity_of(stems.pop()), kind, (), radians, raised=raised)
    expected = "one column, three (r g b or x y z), or one per wavelength (such as 550nm)"
    raise UserError("unknown value columns", file=path, got=" ".join(words) or "none", expected=expected)


def _angle(name: str) -> str | None:
    """theta_i, phi_i, theta_o, phi_o or dphi, if `name` is a common name for it."""
    if len(name) > LONGEST_NAME:
        return None
    word = re.sub(r"\(.*?\)|\[.*?\]|_?(?:deg|rad)$", "", name.lower()).replace("-", "_").strip("_")
    if word in ("dphi", "delta_phi", "phi_diff", "deltaphi"):
        return "dphi"
    if word == "aoi":
        return "theta_i"
    found = _ANGLES.fullmatch(word)
    if found is None:
        return None
    side = "i" if found[2] in _IN else "o" if found[2] in _OUT else None
    return f"{_LIKE.get(found[1], found[1])}_{side}" if side else None


def assemble(
    rows: Floats, layout: Layout, path: Path, reader: str, name: str, notes: tuple[str, ...] = ()
) -> MeasuredTable:
    """A gonio table if the incident directions form a grid, else a scattered one."""
    angles = _degrees(rows, layout)
    check_angles(angles, path)
    theta_o = angles[:, 2].max(initial=0.0)
    if not (layout.radians or layout.gridded) and 0.5 < theta_o <= np.pi / 2:
        got, hint = f"theta_o up to {theta_o:.3g}", "add (rad) to the names of their columns"
        raise UserError("angles seem to be radians", file=path, got=got, hint=hint)
    f, said = _values(rows[:, list(layout.values)], layout)
    f = to_f(f, layout.quantity or "f", angles[:, 2])
    require_values(f, usable_values(f), path)
    if layout.raised:
        notes += ("elevations count from the surface: theta is 90 degrees less the elevation",)
    if layout.kind == "grey" and layout.wavelengths_nm:
        notes += (f"measured at {layout.wavelengths_nm[0]:g} nm alone: taken as grey",)
    if "phi_i" not in layout.angles:
        notes += (f"phi_i not stated, taken as {layout.phi_i_deg:g}",)
    gridded = layout.gridded
    if gridded is None:
        gridded = len(np.unique(np.round(angles[:, :2], 5), axis=0)) * _SCATTERED <= len(rows)
    if gridded or (angles[:, 2] > 90).any():
        stored = layout.quantity or "f"
        return table_of(angles, f, path, reader, name, stored=stored, named=layout.symmetry, notes=notes + said)
    notes += ("incident directions form no grid: the material is taken as isotropic",)
    wi, wo = (direction(*np.radians(angles[:, k : k + 2].T)) for k in (0, 2))
    info = isotropic_brdf(path, reader, {"samples": len(rows)}, notes + said)
    return ScatteredTable(wi, wo, np.repeat(f, 3, axis=1) if f.shape[1] == 1 else f, info)


def _degrees(rows: Floats, layout: Layout) -> Floats:
    """(N, 4) theta_i, phi_i, theta_o, phi_o."""
    unit = 180 / np.pi if layout.radians else 1.0
    with np.errstate(over="ignore"):
        given = {name: rows[:, column] * unit for name, column in layout.angles.items()}
    given |= {name: 90 - given[name] for name in layout.raised}
    theta_i, theta_o = given["theta_i"], given["theta_o"]
    phi_i = given.get("phi_i", np.full(len(rows), layout.phi_i_deg))
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
