"""pab-opto text, the format of Mountain, the program of pab's goniophotometers (pg2); one file per incident direction.

    #sample_name "blind 45"
    #incident_angle 60 180
    #format: theta phi DSF
    84.968 125.790 0.009744

Header lines begin with `#`, in any order: `format` (BSDF, BRDF or BTDF: f; DSF: f |cos theta_o|), the direction of
the light as `intheta` and `inphi` or as `incident_angle`, `upphi` (default 0) and `colorimetry` (CIE-Y or CIE-XYZ).
Then a measurement per line: theta, phi and one value or three, in degrees and 1/sr. Both directions point away from
the specimen; theta over 90 is its back. Conventions are those of Radiance's pabopto2bsdf (man page and source): phi is
turned so that `upphi` becomes 90, and incident directions that span half a turn stand for their mirror images.

Files of one specimen may be joined into one (`cat *.txt`) to make one table: every header with an incident direction
starts a new one.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.plain import is_number
from lambent.materials.measured.parts.gonio_rows import check_angles, table_of, to_f
from lambent.materials.measured.parts.spectral import rgb_of_xyz
from lambent.materials.measured.parts.text_numbers import head_text, numbers, read_text, refuse_decimal_commas, shown
from lambent.materials.measured.protocol import Quantity
from lambent.materials.measured.tables.gonio import GonioTable

NAME = "pab-opto text"
_FORMAT = re.compile(rb"^#[ \t]*format:[ \t]*theta[ \t]+phi[ \t]+\S", re.MULTILINE | re.IGNORECASE)
_INCIDENT = re.compile(rb"^#[ \t]*(?:intheta|incident_angle)[ \t]+[-+.\d]", re.MULTILINE | re.IGNORECASE)
_KEY = re.compile(
    r"^\s*#\s*(sample_name|format:|intheta|inphi|incident_angle|upphi|colorimetry:)[ \t]+(.*?)[ \t]*$",
    re.MULTILINE | re.IGNORECASE,
)
_COMMENTS = re.compile(rb"^(?:[ \t]*#[^\n]*(?:\n|\Z))+", re.MULTILINE)
_LINE = re.compile(rb"^[^\n]*\S", re.MULTILINE)
_QUANTITIES: dict[str, Quantity] = {"bsdf": "f", "brdf": "f", "btdf": "f", "dsf": "f_cos"}
_VALUES = {"cie-y": 1, "cie-xyz": 3}
_INCIDENT_DECIMALS = 2  # of degrees: precision of the motors
_LARGEST_DEG = 3600.0
_QUARTER, _HALF = 90.0, 180.0


@dataclass(frozen=True)
class _Beam:
    """One incident direction: the header's keywords, and the rows below."""

    theta_i: float
    phi_i: float
    up_phi: float
    quantity: Quantity
    rows: Floats
    name: str | None


def recognise(head: bytes, size: int) -> bool:
    """Whether comments name the format and the direction of the light."""
    text = head_text(head)
    return text is not None and _FORMAT.search(text) is not None and _INCIDENT.search(text) is not None


def read(path: Path) -> GonioTable:
    """The table of a pab-opto file, or of several joined.

    Raises
    ------
    UserError
        A header lacks the format or the incident direction, a row is broken, light comes from both sides, or the
        incident directions do not form a grid.
    """
    text = read_text(path)
    refuse_decimal_commas(re.sub(rb"#[^\n]*", b"", text), path)
    beams = _beams(text, path)
    widths = {beam.rows.shape[1] for beam in beams}
    if len(widths) > 1 or len({beam.quantity for beam in beams}) > 1:
        raise UserError("joins files of different formats or colorimetry", file=path)
    angles = np.concatenate([_angles(beam) for beam in beams])
    values = np.concatenate([beam.rows[:, 2:] for beam in beams])
    angles, notes = _from_the_front(angles, path)
    check_angles(angles, path)
    angles, values, said = _whole_turn(angles, values)
    if values.shape[1] == 3:
        values, coloured = rgb_of_xyz(values)
        said += coloured
    f = to_f(np.where(np.isfinite(values), values, np.nan), beams[0].quantity, angles[:, 2])
    if len(beams) == 1:
        said += ("one incident direction: join the specimen's files to one (cat) for a table of all",)
    name = next((beam.name for beam in beams if beam.name), Path(path).stem)
    return table_of(angles, f, path, NAME, name, stored=beams[0].quantity, notes=notes + said)


