"""What frames are drawn into, and how long each pass took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu

from lambent.realtime.passes.depth import DEPTH_FORMAT

_READ = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
_DRAW = wgpu.TextureUsage.RENDER_ATTACHMENT


@dataclass(frozen=True)
class Target:
    """Colour and depth of one size. `radiance` is what later passes read."""

    format: str
    pixel_samples: int
    depth: Any
    colour: Any
    radiance: Any

    def attachment(self) -> dict[str, Any]:
        """The colour attachment: cleared to black, and resolved where it has several samples."""
        colour = {"view": self.colour.create_view(), "load_op": "clear", "store_op": "store"}
        if self.pixel_samples > 1:
            colour |= {"resolve_target": self.radiance.create_view(), "store_op": "discard"}
        return colour


class Targets:
    """Targets of the last size; others are forgotten."""

    def __init__(self, device: Any) -> None:
        self._device = device
        self._size: tuple[int, int] = (0, 0)
        self._made: dict[Any, Any] = {}

    def fit(self, width: int, height: int, single: bool) -> Target:
        """Four samples of half floats, or one of full floats (`single`: progressive frames must not round)."""
        self._forget_other_sizes(width, height)
        if single not in self._made:
            format, count = ("rgba32float", 1) if single else ("rgba16float", 4)
            depth = self._texture(DEPTH_FORMAT, count, _DRAW)
            colour = self._texture(format, count, _DRAW | _READ if single else _DRAW)
            radiance = colour if single else self._texture(format, 1, _DRAW | _READ)
            self._made[single] = Target(format, count, depth, colour, radiance)
        target: Target = self._made[single]
        return target

    def display(self, width: int, height: int, format: str) -> Any:
        """A texture that stands in for a window."""
        self._forget_other_sizes(width, height)
        if format not in self._made:
            self._made[format] = self._texture(format, 1, _DRAW | _READ)
        return self._made[format]

    def _forget_other_sizes(self, width: int, height: int) -> None:
        if self._size != (width, height):
            self._size, self._made = (width, height), {}

    def _texture(self, format: str, sample_count: int, usage: int) -> Any:
        return self._device.create_texture(size=(*self._size, 1), format=format, sample_count=sample_count, usage=usage)


class PassTimer:
    """GPU time per pass by timestamp queries; measures nothing where the adapter has none."""

    PASSES = 8

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
        if self._queries is None:
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
        """Milliseconds per pass of the last frame; waits for the GPU."""
        if not self._resolved:
            return {}
        data = self._device.queue.read_buffer(self._buffer, size=16 * len(self._resolved))
        ticks = np.frombuffer(data, np.uint64).reshape(-1, 2).astype(np.float64)
        return {n: float(t) for n, t in zip(self._resolved, (ticks[:, 1] - ticks[:, 0]) * 1e-6, strict=True)}
