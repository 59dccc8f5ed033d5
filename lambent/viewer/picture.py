"""The picture in the window: which frame is due, where it is drawn, what it cost, how it is saved."""

from __future__ import annotations

import math
import time
from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.colour import srgb_decode
from lambent.core.errors import UserError
from lambent.core.false_colour import Range, with_scale
from lambent.core.images import write_image
from lambent.materials.document import Material
from lambent.realtime.device import adapter_info
from lambent.realtime.frame_state import QMC_N, SHOW, VIEW_TRANSFORMS, FrameState, quantity_of
from lambent.realtime.incident import AUTO, look_ups
from lambent.realtime.integrators import INTEGRATORS
from lambent.realtime.patterns import RINGS
from lambent.realtime.planar_integrators import CHOICES as PLANAR_WAYS
from lambent.realtime.planar_integrators import OFF
from lambent.realtime.renderer import Renderer
from lambent.realtime.slices import SLICE_S, Cut
from lambent.realtime.targets import DISPLAY_FORMAT
from lambent.viewer.input import Rect
from lambent.viewer.pacing import Pacer, Plan, prior_share
from lambent.viewer.quantity import is_false_coloured, shown_scale
from lambent.viewer.state import Choices, Statistics, ViewerState

CHOICES = Choices(
    integrators=tuple(name for name, how in INTEGRATORS.items() if how.specular),
    view_transforms=tuple(reversed(VIEW_TRANSFORMS)),
    shows=tuple(SHOW),
    lookups=(AUTO, *look_ups()),
    sample_counts=tuple(n for n in RINGS if n <= 19),
    planars=PLANAR_WAYS,
)
# At rest: frames of the progressive series, and samples per pixel and lobe in each. Software takes one sample at a
# time, so that a frame is short and the window answers in between.
REST_FRAMES = 128
LARGEST_PX = 8192  # of a texture, by WebGPU's default limits; a larger window shows a magnified picture
SOFTWARE_N = 1
QUIET_S = 0.5  # at most so long after an event, or as long as a part of a frame at rest takes, none is begun


@dataclass
class Job:
    """A frame at rest that is drawn in parts."""

    frame: FrameState
    plan: Plan
    view: Any
    steps: Generator[None, None, Any]
    seconds: float = 0.0
    longest_s: float = 0.0


