"""Frames in time slices: a software adapter takes seconds for a large frame; events wait for one slice at most.

Passes are generators that draw one band of rows after another, and yield where a frame may be cut. Cuts do not change
pixels: the sliced frame is identical, to the bit, to the whole one.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from typing import Any

SLICE_S = 0.05
KEPT = 0.95  # decay of the cost per pixel from slice to slice
STEP_ROWS = 16  # granularity of a band; Mesa's software rasteriser, with tiles of 64, is no faster with larger bands
Steps = Generator[None, None, None]  # a pass, which yields where a frame may be cut


@dataclass(frozen=True)
class Band:
    """Rows `begin` to `end` (not included) of an image of `height` rows."""

    begin: int
    end: int
    width: int
    height: int

    @property
    def shares(self) -> tuple[float, float]:
        """Begin and end as shares of the image's height, from the top."""
        return self.begin / self.height, self.end / self.height

    @property
    def load_op(self) -> str:
        """Load operation: the first band clears the targets of a pass, later ones load them."""
        return "load" if self.begin else "clear"

    def cut(self, render: Any) -> None:
        """Keep a render pass within the band."""
        render.set_scissor_rect(0, self.begin, self.width, self.end - self.begin)


@dataclass
class Whole:
    """A frame in one slice. `encoder` takes the passes."""

    encoder: Any

    def bands(self, _: str, size: tuple[int, int]) -> Iterator[Band]:
        """One band of all rows of an image of `size`."""
        yield Band(0, size[1], *size)


@dataclass
class Cut:
    """A frame in slices of about `SLICE_S`, sized by the measured time per pixel of each kind of pass.

    `encoder` takes the current slice.
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
                rows = min(fitting, 2 * rows)  # grow gradually: costly rows may follow empty ones
            end = min(begin + rows, height)
            self._under_way = (kind, (end - begin) * width)
            yield Band(begin, end, width, height)
            begin = end

    def took(self, seconds: float) -> None:
        """Update costs by the time of the last slice, s."""
        if self._under_way is None:
            return
        kind, pixels = self._under_way
        per_pixel = max(seconds, 1e-6) / max(pixels, 1)
        # Keep the greatest cost of the last frame or two: underestimates make events wait.
        self.costs_s[kind] = max(per_pixel, KEPT * self.costs_s.get(kind, 0.0))
        self._under_way = None
