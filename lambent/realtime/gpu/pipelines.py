"""Render pipelines for the scene's triangles, and for one triangle that covers a whole target."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.targets import DEPTH_FORMAT, stored

_FLOATS = (3, 3, 3, 2, 2)  # of position, normal, tangent, uv2, uv
VERTEX_FLOATS = sum(_FLOATS)
_VERTICES = {
    "array_stride": 4 * VERTEX_FLOATS,
    "attributes": [
        {"format": f"float32x{count}", "offset": 4 * sum(_FLOATS[:location]), "shader_location": location}
        for location, count in enumerate(_FLOATS)
    ],
}


def pipeline(
    device: Any, module: Any, entry: str, layouts: Sequence[Any], formats: Iterable[str], *, compare: str | None = None,
    writes_depth: bool = False, vertex: str = "vertex_main", front_face: str = "ccw",
    constants: Mapping[str, float] | None = None, blend: Mapping[str, Any] | None = None,
) -> Any:  # fmt: skip
    """Pipeline of a shader module into targets of `formats`.

    `entry`, of the fragment stage, is empty for depth alone. `compare` is the depth test; without it there is no depth
    attachment. With a `blend`, the first target is blended and the others are not written.
    """
    first, others = ({"blend": blend}, {"write_mask": 0}) if blend else ({}, {})
    targets = [{"format": format, **(others if i else first)} for i, format in enumerate(formats)]
    fragment = {"module": module, "entry_point": entry, "targets": targets, "constants": constants or {}}
    depth = {"format": DEPTH_FORMAT, "depth_write_enabled": writes_depth, "depth_compare": compare}
    buffers = [_VERTICES] if vertex == "vertex_main" else []
    return device.create_render_pipeline(
        layout=device.create_pipeline_layout(bind_group_layouts=list(layouts)),
        vertex={"module": module, "entry_point": vertex, "buffers": buffers},
        fragment=fragment if entry else None,
        primitive={"topology": "triangle-list", "front_face": front_face},  # not culled: sheets have two sides
        depth_stencil=depth if compare else None,
    )


def screen_pipeline(device: Any, shader: str, layouts: Sequence[Any], formats: Iterable[str], **depth: Any) -> Any:
    """Pipeline of a file that includes screen.wgsl, whose entry point is named after it."""
    module = device.create_shader_module(code=assemble(f"{shader}.wgsl"))
    return pipeline(device, module, f"{shader}_main", layouts, formats, vertex="screen_main", **depth)


def cover(encoder: Any, views: Iterable[Any], pipeline: Any, groups: Iterable[Any], stamps: dict[str, Any]) -> None:
    """Encode a render pass of a `screen_pipeline` into the targets `views`."""
    draw = encoder.begin_render_pass(color_attachments=stored(views), **stamps)
    draw.set_pipeline(pipeline)
    for number, group in enumerate(groups):
        draw.set_bind_group(number, group)
    draw.draw(3)
    draw.end()