class Picture:
    """Draws what a state shows into `view`, a texture of the picture's size or smaller."""

    def __init__(self, renderer: Renderer) -> None:
        self._renderer, self.device = renderer, renderer.device
        adapter = adapter_info(renderer.device)
        self._adapter = adapter.name
        self._rest_n = SOFTWARE_N if adapter.is_software else QMC_N
        self._pacer = Pacer(accumulate_to=REST_FRAMES, slow_adapter=adapter.is_software)
        self._refine = True
        self._part_s = 0.0  # what the longest part of the last frame at rest took
        self._whole_s = math.inf if adapter.is_software else 0.0  # what the last frame at rest took altogether
        self._cut = Cut()
        self._under_way: Job | None = None
        self.view: Any = None
        self.radiance: Any = None  # texture of what `view` shows, linear
        self.drawn: FrameState | None = None  # as it was planned
        self.version = 0  # grows with every drawn frame
        self._size: tuple[int, int] = (0, 0)
        self._spare: list[Any] = []  # views of that size, two at most

    @property
    def views(self) -> tuple[Any, ...]:
        return (self.view,)

    @property
    def renderer(self) -> Renderer:
        return self._renderer

    def update(
        self,
        state: ViewerState,
        rect: Rect,
        pixel_ratio: float,
        materials: Mapping[str, Material] | None = None,
        *,
        integrator: str | None = None,
        refine: bool | None = None,
        share: float = 1.0,
        antialias: bool = True,
    ) -> None:
        """Draw the next frame where one is due.

        `materials`, `integrator` and `refine` stand in for the state's; `share` of the frame time is for this picture.
        Without `antialias` every frame looks through the middle of each pixel.
        """
        width, height = (min(round(size * pixel_ratio), LARGEST_PX) for size in (rect.width, rect.height))
        wanted = frame_state(state, width, height)
        if materials is not None:
            wanted = replace(wanted, materials=dict(materials))
        if integrator is not None:
            wanted = replace(wanted, integrator=integrator, antialias=antialias)
        now_s, self._refine = state.clock(), state.refine if refine is None else refine
        self._pacer.aim(share * state.target_ms / 1e3)
        rests = wanted == self._pacer.shown
        if not rests:
            self._under_way = None  # another frame is wanted: nobody will see this one
        if self._under_way is not None:
            return
        plan = self._pacer.plan(wanted, now_s, refine=self._refine, adaptive=state.adaptive_resolution)
        if plan is None or (rests and (state.answering or self._quiet_for_s(state) > 0)):
            return
        frame = self._planned(wanted, plan)
        view = self._view_of(frame.width, frame.height)
        if rests and self._whole_s > SLICE_S:
            self._under_way = Job(frame, plan, view, self._renderer.slices(frame, view, self._cut))
            return
        started = time.perf_counter()
        radiance = self._renderer.draw(frame, view)
        # Waiting keeps the queue short, so that a frame shows the latest event, and tells what a frame costs.
        self._renderer.finish()
        seconds = time.perf_counter() - started
        if rests:
            self._whole_s = self._part_s = seconds
        self._show(state, frame, plan, view, radiance, seconds)

    @property
    def under_way(self) -> bool:
        """Whether a frame at rest is being drawn in parts, see `work`."""
        return self._under_way is not None

    @property
    def readable(self) -> bool:
        """Whether `radiance` is that of `view`: a frame under way may be drawn over it."""
        over = self._under_way is not None and self._under_way.plan.accumulate is None
        return self.radiance is not None and not over

    def work(self, state: ViewerState) -> bool:
        """Draw a part of the frame under way; whether there is a new picture to show.

        Slices take about `slices.SLICE_S`, so that events are answered in between. The last frame stays in `view`
        until the frame is whole.
        """
        job = self._under_way
        if job is None:
            return False
        started = time.perf_counter()
        try:
            next(job.steps)
        except StopIteration as done:
            self._under_way = None
            self._whole_s, self._part_s = job.seconds, job.longest_s
            self._show(state, job.frame, job.plan, job.view, done.value, job.seconds)
            return True
        seconds = time.perf_counter() - started
        job.seconds, job.longest_s = job.seconds + seconds, max(job.longest_s, seconds)
        return False

    def _show(
        self, state: ViewerState, frame: FrameState, plan: Plan, view: Any, radiance: Any, seconds: float
    ) -> None:
        """Take a frame that is there."""
        self.view, self.radiance, self.drawn = view, radiance, frame
        self.version += 1
        self._pacer.drawn(plan)
        drawn = self._renderer.statistics
        self._pacer.cost(plan, seconds, drawn["mirrors"])
        state.statistics = self._statistics(drawn, seconds, plan)

    def wait_s(self, state: ViewerState) -> float | None:
        """Seconds until a frame is due although nothing changes; None: never."""
        if self._under_way is not None:
            return None  # `work` goes on by itself
        due = self._pacer.wait_s(state.clock(), refine=self._refine)
        return None if due is None else max(due, self._quiet_for_s(state))

    def _quiet_for_s(self, state: ViewerState) -> float:
        """Seconds that no frame of rest is begun: while a part of one is drawn nothing answers."""
        return max(0.0, state.touched_s + min(self._part_s, QUIET_S) - state.clock())

    def save(self, state: ViewerState) -> str | None:
        """Write the picture at full size into the state's folder: PNG as shown, EXR as linear radiance.

        Returns the name without its suffix, None where it could not be written.
        """
        self._under_way = None  # the renderer draws one frame at a time; what is lost is drawn again
        name = free_name(state.folder, state.scene.name)
        frame = self._pacer.shown
        assert isinstance(frame, FrameState), "saved before the first frame"
        if self._pacer.accumulated:
            frame = self._planned(frame, Plan(1.0, self._pacer.accumulated))
        try:
            write_image(state.folder / f"{name}.exr", self._renderer.image(frame))
            display = self._renderer.display_image(frame)
            display = scaled(display, frame)
            write_image(state.folder / f"{name}.png", srgb_decode(display.astype(np.float32) / 255))
        except (UserError, OSError) as error:
            state.say(f"picture not saved: {error}")
            return None
        state.say(f"saved {name}.png and {name}.exr")
        return name

    def _planned(self, frame: FrameState, plan: Plan) -> FrameState:
        if plan.accumulate is not None:
            shown = plan.accumulate + 1
            prior = 0.0 if frame.integrator == "qmc" else prior_share(shown, self._pacer.accumulate_to, self._rest_n)
            return replace(frame, integrator="qmc", n=self._rest_n, accumulate=plan.accumulate, prior=prior)
        if not plan.mirrors:
            frame = replace(frame, planar=OFF)
        width, height = (max(1, round(plan.scale * size)) for size in (frame.width, frame.height))
        return replace(frame, width=width, height=height)

    def _view_of(self, width: int, height: int) -> Any:
        """What the next frame is drawn into: not what is shown, which a frame in parts must leave alone."""
        if self._size != (width, height):
            self._size, self._spare = (width, height), []
        free = [view for view in self._spare if view is not self.view]
        if not free:
            usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING
            texture = self.device.create_texture(size=(width, height, 1), format=DISPLAY_FORMAT, usage=usage)
            free = [texture.create_view()]
            self._spare += free
        return free[0]

    @property
    def accumulated(self) -> int:
        """Frames of the progressive series that the picture is the mean of; 0: it is one of motion."""
        return self._pacer.accumulated

    @property
    def samples(self) -> int:
        """The same in samples per pixel and lobe."""
        return self._pacer.accumulated * self._rest_n

    def _statistics(self, drawn: Mapping[str, Any], seconds: float, plan: Plan) -> Statistics:
        return Statistics(
            adapter=self._adapter,
            integrator=drawn["integrator"],
            frame_ms=seconds * 1e3,
            gpu_ms=drawn["gpu_ms"],
            draw_calls=drawn["draw_calls"],
            resolution=(drawn["width"], drawn["height"]),
            samples=drawn["samples_per_pixel"],
            accumulated=self._pacer.accumulated * self._rest_n,
            accumulate_to=REST_FRAMES * self._rest_n,
            scale=plan.scale,
            mirrors=drawn["mirrors"] if plan.mirrors else None,
        )


