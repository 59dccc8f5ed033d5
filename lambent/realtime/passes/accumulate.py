"""Progressive frames: the running mean of a camera at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import wgpu

from lambent.realtime.passes.screen import cover
from lambent.realtime.shader_source import assemble

MEAN_FORMAT = "rgba32float"


class AccumulatePass:
    """Keeps two full-float pictures and writes the mean from one into the other."""

    def __init__(self, device: Any) -> None:
        self._device = device
        module = device.create_shader_module(code=assemble("accumulate.wgsl"))
        texture = {"sample_type": "unfilterable-float", "view_dimension": "2d"}
        kinds = [{"texture": texture}, {"texture": texture}, {"buffer": {"type": "uniform"}}]
        self._group_layout = device.create_bind_group_layout(
            entries=[{"binding": i, "visibility": wgpu.ShaderStage.FRAGMENT, **kind} for i, kind in enumerate(kinds)]
        )
        self._pipeline = device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[self._group_layout]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": "accumulate_main", "targets": [{"format": MEAN_FORMAT}]},
            primitive={"topology": "triangle-list"},
        )
        self._weight = device.create_buffer(size=16, usage=wgpu.BufferUsage.UNIFORM | wgpu.BufferUsage.COPY_DST)
        self._frame: Any = None  # kept: another texture could else come to stand at the same address
        self._means: list[Any] = []
        self._groups: list[Any] = []

    def encode(self, encoder: Any, frame: Any, index: int, timestamps: dict[str, Any]) -> Any:
        """Add the texture `frame` as the `index`-th of the series; returns the texture of the mean."""
        self._fit(frame)
        into = index % 2
        weight = np.array([1 / (index + 1), 0, 0, 0], np.float32)
        self._device.queue.write_buffer(self._weight, 0, weight)
        cover(encoder, self._means[into].create_view(), self._pipeline, [self._groups[into]], timestamps)
        return self._means[into]

    def _fit(self, frame: Any) -> None:
        if self._frame is frame:
            return
        self._frame = frame
        usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
        self._means = [self._device.create_texture(size=frame.size, format=MEAN_FORMAT, usage=usage) for _ in range(2)]
        self._groups = [
            self._device.create_bind_group(
                layout=self._group_layout,
                entries=[
                    {"binding": 0, "resource": self._means[1 - into].create_view()},
                    {"binding": 1, "resource": frame.create_view()},
                    {"binding": 2, "resource": {"buffer": self._weight}},
                ],
            )
            for into in range(2)
        ]
