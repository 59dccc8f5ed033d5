"""A picture beside another integrator's, and how far the two are apart.

The other is, unless chosen otherwise, the unbiased `qmc`, which accumulates while nothing moves: the error is then that
of the few samples. Figures compare what a display shows; the map of differences compares luminances.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.colour import luminance, shown
from lambent.core.false_colour import STOPS, Range, false_colour
from lambent.core.images import to_bytes
from lambent.core.metrics import psnr
from lambent.core.progress import Progress
from lambent.viewer.editor.work import Work
from lambent.viewer.flip_worker import flip_beside

Floats = NDArray[np.floating[Any]]
Mode = Literal["off", "side by side", "error map"]
Kind = Literal["difference", "FLIP"]
MODES: tuple[Mode, ...] = ("off", "side by side", "error map")
KINDS: tuple[Kind, ...] = ("difference", "FLIP")
REFERENCE = "qmc"
PERCENT = Range(1.0, 100.0)  # of the map of differences
FLOOR = 0.02  # of the mean luminance: below, a difference counts as one of this
FLIP_PIXELS = 1 << 19  # larger pictures are halved first: the library takes seconds per million
_FLIP_STOPS = np.array([(0, 0, 0.02), (0.32, 0.07, 0.48), (0.72, 0.21, 0.47), (0.98, 0.53, 0.38), (0.99, 0.99, 0.75)])


@dataclass(frozen=True)
class Figures:
    """How far A is from B: dB and the mean difference in percent; mean FLIP as soon as it is there."""

    psnr_db: float
    difference_percent: float
    of: int  # samples per pixel and lobe of B, 0 where B does not accumulate
    flip_mean: float | None = None
    flip_of: int = 0
    flip_step: int = 1  # pixels per side that were averaged first


@dataclass
class Comparison:
    """What is compared, and how. `split` is where A ends and B begins, as a share of the picture's width."""

    mode: Mode = "off"
    integrator: str = REFERENCE
    kind: Kind = "difference"
    split: float = 0.5
    figures: Figures | None = None
    busy: bool = False
    a_label: str = ""
    b_label: str = ""

    @property
    def on(self) -> bool:
        return self.mode != "off"


def difference(a: Floats, b: Floats) -> Floats:
    """|A - B| of the luminances (H, W) of two pictures of radiance, in percent of B's."""
    ya, yb = luminance(np.asarray(a, np.float64)), luminance(np.asarray(b, np.float64))
    return np.asarray(100 * np.abs(ya - yb) / np.maximum(yb, max(FLOOR * float(yb.mean()), 1e-9)))


class Errors:
    """The figures and maps of one window, brought up to date while nothing moves."""

    def __init__(self) -> None:
        self._difference: Floats | None = None
        self._flip: Floats | None = None
        self._work: Work | None = None
        self._seen: tuple[Any, ...] = ()
        self._next = 1  # accumulated frames at which it is worth comparing again
        self._made: tuple[str, int, int] = ("", 0, 0)
        self.picture: NDArray[np.uint8] | None = None  # (H, W, 4), the map

    def due(self, what: object, accumulated: int) -> bool:
        """Whether the pictures of `what`, B of so many frames, are to be compared: at 1, 2, 4, 8... frames."""
        if what != self._seen:
            self.forget()
            self._seen, self._next = what, 1  # type: ignore[assignment]
        return accumulated >= self._next

    def forget(self) -> None:
        """Drop what was found for other pictures."""
        if self._work is not None:
            self._work.cancel()
        self._work, self._difference, self._flip, self.picture, self._seen = None, None, None, None, ()

    def compare(
        self, comparison: Comparison, a: Floats, b: Floats, view: str, exposure_ev: float, frames: int, samples: int
    ) -> None:
        """Compare pictures (H, W, 3) of radiance; FLIP goes on in the background."""
        self._next = 2 * max(frames, 1)
        self._difference = difference(a, b)
        pair = [shown(np.asarray(x, np.float32), view, exposure_ev) for x in (b, a)]
        before = comparison.figures
        comparison.figures = Figures(psnr(pair[0], pair[1]), float(self._difference.mean()), samples)
        if before is not None and self._flip is not None:
            comparison.figures = _with_flip(comparison.figures, before.flip_mean, before.flip_of, before.flip_step)
        if self._work is None:
            self._start_flip(comparison, pair, samples)
        self._made = ("", 0, 0)

    def tick(self, comparison: Comparison) -> None:
        """Take what has ended in the background, and paint the map."""
        if self._work is not None and self._work.poll():
            self._work = None
        comparison.busy = self._work is not None
        values = self._flip if comparison.kind == "FLIP" else self._difference
        key = (comparison.kind, id(values), 0)
        if comparison.mode != "error map" or values is None:
            self.picture, self._made = None, ("", 0, 0)
        elif key != self._made:
            self.picture, self._made = _painted(values, comparison.kind), key

    @property
    def busy(self) -> bool:
        return self._work is not None

    def _start_flip(self, comparison: Comparison, pair: list[Floats], samples: int) -> None:
        step = 1 if pair[0].shape[0] * pair[0].shape[1] <= FLIP_PIXELS else 2
        small = [_shrunk(picture, step) for picture in pair]
        seen = self._seen

        def run(progress: Progress) -> Floats:
            return flip_beside(small[0], small[1], progress)

        def done(error: Any) -> None:
            if seen == self._seen and comparison.figures is not None:
                self._flip = error
                comparison.figures = _with_flip(comparison.figures, float(error.mean()), samples, step)

        def failed(_: object) -> None:
            self._flip = None  # PSNR and the difference stand without it

        self._work = Work(run, done, failed)


def error_scale(kind: Kind) -> tuple[list[tuple[float, str]], Floats, str]:
    """Marks (share of the scale, text), colours from low to high, and the unit of a map."""
    if kind == "FLIP":
        return [(x, f"{x:g}") for x in (0.0, 0.25, 0.5, 0.75, 1.0)], _FLIP_STOPS, "FLIP"
    marks = [(float(PERCENT.share(np.array(x))), f"{x:g}") for x in PERCENT.marks()]
    return marks, STOPS, "% of B"


def _painted(values: Floats, kind: Kind) -> NDArray[np.uint8]:
    if kind == "FLIP":
        at = np.clip(values, 0, 1) * (len(_FLIP_STOPS) - 1)
        index = np.arange(len(_FLIP_STOPS))
        colours = np.stack([np.interp(at, index, channel) for channel in _FLIP_STOPS.T], axis=-1)
    else:
        colours = false_colour(values, PERCENT)
    rgba = np.full((*values.shape, 4), 255, np.uint8)
    rgba[..., :3] = to_bytes(colours)
    return rgba


def _with_flip(figures: Figures, mean: float | None, of: int, step: int) -> Figures:
    return Figures(figures.psnr_db, figures.difference_percent, figures.of, mean, of, step)


def _shrunk(encoded: Floats, step: int) -> Floats:
    if step == 1:
        return encoded
    height, width = (size - size % step for size in encoded.shape[:2])
    blocks = encoded[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.asarray(blocks.mean(axis=(1, 3)))
