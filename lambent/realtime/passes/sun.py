"""The share of the sun's disc that each pixel sees: a pass of its own, before light.

In the shaders of light its loops would cost an adapter in software half a frame.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from lambent.realtime.context import FrameContext
from lambent.realtime.layouts import SHADOW_MAP, Layouts
from lambent.realtime.passes.depth import draw_seen, set_geometry
from lambent.realtime.pipelines import pipeline
from lambent.realtime.shader_source import assemble
from lambent.realtime.slices import Steps
from lambent.realtime.targets import target_texture

FORMAT = "r16float"


class SunPass:
    """Draws what a frame's pixels see of the sun, where its depth is, and leaves `context.light`."""

    def __init__(self, layouts: Layouts, front_face: str = "ccw") -> None:
        self._layouts = layouts
        module = layouts.device.create_shader_module(code=assemble("sun.wgsl"))
        groups = [layouts.frame, layouts.of(*SHADOW_MAP)]
        self._pipeline = cache(
            lambda transmits: pipeline(
                layouts.device, module, "sun_main", groups, [FORMAT], compare="equal", front_face=front_face,
                constants={"TRANSMITS": transmits},
            )
        )  # fmt: skip
        self._texture: Any = None

    def encode(self, context: FrameContext) -> Steps:
        """Draw band by band; nothing where there is no sun."""
        resources, size = context.resources, context.target.depth.size[:2]
        sun = resources.sun
        if not sun.exists:
            context.light = resources.light_view, sun.uniform, sun.nowhere
            return
        if self._texture is None or self._texture.size[:2] != size:
            self._texture = target_texture(self._layouts.device, size, FORMAT)
        view = self._texture.create_view()
        for band in context.slicing.bands("sun", size):
            render = context.begin("sun", [view], band.load_op, band=band)
            render.set_bind_group(1, sun.group)
            set_geometry(render, resources)
            seen = context.seen(band.shares)
            for draw in context.draws:
                record = draw.item.record
                render.set_pipeline(self._pipeline(any(draw.material.kt_d)))
                context.counts["draw_calls"] += draw_seen(render, seen, record.first_face, record.face_count)
            render.end()
            yield
        context.light = resources.light_view, sun.uniform, view
