"""One triangle over a whole target: what every pass that reads textures and writes a texture draws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from lambent.realtime.parts import Band


def cover(
    encoder: Any, view: Any, pipeline: Any, groups: Sequence[Any], stamps: dict[str, Any], band: Band | None = None
) -> None:
    """Encode a render pass of a pipeline of screen.wgsl into the target `view`, or into a band of its rows."""
    draw = encoder.begin_render_pass(
        color_attachments=[{"view": view, "load_op": band.load_op if band else "clear", "store_op": "store"}], **stamps
    )
    if band is not None:
        band.cut(draw)
    draw.set_pipeline(pipeline)
    for number, group in enumerate(groups):
        draw.set_bind_group(number, group)
    draw.draw(3)
    draw.end()
