"""Edges of the display image, blended."""

from __future__ import annotations

from lambent.realtime.context import FrameContext
from lambent.realtime.layouts import Layouts
from lambent.realtime.pipelines import screen_pipeline
from lambent.realtime.slices import Steps
from lambent.realtime.targets import DISPLAY_FORMAT


class SmoothPass:
    """Fast approximate antialiasing of an encoded image, see shaders/smooth.wgsl."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts = layouts
        self._pipeline = screen_pipeline(layouts.device, "smooth", [layouts.shown], [DISPLAY_FORMAT])

    def encode(self, context: FrameContext) -> Steps:
        """Draw `unsmoothed` into `shown`."""
        if context.unsmoothed is None:
            return
        group = self._layouts.group(self._layouts.shown, context.unsmoothed.create_view(), context.resources.sampler)
        for band in context.slicing.bands("smooth", context.state.size):
            context.cover("smooth", [context.shown], self._pipeline, [group], band)
            yield
