"""The edited picture in a texture: one submission sums a frame and adds every layer to the unedited background.

GPU time of a frame: `GpuCanvas.milliseconds`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats, Image, Indices
from lambent.realtime.edited.commands import Commands
from lambent.realtime.edited.layer import GpuLayer, texels
from lambent.realtime.gpu.targets import pixels

FORMAT = "rgba32float"  # sunlight may exceed 65504, the largest half float
TEXELS = 16  # rows are padded to a multiple: copies between buffers and textures need rows of a multiple of 256 bytes


class GpuCanvas:
    """`lambent.editing.canvas.Canvas` in GPU memory.

    Parameters
    ----------
    background : (H, W, 3) float32
        Linear radiance, W/(sr m^2), that layers are added to.

    Attributes
    ----------
    texture
        (H, W) `FORMAT`, linear radiance, alpha 1, as last composed; the same texture for the lifetime of the canvas.
    """

    def __init__(self, device: Any, background: Image) -> None:
        self._commands = Commands(device)
        height, self._width, _ = background.shape
        self._stride = self._width + -self._width % TEXELS
        shown = np.ones((height, self._stride, 4), np.float32)
        shown[:, : self._width, :3] = background
        self._bytes = shown.nbytes
        self._background, self._image = (self._commands.empty(self._bytes) for _ in range(2))
        self._commands.write(self._background, shown)
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST | wgpu.TextureUsage.COPY_SRC
        self.texture = device.create_texture(size=(self._width, height, 1), format=FORMAT, usage=usage)

    def layer(self, pixel: Indices, theta_o: Floats) -> GpuLayer:
        """A new layer over pixels (P,), with the viewer's angle (P,), rad."""
        return GpuLayer(self._commands, self._texels(pixel), theta_o, self._image)

    def compose(self, shown: Sequence[tuple[Any, NDArray[np.float32]]]) -> None:
        """Add layers of this canvas, each times its scale (3,), to the background in the texture; one submission."""
        self._commands.copy(lambda to: to.copy_buffer_to_buffer(self._background, 0, self._image, 0, self._bytes))
        for layer, scale in shown:
            layer.compose(scale)
        layout = {"buffer": self._image, "bytes_per_row": 16 * self._stride, "rows_per_image": self.texture.height}
        self._commands.copy(
            lambda to: to.copy_buffer_to_texture(layout, {"texture": self.texture}, self.texture.size)
        )  # fmt: skip
        self._commands.submit()

    def image(self) -> Image:
        """(H, W, 3) float32, read back from the GPU; for saving the picture, not for display."""
        return np.array(pixels(self._commands.device, self.texture))

    def finish(self) -> None:
        """Wait until the GPU has drawn."""
        self._commands.read(self._background, np.uint8, 4)

    def milliseconds(self) -> float | None:
        """GPU time of the last submission's compute passes; None on adapters without timers."""
        return self._commands.timer.read().get("edit")

    def _texels(self, pixel: Indices) -> NDArray[np.uint32]:
        return texels(np.asarray(pixel), self._width, self._stride)
