"""The share of the sun's light that each pixel gets, by colour: a pass of its own, before light.

In the shaders of light its loops would cost an adapter in software half a frame.
"""

from __future__ import annotations

from functools import cache, lru_cache
from typing import Any

from lambent.core.arrays import Flags
from lambent.realtime.gpu.layouts import SHADOW_MAP, Layouts
from lambent.realtime.gpu.pipelines import pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.targets import target_texture
from lambent.realtime.objects.clusters import Clusters
from lambent.realtime.objects.draws import Draw
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import draw_runs, set_geometry
from lambent.realtime.planar.planar_view import MOST_REFLECTORS
from lambent.realtime.sun.sun import SunLight

FORMAT = "rgb10a2unorm"


class SunPass:
    """Draws what a frame's pixels see of the sun, where its depth is, and leaves `context.light`.

    Panes have no depth. What they see is in a texture of its own, `context.pane_light`; of several in a pixel, one.
    """

    def __init__(self, layouts: Layouts, front_face: str = "ccw") -> None:
        self._layouts = layouts
        module = layouts.device.create_shader_module(code=assemble("sun.wgsl"))
        groups = [layouts.frame, layouts.of(*SHADOW_MAP)]
        self._pipeline = cache(
            lambda is_pane, transmits, parts, squares, panes: pipeline(
                layouts.device, module, "sun_main", groups, [FORMAT], compare="greater" if is_pane else "equal",
                front_face=front_face,
                constants={"TRANSMITS": transmits, "PARTS": parts, "SQUARES": squares, "PANES": panes},
            )
        )  # fmt: skip
        self._reached = lru_cache(1)(_reached)
        self._texture = lru_cache(2 * MOST_REFLECTORS)(
            lambda size, is_pane: target_texture(layouts.device, size, FORMAT)
        )

    def encode(self, context: FrameContext) -> None:
        """Draw; nothing where there is no sun."""
        resources, sun = context.resources, context.resources.sun
        views = [sun.nowhere, sun.nowhere]
        if sun.exists:
            size = context.target.depth.size[:2]
            for index, draws in enumerate((context.draws, context.panes)):
                if draws:
                    views[index] = self._texture(size, index).create_view()
                    self._encode(context, draws, views[index])
        lamps = resources.lamps.bindings
        context.light, context.pane_light = ((resources.light_view, sun.uniform, view, *lamps) for view in views)

    def _encode(self, context: FrameContext, draws: list[Draw], view: Any) -> None:
        sun = context.resources.sun
        render = context.begin("sun", [view], "clear")
        render.set_bind_group(1, sun.group)
        set_geometry(render, context.resources)
        seen = context.seen(self._reached(context.clusters, sun))
        for draw in draws:
            if runs := seen.of(draw.item.record.first_face, draw.item.record.face_count):
                render.set_pipeline(
                    self._pipeline(draw.is_pane, draw.material.transmits, sun.parts, sun.squares, sun.pane_layers)
                )
                context.counts["draw_calls"] += draw_runs(render, seen, runs)
        render.end()


def _reached(clusters: Clusters, sun: SunLight) -> Flags | bool:
    """The clusters that the sun may reach."""
    return True if sun.reached_faces is None else clusters.with_any(sun.reached_faces)
