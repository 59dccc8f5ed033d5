"""Base of a frame that redraws only the objects of some materials."""

from __future__ import annotations

from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import screen_pipeline
from lambent.realtime.passes.context import FrameContext


class BasePass:
    """Enlarges the last frame into the target if it was smaller; otherwise the target holds it already."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts = layouts
        self._pipeline = screen_pipeline(layouts.device, "enlarge", [layouts.shown], ["rgba16float"])

    def encode(self, context: FrameContext) -> None:
        """Draw the base into the target."""
        if context.redrawn is None or context.base is context.target.radiance:
            return
        group = self._layouts.group(self._layouts.shown, context.base.create_view(), context.resources.sampler)
        context.cover("enlarge", [context.target.radiance.create_view()], self._pipeline, [group])
