"""EULUMDAT photometry (.ldt; A. Stockmar, 1990): one value a line, in a fixed order.

The C planes are half planes around the luminaire's axis, which points straight down; gamma is the angle from it. A file
holds candela per 1000 lm of its lamps. Its lamp sets are alternatives. A negative number of lamps marks absolute
photometry: the flux is the luminaire's own. Values hold for the tilt that the luminaire had while it was measured; they
are not turned back.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES
from lambent.core.errors import UserError
from lambent.core.inputs import decoded
from lambent.scenes.photometry.distribution import Photometry, check_angles, check_candela, whole_turn
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
    return _Reading(content, path).luminaire()


def _lines(content: bytes) -> list[str]:
    return [line.strip() for line in _LINE_END.split(decoded(content))]


class _Reading:
    """One file: a header with a fixed meaning of each line, then numbers."""

    def __init__(self, content: bytes, path: Path) -> None:
        self._path, self._lines = path, _lines(content)
        if len(self._lines) < HEADER_LINES:
            raise self._error(None, "is not an EULUMDAT file", f"{len(self._lines)} lines", f"{HEADER_LINES} or more")

    def luminaire(self) -> Luminaire:
        symmetry = self._whole(3, "symmetry", NONE, BOTH)
        planes = self._whole(4, "number of C planes", 1, IES_ANGLES.most)
        angles = self._whole(6, "number of gamma angles", 2, IES_ANGLES.most)
        sets = self._whole(26, "number of lamp sets", 1, MOST_SETS)
        numbers = self._numbers(HEADER_LINES + SET_LINES * sets + RATIO_LINES, planes + angles)
        c_deg, gamma_deg, values = np.split(numbers, [planes, planes + angles])
        check_angles(gamma_deg, 0, 180, self._path, "gamma angles")
        if planes > 1:
            check_angles(c_deg, -360, 360, self._path, "C planes")
        if len(values) != planes * angles:  # some programs write every plane, whatever the symmetry
            c_deg = self._given(symmetry, c_deg)
        if len(values) < len(c_deg) * angles:
            raise self._error("intensities", "file is truncated", f"{len(values)}", f"{len(c_deg) * angles} numbers")
        factor = self._number(24, "conversion factor", 0, MOST_FACTOR) or 1.0  # some programs leave it at 0
        candela = factor * values[: len(c_deg) * angles].reshape(len(c_deg), angles)
        check_candela(candela, self._path, "intensities")
        whole = whole_turn(c_deg, np.maximum(candela, 0.0), MIRRORS.get(symmetry, ()))
        lamps = [self._lamps(HEADER_LINES + SET_LINES * k) for k in range(sets)]
        return Luminaire(
            self._path, "EULUMDAT", SYMMETRIES[symmetry], self._lines[8], self._lines[0], self._lines[7],
            tuple(replace(one, count=abs(one.count)) for one in lamps),
            replace(Photometry.of(gamma_deg, *whole), opening=self._opening()), True, lamps[0].count < 0,
            self._number(23, "light output ratio", 0, 1000) / 100,
            self._number(22, "downward flux fraction", 0, 1000) / 100, self._number(25, "tilt", -360, 360),
        )  # fmt: skip

    def _lamps(self, start: int) -> LampSet:
        """The lamp set whose first line has that index."""
        count = int(self._number(start + 1, "number of lamps", -1e6, 1e6))
        lumens = self._number(start + 3, "luminous flux", 0, MOST_LM)
        watts = self._number(start + 6, "watts", 0, MOST_LM)
        return LampSet(count, self._lines[start + 1], lumens, watts, self._lines[start + 3])

    def _given(self, symmetry: int, c_deg: Floats) -> Floats:
        """The C planes that the file has intensities of; by symmetry, the others follow."""
        count = len(c_deg)
        first, given = {
            NONE: (0, count), AXIAL: (0, 1), C0_C180: (0, count // 2 + 1), C90_C270: (3 * count // 4, count // 2 + 1),
            BOTH: (0, count // 4 + 1),
        }[symmetry]  # fmt: skip
        return c_deg[(first + np.arange(given)) % count]

    def _opening(self) -> Opening:
        """The luminous area: round if its width is 0. Its sides may be of different heights; the mean counts."""
        length, width, *heights = (MM * self._number(n, "luminous area", 0, MOST_MM) for n in range(16, 22))
        height = sum(heights) / len(heights)
        if not (length or width or height):
            return POINT
        return Opening("box", (width, length, height)) if width else Opening("cylinder", (length, length, height))

    def _numbers(self, start: int, least: int) -> Floats:
        """All numbers from the line of that index on, up to a line of text, `least` or more."""
        found: list[float] = []
        for number, line in enumerate(self._lines[start:], start + 1):
            try:
                found += map(float, line.replace(",", ".").split())
            except ValueError:
                break  # text after the data; if it comes too early, numbers are missing
            if not np.isfinite(found[-1:]).all():
                raise self._error(f"line {number}", "is not a finite number", line[:20])
        if len(found) < least:
            raise self._error("angles", "file is truncated", f"{len(found)}", f"{least} numbers")
        return np.array(found)

    def _number(self, line: int, field: str, least: float, most: float) -> float:
        """The number on a line, counted from 1; 0 where it is empty."""
        text = self._lines[line - 1] if line <= len(self._lines) else "nothing"
        try:
            number = float(text.replace(",", ".").split()[0]) if text else 0.0
        except ValueError:
            raise self._error(f"{field} (line {line})", "is not a number", text[:20]) from None
        if not least <= number <= most:
            raise self._error(f"{field} (line {line})", "is out of range", f"{number:g}", f"{least:g} to {most:g}")
        return number

    def _whole(self, line: int, field: str, least: int, most: int) -> int:
        number = self._number(line, field, least, most)
        if number != int(number):
            raise self._error(f"{field} (line {line})", "is not a whole number", f"{number:g}")
        return int(number)

    def _error(self, field: str | None, fault: str, got: str | None = None, expected: str | None = None) -> UserError:
        return UserError(fault, file=self._path, field=field, got=got, expected=expected)
