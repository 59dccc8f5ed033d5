"""Holes in the depth of a mirror picture, where its eye looks past the foot of a wall: nothing is drawn there."""

from __future__ import annotations

from typing import Any

import wgpu

from lambent.realtime.mirror import PLAN_DTYPE, MirrorView
from lambent.realtime.passes.depth import DEPTH_FORMAT
from lambent.realtime.resources import Layouts
from lambent.realtime.shader_source import assemble
from lambent.store.contract import PlanRecord
from lambent.store.plans import plan_of

FORMAT = "r8snorm"


class WallsPass:
    """Plans of the reflectors as textures, and the triangle that writes their depth."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        self._device, self._layouts = device, layouts
        stage = wgpu.ShaderStage.FRAGMENT
        picture = {"sample_type": "float", "view_dimension": "2d"}
        self._layout = device.create_bind_group_layout(
            entries=[
                {"binding": 0, "visibility": stage, "buffer": {"type": "uniform"}},
                {"binding": 1, "visibility": stage, "texture": picture},
            ]
        )
        module = device.create_shader_module(code=assemble("mirror_walls.wgsl"))
        self._pipeline = device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[layouts.frame, self._layout]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": "mirror_walls_main", "targets": []},
            primitive={"topology": "triangle-list"},
            depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": True, "depth_compare": "always"},
        )
        self._textures: dict[PlanRecord, Any] = {}
        self._buffers: list[Any] = []  # per view of a frame

    def write(self, views: list[MirrorView]) -> None:
        """Bring buffers up to date with this frame."""
        while len(self._buffers) < len(views):
            usage = wgpu.BufferUsage.UNIFORM | wgpu.BufferUsage.COPY_DST
            self._buffers.append(self._device.create_buffer(size=PLAN_DTYPE.itemsize, usage=usage))
        for view, buffer in zip(views, self._buffers, strict=False):
            if view.plan is not None:
                self._device.queue.write_buffer(buffer, 0, view.plan.tobytes())

    def draw(self, target: Any, index: int, view: MirrorView) -> int:
        """Encode into the depth pass `target`, whose group 0 is set, before all else; returns the draw calls."""
        if view.plan is None or view.reflector.plan is None:
            return 0
        target.set_pipeline(self._pipeline)
        texture = self._texture(view.reflector.plan)
        target.set_bind_group(1, self._layouts.group(self._layout, self._buffers[index], texture))
        target.draw(3)
        return 1

    def _texture(self, record: PlanRecord) -> Any:
        if record not in self._textures:
            plan = plan_of(record)
            usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
            size = (record.columns, record.rows, 1)
            texture = self._device.create_texture(size=size, format=FORMAT, usage=usage)
            lines = {"bytes_per_row": record.columns, "rows_per_image": record.rows}
            self._device.queue.write_texture({"texture": texture}, plan.distance, lines, size)
            self._textures[record] = texture.create_view()
        return self._textures[record]
