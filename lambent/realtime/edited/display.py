"""Display of an edited picture's radiance, from texture to texture."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from lambent.core.arrays import Image
from lambent.core.light.false_colour import Range
from lambent.core.light.photometry import LUMINANCE
from lambent.realtime.edited.canvas import FORMAT
from lambent.realtime.frame_state import VIEW_TRANSFORMS
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import cover, screen_pipeline
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import DISPLAY_FORMAT


class Display:
    """Exposure and view transform on one device; see edited_display.wgsl."""

    def __init__(self, device: Any) -> None:
        self._device, self._layouts = device, Layouts(device)
        self._layout = self._layouts.of("exact", "exact")
        groups = [self._layouts.frame, self._layout]
        self._pipeline = screen_pipeline(device, "edited_display", groups, [DISPLAY_FORMAT])
        self._look = self._layouts.uniform(FRAME_DTYPE.itemsize)
        self._frame = self._layouts.group(self._layouts.frame, self._look, device.create_sampler())

    def texture(self, image: Image) -> Any:
        """A texture of linear radiance (H, W, 3)."""
        height, width, _ = image.shape
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST | wgpu.TextureUsage.COPY_SRC
        made = self._device.create_texture(size=(width, height, 1), format=FORMAT, usage=usage)
        texels = np.ones((height, width, 4), np.float32)
        texels[..., :3] = image
        rows = {"bytes_per_row": 16 * width, "rows_per_image": height}
        self._device.queue.write_texture({"texture": made}, texels, rows, (width, height, 1))
        return made

    def draw(
        self, radiance: Any, shown: Any, view: str, exposure_ev: float, scale: Range, fading: Any = None,
        share: float = 0.0,
    ) -> None:  # fmt: skip
        """Draw `radiance`, and `share` of `fading`, into the texture `shown`; `view` is one of `VIEW_TRANSFORMS`."""
        look = np.zeros((), FRAME_DTYPE)
        look["view_transform"], look["exposure"], look["fading"] = VIEW_TRANSFORMS[view], 2.0**exposure_ev, share
        look["scale"] = (scale.low, scale.high, scale.log, LUMINANCE.per_y)
        self._device.queue.write_buffer(self._look, 0, look.tobytes())
        views = [texture.create_view() for texture in (radiance, fading or radiance)]
        encoder = self._device.create_command_encoder()
        groups = [self._frame, self._layouts.group(self._layout, *views)]
        cover(encoder, [shown.create_view()], self._pipeline, groups, {})
        self._device.queue.submit([encoder.finish()])
