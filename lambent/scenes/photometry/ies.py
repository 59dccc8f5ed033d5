"""IES photometry, IES LM-63 of 1986, 1991, 1995, 2002 and 2019.

Type C: the vertical angle is measured from the luminaire's axis (straight down, unless it is aimed elsewhere), the
horizontal one around it, counter-clockwise seen from above. Types A and B, of headlamps and floodlights,
are converted. Both have a horizontal angle H, clockwise seen from above, and a vertical angle V, upwards (ANSI/IESNA
LM-63-2002, 3.0). Planes of type A share the vertical axis, so that H names a plane and V an angle in it; planes of type
B share the horizontal axis, and V names the plane. The luminaire's axis is H = V = 0; V turns it towards horizontal
angle 0 of type C, H towards 270:

    type A: sin V = sin gamma cos C,    tan H = -tan gamma sin C
    type B: sin H = -sin gamma sin C,   tan V = tan gamma cos C

These are the conversions of CIE 121-1996, table of relations between systems of planes, with its C planes 90 degrees
ahead. So the axis of type A is the direction that LM-63 calls photometric horizontal: that in which a headlamp shines.

Candela are the file's values times its multiplier and its ballast factor; in files up to 1991 also times the
ballast-lamp factor, a field that later versions reserve.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES, IES_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import angles, direction
from lambent.core.inputs import decoded
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.photometry.distribution import (
    MOST_CD,
    Photometry,
    check_angles,
    check_cd,
    numbers_of,
    odd_values,
    whole_turn,
)
from lambent.scenes.photometry.luminaire import LampSet, Luminaire
from lambent.scenes.photometry.opening import Opening, opening_of_signs

FEET_M = 0.3048
UP, AROUND = "vertical angles", "horizontal angles"
TWO_DIAMETERS = ("IESNA:LM-63-2002", "IES:LM-63-2019")  # both diameters of round openings are given
FULL = ("IESNA:LM-63-1995", *TWO_DIAMETERS)
STAYS_LEVEL = 2  # lamp-to-luminaire geometry: the lamp does not tilt with the luminaire
KINDS: dict[int, Literal["A", "B", "C"]] = {1: "C", 2: "B", 3: "A"}
MIRRORS = {  # by the first and last horizontal angle: the symmetry, and its planes
    (90.0, 270.0): ("to C90-C270", (90.0,)),
    (0.0, 90.0): ("to both planes", (90.0, 180.0)),
    (0.0, 180.0): ("to C0-C180", (180.0,)),
}
_TILT = re.compile(r"^[ \t]*TILT[ \t]*=", re.IGNORECASE | re.MULTILINE)
_KEYWORD = re.compile(r"^[ \t]*\[(\w+)\][ \t]*(.*?)[ \t]*$", re.MULTILINE)
# Rows, in luminaire axes: towards H = V = 0, towards a growing angle of planes, and the axis that planes share.
FRAMES = {"A": [[0, 0, 1], [0, -1, 0], [1, 0, 0]], "B": [[0, 0, 1], [1, 0, 0], [0, -1, 0]]}
FINENESS = (1, 2, 4, 8, 16)
PLANES = 72  # of type C at fineness 1
MOST_NODES = 1 << 20
TOLERANCE = 0.005  # of the largest intensity, at the file's own angles, and of the flux
_DECIMAL_COMMA = re.compile(r"(?<![^\s])\d+,\d+(?![^\s])")  # commas may part numbers, too
HALF_TURN = 180.0  # so that angles of planes, from -90 to 90 degrees, are positive


def is_ies(content: bytes) -> bool:
    """Whether this is the beginning of an IES file."""
    return _TILT.search(decoded(content).replace("\r", "\n")) is not None


def parse_ies(content: bytes, path: Path, files: SceneFiles) -> Luminaire:
    """The luminaire of the IES file at `path`; its tilt may be in another of the `files`."""
    return _Reading(decoded(content), path).luminaire(files)


class _Reading:
    """One file."""

    def __init__(self, text: str, path: Path) -> None:
        self._path, self._error = path, partial(UserError, file=path)
        lines = text.splitlines()
        self._version = lines[0].strip().upper()
        start = next(i for i, line in enumerate(lines) if _TILT.match(line))
        self._keywords: dict[str, str] = dict(_KEYWORD.findall("\n".join(lines[:start])))
        self._tilt = lines[start].partition("=")[2].strip()
        self._body = "\n".join(lines[start + 1 :])
        self._numbers = self._numbers_of(self._body)

    def luminaire(self, files: SceneFiles) -> Luminaire:
        tilt_deg, tilt_factors = self._tilts(files)
        lamps, lumens, multiplier = self._take(3, "lamps, lumens and multiplier")
        verticals, horizontals = self._count(UP), self._count(AROUND)
        kind, units = KINDS.get(self._whole("photometric type")), self._whole("units")
        if kind is None:
            raise self._error("is unknown", field="photometric type", expected="1 (C), 2 (B) or 3 (A)")
        opening = self._opening(kind, FEET_M if units == 1 else 1.0)
        ballast, ballast_lamp, watts = self._take(3, "ballast factors and watts")
        scale = multiplier * ballast * (1.0 if self._version in FULL else ballast_lamp)
        if not 0 <= scale <= MOST_CD:
            raise self._error("is out of range", field="multiplier", got=f"{scale:g}", expected="0 or more")
        vertical, horizontal = (np.array(self._take(n, name)) for n, name in ((verticals, UP), (horizontals, AROUND)))
        values = scale * np.reshape(self._take(verticals * horizontals, "candela"), (horizontals, verticals))
        check_cd(values, self._path)
        notes = odd_values(horizontal, values) + self._left_over()
        made, symmetry = self._whole_sphere(kind, vertical, horizontal, np.maximum(values, 0))
        name = self._version if self._version in (*FULL, "IESNA91") else "IES LM-63"
        known, count = self._keywords.get, int(np.clip(lamps, 0, MOST_CD))
        lamp = LampSet(count, known("LAMP") or known("LAMPCAT", ""), count * max(lumens, 0.0), watts)
        return Luminaire(
            self._path, f"{name}, type {kind}", symmetry, known("LUMINAIRE") or known("LUMCAT", ""),
            known("MANUFAC", ""), known("TEST", ""), (lamp,),
            replace(made, opening=opening, tilt_deg=tilt_deg, tilt_factors=tilt_factors), False, lumens < 0,
            notes=notes,
        )  # fmt: skip

    def _whole_sphere(self, kind: str, vertical: Floats, horizontal: Floats, values: Floats) -> tuple[Photometry, str]:
        """Extend to the whole sphere, by the symmetry that the horizontal angles imply; that symmetry in words."""
        check_angles(horizontal, -360, 360, self._path, AROUND)
        first, last = float(horizontal[0]), float(horizontal[-1])
        if kind != "C":
            made = type_c(kind, vertical, horizontal, values, self._path)
            return made, "left to right" if first == 0 else "none"
        check_angles(vertical, 0, 180, self._path, UP, 2)
        symmetry, mirrors = MIRRORS.get((first, last), ("about the axis" if first == last else "none", ()))
        if not (mirrors or first == last or (first == 0 and last > 180)):
            got, expected = f"{first:g} to {last:g}", "0 to 0, 90, 180 or 360, or 90 to 270"
            raise self._error("unsupported range", field=AROUND, got=got, expected=expected)
        return Photometry.of(vertical, *whole_turn(horizontal, values, mirrors)), symmetry

    def _opening(self, kind: str, metres: float) -> Opening:
        width, length, height = (x * metres for x in self._take(3, "opening"))
        if not max(map(abs, (width, length, height))) <= MOST_CD:
            raise self._error("is out of range", field="opening", got=f"{width:g} x {length:g} x {height:g} m")
        if kind == "A":  # its axis is horizontal
            length, height = height, length
        return opening_of_signs(width, length, height, self._version not in TWO_DIAMETERS)

    def _tilts(self, files: SceneFiles) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Angles, and factors there."""
        if self._tilt.upper() == "NONE":
            return (0.0,), (1.0,)
        after: Sequence[float] = ()
        if self._tilt.upper() != "INCLUDE":
            beside, after = files.path(self._tilt, self._path, "TILT"), self._numbers
            if not beside.is_file():
                expected = "NONE, INCLUDE or a file beside it"
                raise self._error("tilt file is missing", field="TILT", got=self._tilt, expected=expected)
            self._numbers = self._numbers_of(decoded(files.read(beside, IES_BYTES)))
        geometry, pairs = self._whole("geometry"), self._count("tilt angles")
        angles, factors = np.array(self._take(pairs, "tilt angles")), self._take(pairs, "tilt factors")
        self._numbers = after or self._numbers
        check_angles(angles, -360, 360, self._path, "tilt angles")
        if min(factors) < 0 or max(factors) > MOST_CD:
            raise self._error("are out of range", field="tilt factors", got=f"{min(factors):g}", expected="0 or more")
        return ((0.0,), (factors[0],)) if geometry == STAYS_LEVEL else (tuple(angles.tolist()), tuple(factors))

    def _count(self, field: str) -> int:
        count = self._whole(field)
        IES_ANGLES.check(count, file=self._path, field=field)
        if count < 1:
            raise self._error("is empty", field=field, got=count, expected="1 or more")
        return count

    def _whole(self, field: str) -> int:
        (number,) = self._take(1, field)
        if number != int(number):
            raise self._error("is not a whole number", field=field, got=f"{number:g}")
        return int(number)

    def _take(self, count: int, field: str) -> Sequence[float]:
        taken, self._numbers = self._numbers[:count], self._numbers[count:]
        if len(taken) < count:
            raise self._error("file is truncated", field=field, got=len(taken), expected=f"{count} numbers")
        return taken

    def _left_over(self) -> tuple[str, ...]:
        """A line on numbers that follow the last one promised; `UserError` if these come of decimal commas."""
        if not (count := len(self._numbers)):
            return ()
        if found := _DECIMAL_COMMA.search(self._body):
            hint = "replace the decimal commas by points"
            raise self._error("has more numbers than it promises", field="candela", got=found[0], hint=hint)
        return (f"{count} numbers follow the last that the file promises; they are ignored",)

    def _numbers_of(self, text: str) -> Sequence[float]:
        return list(numbers_of(text.replace(",", " ").split(), self._path))


