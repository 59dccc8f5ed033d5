"""Render targets of frames, and GPU times of passes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

DEPTH_FORMAT, DISPLAY_FORMAT = "depth32float", "rgba8unorm"


def target_texture(device: Any, size: tuple[int, ...], format: str, levels: int = 1) -> Any:
    """Texture of size (width, height) or (width, height, layers) for passes to draw into and read."""
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
    return device.create_texture(size=size, format=format, mip_level_count=levels, usage=usage)


def texels(device: Any, texture: Any) -> NDArray[Any]:
    """(height, width, 4) texels of a four-channel texture, row 0 on top; waits for the GPU."""
    width, height, _ = texture.size
    dtype = np.dtype({"rgba8unorm": np.uint8, "rgba16float": np.float16, "rgba32float": np.float32}[texture.format])
    rows = {"bytes_per_row": 4 * width * dtype.itemsize}
    data = device.queue.read_texture({"texture": texture}, rows, (width, height, 1))
    return np.frombuffer(data, dtype).reshape(height, width, 4)


def pixels(device: Any, texture: Any) -> NDArray[Any]:
    """(height, width, 3): `texels` without the last channel."""
    return texels(device, texture)[..., :3]


def stored(views: Iterable[Any], load_op: str = "clear") -> list[dict[str, Any]]:
    """Colour attachments of a render pass that stores its result."""
    return [{"view": view, "load_op": load_op, "store_op": "store"} for view in views]


@dataclass(frozen=True)
class Target:
    """Textures of depth (reversed: 0 is infinity) and radiance."""

    depth: Any
    radiance: Any


class Targets:
    """Targets of the latest size; other sizes are released."""

    def __init__(self, device: Any) -> None:
        self._device = device
        self._size: tuple[int, int] = (0, 0)
        self._made: dict[str, Any] = {}

    def fit(self, size: tuple[int, int], format: str, *, passing: bool = False) -> Target:
        """The target for light of a size; `format` is the format of the radiance.

        Passing frames have a separate target, so that the last one stays while other frames are drawn.
        """
        name = f"{format}, passing" if passing else format
        return Target(self._texture("depth", size, DEPTH_FORMAT), self._texture(name, size, format))

    def display(self, name: str, size: tuple[int, int]) -> Any:
        """The display image `name`; its texture stays until the size changes."""
        return self._texture(name, size, DISPLAY_FORMAT)

    def _texture(self, name: str, size: tuple[int, int], format: str) -> Any:
        if self._size != size:
            self._size, self._made = size, {}
        if name not in self._made:
            self._made[name] = target_texture(self._device, size, format)
        return self._made[name]


class PassTimer:
    """GPU time per pass by timestamp queries; measures nothing on adapters without them."""

    PASSES = 512  # most timed passes: planar reflection buffers have one per MIP level

    def __init__(self, device: Any) -> None:
        self._device, self._names = device, []  # type: Any, list[str]
        self._resolved: list[str] = []
        self._queries = None
        if "timestamp-query" in device.features:
            usage = wgpu.BufferUsage.QUERY_RESOLVE | wgpu.BufferUsage.COPY_SRC
            self._queries = device.create_query_set(type="timestamp", count=2 * self.PASSES)
            self._buffer = device.create_buffer(size=16 * self.PASSES, usage=usage)

    def writes(self, name: str) -> dict[str, Any]:
        """Arguments of `begin_render_pass` that time the pass `name`."""
        if self._queries is None or len(self._names) == self.PASSES:
            return {}
        at = 2 * len(self._names)
        self._names.append(name)
        indices = {"beginning_of_pass_write_index": at, "end_of_pass_write_index": at + 1}
        return {"timestamp_writes": {"query_set": self._queries, **indices}}

    def resolve(self, encoder: Any) -> None:
        """Encode the copy of this frame's times, after its last pass."""
        if self._names:
            encoder.resolve_query_set(self._queries, 0, 2 * len(self._names), self._buffer, 0)
        self._resolved, self._names = self._names, []

    def read(self) -> dict[str, float]:
        """Milliseconds of the last frame by pass name; waits for the GPU."""
        if not self._resolved:
            return {}
        data = self._device.queue.read_buffer(self._buffer, size=16 * len(self._resolved))
        ticks = np.frombuffer(data, np.uint64).reshape(-1, 2).astype(np.float64)
        times: dict[str, float] = {}
        for name, ms in zip(self._resolved, (ticks[:, 1] - ticks[:, 0]) * 1e-6, strict=True):
            times[name] = times.get(name, 0.0) + float(ms)
        return times
