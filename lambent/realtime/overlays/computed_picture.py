"""Displays radiance computed elsewhere like the renderer's own: exposure, view transform, false colours."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from lambent.core.arrays import Floats
from lambent.realtime.frame_state import FrameState, frame_data
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import cover, screen_pipeline
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, target_texture
from lambent.realtime.resources import SceneResources


class UploadedPicture:
    """One picture: `radiance` is its texture, `view` a view of its display texture; both None before the first."""

    def __init__(self, layouts: Layouts, resources: SceneResources) -> None:
        self._layouts, self._scene, self.device = layouts, resources.scene, layouts.device
        self._layout = layouts.of("exact")
        self._pipeline = screen_pipeline(
            self.device, "tonemap", [layouts.frame, self._layout], [DISPLAY_FORMAT], constants={"MARKED": False}
        )
        self._frame_buffer = layouts.uniform(FRAME_DTYPE.itemsize)
        self._frame_group = layouts.group(layouts.frame, self._frame_buffer, resources.sampler)
        self._group: Any = None
        self._target: Any = None
        self.radiance: Any = None
        self.view: Any = None

    def take(self, radiance: Floats) -> None:
        """Upload a picture (height, width, 3), W/(sr m^2); `show` shows it from then on."""
        height, width = radiance.shape[:2]
        texels = np.ones((height, width, 4), np.float16)
        texels[..., :3] = np.minimum(radiance / self._scene.unit, np.finfo(np.float16).max)
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
        texture = self.device.create_texture(size=(width, height, 1), format="rgba16float", usage=usage)
        rows = {"bytes_per_row": 8 * width, "rows_per_image": height}
        self.device.queue.write_texture({"texture": texture}, texels, rows, (width, height, 1))
        self._group = self._layouts.group(self._layout, texture.create_view())
        self.radiance = texture
        self._target = target_texture(self.device, (width, height, 1), DISPLAY_FORMAT)
        self.view = self._target.create_view()

    def show(self, state: FrameState) -> None:
        """Draw the picture into `view` with the exposure and view transform of a state."""
        data = frame_data(state, self._scene.record.bounds)
        for factor in (data["exposure"], data["scale"][3:]):
            factor *= self._scene.unit
        self.device.queue.write_buffer(self._frame_buffer, 0, data.tobytes())
        encoder = self.device.create_command_encoder()
        cover(encoder, [self.view], self._pipeline, [self._frame_group, self._group], {})
        self.device.queue.submit([encoder.finish()])
