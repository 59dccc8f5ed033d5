"""EULUMDAT photometry (.ldt; A. Stockmar, 1990): one value a line, in a fixed order.

The C planes are half planes around the luminaire's axis, which points straight down; gamma is the angle from it. A file
holds candela per 1000 lm of its lamps. Its lamp sets are alternatives. A negative number of lamps marks absolute
photometry: the flux is the luminaire's own. Values hold for the tilt that the luminaire had while it was measured; they
are not turned back.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES
from lambent.core.errors import UserError
from lambent.core.inputs import decoded
from lambent.scenes.photometry.distribution import (
    Photometry,
    check_angles,
    check_cd,
    numbers_of,
    odd_values,
    whole_turn,
)
from lambent.scenes.photometry.luminaire import LampSet, Luminaire
from lambent.scenes.photometry.opening import POINT, Opening

HEADER_LINES, SET_LINES, RATIO_LINES = 26, 6, 10  # up to the number of lamp sets; of each set; of direct ratios
MM = 1e-3
NONE, AXIAL, C0_C180, C90_C270, BOTH = range(5)  # kinds of symmetry
SYMMETRIES = ("none", "about the axis", "to C0-C180", "to C90-C270", "to both planes")
MIRRORS = {C0_C180: (180.0,), C90_C270: (90.0,), BOTH: (90.0, 180.0)}  # planes in degrees, one after another
MOST_SETS, MOST_LM, MOST_MM, MOST_FACTOR = 20, 1e9, 1e6, 1e6
_LINE_END = re.compile(r"\r*\n|\r")


def is_eulumdat(content: bytes) -> bool:
    """Whether this is the beginning of an EULUMDAT file: its counts are whole numbers, the luminaire's name is not."""
    lines = _lines(content)
    counts = [lines[k - 1] for k in (2, 3, 4, 6)] if len(lines) >= HEADER_LINES else [""]
    return all(re.fullmatch(r"\d{1,4}([.,]0*)?", count) for count in counts) and not re.match(r"[-+.\d]*$", lines[8])


def parse_eulumdat(content: bytes, path: Path) -> Luminaire:
    """The luminaire of the EULUMDAT file at `path`."""
    return _Reading(_lines(content), path).luminaire()


def _lines(content: bytes) -> list[str]:
    return [line.strip() for line in _LINE_END.split(decoded(content))]


class _Reading:
    """One file: a header with a fixed meaning of each line, then numbers."""

    def __init__(self, lines: list[str], path: Path) -> None:
        self._path, self._lines, self._error = path, lines, partial(UserError, file=path)
        if len(lines) < HEADER_LINES:
            raise self._error("is not an EULUMDAT file", got=f"{len(lines)} lines", expected=f"{HEADER_LINES} or more")

    def luminaire(self) -> Luminaire:
        symmetry = self._whole(3, "symmetry", NONE, BOTH)
        planes = self._whole(4, "number of C planes", 1, IES_ANGLES.most)
        angles = self._whole(6, "number of gamma angles", 2, IES_ANGLES.most)
        sets = [HEADER_LINES + SET_LINES * k for k in range(self._whole(26, "number of lamp sets", 1, MOST_SETS))]
        c_deg, gamma_deg, values = self._angles_and_values(sets[-1] + SET_LINES + RATIO_LINES, planes, angles)
        if len(values) != planes * angles:  # some programs write every plane, whatever the symmetry
            c_deg = _given(symmetry, c_deg)
        if len(values) < len(c_deg) * angles:
            raise self._error("file is truncated", field="intensities", got=len(values), expected=len(c_deg) * angles)
        factor = self._number(24, "conversion factor", 0, MOST_FACTOR) or 1.0  # some programs leave it at 0
        candela = factor * values[: len(c_deg) * angles].reshape(len(c_deg), angles)
        check_cd(candela, self._path)
        whole = Photometry.of(gamma_deg, *whole_turn(c_deg, np.maximum(candela, 0.0), MIRRORS.get(symmetry, ())))
        ratio, downward = (self._number(line, "percentage", 0, 1000) / 100 for line in (23, 22))
        return Luminaire(
            self._path, "EULUMDAT", SYMMETRIES[symmetry], self._lines[8], self._lines[0], self._lines[7],
            tuple(map(self._lamps, sets)), replace(whole, opening=self._opening()), True,
            self._number(HEADER_LINES + 1, "number of lamps", -1e6, 1e6) < 0, ratio, downward,
            self._number(25, "tilt", -360, 360), odd_values(c_deg, candela),
        )  # fmt: skip

    def _angles_and_values(self, start: int, planes: int, angles: int) -> tuple[Floats, Floats, Floats]:
        """C, gamma and intensities from the line of that index on."""
        words = " ".join(self._lines[start:]).replace(",", ".").split()
        numbers = np.array(list(numbers_of(words, self._path)))
        if len(numbers) < planes + angles:
            raise self._error("file is truncated", field="angles", got=len(numbers), expected=planes + angles)
        c_deg, gamma_deg, values = np.split(numbers, [planes, planes + angles])
        check_angles(c_deg, -360, 360, self._path, "C planes")
        check_angles(gamma_deg, 0, 180, self._path, "gamma angles")
        return c_deg, gamma_deg, values

    def _lamps(self, start: int) -> LampSet:
        """The lamp set whose first line has that index."""
        count = int(self._number(start + 1, "number of lamps", -1e6, 1e6))
        lumens, watts = (self._number(start + k, name, 0, MOST_LM) for k, name in ((3, "luminous flux"), (6, "watts")))
        return LampSet(abs(count), self._lines[start + 1], lumens, watts, self._lines[start + 3])

    def _opening(self) -> Opening:
        """The luminous area: round if its width is 0; as high as its highest side, because lower ones shine less."""
        length, width, *heights = (MM * self._number(n, "luminous area", 0, MOST_MM) for n in range(16, 22))
        if not any((length, width, *heights)):
            return POINT
        return Opening("cylinder" if width == 0 else "box", (width or length, length, max(heights)))

    def _number(self, line: int, field: str, least: float, most: float) -> float:
        """The number on a line, counted from 1; 0 where it is empty."""
        words, place = self._lines[line - 1 : line] or ["nothing"], f"{field} (line {line})"
        try:
            number = float(words[0].replace(",", ".").split()[0]) if words[0] else 0.0
        except ValueError:
            raise self._error("is not a number", field=place, got=words[0][:20]) from None
        if not least <= number <= most:
            raise self._error("is out of range", field=place, got=f"{number:g}", expected=f"{least:g} to {most:g}")
        return number

    def _whole(self, line: int, field: str, least: int, most: int) -> int:
        number = self._number(line, field, least, most)
        if number != int(number):
            raise self._error("is not a whole number", field=f"{field} (line {line})", got=f"{number:g}")
        return int(number)


def _given(symmetry: int, c_deg: Floats) -> Floats:
    """The C planes that a file has intensities of; by symmetry, the others follow."""
    count = len(c_deg)
    first = 3 * count // 4 if symmetry == C90_C270 else 0
    given = {NONE: count, AXIAL: 1, BOTH: count // 4 + 1}.get(symmetry, count // 2 + 1)
    return c_deg[(first + np.arange(given)) % count]
