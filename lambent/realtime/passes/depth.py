"""Depth before light: every pixel is shaded once, whatever lies behind it."""

from __future__ import annotations

from typing import Any

from lambent.realtime.resources import VERTEX_FLOATS, Layouts, SceneResources
from lambent.realtime.shader_source import assemble

DEPTH_FORMAT = "depth32float"
VERTEX_BUFFERS = [
    {
        "array_stride": VERTEX_FLOATS * 4,
        "attributes": [
            {"format": format, "offset": offset * 4, "shader_location": location}
            for location, (format, offset) in enumerate(
                [("float32x3", 0), ("float32x3", 3), ("float32x3", 6), ("float32x2", 9)]
            )
        ],
    }
]
TRIANGLES = {"topology": "triangle-list", "front_face": "ccw", "cull_mode": "none"}  # sheets have two sides


class DepthPass:
    """Draws the depth (reversed: near/z) of all objects."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        module = device.create_shader_module(code=assemble("vertex.wgsl"))
        self._pipeline = device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[layouts.frame]),
            vertex={"module": module, "entry_point": "vertex_main", "buffers": VERTEX_BUFFERS},
            primitive=TRIANGLES,
            depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": True, "depth_compare": "greater"},
        )

    def draw(self, target: Any, resources: SceneResources) -> int:
        """Encode into the render pass `target`, whose group 0 is set; returns the draw calls."""
        target.set_pipeline(self._pipeline)
        target.set_vertex_buffer(0, resources.vertices)
        target.set_index_buffer(resources.indices, "uint32")
        target.draw_indexed(resources.scene.faces.size)
        return 1
