"""IES photometry, IES LM-63 of 1986, 1991, 1995, 2002 and 2019: the luminous intensity of a luminaire by direction.

Type C: the vertical angle is measured from the luminaire's axis (straight down, unless it is aimed elsewhere), the
horizontal one around it, counter-clockwise seen from above. Types A and B, for floodlights and headlamps, are refused.

Candela are the file's values times its multiplier and its ballast factor; in files up to 1991 also times the
ballast-lamp factor, a field that later versions reserve. Intensities are linear in both angles; beyond the given
vertical angles there is no light.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.ceilings import IES_ANGLES, IES_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import foreign_bytes, read_bytes

NAME = "IES LM-63"
FEET_M = 0.3048
FULL = ("IESNA:LM-63-1995", "IESNA:LM-63-2002", "IES:LM-63-2019")
MOST_CD = 1e12
STAYS_LEVEL = 2  # lamp-to-luminaire geometry: the lamp does not tilt with the luminaire
_TYPES = {2: "B", 3: "A"}
_SEPARATORS = re.compile(r"[\s,]+")


@dataclass(frozen=True)
class Photometry:
    """Luminous intensity of a luminaire.

    Attributes
    ----------
    vertical_deg : (V,)
        Ascending, within 0 to 180; 0 is the luminaire's axis.
    horizontal_deg : (H,)
        Ascending from 0 to 360, both included.
    candela : (H, V)
        Not negative.
    opening_m : (width, length, height)
        Of the luminous opening, as in the file; negative ones are diameters. Light comes from a point at its centre.
    tilt_deg, tilt_factors : (N,)
        Factors on all intensities by the angle between the luminaire's axis and straight down.
    """

    vertical_deg: tuple[float, ...]
    horizontal_deg: tuple[float, ...]
    candela: tuple[tuple[float, ...], ...]
    opening_m: tuple[float, ...] = (0.0, 0.0, 0.0)
    tilt_deg: tuple[float, ...] = (0.0,)
    tilt_factors: tuple[float, ...] = (1.0,)

    @cached_property
    def lumens(self) -> float:
        """Luminous flux of all directions, the exact integral of `at`."""
        theta, phi = np.radians(self.vertical_deg), np.radians(self.horizontal_deg)
        around = ((np.array(self.candela)[1:] + np.array(self.candela)[:-1]) / 2 * np.diff(phi)[:, None]).sum(axis=0)
        a, b = theta[:-1], theta[1:]
        slope = np.diff(around) / np.diff(theta)
        # of (start + slope (x - a)) sin x from a to b
        whole = around[:-1] * (np.cos(a) - np.cos(b)) + slope * (np.sin(b) - np.sin(a) - (b - a) * np.cos(b))
        return float(whole.sum())

    def tilted(self, tilt_deg: float) -> float:
        """Factor on all intensities of a luminaire whose axis is tilted by `tilt_deg` from straight down."""
        return float(np.interp(tilt_deg, self.tilt_deg, self.tilt_factors))

    def at(self, vertical_deg: Floats, horizontal_deg: Floats) -> Floats:
        """Candela (...) towards angles (...), without tilt."""
        theta, phi = np.array(self.vertical_deg), np.array(self.horizontal_deg)
        wanted, turn = np.asarray(vertical_deg, float), np.mod(horizontal_deg, 360.0)
        i = np.clip(np.searchsorted(phi, turn, side="right") - 1, 0, len(phi) - 2)
        j = np.clip(np.searchsorted(theta, wanted, side="right") - 1, 0, len(theta) - 2)
        s, t = (turn - phi[i]) / (phi[i + 1] - phi[i]), (wanted - theta[j]) / (theta[j + 1] - theta[j])
        cd = np.array(self.candela)
        found = (1 - s) * ((1 - t) * cd[i, j] + t * cd[i, j + 1]) + s * ((1 - t) * cd[i + 1, j] + t * cd[i + 1, j + 1])
        return np.where((wanted >= theta[0]) & (wanted <= theta[-1]), found, 0.0)


def read_ies(path: Path) -> Photometry:
    """Read the photometry of an IES file.

    Raises
    ------
    UserError
        If it is not an IES file, is damaged, is of type A or B, or has its tilt in another file.
    """
    return parse_ies(read_bytes(path, IES_BYTES), path)


def parse_ies(content: bytes, path: Path) -> Photometry:
    """`read_ies` for the content of the file at `path`."""
    with foreign_bytes(NAME, path):
        return _Reading(content.decode("latin-1"), path).photometry()


class _Reading:
    """One file."""

    def __init__(self, text: str, path: Path) -> None:
        self._path = path
        lines = text.lstrip("\ufeff").splitlines()
        self._first = lines[0].strip() if lines else ""
        start = next((i for i, line in enumerate(lines) if line.lstrip().upper().startswith("TILT")), None)
        if start is None:
            raise UserError("is not an IES file", file=path, expected="a line TILT=NONE or TILT=INCLUDE")
        self._tilt = lines[start].partition("=")[2].strip()
        words = _SEPARATORS.split("\n".join(lines[start + 1 :]))
        self._numbers = list(self._parsed(word for word in words if word))

    def photometry(self) -> Photometry:
        tilt = self._tilts()
        _, _, multiplier = self._take(3, "lamps, lumens and multiplier")
        verticals, horizontals, kind, units = (
            self._whole(name) for name in ("vertical angles", "horizontal angles", "photometric type", "units")
        )
        if kind != 1:
            found = f"type {_TYPES.get(kind, kind)}"
            hint = "ask for the type C file of the luminaire"
            raise self._error("photometric type", "photometry is not of type C", found, "type C (1)", hint)
        for name, count in (("vertical angles", verticals), ("horizontal angles", horizontals)):
            IES_ANGLES.check(count, file=self._path, field=name)
            if count < 1:
                raise self._error(name, "is empty", str(count), "1 or more")
        opening = [x * (FEET_M if units == 1 else 1.0) for x in self._take(3, "opening")]
        ballast, ballast_lamp, _ = self._take(3, "ballast factors and watts")
        scale = multiplier * ballast * (1.0 if self._first.upper() in FULL else ballast_lamp)
        if not 0 <= scale <= MOST_CD:
            raise self._error("multiplier", "intensities are out of range", f"{scale:g}", "0 or more")
        vertical = self._angles("vertical angles", verticals)
        horizontal = self._angles("horizontal angles", horizontals)
        values = scale * np.reshape(self._take(verticals * horizontals, "candela"), (horizontals, verticals))
        most = float(np.abs(values).max())
        if not most <= MOST_CD:
            raise self._error("candela", "intensities are out of range", f"{most:g}", f"up to {MOST_CD:g}")
        made = self._whole_sphere(vertical, horizontal, np.maximum(values, 0))
        return replace(made, opening_m=tuple(opening), tilt_deg=tilt[0], tilt_factors=tilt[1])

    def _whole_sphere(self, vertical: Floats, horizontal: Floats, values: Floats) -> Photometry:
        """Extend to the whole sphere, by the symmetry that the horizontal angles imply."""
        field = "vertical angles"
        if not (vertical[0] >= 0 and vertical[-1] <= 180):
            raise self._error(field, "are outside 0 to 180 degrees", f"{vertical[0]:g} to {vertical[-1]:g}")
        if len(vertical) == 1:
            raise self._error(field, "too few for a distribution", "1", "2 or more")
        if len(horizontal) == 1:
            horizontal, values = np.array([0.0, 360.0]), np.repeat(values, 2, axis=0)
        else:
            first, last = horizontal[0], horizontal[-1]
            if (first, last) == (90.0, 270.0):  # mirrored at the plane through both
                turned, index = np.unique(np.concatenate([horizontal, (180 - horizontal) % 360]), return_index=True)
                horizontal, values = _closed(turned, np.concatenate([values, values])[index])
            elif first != 0:
                raise self._error("horizontal angles", "start at an unsupported angle", f"{first:g}", "0, or 90 to 270")
            elif last == 90.0:
                horizontal, values = _mirrored(*_mirrored(horizontal, values, 90.0), 180.0)
            elif last == 180.0:
                horizontal, values = _mirrored(horizontal, values, 180.0)
            elif 180 < last <= 360:
                horizontal, values = _closed(horizontal, values)
            else:
                raise self._error("horizontal angles", "end at an unsupported angle", f"{last:g}", "0, 90, 180 or 360")
        return Photometry(tuple(vertical.tolist()), tuple(horizontal.tolist()), tuple(map(tuple, values.tolist())))

    def _tilts(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        if self._tilt.upper() == "NONE":
            return (0.0,), (1.0,)
        if self._tilt.upper() != "INCLUDE":
            raise self._error("TILT", "a tilt file is not supported", self._tilt[:40], "NONE or INCLUDE")
        geometry, pairs = self._whole("geometry"), self._whole("tilt angles")
        IES_ANGLES.check(pairs, file=self._path, field="tilt angles")
        if pairs < 1:
            raise self._error("tilt angles", "is empty", str(pairs), "1 or more")
        angles, factors = self._angles("tilt angles", pairs), self._take(pairs, "tilt factors")
        if min(factors) < 0 or max(factors) > MOST_CD:
            raise self._error("tilt factors", "factors are out of range", f"{min(factors):g}", "0 or more")
        if geometry == STAYS_LEVEL:
            return (0.0,), (float(factors[0]),)
        return tuple(angles.tolist()), tuple(factors)

    def _angles(self, field: str, count: int) -> Floats:
        angles = np.array(self._take(count, field))
        if any(b <= a for a, b in pairwise(angles.tolist())) or np.abs(angles).max() > 360:
            raise self._error(field, "angles do not increase", expected="increasing angles in degrees")
        return angles

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

    def _parsed(self, words: Iterable[str]) -> Iterator[float]:
        for word in words:
            try:
                number = float(word)
            except ValueError:
                return  # text after the data; if it comes too early, numbers are missing
            if not np.isfinite(number):
                raise self._error(None, "numbers are not finite", word[:20])
            yield number

    def _error(
        self,
        field: str | None,
        fault: str,
        got: str | None = None,
        expected: str | None = None,
        hint: str | None = None,
    ) -> UserError:
        return UserError(fault, file=self._path, field=field, got=got, expected=expected, hint=hint)


def _mirrored(horizontal: Floats, values: Floats, at_deg: float) -> tuple[Floats, Floats]:
    return np.concatenate([horizontal, 2 * at_deg - horizontal[-2::-1]]), np.concatenate([values, values[-2::-1]])


def _closed(horizontal: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Extend from 0 to 360, with the gap between the last angle and the first closed."""
    before, after = horizontal[-1] - 360, horizontal[0]
    share = -before / (after - before) if after > before else 0.0
    at_zero = (1 - share) * values[-1:] + share * values[:1]
    if after > 0:
        horizontal, values = np.insert(horizontal, 0, 0.0), np.concatenate([at_zero, values])
    if before < 0:
        horizontal, values = np.append(horizontal, 360.0), np.concatenate([values, at_zero])
    return horizontal, values