def type_c(kind: str, vertical_deg: Floats, horizontal_deg: Floats, candela: Floats, file: Path) -> Photometry:
    """Resample candela (H, V) of type "A" or "B" onto type C angles.

    Horizontal or vertical angles that start at 0 are mirrored there. The grid is refined until values at the file's
    angles and the flux agree to half a per cent.
    """
    check_angles(vertical_deg, -90, 90, file, "vertical angles", 2)
    check_angles(horizontal_deg, -90, 90, file, "horizontal angles", 2)
    (h_deg, h), (v_deg, v) = _both_sides(horizontal_deg), _both_sides(vertical_deg)
    values = candela[np.ix_(h, v)]
    in_plane, of_plane, values = (v_deg, h_deg, values) if kind == "A" else (h_deg, v_deg, values.T)
    own = Photometry.of(90 - in_plane[::-1], of_plane + HALF_TURN, values[:, ::-1])
    frame, offsets = np.array(FRAMES[kind]), np.unique(np.abs([*h_deg, *v_deg, 0.0, 90.0]))
    nodes = np.degrees(angles(direction(*np.radians(np.meshgrid(90 - in_plane, of_plane))) @ frame))
    for fineness in FINENESS:
        shares = np.arange((len(offsets) - 1) * fineness + 1) / fineness
        gamma, c = np.interp(shares, np.arange(len(offsets)), offsets), np.linspace(0, 360, PLANES * fineness + 1)
        polar, turn = np.degrees(angles(direction(*np.radians(np.meshgrid(gamma, c))) @ frame.T))
        found = Photometry.of(gamma, c, own.at(polar, turn + HALF_TURN))
        error = np.abs(found.at(*nodes) - values).max() / max(values.max(), 1e-300)
        error = max(error, abs(found.lumens / max(own.lumens, 1e-300) - 1))
        if error < TOLERANCE or 4 * gamma.size * c.size > MOST_NODES:
            break
    return found


def _both_sides(angles_deg: Floats) -> tuple[Floats, Any]:
    """Angles, mirrored at 0 if they start there, and the index of each in the file."""
    index = np.arange(len(angles_deg))
    if angles_deg[0] != 0:
        return angles_deg, index
    return np.concatenate([-angles_deg[:0:-1], angles_deg]), np.concatenate([index[:0:-1], index])
