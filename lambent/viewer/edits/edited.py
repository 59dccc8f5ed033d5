"""Choice of the backend that sums edited pictures: the GPU that shows them, or the CPU.

picture = on_device(device, lambda canvas: edited_picture(store, session, canvas=canvas), say)
picture.step(); picture.compose()          # a frame, in `texture_of(picture)`
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image, Indices
from lambent.editing.canvas import Canvas, HostCanvas, Layer
from lambent.editing.picture import EditedPicture
from lambent.editing.products import Products
from lambent.editing.rows import PairTransport
from lambent.editing.stored import StoredPairs
from lambent.realtime.edited.canvas import FORMAT, GpuCanvas
from lambent.realtime.edited.commands import OutOfGpuMemory
from lambent.realtime.edited.layer import GpuLayer
from lambent.realtime.gpu.device import adapter_info

Backend = Callable[[Image], Canvas]


class _ShadedLayer(GpuLayer):
    """A layer on the GPU that reads the transport of a store."""

    def fold(self, pairs: PairTransport, idle: int, means: Floats) -> tuple[Products, float]:
        if not isinstance(pairs, StoredPairs):
            rows = pairs.fold(idle, means)
            return self.hold(rows.values), rows.unit
        edited = 1 - idle
        products, scale = self.fold_pairs(pairs.spans, pairs.steps, pairs.values, means, edited, pairs.counts[edited])
        return products, pairs.unit * scale


class ShadedCanvas(GpuCanvas):
    """Canvas of compute shaders, which draw into `texture`."""

    def layer(self, pixel: Indices, theta_o: Floats) -> _ShadedLayer:
        return _ShadedLayer(self._commands, self._texels(pixel), theta_o, self._image)


class SentCanvas(HostCanvas):
    """Canvas on the CPU: every composed picture is uploaded to `texture`."""

    def __init__(self, device: Any, background: Image) -> None:
        super().__init__(background)
        self._device, self._texels = device, np.ones((*background.shape[:2], 4), np.float32)
        height, width, _ = background.shape
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST | wgpu.TextureUsage.COPY_SRC
        self.texture = device.create_texture(size=(width, height, 1), format=FORMAT, usage=usage)

    def compose(self, shown: Sequence[tuple[Layer, NDArray[np.float32]]]) -> None:
        super().compose(shown)
        self._texels[..., :3] = self.image()
        height, width, _ = self._texels.shape
        rows = {"bytes_per_row": 16 * width, "rows_per_image": height}
        self._device.queue.write_texture({"texture": self.texture}, self._texels, rows, (width, height, 1))


def sums(device: Any) -> bool:
    """Whether a device sums faster than the CPU, as hardware GPUs do."""
    return not adapter_info(device).is_software


def backend(device: Any) -> Backend:
    """Factory of the canvas for a picture that a device shows.

    On a hardware GPU shaders sum. On a software adapter numba sums: both use the CPU, and numba is faster
    (docs/editing.md).
    """
    return partial(ShadedCanvas if sums(device) else SentCanvas, device)


def on_device(device: Any, make: Callable[[Backend], EditedPicture], say: Callable[[str], None]) -> EditedPicture:
    """The picture made by `make` on the device's backend or, with a note if the GPU lacks memory, on the CPU."""
    try:
        return make(backend(device))
    except OutOfGpuMemory as error:
        say(f"{error.message}: the CPU draws the picture")
        return make(partial(SentCanvas, device))


def texture_of(picture: EditedPicture) -> Any:
    """(H, W) rgba32float: linear radiance as last composed; the same texture for the picture's life."""
    canvas = picture.canvas
    assert isinstance(canvas, ShadedCanvas | SentCanvas), "the picture is not on a device"
    return canvas.texture
