"""The luminous intensity of a luminaire by direction, in type C angles, and what its readers share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.scenes.photometry.opening import POINT, Opening

MOST_CD = 1e12
EDGE_DEG = 1e-6  # tolerance beyond the first and the last angle, and least step
ANGLE_DIGITS = 6  # mirrored angles are equal up to rounding


@dataclass(frozen=True)
class Photometry:
    """Luminous intensity of a luminaire, linear in both angles; beyond the given angles there is no light.

    Attributes
    ----------
    vertical_deg : (V,)
        Ascending, within 0 to 180; 0 is the luminaire's axis.
    horizontal_deg : (H,)
        Ascending from 0 to 360, both included.
    candela : (H, V)
        Not negative.
    opening : Opening
        Its luminous opening.
    tilt_deg, tilt_factors : (N,)
        Factors on all intensities by the angle between the luminaire's axis and straight down.
    """

    vertical_deg: tuple[float, ...]
    horizontal_deg: tuple[float, ...]
    candela: tuple[tuple[float, ...], ...]
    opening: Opening = POINT
    tilt_deg: tuple[float, ...] = (0.0,)
    tilt_factors: tuple[float, ...] = (1.0,)

    @classmethod
    def of(cls, vertical_deg: Floats, horizontal_deg: Floats, candela: Floats) -> Photometry:
        """Of arrays (V,), (H,) and (H, V)."""
        return cls(tuple(vertical_deg.tolist()), tuple(horizontal_deg.tolist()), tuple(map(tuple, candela.tolist())))

    @cached_property
    def table(self) -> Floats:
        """The candela as an array (H, V)."""
        return np.array(self.candela)

    @cached_property
    def lumens(self) -> float:
        """Luminous flux of all directions, the exact integral of `at`."""
        return self.lumens_within(180.0)

    def lumens_within(self, most_deg: float) -> float:
        """Luminous flux of directions up to `most_deg` from the axis."""
        theta, phi = np.radians(self.vertical_deg), np.radians(self.horizontal_deg)
        around = ((self.table[1:] + self.table[:-1]) / 2 * np.diff(phi)[:, None]).sum(axis=0)
        a, b = theta[:-1], np.minimum(theta[1:], np.radians(most_deg))
        slope = np.diff(around) / np.diff(theta)
        # of (start + slope (x - a)) sin x from a to b
        whole = around[:-1] * (np.cos(a) - np.cos(b)) + slope * (np.sin(b) - np.sin(a) - (b - a) * np.cos(b))
        return float(whole[a < b].sum())

    def scaled(self, factor: float) -> Photometry:
        """With all intensities multiplied by `factor`."""
        return replace(self, candela=tuple(map(tuple, (factor * self.table).tolist())))

    def tilted(self, tilt_deg: float) -> float:
        """Factor on all intensities of a luminaire whose axis is tilted by `tilt_deg` from straight down."""
        return float(np.interp(tilt_deg, self.tilt_deg, self.tilt_factors))

    def at(self, vertical_deg: Floats, horizontal_deg: Floats) -> Floats:
        """Candela (...) towards angles (...), without tilt."""
        theta, phi = np.array(self.vertical_deg), np.array(self.horizontal_deg)
        wanted, turn = np.asarray(vertical_deg, float), np.mod(horizontal_deg, 360.0)
        i = np.clip(np.searchsorted(phi, turn, side="right") - 1, 0, len(phi) - 2)
        j = np.clip(np.searchsorted(theta, wanted, side="right") - 1, 0, len(theta) - 2)
        s = np.clip((turn - phi[i]) / (phi[i + 1] - phi[i]), 0, 1)
        t = np.clip((wanted - theta[j]) / (theta[j + 1] - theta[j]), 0, 1)
        cd = self.table
        found = (1 - s) * ((1 - t) * cd[i, j] + t * cd[i, j + 1]) + s * ((1 - t) * cd[i + 1, j] + t * cd[i + 1, j + 1])
        return np.where(_within(wanted, theta) & _within(turn, phi), found, 0.0)


def _within(angle_deg: Floats, nodes_deg: Floats) -> Flags:
    inside: Flags = (angle_deg >= nodes_deg[0] - EDGE_DEG) & (angle_deg <= nodes_deg[-1] + EDGE_DEG)
    return inside


def numbers_of(words: Iterable[str], file: Path) -> Iterator[float]:
    """The numbers up to the first text; raise `UserError` if one is not finite."""
    for word in words:
        try:
            number = float(word)
        except ValueError:
            return  # text after the data; if it comes too early, numbers are missing
        if not np.isfinite(number):
            raise UserError("numbers are not finite", file=file, got=word[:20])
        yield number


def check_angles(angles_deg: Floats, least: float, most: float, file: Path, field: str, fewest: int = 1) -> None:
    """Raise `UserError` unless angles increase, lie from `least` to `most` degrees, and are at least `fewest`."""
    error = partial(UserError, file=file, field=field)
    if len(angles_deg) < fewest:
        raise error("are too few for a distribution", got=len(angles_deg), expected=f"{fewest} or more")
    if (np.diff(angles_deg) < EDGE_DEG).any():
        raise error("angles do not increase", expected="increasing angles in degrees")
    if not least <= angles_deg[0] <= angles_deg[-1] <= most:
        raise error(f"are outside {least:g} to {most:g} degrees", got=f"{angles_deg[0]:g} to {angles_deg[-1]:g}")


def check_cd(candela: Floats, file: Path) -> None:
    """Raise `UserError` if intensities are beyond all luminaires."""
    if not (most := float(np.abs(candela).max())) <= MOST_CD:
        got, expected = f"{most:g}", f"up to {MOST_CD:g}"
        raise UserError("are out of range", file=file, field="intensities", got=got, expected=expected)


def odd_values(horizontal_deg: Floats, candela: Floats) -> tuple[str, ...]:
    """Lines on intensities (H, V) below zero, and on planes 0 and 360 that differ."""
    said, below = [], candela < 0
    if below.any():
        share = f"{int(below.sum())} of {candela.size} intensities ({below.mean():.2g} of all)"
        said.append(f"{share} are below zero, down to {float(candela.min()):.3g}; they count as 0")
    first, last = (candela[np.isclose(horizontal_deg, at)] for at in (0, 360))
    if len(first) and len(last) and (off := float(np.abs(first - last).max())) > 0:
        said.append(f"planes 0 and 360 differ, by up to {off:.3g}; plane 0 is taken")
    return tuple(said)


def whole_turn(horizontal_deg: Floats, values: Floats, mirrors_deg: Iterable[float] = ()) -> tuple[Floats, Floats]:
    """Angles from 0 to 360 degrees, both included, and values (H, V) there.

    Values are mirrored at each of the planes through the axis at `mirrors_deg`, one after the other, and linear in the
    gap that is left.
    """
    for at_deg in mirrors_deg:
        horizontal_deg = np.concatenate([horizontal_deg, 2 * at_deg - horizontal_deg])
        values = np.concatenate([values, values])
    rounded = np.mod(np.round(np.mod(horizontal_deg, 360.0), ANGLE_DIGITS), 360.0)
    turned, index = np.unique(rounded, return_index=True)
    before, after, inner = turned[-1] - 360, turned[0], turned > 0
    share = -before / (after - before)
    at_zero = (1 - share) * values[index[-1:]] + share * values[index[:1]]
    return np.array([0, *turned[inner], 360.0]), np.concatenate([at_zero, values[index[inner]], at_zero])
