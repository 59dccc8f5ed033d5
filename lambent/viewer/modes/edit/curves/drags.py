"""A drag over a plot as operators on its curve, or as a line drawn freehand. Nothing here draws or edits.

A drag is computed from its begin and its present end alone, so that it comes back exactly to where it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from pydantic import ValidationError

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.editing.operators import Kind, Operator, Region, room_for, translation
from lambent.viewer.modes.edit.curves.axes import Axis
from lambent.viewer.modes.edit.curves.lines import ANGLES_DEG

Tool = Literal["translate", "amplify", "draw"]
Direction = Literal["x and y", "x", "y"]
Channels = tuple[Literal[0, 1, 2], ...]
Point = tuple[float, float]  # angle in degrees, value
STRETCH = (0.05, 20.0)  # factors of x
NEAR = 0.05  # share of the axis: a grip closer to the base would amplify without bound
STEPS = 16  # of bisection
LEAST = 1e-30  # on a logarithmic axis


@dataclass(frozen=True)
class Drag:
    """What is dragged: by which tool, where it began, and the base that amplification leaves in place."""

    tool: Tool
    region: Region
    channels: Channels
    begin: Point
    y_axis: Axis
    x_axis: Axis
    base: Point = (0.0, 0.0)

    def operators(self, end: Point, direction: Direction) -> tuple[Operator, ...]:
        """The layers of a drag that ends here; none where nothing changes. That in y is the lower one."""
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
        """Stretched by `factor`, or as far as the curve does not fold."""
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
    """The direction while modifier keys are held: Shift keeps angles, Ctrl keeps values."""
    return "y" if shift else "x" if ctrl else direction


def resized(layer: Operator, size: float) -> Operator:
    """A layer with another size, and with ramps as wide as it needs.

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
    """A curve (KNOTS + 1, 3) with the line from `begin` to `end` drawn over it; straight on the axis that is shown."""
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
    """A distance that is not 0, with its sign."""
    least = least if bounded else LEAST
    return distance if abs(distance) >= least else (-least if distance < 0 else least)
