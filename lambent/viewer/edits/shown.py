"""Pictures for the window: bytes made by the CPU, or textures that stay on the GPU."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lambent.core.arrays import Image
from lambent.core.light.false_colour import Range, SignedRange
from lambent.editing.canvas import HostCanvas
from lambent.realtime.edited.display import Display
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, pixels, target_texture
from lambent.viewer.edits.edited import ShadedCanvas, sums
from lambent.viewer.edits.tone import Bytes, difference, displayed

Look = tuple[str, float, Range]  # view transform, exposure in EV, scale of false colours
Fading = tuple[Image, float]  # a difference added to a picture, and its remaining share


@dataclass(frozen=True)
class HostShown:
    """A picture (H, W) of a frame in memory: radiance (H, W, 3) float32, and encoded bytes (H, W, 4)."""

    device: Any
    radiance: Image
    bytes: Bytes

    def put(self, texture: Any) -> None:
        """Copy the picture into a texture of the window."""
        height, width = self.bytes.shape[:2]
        rows = {"bytes_per_row": 4 * width, "rows_per_image": height}
        self.device.queue.write_texture({"texture": texture}, self.bytes, rows, (width, height, 1))


class OnHost:
    """Sums and displays pictures on the CPU; without a device nothing can be copied into textures."""

    def __init__(self, device: Any = None) -> None:
        self._device = device
        self._still: tuple[Image, Look, HostShown] | None = None

    def canvas(self, background: Image) -> HostCanvas:
        """A canvas for a picture."""
        return HostCanvas(background)

    def show(self, canvas: Any, look: Look, fading: Fading | None) -> HostShown:
        """The last composed picture of a canvas from `canvas`."""
        return self._made(faded(canvas.image(), fading), look)

    def still(self, image: Image, look: Look) -> HostShown:
        """A fixed picture of linear radiance."""
        if self._still is None or self._still[0] is not image or self._still[1] != look:
            self._still = image, look, self._made(image, look)
        return self._still[2]

    def difference(self, shown: Shown, against: Shown, scale: SignedRange) -> HostShown:
        """Difference of two pictures in false colours."""
        return HostShown(self._device, shown.radiance, difference(shown.radiance, against.radiance, scale))

    def _made(self, image: Image, look: Look) -> HostShown:
        return HostShown(self._device, image, displayed(image, *look))

    def without_gpu(self) -> OnHost:
        """The CPU backend for the same window."""
        return self


@dataclass(frozen=True)
class GpuShown:
    """As `HostShown`, in textures, which the next frame overwrites; reading them back waits for the GPU."""

    device: Any
    light: Any
    texture: Any
    fading: Fading | None = None

    @cached_property
    def radiance(self) -> Image:
        return faded(np.array(pixels(self.device, self.light)), self.fading)

    @cached_property
    def bytes(self) -> Bytes:
        return np.pad(pixels(self.device, self.texture), ((0, 0), (0, 0), (0, 1)), constant_values=255)

    def put(self, texture: Any) -> None:
        encoder = self.device.create_command_encoder()
        encoder.copy_texture_to_texture({"texture": self.texture}, {"texture": texture}, self.texture.size)
        self.device.queue.submit([encoder.finish()])


class OnGpu:
    """As `OnHost`, by compute shaders: a frame is a few submissions, and no picture leaves the GPU."""

    def __init__(self, device: Any) -> None:
        self._device, self._display = device, Display(device)
        self._targets: dict[tuple[str, int, int], Any] = {}
        self._sent: dict[str, tuple[Image, Any]] = {}  # fixed images, with their textures

    def canvas(self, background: Image) -> ShadedCanvas:
        return ShadedCanvas(self._device, background)

    def show(self, canvas: Any, look: Look, fading: Fading | None) -> GpuShown:
        target = self._target("canvas", canvas.texture)
        more = (self._texture("fading", fading[0]), fading[1]) if fading is not None else ()
        self._display.draw(canvas.texture, target, *look, *more)
        return GpuShown(self._device, canvas.texture, target, fading)

    def still(self, image: Image, look: Look) -> GpuShown:
        light = self._texture("still", image)
        target = self._target("still", light)
        self._display.draw(light, target, *look)
        return GpuShown(self._device, light, target)

    def difference(self, shown: Shown, against: Shown, scale: SignedRange) -> HostShown:
        return self.without_gpu().difference(shown, against, scale)

    def without_gpu(self) -> OnHost:
        return OnHost(self._device)

    def _target(self, name: str, light: Any) -> Any:
        key = (name, *light.size[:2])
        if key not in self._targets:
            self._targets[key] = target_texture(self._device, light.size, DISPLAY_FORMAT)
        return self._targets[key]

    def _texture(self, name: str, image: Image) -> Any:
        if name not in self._sent or self._sent[name][0] is not image:
            self._sent[name] = image, self._display.texture(image)
        return self._sent[name][1]


Shown = HostShown | GpuShown
Backend = OnHost | OnGpu


def faded(image: Image, fading: Fading | None) -> Image:
    """An image plus the fading difference."""
    return image if fading is None else np.maximum(image + np.float32(fading[1]) * fading[0], 0)


def backend_of(device: Any) -> Backend:
    """The faster backend: a software adapter shares the CPU cores with numba and is several times slower."""
    return OnGpu(device) if sums(device) else OnHost(device)
