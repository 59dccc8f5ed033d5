"""Converts a drag over a plot to operators on its curve, or to a freehand line. Nothing here draws or edits.

A drag is computed from its start and its present end only, so that dragging back restores the curve exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import ValidationError

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.editing.curves.operators import Kind, Operator, Region, room_for, translation
from lambent.viewer.modes.edit.curves.axes import Axis
from lambent.viewer.modes.edit.curves.lines import ANGLES_DEG

Tool = Literal["translate", "amplify", "draw"]
Direction = Literal["x and y", "x", "y"]
Channels = tuple[Literal[0, 1, 2], ...]
Point = tuple[float, float]  # angle in degrees, value
STRETCH = (0.05, 20.0)  # range of the factor on x
NEAR = 0.05  # least distance of grip and base, as a share of the axis: closer ones amplify without bound
STEPS = 16  # steps of bisection
LEAST = 1e-30  # least value on a logarithmic axis


@dataclass(frozen=True)
class Drag:
    """A drag: its tool, its start, and the base that amplification leaves in place."""

    tool: Tool
    region: Region
    channels: Channels
    begin: Point
    y_axis: Axis
    x_axis: Axis
    base: Point = (0.0, 0.0)

    def operators(self, end: Point, direction: Direction) -> tuple[Operator, ...]:
        """The layers of a drag that ends here, the layer in y first; empty if nothing changes."""
        if self.tool == "translate":
            x = 0.0 if direction == "y" else float(np.radians(end[0] - self.begin[0]))
            y = 0.0 if direction == "x" else end[1] - self.begin[1]
            return translation(room_for(self.region, x), x, y, self.channels)
        found = []
        if direction != "x":
            found.append(self._operator("amplify_y", self.region, self._factor_y(end[1]), self.base[1]))
        if direction != "y":
            found.append(self._stretched(self._factor_x(end[0])))
        return tuple(operator for operator in found if operator.size != 1)

    def _factor_y(self, value: float) -> float:
        reach = _away(self.begin[1] - self.base[1], NEAR * (self.y_axis.high - self.y_axis.low), not self.y_axis.log)
        return max(0.0, 1 + (value - self.begin[1]) / reach)

    def _factor_x(self, angle_deg: float) -> float:
        reach = _away(self.begin[0] - self.base[0], NEAR * (self.x_axis.high - self.x_axis.low), True)
        return min(max(1 + (angle_deg - self.begin[0]) / reach, STRETCH[0]), STRETCH[1])

    def _stretched(self, factor: float) -> Operator:
        """Stretch by `factor`, limited so that the curve does not fold."""
        base = float(np.radians(self.base[0]))
        possible, wanted = 1.0, factor
        for _ in range(STEPS):
            try:
                found = self._operator("amplify_x", self.region, wanted, base)
            except ValidationError:
                factor = wanted
            else:
                if wanted == factor:
                    return found
                possible = wanted
            wanted = (possible + factor) / 2
        return self._operator("amplify_x", self.region, possible, base)

    def _operator(self, kind: Kind, region: Region, size: float, base: float) -> Operator:
        return Operator(kind=kind, region=region, size=size, base=base, channels=self.channels)


def locked(direction: Direction, *, shift: bool, ctrl: bool) -> Direction:
    """The direction under modifier keys: Shift keeps angles, Ctrl keeps values."""
    return "y" if shift else "x" if ctrl else direction


def resized(layer: Operator, size: float) -> Operator:
    """A layer with another size, its ramps widened as far as needed.

    Raises
    ------
    UserError
        The curve would fold.
    """
    region = room_for(layer.region, size) if layer.kind == "translate_x" else layer.region
    try:
        return Operator(kind=layer.kind, region=region, size=size, base=layer.base, channels=layer.channels)
    except ValidationError as error:
        raise UserError(str(error.errors()[0]["msg"]), field=layer.kind) from error


def painted(values: Floats, begin: Point, end: Point, channels: Channels, log: bool) -> Floats:
    """A curve (KNOTS + 1, 3) overdrawn with a line from `begin` to `end`, straight on the shown axis."""
    low, high = sorted((begin, end)) if begin[0] != end[0] else (end, end)
    inside = np.flatnonzero((low[0] <= ANGLES_DEG) & (high[0] >= ANGLES_DEG))
    if not len(inside):
        inside = np.array([np.abs(ANGLES_DEG - end[0]).argmin()])
    ends = np.maximum((low[1], high[1]), LEAST if log else 0.0)
    across = np.interp(ANGLES_DEG[inside], (low[0], high[0]), np.log(ends) if log else ends)
    result = np.array(values)
    for channel in channels:
        result[inside, channel] = np.exp(across) if log else across
    return result


def _away(distance: float, least: float, bounded: bool) -> float:
    """A signed distance, kept away from 0."""
    least = least if bounded else LEAST
    return distance if abs(distance) >= least else (-least if distance < 0 else least)
