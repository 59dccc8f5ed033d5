"""Progressive frames: the running mean while the camera rests."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import screen_pipeline
from lambent.realtime.gpu.targets import target_texture
from lambent.realtime.passes.context import FrameContext

MEAN_FORMAT = "rgba32float"


class AccumulatePass:
    """Keeps two images of 32-bit floats and writes the mean from one into the other."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts = layouts
        self._layout = layouts.of("exact", "exact", "uniform")
        self._pipeline = screen_pipeline(layouts.device, "accumulate", [self._layout], [MEAN_FORMAT])
        self.weight = layouts.uniform(16)
        self._means = lru_cache(1)(self._new_means)

    def encode(self, context: FrameContext) -> None:
        """Add the frame's radiance, by its index in the series, to the mean, which becomes the frame's radiance."""
        index = context.state.accumulate
        if index is None:
            return
        weight = np.array([1 / (index + 1), 0, 0, 0], np.float32)
        self._layouts.device.queue.write_buffer(self.weight, 0, weight)
        mean, group = self._means(context.radiance)[index % 2]
        context.cover("accumulate", [mean.create_view()], self._pipeline, [group])
        context.radiance = mean

    def _new_means(self, frame: Any) -> list[tuple[Any, Any]]:
        """Both images, each with the bind group that reads the other image and the frame."""
        means = [target_texture(self._layouts.device, frame.size, MEAN_FORMAT) for _ in range(2)]
        return [
            (mean, self._layouts.group(self._layout, before.create_view(), frame.create_view(), self.weight))
            for mean, before in zip(means, means[::-1], strict=True)
        ]
