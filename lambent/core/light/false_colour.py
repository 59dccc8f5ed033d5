"""False-colour images of luminance with a numbered scale, for lighting designers."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.photometry import LUMINANCE

# Encoded colours at even steps from the low end to the high one; realtime/display/false_colour.wgsl has a copy.
STOPS = np.array(
    [
        (0.11, 0.07, 0.28), (0.16, 0.27, 0.62), (0.12, 0.52, 0.78), (0.09, 0.70, 0.64), (0.30, 0.76, 0.35),
        (0.71, 0.80, 0.20), (0.96, 0.75, 0.13), (0.94, 0.45, 0.12), (0.78, 0.12, 0.12),
    ]
)  # fmt: skip
SIGNED = np.array(
    [
        (0.55, 0.85, 1.00), (0.20, 0.55, 0.95), (0.12, 0.27, 0.60), (0.07, 0.07, 0.07), (0.55, 0.20, 0.07),
        (0.93, 0.50, 0.12), (1.00, 0.88, 0.50),
    ]
)  # fmt: skip
BELOW, ABOVE = (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)
LEAST, MOST = 1e-4, 1e9  # limits of the ends of a range
DECADES = 3.0  # of a logarithmic range fitted to an image
ROUND = (1, 2, 5, 10)  # leading digits of round numbers


@dataclass(frozen=True)
class Range:
    """Scale from `low` (dark blue) to `high` (red), in a quantity's unit; black below, white above."""

    low: float = 1.0
    high: float = 1000.0
    log: bool = True

    @property
    def stops(self) -> Floats:
        """Encoded colours at even steps."""
        return STOPS

    def check(self) -> None:
        """Raise `UserError` if no scale can be drawn."""
        least = LEAST if self.log else 0.0
        if not (least <= self.low < self.high <= MOST):
            expected = f"{least:g} <= LOW < HIGH <= {MOST:g}"
            raise UserError("is not a luminance range", got=f"{self.low:g}:{self.high:g}", expected=expected)

    def share(self, values: Floats) -> Floats:
        """Positions of values on the scale: 0 at `low`, 1 at `high`."""
        if self.log:
            lowest = math.log(self.low)
            return np.asarray((np.log(np.maximum(values, 1e-12)) - lowest) / (math.log(self.high) - lowest))
        return np.asarray((values - self.low) / (self.high - self.low))

    def marks(self) -> list[float]:
        """Round numbers for the scale: 1, 2 and 5 of each decade, and the ends if they are round."""
        if self.log:
            decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
            digits = ROUND[:1] if math.log10(self.high / self.low) > 4 else ROUND[:3]
            found = [digit * 10.0**decade for decade in decades for digit in digits]
        else:
            step = _round_up((self.high - self.low) / 8, slack=0.0)
            found = [step * k for k in range(math.ceil(self.low / step), math.floor(self.high / step) + 1)]
        inside = [x for x in found if self.low - 1e-9 * abs(self.low) <= x <= self.high * (1 + 1e-9)]
        return inside or [self.low, self.high]


class SignedRange(Range):
    """Linear scale of differences from -most (light blue) over 0 (black) to most (light orange); clamped beyond."""

    def __init__(self, most: float) -> None:
        super().__init__(-most, most, log=False)

    @property
    def stops(self) -> Floats:
        return SIGNED

    def share(self, values: Floats) -> Floats:
        return np.clip(super().share(values), 0.0, 1.0)

    @classmethod
    def fitting(cls, values: Floats) -> SignedRange:
        """A range that holds all differences of an image but the largest half percent."""
        sizes = np.abs(values[np.isfinite(values)])
        return cls(_round_up(min(max(float(np.percentile(sizes, 99.5)) if sizes.size else 0.0, LEAST), MOST)))


def fitting_range(values: Floats, *, log: bool = True) -> Range:
    """A range of round numbers that holds all values of an image but the brightest half percent.

    Logarithmic ranges span at most `DECADES` below the high end.
    """
    positive = values[np.isfinite(values) & (values > 0)]
    if not positive.size:
        return Range(log=log)
    low, high = np.percentile(positive, (1.0, 99.5))
    high = _round_up(min(max(float(high), 10 * LEAST), MOST))
    if not log:
        return Range(0.0, high, log=False)
    low = max(float(low), high / 10**DECADES, LEAST)
    down = 10.0 ** math.floor(math.log10(low))
    low = max(m * down for m in ROUND[:3] if m * down <= low * (1 + 1e-9))
    return Range(low if low < high else high / 10, high)


def false_colour(values: Floats, scale: Range) -> Floats:
    """Encoded colours (..., 3) of luminances (...)."""
    share = scale.share(values)
    colours = np.where((share < 0)[..., None], BELOW, ramp(share, scale.stops))
    return np.asarray(np.where((share > 1)[..., None], ABOVE, colours))


def ramp(share: Floats, stops: Floats = STOPS) -> Floats:
    """Colours (..., 3) at positions `share` (...) in [0, 1], interpolated in `stops` (N, 3) at even steps."""
    at = np.clip(share, 0, 1) * (len(stops) - 1)
    return np.stack([np.interp(at, np.arange(len(stops)), channel) for channel in stops.T], axis=-1)


def number(value: float) -> str:
    """A number of the scale in plain notation: three digits, no exponent."""
    if value < 0:
        return f"-{number(-value)}"
    digits = max(0, 2 - math.floor(math.log10(value))) if value > 0 else 0
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if digits else text


def with_scale(picture: NDArray[np.uint8], scale: Range, unit: str = LUMINANCE.unit) -> NDArray[np.uint8]:
    """A copy of an encoded image (H, W, 3) with the numbered scale drawn over its right edge."""
    from PIL import Image, ImageDraw, ImageFont

    height, width = picture.shape[:2]
    size = max(8, min(18, height // 30, width // 12))
    font = ImageFont.load_default(size)
    image = Image.fromarray(picture.copy()).convert("RGB")
    draw = ImageDraw.Draw(image, "RGBA")
    labels = [number(value) for value in scale.marks()]
    wide = max([draw.textlength(text, font) for text in (*labels, unit)])
    bar, gap = size, size // 2
    x0, y0, y1 = width - bar - 2 * gap - round(wide) - gap, 2 * size + gap, height - size - gap
    if y1 - y0 < 2 * size or x0 < 0:
        return picture
    draw.rectangle((x0 - gap, 0, width, height), fill=(0, 0, 0, 150))
    draw.text((x0, gap), unit, font=font, fill=(255, 255, 255, 255))
    steps = np.linspace(1, 0, y1 - y0)
    span = scale.low * (scale.high / scale.low) ** steps if scale.log else scale.low + (scale.high - scale.low) * steps
    colours = (255 * false_colour(span, scale) + 0.5).astype(int)
    for row, colour in enumerate(colours):
        draw.line((x0, y0 + row, x0 + bar, y0 + row), fill=(*map(int, colour), 255))
    last = math.inf
    for value, text in zip(scale.marks(), labels, strict=True):
        y = y1 - float(scale.share(np.array(value))) * (y1 - y0)
        if last - y >= 1.1 * size:  # skip numbers that would touch the one below
            draw.line((x0 + bar - gap // 2, y, x0 + bar, y), fill=(255, 255, 255, 255))
            draw.text((x0 + bar + gap, y), text, font=font, fill=(255, 255, 255, 255), anchor="lm")
            last = y
    return np.asarray(image, np.uint8)


def _round_up(value: float, slack: float = 1e-9) -> float:
    down = 10.0 ** math.floor(math.log10(value))
    return next(m * down for m in ROUND if m * down >= value * (1 - slack))
