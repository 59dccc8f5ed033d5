"""A frame in slices of time: an adapter in software takes seconds for a large frame, events wait for a slice at most.

Passes are generators that draw one band of rows after another, and yield where a frame may be cut. What a pixel becomes
does not depend on where: the bands of all passes together are the same frame to the bit.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from typing import Any

SLICE_S = 0.05
KEPT = 0.95  # of a cost per pixel, from slice to slice
STEP_ROWS = 16  # of a band; Mesa's rasteriser in software works on tiles of 64, and gains nothing by fewer, larger ones
Steps = Generator[None, None, None]  # of a pass


@dataclass(frozen=True)
class Band:
    """Rows `begin` to `end` (not included) of an image of `height` rows."""

    begin: int
    end: int
    width: int
    height: int

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of the image's height, from the top."""
        return self.begin / self.height, self.end / self.height

    @property
    def load_op(self) -> str:
        """The first band clears the targets of a pass, the others load them."""
        return "load" if self.begin else "clear"

    def cut(self, render: Any) -> None:
        """Keep a render pass within the band."""
        render.set_scissor_rect(0, self.begin, self.width, self.end - self.begin)


@dataclass
class Whole:
    """A frame in one slice. `encoder` takes the passes."""

    encoder: Any

    def bands(self, _: str, size: tuple[int, int]) -> Iterator[Band]:
        """One of all rows of an image of `size`."""
        yield Band(0, size[1], *size)


@dataclass
class Cut:
    """A frame in slices of about `SLICE_S`, by the time that a pixel of each kind of pass took before.

    `encoder` is that of the slice under way.
    """

    costs_s: dict[str, float] = field(default_factory=dict)  # per pixel, by the kind of pass; kept between frames
    encoder: Any = None
    _under_way: tuple[str, int] | None = None

    def bands(self, kind: str, size: tuple[int, int]) -> Iterator[Band]:
        """Bands of an image of `size`, one after another."""
        width, height = size
        begin, rows = 0, STEP_ROWS
        while begin < height:
            if kind in self.costs_s:
                fitting = max(1, int(SLICE_S / (self.costs_s[kind] * width * STEP_ROWS))) * STEP_ROWS
                rows = min(fitting, 2 * rows)  # by and by: the most costly rows may follow empty ones
            end = min(begin + rows, height)
            self._under_way = (kind, (end - begin) * width)
            yield Band(begin, end, width, height)
            begin = end

    def took(self, seconds: float) -> None:
        """Learn the time of the last slice."""
        if self._under_way is None:
            return
        kind, pixels = self._under_way
        per_pixel = max(seconds, 1e-6) / max(pixels, 1)
        # The greatest cost of the last frame or two: a band that took longer than foreseen was waited for.
        self.costs_s[kind] = max(per_pixel, KEPT * self.costs_s.get(kind, 0.0))
        self._under_way = None
