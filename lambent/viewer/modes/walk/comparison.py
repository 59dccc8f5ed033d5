"""Comparison of the picture A with B: drawn by another integrator, or traced.

By default B is traced against the baked light, and A is drawn: the difference is the error of drawing. Against other
pictures, A is the picture at rest: the difference from whole paths is the error of the baked light, that from a drawn B
the error of B. Figures compare displayed pictures; the map of differences compares luminances.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.colour import luminance, shown
from lambent.core.light.false_colour import STOPS, Range, false_colour, ramp
from lambent.core.machine import python_environment
from lambent.core.pictures.images import to_bytes
from lambent.core.pictures.metrics import psnr
from lambent.core.progress import Progress
from lambent.viewer.background.work import POLL_S, Work, pending
from lambent.viewer.mode import Divider, Image
from lambent.viewer.modes.walk.at_rest.tracing import KINDS as TRACED
from lambent.viewer.modes.walk.at_rest.tracing import Kind as TracedKind

Mode = Literal["off", "side by side", "error map"]
Kind = Literal["difference", "FLIP"]
MODES: tuple[Mode, ...] = get_args(Mode)
KINDS: tuple[Kind, ...] = get_args(Kind)
AS_A = "as A"  # look-up of B: the same as A's
PERCENT = Range(1.0, 100.0)  # scale of the map of differences
FLOOR = 0.02  # least divisor of relative differences, as a share of the mean luminance
FLIP_PIXELS = 1 << 19  # larger pictures are halved: FLIP takes seconds per million pixels
FLIP_PROGRAM = """
import sys
import numpy as np
from lambent.core.pictures.metrics import flip_error
np.save(sys.argv[2], flip_error(*np.load(sys.argv[1])))
"""
_FLIP_STOPS = np.array([(0, 0, 0.02), (0.32, 0.07, 0.48), (0.72, 0.21, 0.47), (0.98, 0.53, 0.38), (0.99, 0.99, 0.75)])


@dataclass(frozen=True)
class Figures:
    """Difference of A from B: PSNR in dB, mean difference in per cent, and mean FLIP once it is computed."""

    psnr_db: float
    difference_percent: float
    of: tuple[int, int]  # samples per pixel of A and B; 0 if drawn
    flip_mean: float | None = None
    flip_of: tuple[int, int] = (0, 0)
    flip_step: int = 1  # side of the pixel blocks that were averaged before FLIP


class Comparison:
    """Choice of the picture B, with figures and maps of its difference from A, updated at rest."""

    def __init__(self) -> None:
        self.mode: Mode = "off"
        self.integrator: str = TRACED[0]
        self.look_up = AS_A
        self.fault = ""  # why there is no B, in one line
        self.kind: Kind = "difference"
        self.divider = Divider()
        self.figures: Figures | None = None
        self.map: Image | None = None  # the error map to show, if any
        self._difference: Floats | None = None
        self._flip: Floats | None = None
        self._work: Work | None = None
        self._of: object = None
        self._compared: tuple[int, int] | None = None  # samples of A and B at the last comparison of `_of`
        self._painted: object = None  # values drawn in `map`

    @property
    def on(self) -> bool:
        return self.mode != "off"

    @property
    def traced_kind(self) -> TracedKind | None:
        """How B is traced; None if it is drawn or there is none."""
        return next((kind for kind in TRACED if self.on and kind == self.integrator), None)

    @property
    def busy(self) -> bool:
        return self._work is not None

    def due(self, of: object, samples: tuple[int, int]) -> bool:
        """Whether to compare the pictures of `of` now: when the samples of either have doubled."""
        if of != self._of:
            self.forget()
            self._of, self._compared = of, None
        return self._compared is None or any(n > 0 and n >= 2 * k for n, k in zip(samples, self._compared, strict=True))

    def forget(self) -> None:
        """Drop maps and work for earlier pictures; keep the figures."""
        if self._work is not None:
            self._work.cancel()
        self._work = self._difference = self._flip = self.map = self._painted = self._of = None

    def compare(self, a: Floats, b: Floats, view: str, exposure_ev: float, samples: tuple[int, int]) -> None:
        """Compare pictures (H, W, 3) of radiance with `samples` per pixel; FLIP runs in the background."""
        self._compared = samples
        self._difference = difference(a, b)
        pair = [shown(np.asarray(x, np.float32), view, exposure_ev) for x in (b, a)]
        figures, before = Figures(psnr(pair[0], pair[1]), float(self._difference.mean()), samples), self.figures
        if before is not None and self._flip is not None:
            figures = replace(figures, flip_mean=before.flip_mean, flip_of=before.flip_of, flip_step=before.flip_step)
        self.figures = figures
        if self._work is None:
            self._start_flip(pair, samples)

    def tick(self) -> None:
        """Take a finished FLIP, and draw the map."""
        self._work = pending(self._work)
        values = self._flip if self.kind == "FLIP" else self._difference
        if self.mode != "error map" or values is None:
            self.map = self._painted = None
        elif values is not self._painted:
            self.map, self._painted = _painted(values, self.kind), values

    def _start_flip(self, pair: list[Floats], samples: tuple[int, int]) -> None:
        step = 1 if pair[0].shape[0] * pair[0].shape[1] <= FLIP_PIXELS else 2
        reference, test = (_shrunk(picture, step) for picture in pair)
        of = self._of

        def done(error: Any) -> None:
            if of == self._of and self.figures is not None:
                self._flip = error
                self.figures = replace(self.figures, flip_mean=float(error.mean()), flip_of=samples, flip_step=step)

        def failed(_: object) -> None:
            self._flip = None  # PSNR and mean difference remain

        self._work = Work(lambda progress: flip_in_process(reference, test, progress), done, failed)


def difference(a: Floats, b: Floats) -> Floats:
    """|A - B| of the luminances (H, W) of two pictures of radiance, in per cent of B."""
    ya, yb = luminance(np.asarray(a, np.float64)), luminance(np.asarray(b, np.float64))
    return np.asarray(100 * np.abs(ya - yb) / np.maximum(yb, max(FLOOR * float(yb.mean()), 1e-9)))


def error_scale(kind: Kind) -> tuple[list[tuple[float, str]], Floats, str]:
    """Ticks (share of the scale, text), colours from low to high, and the unit of a map."""
    if kind == "FLIP":
        return [(x, f"{x:g}") for x in (0.0, 0.25, 0.5, 0.75, 1.0)], _FLIP_STOPS, "FLIP"
    marks = [(float(PERCENT.share(np.array(x))), f"{x:g}") for x in PERCENT.marks()]
    return marks, STOPS, "% of B"


def _painted(values: Floats, kind: Kind) -> Image:
    rgba = np.full((*values.shape, 4), 255, np.uint8)
    rgba[..., :3] = to_bytes(ramp(values, _FLIP_STOPS) if kind == "FLIP" else false_colour(values, PERCENT))
    return rgba


def _shrunk(encoded: Floats, step: int) -> Floats:
    if step == 1:
        return encoded
    height, width = (size - size % step for size in encoded.shape[:2])
    blocks = encoded[:height, :width].reshape(height // step, step, width // step, step, 3)
    return np.asarray(blocks.mean(axis=(1, 3)))


def flip_in_process(reference: Floats, test: Floats, progress: Progress) -> Floats:
    """FLIP error (H, W) of two encoded pictures (H, W, 3); `progress` may raise `Cancelled`.

    It runs in another process: the library holds Python's global lock, which would freeze the window.
    """
    with tempfile.TemporaryDirectory() as folder:
        pair, error, words = (Path(folder) / name for name in ("pair.npy", "error.npy", "words.txt"))
        np.save(pair, np.stack([reference, test]).astype(np.float32))
        command = [sys.executable, "-c", FLIP_PROGRAM, str(pair), str(error)]
        environment = python_environment()
        with words.open("w") as log, subprocess.Popen(command, stdout=log, stderr=log, env=environment) as worker:
            try:
                while worker.poll() is None:
                    progress(0, 1, "FLIP")
                    time.sleep(POLL_S)
            except BaseException:
                worker.kill()
                raise
        if worker.returncode != 0:
            raise UserError(f"FLIP could not be computed ({words.read_text().strip()[-200:]})")
        return np.asarray(np.load(error))
