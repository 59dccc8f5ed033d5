"""Glare at the eye: a fisheye, made face by face and rated; traced as the picture at rest is, otherwise drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.false_colour import Range
from lambent.core.light.glare import Glare, glare
from lambent.core.views.panorama import Panorama
from lambent.core.views.projections import Projection, View
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.viewer.modes.walk.at_rest.traced import TracedFrames

SIDE_PX = 400  # of the fisheye
SUPERSAMPLES = 2  # frames of a drawn face
SAMPLES = 16  # of a traced face; in the built-in room, DGP is within .001 and UGR within .1 of those of 256 samples


@dataclass
class GlareMeter:
    """Request and result of the panel: `share` of the faces is made.

    `found` was rated from pictures that were made as `made` says; `is_old` once the view or the room has changed.
    """

    wanted: bool = False
    found: Glare | None = None
    made: str = ""
    is_old: bool = False
    share: float | None = None


class GlareDrawing:
    """Makes the faces of a view one by one; a new request restarts."""

    def __init__(self, meter: GlareMeter) -> None:
        self._meter = meter
        self._frame: FrameState | None = None  # whose light is rated
        self._view: View | None = None
        self._around: Panorama | None = None
        self._traced: TracedFrames | None = None  # makes the faces; None: they are drawn
        self._is_asked = False  # whether the next face is being traced
        self._done = 0

    @property
    def busy(self) -> bool:
        return self._around is not None or self._meter.wanted

    @property
    def waits(self) -> bool:
        """Whether the next face is traced in another process, which wakes the window."""
        return self._is_asked and not self._meter.wanted

    def step(
        self, frame: FrameState, renderer: Callable[[], Renderer], traced: Callable[[FrameState], TracedFrames | None]
    ) -> None:
        """Make the next face, if one is due, with the light of `frame` at the time of the request.

        Faces are made by `traced`, or by the renderer if it is None or fails.
        """
        meter = self._meter
        if meter.wanted:
            meter.wanted, self._frame = False, replace(frame, show="full")
            self._begin(traced(self._frame))
        meter.is_old = self._frame is None or _rated(frame) != _rated(self._frame)
        around, view = self._around, self._view
        if around is None or view is None:
            return
        try:
            face = self._face(around, renderer)
        except UserError:  # the line on the picture at rest says why
            return self._begin(None)
        if face is None:
            return
        around.fill(self._done, face)
        self._done += 1
        meter.share = self._done / len(around.cameras)
        if self._done == len(around.cameras):
            meter.found, meter.share, self._around = glare(around.image(), view), None, None
            meter.made = "drawn" if self._traced is None else f"traced, {SAMPLES} samples"

    def _begin(self, traced: TracedFrames | None) -> None:
        assert self._frame is not None, "there is a request"
        self._view = View.of(self._frame.camera, Projection.fisheye, SIDE_PX, SIDE_PX)
        self._around, self._done = Panorama(self._view, SIDE_PX, SIDE_PX), 0
        self._traced, self._is_asked = traced, False

    def _face(self, around: Panorama, renderer: Callable[[], Renderer]) -> Floats | None:
        """Radiance of the next face; None while it is traced. Raises `UserError` if it will not come."""
        assert self._frame is not None, "there is a request"
        side = around.side_px
        frame = replace(self._frame, camera=around.cameras[self._done], width=side, height=side)
        if self._traced is None:
            return renderer().still_radiance(frame, SUPERSAMPLES)
        if not self._is_asked:
            self._traced.ask(frame)
        found = self._traced.radiance
        self._is_asked = found is None
        return found


def _rated(frame: FrameState) -> FrameState:
    """What ratings depend on, of a frame."""
    return replace(
        frame, camera=replace(frame.camera, name=""), width=1, height=1, show="full", exposure_ev=0.0,
        view_transform="linear", scale=Range(), maps=0, mixed=0,
    )  # fmt: skip
