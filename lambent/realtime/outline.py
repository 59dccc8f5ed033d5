"""The outline of one object as a picture of its own: at full size whatever the frames' size is, and without jitter.

It is the border of what is seen of the object: where something stands before it, the line runs along that.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from lambent.realtime.clusters import Clusters
from lambent.realtime.context import FrameContext
from lambent.realtime.draws import draws_of
from lambent.realtime.frame_state import FrameState, frame_data
from lambent.realtime.layouts import Layouts
from lambent.realtime.passes.depth import DepthPass, draw_seen, set_geometry
from lambent.realtime.pipelines import pipeline, screen_pipeline
from lambent.realtime.planar_integrators import OFF
from lambent.realtime.resources import SceneResources
from lambent.realtime.shader_source import assemble
from lambent.realtime.slices import Whole
from lambent.realtime.structs import FRAME_DTYPE, Record
from lambent.realtime.targets import DISPLAY_FORMAT, PassTimer, Targets, stored, target_texture

SEEN_FORMAT = "r8unorm"
REACH_PX = 2  # of the line, on either side of the border; as shaders/outline.wgsl


class Outline:
    """Draws outlines of a scene's objects beside its renderer, also while that one has a frame under way."""

    def __init__(self, layouts: Layouts, resources: SceneResources, clusters: Clusters) -> None:
        self._layouts, self._resources, self._clusters = layouts, resources, clusters
        self._depth = DepthPass(layouts)
        device = self._device = layouts.device
        self._targets, self._timer = Targets(device), PassTimer(device)
        self._frame_buffer = layouts.uniform(FRAME_DTYPE.itemsize)
        self._frame_group = layouts.group(layouts.frame, self._frame_buffer, resources.sampler)
        module = device.create_shader_module(code=assemble("silhouette.wgsl"))
        self._silhouette = pipeline(
            device, module, "silhouette_main", [layouts.frame], [SEEN_FORMAT], compare="equal"
        )  # fmt: skip
        self._read = layouts.of("exact")
        self._line = screen_pipeline(device, "outline", [self._read], [DISPLAY_FORMAT])
        self.records = {item.record.name: item.record for item in resources.objects}

    def draw(self, state: FrameState, name: str) -> Any:
        """View of an RGBA texture of the state's size: the line around the object `name`, clear elsewhere."""
        state = replace(state, accumulate=None, jitter_px=(0.0, 0.0), planar=OFF)
        record = self.records[name]
        data = frame_data(state, self._resources.scene.record.bounds)
        self._device.queue.write_buffer(self._frame_buffer, 0, data.tobytes())
        draws = draws_of(state, self._resources) if self._resources.masked else []  # for their holes alone
        encoder = self._device.create_command_encoder()
        target = self._targets.fit(state.size, SEEN_FORMAT)
        context = FrameContext(
            Whole(encoder), state, data, self._frame_group, self._resources, self._clusters, self._targets,
            self._timer, target, draws, [], Counter(),
        )  # fmt: skip
        seen = target.radiance.create_view()
        place = covered(record.bounds, data, state.size)
        render = context.begin("depth", [], "clear", depth="clear")
        render.set_scissor_rect(*place)
        self._depth.draw(render, context)
        render.end()
        render = context.begin("silhouette", [seen], "clear")
        render.set_scissor_rect(*place)
        set_geometry(render, self._resources)
        render.set_pipeline(self._silhouette)
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
    """Left, top, width and height in pixels of what a box (2, 3) covers of a picture, and `REACH_PX` around it."""
    corners = np.array(list(product(*np.asarray(bounds, float).T)))
    x, y, _, w = data["clip_from_world"].T @ np.concatenate([corners, np.ones((8, 1))], axis=1).T
    if (w <= 1e-6).any():
        return (0, 0, *size)  # some of it is beside or behind the eye
    across, down = ((1 + x / w) / 2 * size[0], (1 - y / w) / 2 * size[1])
    (left, right), (top, bottom) = (
        np.clip((np.floor(at.min()) - REACH_PX, np.ceil(at.max()) + REACH_PX), 0, most).astype(int).tolist()
        for at, most in ((across, size[0]), (down, size[1]))
    )
    return left, top, right - left, bottom - top
