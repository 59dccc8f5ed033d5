"""The outline of one object, drawn into its own picture: a line along the border of the object's visible part."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import pipeline, screen_pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.structs import Record
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, stored, target_texture
from lambent.realtime.objects.clusters import Clusters
from lambent.realtime.overlays.overlay import Overlay
from lambent.realtime.passes.depth import draw_seen, set_geometry
from lambent.realtime.resources import SceneResources
from lambent.store.contract import ObjectRecord

SEEN_FORMAT = "r8unorm"
REACH_PX = 2  # reach of the line on either side of the border; as in outline.wgsl


class Outline(Overlay):
    """Draws outlines of a scene's objects."""

    def __init__(self, layouts: Layouts, resources: SceneResources, clusters: Clusters) -> None:
        super().__init__(layouts, resources, clusters)
        device = self._device
        module = device.create_shader_module(code=assemble("silhouette.wgsl"))
        self._silhouette, self._glass = (
            pipeline(device, module, "silhouette_main", [layouts.frame], [SEEN_FORMAT], compare=compare)
            for compare in ("equal", "greater")
        )
        self._read = layouts.of("exact")
        self._line = screen_pipeline(device, "outline", [self._read], [DISPLAY_FORMAT])

    def draw(self, state: FrameState, record: ObjectRecord) -> Any:
        """View of an RGBA texture of the state's size: the line around an object or its parts; clear elsewhere."""
        context = self._frame_context(state, SEEN_FORMAT)
        encoder, target, data = context.encoder, context.target, context.data
        seen = target.radiance.create_view()
        place = covered(record.bounds, data, state.size)
        render = context.begin("depth", [], "clear", depth="clear")
        render.set_scissor_rect(*place)
        self._depth.draw(render, context)
        render.end()
        render = context.begin("silhouette", [seen], "clear")
        render.set_scissor_rect(*place)
        set_geometry(render, self._resources)
        is_pane = any(draw.item.record.name == record.name for draw in context.panes)
        render.set_pipeline(self._glass if is_pane else self._silhouette)
        draw_seen(render, context.seen(), record.first_face, record.face_count)
        render.end()
        line = target_texture(self._device, (*state.size, 1), DISPLAY_FORMAT).create_view()
        render = encoder.begin_render_pass(color_attachments=stored([line]))
        render.set_scissor_rect(*place)
        render.set_pipeline(self._line)
        render.set_bind_group(0, self._layouts.group(self._read, seen))
        render.draw(3)
        render.end()
        self._device.queue.submit([encoder.finish()])
        return line


def covered(bounds: ArrayLike, data: Record, size: tuple[int, int]) -> tuple[int, int, int, int]:
    """Left, top, width and height, pixels, of a box (2, 3) in a picture, with a margin of `REACH_PX`."""
    corners = np.array(list(product(*np.asarray(bounds, float).T)))
    x, y, _, w = data["clip_from_world"].T @ np.concatenate([corners, np.ones((8, 1))], axis=1).T
    if (w <= 1e-6).any():
        return (0, 0, *size)  # part of the box is beside or behind the eye
    across, down = ((1 + x / w) / 2 * size[0], (1 - y / w) / 2 * size[1])
    (left, right), (top, bottom) = (
        np.clip((np.floor(at.min()) - REACH_PX, np.ceil(at.max()) + REACH_PX), 0, most).astype(int).tolist()
        for at, most in ((across, size[0]), (down, size[1]))
    )
    return left, top, right - left, bottom - top
