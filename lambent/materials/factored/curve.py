"""One-dimensional factors of a BRDF: curves over an angle from 0 to 90 degrees, one per colour channel."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from lambent.core.arrays import Floats

END_RAD = np.pi / 2  # every parametrisation ends there
KNOTS = 4096  # intervals: 1.3 minutes of arc, an eighth of the narrowest lobe's slope of .003


@dataclass(frozen=True, eq=False)
class Curve:
    """A piecewise linear function: values (KNOTS + 1, 3) at equal steps from 0 to `END_RAD`."""

    values: Floats

    def __post_init__(self) -> None:
        values = np.array(self.values, float)
        if values.shape != (KNOTS + 1, 3) or not np.isfinite(values).all():
            raise ValueError(f"a curve has {KNOTS + 1} finite RGB values, not an array of shape {values.shape}")
        values.flags.writeable = False
        object.__setattr__(self, "values", values)

    @classmethod
    def of(cls, function: Callable[[Floats], Floats]) -> Curve:
        """The curve of a function of angles in radians, (K,) to (K,), or to (K, 3) with channels of their own."""
        values = np.asarray(function(angles_rad()), float)
        return cls(np.broadcast_to(values.reshape(KNOTS + 1, -1), (KNOTS + 1, 3)))

    @classmethod
    def constant(cls, value: float = 1.0) -> Curve:
        return cls(np.full((KNOTS + 1, 3), value))

    @classmethod
    def through(cls, angle_rad: Floats, values: Floats) -> Curve:
        """The curve through points: angles (K,) increasing, values (K,) or (K, 3); constant beyond the outermost."""
        columns = np.broadcast_to(np.asarray(values, float).reshape(len(angle_rad), -1), (len(angle_rad), 3))
        return cls(np.stack([np.interp(angles_rad(), angle_rad, columns[:, c]) for c in range(3)], axis=1))

    def at(self, angle_rad: Floats) -> Floats:
        """Values (..., 3) at angles (...) in radians; 0 beyond the end, the first value below 0."""
        inside = np.asarray(angle_rad) <= END_RAD + 1e-9
        columns = [np.interp(angle_rad, angles_rad(), self.values[:, c]) for c in range(3)]
        return np.where(inside[..., None], np.stack(columns, axis=-1), 0.0)

    def band_means(self, bands: int, polar: int = 0) -> Floats:
        """Coefficients (bands, 3): the exact mean over each of `bands` equal bands; `bands` must divide KNOTS.

        Point samples would pop while a narrow peak is dragged (Ben-Artzi 2007, eq. 4.17). If `polar` times the angle is
        an angle from an axis, bands are rings of a sphere, and a peak keeps its light in any band.
        """
        per_band, rest = divmod(KNOTS, bands)
        if rest:
            raise ValueError(f"{bands} bands do not divide {KNOTS} intervals")
        means = self._interval_means.reshape(bands, per_band, 3)
        if not polar:
            return np.asarray(means.mean(axis=1))
        rings = _rings(polar).reshape(bands, per_band, 1)
        return np.asarray((means * rings).sum(axis=1) / rings.sum(axis=1))

    def node_values(self, bands: int, polar: int = 0) -> Floats:
        """Values (bands, 3) at the centres of equal bands, whose linear interpolation follows the curve.

        Curve values at the centres would make a narrow peak pop while it is dragged. Means over the bands flatten it by
        1/8 of their second difference. That amount is added back, limited to half way to the curve's least and largest
        value in the band and its neighbours, so that nothing overshoots or becomes negative. With `polar`, see
        `band_means`, the first value preserves the light of the first two bands: a mean would make a peak about the
        axis brighter with wider bands.
        """
        means, per_band = self.band_means(bands), KNOTS // bands
        within = np.ascontiguousarray(self.values[:-1].T).reshape(3, bands, per_band)  # fast along the last axis
        least, most = (f(f.reduce(within, axis=2).T, self.values[per_band::per_band]) for f in (np.minimum, np.maximum))
        least, most = (np.pad(of, ((1, 1), (0, 0)), mode="edge") for of in (least, most))
        below = means - np.minimum(np.minimum(least[:-2], least[1:-1]), least[2:])
        above = np.maximum(np.maximum(most[:-2], most[1:-1]), most[2:]) - means
        rise = np.diff(means, axis=0)
        room = np.where(rise > 0, np.minimum(below[:-1], above[1:]), np.minimum(above[:-1], below[1:]))
        moved = np.sign(rise) * np.minimum(np.abs(rise) / 8, room / 2)
        found = means - np.diff(np.pad(moved, ((1, 1), (0, 0))), axis=0)
        if polar and bands > 2:
            rings, shares = _first_lines(bands, polar)
            light = rings @ self._interval_means[: len(rings)] - shares[1:] @ found[1:3]
            found[0] = np.clip(light / shares[0], least[1], most[1])
        return np.asarray(found)

    @cached_property
    def _interval_means(self) -> Floats:
        return np.asarray((self.values[:-1] + self.values[1:]) / 2)


def angles_rad() -> Floats:
    """(KNOTS + 1,) angles of a curve's values."""
    return np.linspace(0, END_RAD, KNOTS + 1)


@lru_cache(maxsize=8)
def _rings(polar: int) -> Floats:
    """(KNOTS,) solid angles of intervals, over pi."""
    return np.abs(np.diff(np.cos(polar * angles_rad())))


@lru_cache(maxsize=32)
def _first_lines(bands: int, polar: int) -> tuple[Floats, Floats]:
    """Solid angles (2 KNOTS / bands,) of intervals in the first two bands, and the light (3,) in them of value 1 at
    the first, second and third node, with linear interpolation."""
    count = 2 * KNOTS // bands
    nodes = np.arange(3) * (KNOTS // bands) + KNOTS / bands / 2
    rings, middles = _rings(polar)[:count], np.arange(count) + 0.5
    return rings, np.array([rings @ np.interp(middles, nodes, at) for at in np.eye(3)])
