"""Edges of the shown picture, blended."""

from __future__ import annotations

from typing import Any

from lambent.realtime.parts import Cut, Steps, Whole
from lambent.realtime.passes.screen import cover
from lambent.realtime.passes.tonemap import DISPLAY_FORMAT
from lambent.realtime.resources import Layouts
from lambent.realtime.shader_source import assemble
from lambent.realtime.targets import PassTimer


class SmoothPass:
    """Fast approximate antialiasing of an encoded picture, see shaders/smooth.wgsl."""

    def __init__(self, device: Any, layouts: Layouts, sampler: Any) -> None:
        self._layouts, self._sampler = layouts, sampler
        module = device.create_shader_module(code=assemble("smooth.wgsl"))
        self._pipeline = device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[layouts.shown]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": "smooth_main", "targets": [{"format": DISPLAY_FORMAT}]},
            primitive={"topology": "triangle-list"},
        )

    def encode(self, part: Whole | Cut, shown: Any, target: Any, timer: PassTimer) -> Steps:
        """Draw the texture `shown` into the view `target`."""
        group = self._layouts.group(self._layouts.shown, shown.create_view(), self._sampler)
        for band in part.bands("smooth", shown.size[:2]):
            cover(part.encoder, target, self._pipeline, [group], timer.writes("smooth"), band)
            yield
        return 0
