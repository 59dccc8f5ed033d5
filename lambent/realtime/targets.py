"""What frames are drawn into, and how long each pass took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from lambent.realtime.passes.depth import DEPTH_FORMAT
from lambent.realtime.passes.tonemap import DISPLAY_FORMAT

_READ = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
_DRAW = wgpu.TextureUsage.RENDER_ATTACHMENT


@dataclass(frozen=True)
class Target:
    """Depth and radiance of one size."""

    depth: Any
    radiance: Any


class Targets:
    """Targets of the last size; others are forgotten."""

    def __init__(self, device: Any) -> None:
        self._device = device
        self._size: tuple[int, int] = (0, 0)
        self._made: dict[str, Any] = {}

    def fit(self, width: int, height: int, format: str) -> Target:
        """What light is drawn into; `format` is that of the radiance."""
        depth = self._texture("depth", width, height, DEPTH_FORMAT, _DRAW)
        return Target(depth, self._texture(format, width, height, format))

    def picture(self, name: str, width: int, height: int) -> Any:
        """An encoded picture that stays here."""
        return self._texture(name, width, height, DISPLAY_FORMAT)

    def _texture(self, name: str, width: int, height: int, format: str, usage: int = _DRAW | _READ) -> Any:
        if self._size != (width, height):
            self._size, self._made = (width, height), {}
        if name not in self._made:
            self._made[name] = self._device.create_texture(size=(width, height, 1), format=format, usage=usage)
        return self._made[name]


class PassTimer:
    """GPU time per pass by timestamp queries; measures nothing where the adapter has none."""

    PASSES = 512  # timed in one go: mirror pictures have one for each of their levels

    def __init__(self, device: Any) -> None:
        self._device, self._names = device, []  # type: Any, list[str]
        self._resolved: list[str] = []
        self._queries = None
        if "timestamp-query" in device.features:
            usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
            self._queries = device.create_query_set(type="timestamp", count=2 * self.PASSES)
            self._buffer = device.create_buffer(size=16 * self.PASSES, usage=usage)

    def writes(self, name: str) -> dict[str, Any]:
        """Arguments of `begin_render_pass` that time the pass."""
        if self._queries is None or len(self._names) == self.PASSES:
            return {}
        at = 2 * len(self._names)
        self._names.append(name)
        return {
            "timestamp_writes": {
                "query_set": self._queries,
                "beginning_of_pass_write_index": at,
                "end_of_pass_write_index": at + 1,
            }
        }

    def resolve(self, encoder: Any) -> None:
        """Encode the copy of this frame's times, after its last pass."""
        if self._names:
            encoder.resolve_query_set(self._queries, 0, 2 * len(self._names), self._buffer, 0)
        self._resolved, self._names = self._names, []

    def read(self) -> dict[str, float]:
        """Milliseconds of the last frame by the passes' names; waits for the GPU."""
        if not self._resolved:
            return {}
        data = self._device.queue.read_buffer(self._buffer, size=16 * len(self._resolved))
        ticks = np.frombuffer(data, np.uint64).reshape(-1, 2).astype(np.float64)
        times: dict[str, float] = {}
        for name, ms in zip(self._resolved, (ticks[:, 1] - ticks[:, 0]) * 1e-6, strict=True):
            times[name] = times.get(name, 0.0) + float(ms)
        return times
