"""Angles and values of a plot as pixels, and back; the shown range. Pure arithmetic."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

END_DEG = 90.0
LEAST_DEG = 0.05  # shortest range of angles: two knots of a curve
MARGIN = 4.0  # a drag may reach this many plot sizes beyond the edge


@dataclass(frozen=True)
class Axis:
    """A shown range on a linear or logarithmic scale; positions are shares of its length, 0 to 1."""

    low: float
    high: float
    log: bool = False

    def share(self, value: float) -> float:
        """Position of a value; on a logarithmic axis, values of 0 and less are far below."""
        if not self.log:
            return (value - self.low) / (self.high - self.low)
        if value <= 0:
            return -MARGIN
        return math.log(value / self.low) / math.log(self.high / self.low)

    def value(self, share: float) -> float:
        share = min(max(share, -MARGIN), 1 + MARGIN)
        if not self.log:
            return self.low + share * (self.high - self.low)
        return self.low * math.exp(share * math.log(self.high / self.low))

    def zoomed(self, about: float, factor: float) -> Axis:
        """Scale the range by `factor` about the value at share `about`."""
        return self._spread(about - about * factor, about + (1 - about) * factor)

    def panned(self, share: float) -> Axis:
        """Move the range by a share of its length."""
        return self._spread(share, 1 + share)

    def _spread(self, low: float, high: float) -> Axis:
        moved = replace(self, low=self.value(low), high=self.value(high))
        if self.log:
            sane = moved.low > 1e-30 and moved.high < 1e30 and moved.high / moved.low > 1.01
            return moved if sane else self
        longest = max(abs(moved.low), abs(moved.high))
        return moved if 1e-30 < longest < 1e30 and moved.high - moved.low > 1e-6 * longest else self


def within_curve(axis: Axis) -> Axis:
    """Move the range of angles into 0 to 90 degrees, and shorten it if needed."""
    length = min(max(axis.high - axis.low, LEAST_DEG), END_DEG)
    low = min(max(axis.low, 0.0), END_DEG - length)
    return Axis(low, low + length)


@dataclass(frozen=True)
class Place:
    """A rectangle in the window, in pixels."""

    x: float
    y: float
    width: float
    height: float


@dataclass(frozen=True)
class Axes:
    """A plot: angles in degrees across, values up, and its place in the window in pixels."""

    x: Axis
    y: Axis
    place: Place

    @property
    def least(self) -> float:
        """Smallest value that is drawn: a logarithmic axis has no 0."""
        return self.y.low * 1e-6 if self.y.log else 0.0

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Angle in degrees, clamped to 0 to 90, and value at a pixel, which may be outside of the plot."""
        across, up = (x - self.place.x) / self.place.width, (self.place.y + self.place.height - y) / self.place.height
        return min(max(self.x.value(across), 0.0), END_DEG), self.y.value(up)

    def pixel(self, angle_deg: float, value: float) -> tuple[float, float]:
        """The pixel of an angle and a value."""
        across, up = self.x.share(angle_deg), self.y.share(value)
        return self.place.x + across * self.place.width, self.place.y + (1 - up) * self.place.height
