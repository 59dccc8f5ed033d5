"""Overlays of a picture: drawn at full size for frames of any size, without jitter, with the scene's occlusion."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from lambent.realtime.frame_state import FrameState, frame_data
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import PassTimer, Targets
from lambent.realtime.objects.clusters import Clusters
from lambent.realtime.objects.draws import draws_of, panes_of
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.planar.planar_integrators import OFF
from lambent.realtime.resources import SceneResources


class Overlay:
    """Draws independently of the scene's renderer, even while it has a frame in progress."""

    def __init__(self, layouts: Layouts, resources: SceneResources, clusters: Clusters) -> None:
        self._layouts, self._resources, self._clusters = layouts, resources, clusters
        self._depth = DepthPass(layouts)
        self._device = layouts.device
        self._targets, self._timer = Targets(self._device), PassTimer(self._device)
        self._frame_buffer = layouts.uniform(FRAME_DTYPE.itemsize)
        self._frame_group = layouts.group(layouts.frame, self._frame_buffer, resources.sampler)

    def _frame_context(self, state: FrameState, format: str) -> FrameContext:
        """A frame of a state into a target of `format`, before its first pass."""
        state = replace(state, accumulate=None, jitter_px=(0.0, 0.0), planar=OFF)
        data = frame_data(state, self._resources.scene.record.bounds)
        self._device.queue.write_buffer(self._frame_buffer, 0, data.tobytes())
        draws = draws_of(state, self._resources, panes=panes_of(state, self._resources))
        return FrameContext(
            self._device.create_command_encoder(), state, data, self._frame_group, self._resources,
            self._clusters, self._targets, self._timer, self._targets.fit(state.size, format),
            [draw for draw in draws if not draw.is_pane], [draw for draw in draws if draw.is_pane], [], Counter(),
        )  # fmt: skip