def scaled(display: NDArray[np.uint8], frame: FrameState) -> NDArray[np.uint8]:
    """A picture of the frame as it is kept: false colours with the scale that says what they mean."""
    if not frame.is_false_coloured:
        return display
    return with_scale(display, frame.scale, quantity_of(frame.show).unit)


def frame_state(state: ViewerState, width: int, height: int) -> FrameState:
    """The frame that shows the state at full size."""
    return FrameState(
        replace(state.camera, name=""),  # another name is no other picture
        width,
        height,
        integrator=state.integrator,
        n=state.n,
        exposure_ev=state.exposure_ev,
        view_transform=state.view_transform,
        materials=dict(state.edits.edited),
        lookup=state.lookup,
        planar=state.planar,
        show=state.show,
        scale=shown_scale(state) if is_false_coloured(state) else Range(),
        near_m=state.near_m,
    )


def free_name(folder: Path, stem: str) -> str:
    """`stem` with the first number that is not taken in `folder`, without characters that file systems refuse."""
    plain = "".join(c if c.isalnum() or c in "._-" else "-" for c in stem).strip(".-") or "picture"
    number = 1
    while any((folder / f"{plain}-{number:03}{suffix}").exists() for suffix in (".png", ".exr")):
        number += 1
    return f"{plain}-{number:03}"
