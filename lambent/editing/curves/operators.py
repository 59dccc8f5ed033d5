"""Operators on curves: translate and amplify a region, in x and in y (Ben-Artzi 2007, chapter 9).

An operator has full effect in [b, c], fades smoothly to none at a and d, and changes nothing outside. Its step function
is infinitely differentiable, so it creates no kinks. Operators are layered: first those in y, then those in x, because
operators in x move the regions of the others.
"""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from lambent.core.arrays import Floats
from lambent.core.strict import Strict
from lambent.materials.factored.curve import END_RAD, Curve, angles_rad

STEEPEST = 2.125  # largest slope of `smooth_step`
Kind = Literal["translate_x", "translate_y", "amplify_x", "amplify_y"]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class Region(Strict):
    """Region of an operator, in radians: a < b <= c < d. The ends may lie outside the curve."""

    a: Finite
    b: Finite
    c: Finite
    d: Finite

    @model_validator(mode="after")
    def _in_order(self) -> Region:
        if not self.a < self.b <= self.c < self.d:
            raise ValueError(f"a region has a < b <= c < d, not {self.a:g}, {self.b:g}, {self.c:g}, {self.d:g}")
        return self

    def weight(self, x: Floats) -> Floats:
        """Strength (...) of an operator at x: 1 in [b, c], 0 outside (a, d), smooth in between."""
        rise, fall = (x - self.a) / (self.b - self.a), (self.d - x) / (self.d - self.c)
        return smooth_step(np.minimum(rise, fall))


class Operator(Strict):
    """One edit of a curve.

    Attributes
    ----------
    kind
        translate_y: f(x) + size. amplify_y: base + size (f(x) - base). translate_x: moved by `size` radians to larger
        angles. amplify_x: stretched about the angle `base` by the factor `size`.
    channels
        Colour channels that it acts on.
    """

    kind: Kind
    region: Region
    size: Finite
    base: Finite = 0.0
    channels: tuple[Literal[0, 1, 2], ...] = (0, 1, 2)

    @model_validator(mode="after")
    def _does_not_fold(self) -> Operator:
        if self.kind == "amplify_x" and self.size <= 0:
            raise ValueError(f"a curve is stretched by a factor above 0, not {self.size:g}")
        if self.kind.endswith("_x") and np.any(np.diff(self.source(_fine(self.region))) < 0):
            raise ValueError(f"{self.kind} by {self.size:g} folds the curve over itself: widen a..b or c..d")
        return self

    def source(self, x: Floats) -> Floats:
        """Angle whose value the edited curve takes at x; x itself for operators in y."""
        weight = self.region.weight(x)
        if self.kind == "translate_x":
            return np.asarray(x - self.size * weight)
        if self.kind == "amplify_x":
            return np.asarray(x + (x - self.base) * (1 / self.size - 1) * weight)
        return x

    def applied(self, curve: Curve) -> Curve:
        """The edited curve, clamped at 0."""
        x = angles_rad()
        weight = self.region.weight(x)[:, None]
        if self.kind == "translate_y":
            edited = curve.values + self.size * weight
        elif self.kind == "amplify_y":
            edited = curve.values + (curve.values - self.base) * (self.size - 1) * weight
        else:
            edited = curve.at(np.clip(self.source(x), 0.0, END_RAD))
        chosen = np.isin(range(3), self.channels) & (weight > 0)
        return Curve(np.where(chosen, np.maximum(edited, 0.0), curve.values))


def translation(region: Region, x: float, y: float, channels: tuple[Literal[0, 1, 2], ...]) -> tuple[Operator, ...]:
    """A drag by x radians and y: the translation in y comes first, to act where the region is."""
    sizes: tuple[tuple[Kind, float], ...] = (("translate_y", y), ("translate_x", x))
    return tuple(Operator(kind=kind, region=region, size=size, channels=channels) for kind, size in sizes if size)


def room_for(region: Region, x: float) -> Region:
    """`region` with ramps widened as far as a translation by x radians needs."""
    need = abs(x) * STEEPEST * 1.01
    a = min(region.a, region.b - need) if x > 0 else region.a
    d = max(region.d, region.c + need) if x < 0 else region.d
    return region.model_copy(update={"a": a, "d": d})


def smooth_step(t: Floats) -> Floats:
    """0 for t <= 0, 1 for t >= 1, in between e(t) / (e(t) + e(1 - t)) with e(t) = exp(-1/(2t)^2): C-infinity."""
    inside = np.clip(t, 1e-3, 1 - 1e-3)  # beyond, the step is 0 or 1 in float64
    difference = 1 / (2 * inside) ** 2 - 1 / (2 * (1 - inside)) ** 2
    step = 1 / (1 + np.exp(np.clip(difference, -700, 700)))
    return np.where(t <= 0, 0.0, np.where(t >= 1, 1.0, step))


def _fine(region: Region) -> Floats:
    return np.linspace(region.a, region.d, 2049)
