"""The path traced picture B of a comparison: requested at rest, shown while it refines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.realtime.frame_state import FrameState
from lambent.realtime.given import Given
from lambent.scenes.scene import ImageTexture
from lambent.viewer.modes.walk.tracing import Traced, Tracing
from lambent.viewer.pacing import REST_S
from lambent.viewer.screen import Screen
from lambent.viewer.work import POLL_S

ALL_LIGHT = "full"  # the only part of the light that the path tracer has


class TracedPicture:
    """Shows the present path traced picture; `view` is None before the first."""

    under_way = False  # nothing is drawn in parts on the GPU

    def __init__(
        self, given: Given, screen: Screen, store: Path, sky_turn_deg: float, replaced: tuple[str, ...]
    ) -> None:  # fmt: skip
        self._given, self._screen, self._tracing = given, screen, Tracing(store, sky_turn_deg, replaced)
        self._of: tuple[FrameState, Mapping[str, str | ImageTexture]] | None = (
            None  # the requested frame, reduced to what paths depend on
        )
        self._is_mixed = False  # whether the picture A has another light mix than the scene
        self._asked = False
        self._changed_s = 0.0
        self._taken: Traced | None = None
        self._shown: object = None

    @property
    def view(self) -> Any:
        return None if self._taken is None else self._given.view

    @property
    def size(self) -> tuple[int, int]:
        """Width and height; 0, 0 before the first picture, reduced while it is coarse."""
        return (0, 0) if self._taken is None else size_of(self._taken)

    @property
    def samples(self) -> int:
        """Paths per pixel; 0 while there is only a coarse picture, or none."""
        return self._taken.samples if self._taken is not None and self._is_whole else 0

    @property
    def accumulated(self) -> int:
        """Passes in the picture's mean, one path per pixel each."""
        return self.samples

    @property
    def readable(self) -> bool:
        return self._taken is not None

    @property
    def fault(self) -> str:
        """Reason why there is no picture, in one line; else empty."""
        if self._of is not None and self._of[0].show != ALL_LIGHT:
            return "The path tracer shows all light: set 'show' to full."
        return self._tracing.error

    @property
    def label(self) -> str:
        """Label of the picture, for the divider."""
        if self.fault:
            return "not path traced"
        if self._taken is None:
            return f"path tracing: {self._tracing.what}" if self._asked else "path tracing: at rest"
        mix = ", light as baked" if self._is_mixed else ""
        return f"path traced, {f'{self.samples} samples' if self.samples else 'coarse'}{mix}"

    def update(self, wanted: FrameState, textures: Mapping[str, str | ImageTexture]) -> None:
        """Request a view once it rests, and show its present picture.

        `textures` replace textures of materials. Light mixes are not traced.
        """
        self._tracing.tick()
        of, self._is_mixed = (_traced_of(wanted), dict(textures)), bool(wanted.light)
        now_s = self._screen.clock()
        if of != self._of:
            self._of, self._changed_s, self._asked, self._taken = of, now_s, False, None
            self._tracing.ask(None, wanted.size, {}, {})
        if not self._asked and wanted.show == ALL_LIGHT and now_s - self._changed_s >= REST_S:
            self._asked = True
            self._tracing.ask(wanted.camera, wanted.size, wanted.materials, textures)
        last = self._tracing.last if self._asked else None
        if last is not None and last is not self._taken:
            self._given.take(last.radiance)
            self._taken, self._shown = last, None
        how = (wanted.exposure_ev, wanted.view_transform, wanted.scale)
        if self._taken is not None and how != self._shown:
            width, height = self.size
            self._given.show(replace(wanted, width=width, height=height))
            self._shown = how

    def wait_s(self) -> float | None:
        """Seconds until something may have changed; None: never."""
        if self.fault:
            return None
        if not self._asked:
            return max(0.0, self._changed_s + REST_S - self._screen.clock())
        return POLL_S if self._tracing.busy else None

    def work(self) -> bool:
        return False

    def read(self, at: tuple[float, float] | None = None) -> NDArray[np.float32]:
        """Radiance (height, width, 3); (1, 1, 3) `at` shares of the picture from its upper left."""
        assert self._taken is not None, "read before there is a picture"
        light = self._taken.radiance
        if at is None:
            return np.asarray(light, np.float32)
        height, width = light.shape[:2]
        column, row = (
            min(max(int(share * size), 0), size - 1) for share, size in zip(at, (width, height), strict=True)
        )
        return np.asarray(light[row : row + 1, column : column + 1], np.float32)

    def rest(self) -> None:
        """Pause until the next `update`."""
        if self._of is not None:
            self._of, self._asked, self._taken = None, False, None
            self._tracing.ask(None, (1, 1), {}, {})

    def close(self) -> None:
        """End the process."""
        self._tracing.close()

    @property
    def _is_whole(self) -> bool:
        return self._taken is not None and self._of is not None and self.size == self._of[0].size


def size_of(traced: Traced) -> tuple[int, int]:
    """Width and height of a traced picture."""
    height, width = traced.radiance.shape[:2]
    return width, height


def _traced_of(frame: FrameState) -> FrameState:
    """A frame reduced to the fields that path tracing depends on."""
    return FrameState(frame.camera, *frame.size, materials=dict(frame.materials), show=frame.show)
