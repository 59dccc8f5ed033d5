"""The edited picture in a texture: a frame's sums, then every layer over what is not edited, in one submission.

Times of a frame on the GPU: `Canvas.milliseconds`.
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
from lambent.realtime.targets import pixels

FORMAT = "rgba32float"  # half floats end at 65504; the sun's light does not
TEXELS = 16  # of a row: what is copied between buffers and textures begins at multiples of 256 bytes


class GpuCanvas:
    """As `lambent.editing.canvas.Canvas`, in the memory of a GPU.

    Parameters
    ----------
    background : (H, W, 3) float32
        Linear radiance that layers are added to.

    Attributes
    ----------
    texture
        (H, W) `FORMAT`, linear radiance, alpha 1, as last composed; the same texture for the canvas's life.
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

    def layer(self, pixel: Indices, theta_o: Floats, texture: Floats | None) -> GpuLayer:
        """A new layer over pixels (P,), with the viewer's angle (P,) and a texture (P, 3) or none."""
        return GpuLayer(self._commands, self._texels(pixel), theta_o, texture, self._image)

    def compose(self, shown: Sequence[tuple[Any, NDArray[np.float32]]]) -> None:
        """Draw the sum of this canvas's layers, each with its scale (3,), into the texture, in one submission."""
        self._commands.copy(lambda to: to.copy_buffer_to_buffer(self._background, 0, self._image, 0, self._bytes))
        for layer, scale in shown:
            layer.compose(scale)
        layout = {"buffer": self._image, "bytes_per_row": 16 * self._stride, "rows_per_image": self.texture.height}
        self._commands.copy(
            lambda to: to.copy_buffer_to_texture(layout, {"texture": self.texture}, self.texture.size)
        )  # fmt: skip
        self._commands.submit()

    def image(self) -> Image:
        """(H, W, 3) float32, read back from the GPU: to save the picture, not to show it."""
        return np.array(pixels(self._commands.device, self.texture))

    def finish(self) -> None:
        """Wait until the GPU has drawn."""
        self._commands.read(self._background, np.uint8, 4)

    def milliseconds(self) -> float | None:
        """Time of the last submission's compute passes on the GPU; None where the adapter has no timers."""
        return self._commands.timer.read().get("edit")

    def _texels(self, pixel: Indices) -> NDArray[np.uint32]:
        return texels(np.asarray(pixel), self._width, self._stride)
