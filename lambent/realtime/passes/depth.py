"""Depth before light, so that every pixel is shaded only once."""

from __future__ import annotations

from typing import Any

from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.objects.clusters import Ranges, Seen
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.resources import SceneResources


class DepthPass:
    """Draws the reversed depth (near/z) of all objects except panes; holes of masked ones show what is behind."""

    def __init__(self, layouts: Layouts) -> None:
        device, groups = layouts.device, [layouts.frame, layouts.material]
        whole, masked = (device.create_shader_module(code=assemble(name)) for name in ("depth.wgsl", "mask.wgsl"))
        self._whole, self._masked, self._solid = (
            pipeline(device, module, entry, groups[:count], (), compare="greater", writes_depth=True)
            for module, entry, count in ((whole, "", 1), (masked, "mask_main", 2), (masked, "solid_main", 2))
        )

    def encode(self, context: FrameContext) -> None:
        """Draw the depth of the frame."""
        render = context.begin("depth", [], "clear", depth="clear")
        context.counts["draw_calls"] += self.draw(render, context)
        render.end()

    def draw(self, render: Any, context: FrameContext) -> int:
        """Encode into a render pass whose group 0 is set; returns the draw calls.

        If the frame blends pixels that a masked surface covers in part (`light.FRINGE`), they stay open. Later passes
        shade at equal depth, and need not test for holes again.
        """
        seen, resources = context.seen(), context.resources
        set_geometry(render, resources)
        render.set_pipeline(self._whole)
        panes = frozenset(draw.item.record.name for draw in context.panes)
        calls = sum(draw_seen(render, seen, *faces) for faces in resources.whole_ranges(panes))
        if resources.masked:
            render.set_pipeline(self._solid if context.blends_masks else self._masked)
        for draw in context.draws:
            record = draw.item.record
            if record.name in resources.masked:
                render.set_bind_group(1, draw.material_group)
                calls += draw_seen(render, seen, record.first_face, record.face_count)
        return calls


def set_geometry(render: Any, resources: SceneResources) -> None:
    """Bind the vertices and indices of a scene."""
    render.set_vertex_buffer(0, resources.vertices)
    render.set_index_buffer(resources.indices, "uint32")


def draw_seen(render: Any, seen: Seen, first_face: int, face_count: int) -> int:
    """Encode the visible faces of a range; returns the draw calls."""
    return draw_runs(render, seen, seen.of(first_face, face_count))


def draw_runs(render: Any, seen: Seen, runs: Ranges) -> int:
    """Encode runs (first, count) of the faces seen; returns the draw calls."""
    draw = render.draw_thin if seen.thin else render.draw_indexed
    for first, count in runs:
        draw(count * 3, 1, first * 3)
    return len(runs)