def _beams(text: bytes, path: Path) -> list[_Beam]:
    """The incident directions of a file; a comment among the rows does not start a new one."""
    beams: list[_Beam] = []
    keys: dict[str, str] = {}
    body, end = b"", 0
    for comment in [*_COMMENTS.finditer(text), None]:
        body += text[end : comment.start() if comment else len(text)]
        found = _KEY.findall(shown(comment[0])) if comment else []
        stated = {key.lower().rstrip(":"): value for key, value in found}
        if comment is None or (body.strip() and {"intheta", "incident_angle"} & set(stated)):
            beams.append(_beam(keys, body, path, len(beams) + 1))
            keys, body = {}, b""
        keys |= stated
        end = comment.end() if comment else end
    return beams


def _beam(keys: dict[str, str], body: bytes, path: Path, number: int) -> _Beam:
    """One header and its rows."""
    where = f"header {number}"
    words = keys.get("format", "").lower().split()
    if len(words) != 3 or words[:2] != ["theta", "phi"] or words[2] not in _QUANTITIES:
        expected = "theta phi, then DSF, BSDF, BRDF or BTDF"
        raise UserError("format is unknown", file=path, field=where, got=keys.get("format"), expected=expected)
    theta, phi = ([*keys.get("incident_angle", "").split(), "", ""])[:2]
    light = [_number(word, name, where, path) for word, name in (
        (keys.get("intheta", theta), "intheta"), (keys.get("inphi", phi), "inphi"), (keys.get("upphi", "0"), "upphi")
    )]  # fmt: skip
    colorimetry = keys.get("colorimetry", "CIE-Y")
    if colorimetry.lower() not in _VALUES:
        expected = "CIE-Y or CIE-XYZ"
        raise UserError("colorimetry is unknown", file=path, field=where, got=colorimetry, expected=expected)
    columns = 2 + _VALUES[colorimetry.lower()]
    flat = numbers(body, path, where)
    lines = len(_LINE.findall(body))
    if lines == 0 or len(flat) != lines * columns:
        got = f"{len(flat)} numbers in {lines} rows"
        raise UserError("rows do not match the header", file=path, field=where, got=got, expected=f"{columns} per row")
    rows = flat.reshape(-1, columns)
    if not np.isfinite(rows[:, :2]).all():
        raise UserError("an angle is not finite", file=path, field=where)
    name = keys.get("sample_name", "").strip("\"' ") or None
    return _Beam(light[0], light[1], light[2], _QUANTITIES[words[2]], rows, name)


def _number(word: str, name: str, where: str, path: Path) -> float:
    if not is_number(word) or not abs(float(word)) <= _LARGEST_DEG:
        raise UserError(f"{name} is not an angle", file=path, field=where, got=word or "nothing")
    return float(word)


def _angles(beam: _Beam) -> Floats:
    """(N, 4) theta_i, phi_i, theta_o, phi_o, rotated to put up at 90 degrees."""
    turn = 90 - beam.up_phi
    light = np.round((beam.theta_i, (beam.phi_i + turn) % 360), _INCIDENT_DECIMALS) % (361, 360)
    lit = np.broadcast_to(light, (len(beam.rows), 2))
    return np.column_stack([lit, beam.rows[:, 0], (beam.rows[:, 1] + turn) % 360])


def _from_the_front(angles: Floats, path: Path) -> tuple[Floats, tuple[str, ...]]:
    """The angles, with the specimen turned over if its back is lit."""
    back = angles[:, 0] > 90
    if not back.any():
        return angles, ()
    if not back.all():
        raise UserError("the light comes from both sides", file=path, hint="join the files of one side alone")
    turned = np.column_stack([180 - angles[:, 0], -angles[:, 1] % 360, 180 - angles[:, 2], -angles[:, 3] % 360])
    return turned, ("the light comes from the back: the specimen is turned over, about phi = 0",)


def _whole_turn(angles: Floats, values: Floats) -> tuple[Floats, Floats, tuple[str, ...]]:
    """Add mirror images if the incident directions span more than a quarter and at most half a turn.

    The mirror plane contains the first of them; directions in it are not repeated.
    """
    tilted = angles[:, 0] > 0
    phi = np.unique(angles[tilted, 1]) if tilted.any() else np.zeros(1)
    angles[~tilted, 1] = phi[0]  # light along the normal has no azimuth of its own
    gaps = np.diff(np.append(phi, phi[0] + 360))
    first, span = phi[(np.argmax(gaps) + 1) % len(phi)], 360 - gaps.max()
    if not _QUARTER < span <= _HALF:
        return angles, values, ()
    aside = tilted & ((angles[:, 1] - first) % 180 > 0)
    images = angles[aside] * (1, -1, 1, -1) + (0, 2 * first, 0, 2 * first)
    images[:, [1, 3]] = np.round(images[:, [1, 3]] % 360, 5) % 360
    note = f"incident directions span {span:g} degrees of phi: mirrored at phi = {first:g}, as in Radiance"
    return np.concatenate([angles, images]), np.concatenate([values, values[aside]]), (note,)
