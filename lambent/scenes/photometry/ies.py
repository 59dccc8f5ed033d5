"""IES photometry, IES LM-63 of 1986, 1991, 1995, 2002 and 2019.

Type C: the vertical angle is measured from the luminaire's axis (straight down, unless it is aimed elsewhere), the
horizontal one around it, counter-clockwise seen from above. Types A and B, of headlamps and floodlights, are converted.

Candela are the file's values times its multiplier and its ballast factor; in files up to 1991 also times the
ballast-lamp factor, a field that later versions reserve.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES, IES_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import decoded
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.photometry.distribution import MOST_CD, Photometry, check_angles, check_cd, numbers_of, whole_turn
from lambent.scenes.photometry.luminaire import LampSet, Luminaire
from lambent.scenes.photometry.opening import Opening, opening_of_signs
from lambent.scenes.photometry.rotated import type_c

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
        self._numbers = self._numbers_of("\n".join(lines[start + 1 :]))

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
        made, symmetry = self._whole_sphere(kind, vertical, horizontal, np.maximum(values, 0))
        name = self._version if self._version in (*FULL, "IESNA91") else "IES LM-63"
        known, count = self._keywords.get, int(np.clip(lamps, 0, MOST_CD))
        lamp = LampSet(count, known("LAMP") or known("LAMPCAT", ""), count * max(lumens, 0.0), watts)
        return Luminaire(
            self._path, f"{name}, type {kind}", symmetry, known("LUMINAIRE") or known("LUMCAT", ""),
            known("MANUFAC", ""), known("TEST", ""), (lamp,),
            replace(made, opening=opening, tilt_deg=tilt_deg, tilt_factors=tilt_factors), False, lumens < 0,
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

    def _numbers_of(self, text: str) -> Sequence[float]:
        return list(numbers_of(text.replace(",", " ").split(), self._path))
