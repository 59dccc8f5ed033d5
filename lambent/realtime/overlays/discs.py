"""Discs of a few pixels at points of a scene, drawn into their own picture and hidden behind the scene's surfaces."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.pipelines import VERTEX_FLOATS, pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, target_texture
from lambent.realtime.overlays.overlay import Overlay

_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, -1), (1, 1), (-1, 1)], np.float32)  # of two triangles


class Discs(Overlay):
    """Draws discs of one scene; see the module."""

    _pipeline: Any = None

    def draw(self, state: FrameState, places: Floats, colours: Floats, radii_px: Floats, rims: Floats) -> Any:
        """View of an RGBA texture of the state's size: discs at world positions `places` (P, 3), m; clear elsewhere.

        `colours` (P, 3) and the greys `rims` (P,) of the rims are display-encoded, 0 to 1; `radii_px` (P,) are in
        display pixels.
        """
        if self._pipeline is None:
            module = self._device.create_shader_module(code=assemble("discs.wgsl"))
            groups = [self._layouts.frame]
            self._pipeline = pipeline(self._device, module, "discs_main", groups, [DISPLAY_FORMAT], compare="greater")
        context = self._frame_context(state, DISPLAY_FORMAT)
        shown = target_texture(self._device, (*state.size, 1), DISPLAY_FORMAT).create_view()
        render = context.begin("depth", [], "clear", depth="clear")
        self._depth.draw(render, context)
        render.end()
        render = context.begin("discs", [shown], "clear")
        if len(places):
            render.set_pipeline(self._pipeline)
            render.set_vertex_buffer(
                0, self._layouts.buffer("VERTEX", _vertices(places, colours, radii_px, rims, state))
            )
            render.draw(len(_CORNERS) * len(places))
        render.end()
        self._device.queue.submit([context.encoder.finish()])
        return shown


def _vertices(places: Floats, colours: Floats, radii_px: Floats, rims: Floats, state: FrameState) -> Floats:
    """(6 P, VERTEX_FLOATS): place, colour, corner within [-1, 1]^2 and rim, half sizes in clip space, 0, 0."""
    each = np.zeros((len(places), len(_CORNERS), VERTEX_FLOATS), np.float32)
    each[..., :3], each[..., 3:6] = places[:, None], colours[:, None]
    each[..., 6:8], each[..., 8] = _CORNERS, np.asarray(rims)[:, None]
    each[..., 9:11] = 2 * np.asarray(radii_px)[:, None, None] / np.array(state.size)
    return each.reshape(-1, VERTEX_FLOATS)
