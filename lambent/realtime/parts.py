"""A frame in parts: an adapter in software takes seconds for a large one, and nothing is answered meanwhile.

Passes are generators that draw one band of rows of the picture after another, and yield where a frame may be cut. What
a pixel becomes does not depend on where: the bands of all passes together are the same picture to the bit.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from typing import Any

PART_S = 0.05
KEPT = 0.95  # of a cost per pixel, from part to part
STEP_ROWS = 16  # of a band; Mesa's rasteriser in software works on tiles of 64, and gains nothing by fewer, larger ones
Steps = Generator[None, None, int]  # of a pass; returns its draw calls


@dataclass(frozen=True)
class Band:
    """Rows `begin` to `end` (not included) of a picture of `height` rows."""

    begin: int
    end: int
    width: int
    height: int

    @property
    def shares(self) -> tuple[float, float]:
        """Of the picture's height, from the top."""
        return self.begin / self.height, self.end / self.height

    @property
    def load_op(self) -> str:
        """What a pass does with what its targets hold: the first band clears, the others go on."""
        return "load" if self.begin else "clear"

    def cut(self, render: Any) -> None:
        """Keep a render pass within the band."""
        render.set_scissor_rect(0, self.begin, self.width, self.end - self.begin)


@dataclass
class Whole:
    """A frame in one part. `encoder` takes the passes."""

    encoder: Any

    def bands(self, _: str, size: tuple[int, int]) -> Iterator[Band]:
        """One of all rows of a picture of `size`."""
        yield Band(0, size[1], *size)


@dataclass
class Cut:
    """A frame in parts of about `PART_S`, by what a pixel of each kind of pass took before.

    `encoder` is that of the part under way.
    """

    costs_s: dict[str, float] = field(default_factory=dict)  # per pixel, by the kind of pass; kept between frames
    encoder: Any = None
    _under_way: tuple[str, int] | None = None

    def bands(self, kind: str, size: tuple[int, int]) -> Iterator[Band]:
        """Bands of a picture of `size`, one after another."""
        width, height = size
        begin, rows = 0, STEP_ROWS
        while begin < height:
            if kind in self.costs_s:
                fitting = max(1, int(PART_S / (self.costs_s[kind] * width * STEP_ROWS))) * STEP_ROWS
                rows = min(fitting, 2 * rows)  # by and by: below empty rows stands what costs most
            end = min(begin + rows, height)
            self._under_way = (kind, (end - begin) * width)
            yield Band(begin, end, width, height)
            begin = end

    def took(self, seconds: float) -> None:
        """Learn what the last part took."""
        if self._under_way is None:
            return
        kind, pixels = self._under_way
        per_pixel = max(seconds, 1e-6) / max(pixels, 1)
        # The dearest of late, over a frame or two: a band that took longer than foreseen was waited for.
        self.costs_s[kind] = max(per_pixel, KEPT * self.costs_s.get(kind, 0.0))
        self._under_way = None
