"""Radiance to the display image: exposure, view transform, sRGB; then blending of edges."""

from __future__ import annotations

from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import screen_pipeline
from lambent.realtime.gpu.targets import DISPLAY_FORMAT
from lambent.realtime.passes.context import FrameContext


class TonemapPass:
    """Draws the radiance into the display image."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts, self._layout = layouts, layouts.of("exact")
        groups = [layouts.frame, self._layout]
        self._plain, self._marked = (
            screen_pipeline(layouts.device, "tonemap", groups, [DISPLAY_FORMAT], constants={"MARKED": marked})
            for marked in (False, True)
        )

    def encode(self, context: FrameContext) -> None:
        """Draw into `unsmoothed`, or straight into `shown` without blending of edges."""
        if context.shown is None:
            return
        groups = [context.frame_group, self._layouts.group(self._layout, context.radiance.create_view())]
        target = context.unsmoothed.create_view() if context.unsmoothed else context.shown
        pipeline = self._marked if context.unsmoothed else self._plain
        context.cover("tonemap", [target], pipeline, groups)


class SmoothPass:
    """Fast approximate antialiasing of an encoded image, see smooth.wgsl."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts = layouts
        self._pipeline = screen_pipeline(layouts.device, "smooth", [layouts.shown], [DISPLAY_FORMAT])

    def encode(self, context: FrameContext) -> None:
        """Draw `unsmoothed` into `shown`."""
        if context.unsmoothed is None:
            return
        group = self._layouts.group(self._layouts.shown, context.unsmoothed.create_view(), context.resources.sampler)
        context.cover("smooth", [context.shown], self._pipeline, [group])
