"""Depth before light: every pixel is shaded once, whatever lies behind it."""

from __future__ import annotations

from typing import Any

from lambent.realtime.clusters import Seen
from lambent.realtime.resources import VERTEX_FLOATS, Layouts, SceneResources
from lambent.realtime.shader_source import assemble

DEPTH_FORMAT = "depth32float"
VERTEX_BUFFERS = [
    {
        "array_stride": VERTEX_FLOATS * 4,
        "attributes": [
            {"format": format, "offset": offset * 4, "shader_location": location}
            for location, (format, offset) in enumerate(
                [("float32x3", 0), ("float32x3", 3), ("float32x3", 6), ("float32x2", 9), ("float32x2", 11)]
            )
        ],
    }
]
TRIANGLES = {"topology": "triangle-list", "front_face": "ccw", "cull_mode": "none"}  # sheets have two sides


class DepthPass:
    """Draws the depth (reversed: near/z) of all objects; where a picture leaves a hole, of what is behind it."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        whole = device.create_shader_module(code=assemble("vertex.wgsl"))
        cut_out = device.create_shader_module(code=assemble("mask.wgsl"))
        groups = [layouts.frame, layouts.material]
        self._whole = _pipeline(device, groups[:1], whole)
        self._cut_out, self._solid = (
            _pipeline(device, groups, cut_out, {"module": cut_out, "entry_point": entry, "targets": []})
            for entry in ("mask_main", "solid_main")
        )

    def draw(self, target: Any, resources: SceneResources, seen: Seen, fringed: bool = False) -> int:
        """Encode into the render pass `target`, whose group 0 is set; returns the draw calls.

        With `fringed` pixels that a masked surface covers in part are left open, for `passes.shade.FRINGE`.

        The materials' bind groups must be there. The pass that follows shades where depths are equal, and so need not
        look for holes again.
        """
        target.set_vertex_buffer(0, resources.vertices)
        target.set_index_buffer(resources.indices, "uint32")
        target.set_pipeline(self._whole)
        calls = sum(draw_seen(target, seen, *faces) for faces in resources.whole_ranges)
        cut_out = resources.cut_out
        if cut_out:
            target.set_pipeline(self._solid if fringed else self._cut_out)
        for record in cut_out:
            target.set_bind_group(1, resources.materials[record.material].group)
            calls += draw_seen(target, seen, record.first_face, record.face_count)
        return calls


def draw_seen(target: Any, seen: Seen, first_face: int, face_count: int) -> int:
    """Encode what is seen of a range of faces; returns the draw calls."""
    runs = seen.of(first_face, face_count)
    for first, count in runs:
        target.draw_indexed(count * 3, 1, first * 3)
    return len(runs)


def _pipeline(device: Any, groups: list[Any], module: Any, fragment: dict[str, Any] | None = None) -> Any:
    return device.create_render_pipeline(
        layout=device.create_pipeline_layout(bind_group_layouts=groups),
        vertex={"module": module, "entry_point": "vertex_main", "buffers": VERTEX_BUFFERS},
        fragment=fragment,
        primitive=TRIANGLES,
        depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": True, "depth_compare": "greater"},
    )
