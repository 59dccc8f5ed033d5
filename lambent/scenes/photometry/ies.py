"""IES photometry, IES LM-63 of 1986, 1991, 1995, 2002 and 2019.

Type C: the vertical angle is measured from the luminaire's axis (straight down, unless it is aimed elsewhere), the
horizontal one around it, counter-clockwise seen from above. Types A and B, of headlamps and floodlights, are converted.

Candela are the file's values times its multiplier and its ballast factor; in files up to 1991 also times the
ballast-lamp factor, a field that later versions reserve.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES, IES_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import decoded
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.photometry.distribution import MOST_CD, Photometry, check_angles, check_candela, whole_turn
from lambent.scenes.photometry.luminaire import LampSet, Luminaire
from lambent.scenes.photometry.opening import Opening, opening_of_signs
from lambent.scenes.photometry.rotated import type_c

FEET_M = 0.3048
TWO_DIAMETERS = ("IESNA:LM-63-2002", "IES:LM-63-2019")  # both diameters of round openings are given
FULL = ("IESNA:LM-63-1995", *TWO_DIAMETERS)
STAYS_LEVEL = 2  # lamp-to-luminaire geometry: the lamp does not tilt with the luminaire
_TYPES: dict[int, Literal["A", "B", "C"]] = {1: "C", 2: "B", 3: "A"}
_SEPARATORS = re.compile(r"[\s,]+")
_TILT = re.compile(r"^[ \t]*TILT\b", re.IGNORECASE | re.MULTILINE)
Tilts = tuple[tuple[float, ...], tuple[float, ...]]


def is_ies(content: bytes) -> bool:
    """Whether this is the beginning of an IES file."""
    return _TILT.search(decoded(content).replace("\r", "\n")) is not None


def parse_ies(content: bytes, path: Path, files: SceneFiles) -> Luminaire:
    """The luminaire of the IES file at `path`; its tilt may be in another of the `files`."""
    return _Reading(decoded(content), path).luminaire(files)


class _Reading:
    """One file."""

    def __init__(self, text: str, path: Path) -> None:
        self._path = path
        lines = text.splitlines()
        self._first = lines[0].strip() if lines else ""
        start = next((i for i, line in enumerate(lines) if _TILT.match(line)), None)
        if start is None:
            raise UserError("is not an IES file", file=path, expected="a line TILT=NONE or TILT=INCLUDE")
        self._keywords = dict(re.findall(r"^\s*\[(\w+)\]\s*(.*?)\s*$", "\n".join(lines[:start]), re.MULTILINE))
        self._tilt = lines[start].partition("=")[2].strip()
        self._numbers = self._numbers_of("\n".join(lines[start + 1 :]))

    def luminaire(self, files: SceneFiles) -> Luminaire:
        tilt = self._tilts(files)
        lamps, lumens, multiplier = self._take(3, "lamps, lumens and multiplier")
        verticals, horizontals, kind, units = (
            self._whole(name) for name in ("vertical angles", "horizontal angles", "photometric type", "units")
        )
        if kind not in _TYPES:
            raise self._error("photometric type", "unknown photometric type", str(kind), "1 (C), 2 (B) or 3 (A)")
        for name, count in (("vertical angles", verticals), ("horizontal angles", horizontals)):
            IES_ANGLES.check(count, file=self._path, field=name)
            if count < 1:
                raise self._error(name, "is empty", str(count), "1 or more")
        opening = self._opening(_TYPES[kind], FEET_M if units == 1 else 1.0)
        ballast, ballast_lamp, watts = self._take(3, "ballast factors and watts")
        scale = multiplier * ballast * (1.0 if self._first.upper() in FULL else ballast_lamp)
        if not 0 <= scale <= MOST_CD:
            raise self._error("multiplier", "intensities are out of range", f"{scale:g}", "0 or more")
        vertical = np.array(self._take(verticals, "vertical angles"))
        horizontal = np.array(self._take(horizontals, "horizontal angles"))
        values = scale * np.reshape(self._take(verticals * horizontals, "candela"), (horizontals, verticals))
        check_candela(values, self._path, "candela")
        made, symmetry = self._whole_sphere(_TYPES[kind], vertical, horizontal, np.maximum(values, 0))
        name = self._first.upper() if self._first.upper() in (*FULL, "IESNA91") else "IES LM-63"
        known, count = self._keywords, int(np.clip(lamps, 0, MOST_CD))
        return Luminaire(
            self._path, f"{name}, type {_TYPES[kind]}", symmetry,
            known.get("LUMINAIRE") or known.get("LUMCAT", ""), known.get("MANUFAC", ""), known.get("TEST", ""),
            (LampSet(count, known.get("LAMP") or known.get("LAMPCAT", ""), count * max(lumens, 0.0), watts),),
            replace(made, opening=opening, tilt_deg=tilt[0], tilt_factors=tilt[1]), per_klm=False, absolute=lumens < 0,
        )  # fmt: skip

    def _whole_sphere(
        self, kind: Literal["A", "B", "C"], vertical: Floats, horizontal: Floats, values: Floats
    ) -> tuple[Photometry, str]:
        """Extend to the whole sphere, by the symmetry that the horizontal angles imply; that symmetry in words."""
        if kind != "C":
            return type_c(kind, vertical, horizontal, values, self._path), "left to right" * (
                horizontal[0] == 0
            ) or "none"
        check_angles(vertical, 0, 180, self._path, "vertical angles")
        if len(horizontal) == 1:
            return Photometry.of(vertical, *whole_turn(horizontal, values)), "about the axis"
        check_angles(horizontal, -360, 360, self._path, "horizontal angles")
        first, last = horizontal[0], horizontal[-1]
        if (first, last) == (90.0, 270.0):
            mirrors, symmetry = [90.0], "to C90-C270"
        elif first != 0:
            raise self._error("horizontal angles", "start at an unsupported angle", f"{first:g}", "0, or 90 to 270")
        elif last in (90.0, 180.0):
            mirrors, symmetry = ([90.0, 180.0], "to both planes") if last == 90 else ([180.0], "to C0-C180")
        elif last > 180:
            mirrors, symmetry = [], "none"
        else:
            raise self._error("horizontal angles", "end at an unsupported angle", f"{last:g}", "0, 90, 180 or 360")
        return Photometry.of(vertical, *whole_turn(horizontal, values, mirrors)), symmetry

    def _opening(self, kind: str, metres: float) -> Opening:
        width, length, height = (x * metres for x in self._take(3, "opening"))
        if not max(map(abs, (width, length, height))) <= MOST_CD:
            raise self._error("opening", "is out of range", f"{width:g} x {length:g} x {height:g} m")
        if kind == "A":  # its axis is horizontal
            length, height = height, length
        return opening_of_signs(width, length, height, self._first.upper() not in TWO_DIAMETERS)

    def _tilts(self, files: SceneFiles) -> Tilts:
        if self._tilt.upper() == "NONE":
            return (0.0,), (1.0,)
        if self._tilt.upper() == "INCLUDE":
            return self._tilts_here()
        beside = files.path(self._tilt, self._path, "TILT")
        if not beside.is_file():
            raise self._error("TILT", "tilt file is missing", self._tilt[:40], "NONE, INCLUDE or a file beside it")
        rest, self._numbers = self._numbers, self._numbers_of(decoded(files.read(beside, IES_BYTES)))
        found, self._numbers = self._tilts_here(), rest
        return found

    def _tilts_here(self) -> Tilts:
        geometry, pairs = self._whole("geometry"), self._whole("tilt angles")
        IES_ANGLES.check(pairs, file=self._path, field="tilt angles")
        if pairs < 1:
            raise self._error("tilt angles", "is empty", str(pairs), "1 or more")
        angles, factors = np.array(self._take(pairs, "tilt angles")), self._take(pairs, "tilt factors")
        if pairs > 1:
            check_angles(angles, -360, 360, self._path, "tilt angles")
        if min(factors) < 0 or max(factors) > MOST_CD:
            raise self._error("tilt factors", "factors are out of range", f"{min(factors):g}", "0 or more")
        if geometry == STAYS_LEVEL:
            return (0.0,), (float(factors[0]),)
        return tuple(angles.tolist()), tuple(factors)

    def _whole(self, field: str) -> int:
        (number,) = self._take(1, field)
        if number != int(number):
            raise self._error(field, "is not a whole number", f"{number:g}")
        return int(number)

    def _take(self, count: int, field: str) -> Sequence[float]:
        taken = self._numbers[:count]
        if len(taken) < count:
            raise self._error(field, "file is truncated", f"{len(taken)} numbers", f"{count} numbers")
        self._numbers = self._numbers[count:]
        return taken

    def _numbers_of(self, text: str) -> list[float]:
        return list(self._parsed(word for word in _SEPARATORS.split(text) if word))

    def _parsed(self, words: Iterable[str]) -> Iterator[float]:
        for word in words:
            try:
                number = float(word)
            except ValueError:
                return  # text after the data; if it comes too early, numbers are missing
            if not np.isfinite(number):
                raise self._error(None, "numbers are not finite", word[:20])
            yield number

    def _error(self, field: str | None, fault: str, got: str | None = None, expected: str | None = None) -> UserError:
        return UserError(fault, file=self._path, field=field, got=got, expected=expected)
