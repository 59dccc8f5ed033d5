"""Glare at the eye: draws a fisheye, one face per frame of the window, and rates it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from lambent.core.around import Around
from lambent.core.camera import Camera
from lambent.core.glare import Glare, glare
from lambent.core.projections import Projection, View
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer

SIDE_PX = 400  # of the fisheye
SUPERSAMPLES = 2


@dataclass
class GlareMeter:
    """Request and result of the panel: `found` was rated at `camera`; `share` of the faces is drawn."""

    wanted: bool = False
    found: Glare | None = None
    camera: Camera | None = None
    share: float | None = None


class GlareDrawing:
    """Draws the faces of a view one by one; a new request restarts."""

    def __init__(self, meter: GlareMeter) -> None:
        self._meter = meter
        self._view: View | None = None
        self._around: Around | None = None
        self._done = 0

    @property
    def busy(self) -> bool:
        return self._around is not None or self._meter.wanted

    def step(self, renderer: Renderer, frame: FrameState) -> None:
        """Draw the next face, if one is due, with the materials and look-ups of `frame`."""
        meter = self._meter
        if meter.wanted:
            self._view = View.of(frame.camera, Projection.fisheye, SIDE_PX, SIDE_PX)
            self._around, self._done, meter.wanted = Around(self._view, SIDE_PX, SIDE_PX), 0, False
        around, view = self._around, self._view
        if around is None or view is None:
            return
        side, camera = around.side_px, around.cameras[self._done]
        drawn = replace(frame, camera=camera, width=side, height=side, show="full")
        around.fill(self._done, renderer.still_radiance(drawn, SUPERSAMPLES))
        self._done += 1
        meter.share = self._done / len(around.cameras)
        if self._done == len(around.cameras):
            meter.found, meter.camera, meter.share = glare(around.image(), view), view.camera, None
            self._around = None
