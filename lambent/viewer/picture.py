"""Pictures in the window: choice of the next frame, drawing, timing, saving."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.false_colour import with_scale
from lambent.core.pictures.images import write_image, write_shown
from lambent.realtime.frame_state import FrameState, quantity_of
from lambent.realtime.gpu.device import adapter_info
from lambent.realtime.gpu.targets import DISPLAY_FORMAT, target_texture
from lambent.realtime.planar.planar_integrators import OFF
from lambent.realtime.renderer import Renderer
from lambent.viewer.edits.edits import unused
from lambent.viewer.mode import Drawing
from lambent.viewer.pacing import Pacer, Plan
from lambent.viewer.screen import Rect, Screen, Statistics, least

LARGEST_PX = 8192  # of a texture, by WebGPU's default limits; a larger window shows a magnified picture
LONGEST_OVER_S = 0.15  # longest frame over another one; changes that take longer are drawn as motion is
QUIET_S = 0.5  # longest pause of frames at rest after an event; else the time of such a frame


class Picture:
    """Draws frames into `view`, a texture of the picture's size or smaller."""

    def __init__(self, renderer: Renderer, screen: Screen) -> None:
        self._renderer, self._screen, self._device = renderer, screen, renderer.device
        adapter = adapter_info(renderer.device)
        self._adapter = adapter.name
        if screen.pace.covers is None:
            screen.pace.covers = not adapter.is_software
        self.pacer = Pacer(slow_adapter=adapter.is_software)
        self._sharpen = True
        self._whole_s = 0.0  # time of the last frame at rest
        self._over_s: dict[frozenset[str], float] = {}  # time of the last frame over another one, by its materials
        self.view: Any = None
        self.radiance: Any = None  # texture that `view` shows, linear
        self.version = 0  # counts drawn frames
        self._size: tuple[int, int] = (0, 0)
        self._spare: list[Any] = []  # unused views of that size, at most two

    def update(self, wanted: FrameState, *, sharpen: bool = True, share: float = 1.0) -> None:
        """Draw the next due frame towards the picture `wanted`.

        `sharpen`: draw it whole at rest; `share` is this picture's share of the frame time.
        """
        pace, now_s = self._screen.pace, self._screen.clock()
        self._sharpen = sharpen
        self.pacer.aim(share * pace.target_ms / 1e3)
        rests = wanted == self.pacer.shown
        soon = pace.dragging or self._renderer.mixer.lags  # soon rather than sharp: the user waits for this light
        relit = not rests and not soon and is_relit(wanted, self.pacer.shown)
        if relit and not sharpen:
            return
        redrawn = None if rests else self._renderer.redrawn(wanted)
        over = bool(redrawn) and self._over_s.get(redrawn or frozenset(), 0.0) <= LONGEST_OVER_S
        plan = self.pacer.plan(wanted, now_s, sharpen=sharpen, adaptive=pace.adaptive, over=over)
        if plan is None or (rests and (pace.answering or self._quiet_for_s() > 0)):
            return
        frame = self._planned(wanted, plan)
        view = self._view_of(frame.width, frame.height)
        started = time.perf_counter()
        self.radiance, self.view = self._renderer.draw(frame, view), view
        # Waiting keeps the queue short, so that a frame shows the latest event, and measures its cost.
        self._renderer.finish()
        seconds = time.perf_counter() - started
        if rests:
            self._whole_s = seconds
        elif plan.over and redrawn is not None:
            self._over_s[redrawn] = seconds
        self.version += 1
        drawn = self._renderer.statistics
        self.pacer.drawn(plan, rests=rests)
        self.pacer.cost(plan, seconds, drawn["mirrors"])
        self._screen.statistics = self._statistics(drawn, seconds, plan)

    def stand_in(self, texture: Any, frame: FrameState) -> None:
        """Draw later changes over a texture of radiance (rgba16float) that shows `frame`."""
        self._renderer.base(texture, replace(frame, covers=bool(self._screen.pace.covers)))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of `radiance`; 0, 0 without one."""
        return (0, 0) if self.radiance is None else self.radiance.size[:2]

    @property
    def drawing(self) -> object:
        """What the picture shows."""
        return self.version

    @property
    def readable(self) -> bool:
        return self.radiance is not None

    @property
    def rests(self) -> bool:
        """Whether no other frame is due."""
        return self.wait_s() is None

    def wait_s(self) -> float | None:
        """Seconds until a frame is due although nothing changes; None: never."""
        due = self.pacer.wait_s(self._screen.clock(), sharpen=self._sharpen)
        return None if due is None else max(due, self._quiet_for_s())

    def _quiet_for_s(self) -> float:
        """Seconds for which no frame at rest is started: events wait while it is drawn."""
        return max(0.0, self._screen.pace.touched_s + min(self._whole_s, QUIET_S) - self._screen.clock())

    def save(self, name: str) -> str | None:
        """Write the picture at full size, see `write_picture`."""
        frame = self.pacer.shown
        assert isinstance(frame, FrameState), "saved before the first frame"
        return write_picture(
            self._screen, name, frame, self._renderer.image(frame), self._renderer.display_image(frame)
        )  # fmt: skip

    def _planned(self, frame: FrameState, plan: Plan) -> FrameState:
        if not plan.mirrors:
            frame = replace(frame, planar=OFF)
        width, height = (max(1, round(plan.scale * size)) for size in (frame.width, frame.height))
        covers = bool(self._screen.pace.covers)
        return replace(frame, width=width, height=height, over=plan.over, covers=covers)

    def _view_of(self, width: int, height: int) -> Any:
        """A target for the next frame, never the shown view, which must stay until the frame is complete."""
        if self._size != (width, height):
            self._size, self._spare = (width, height), []
        free = [view for view in self._spare if view is not self.view]
        if not free:
            free = [target_texture(self._device, (width, height, 1), DISPLAY_FORMAT).create_view()]
            self._spare += free
        return free[0]

    def read(self, at: tuple[float, float] | None = None) -> NDArray[np.float32]:
        """Radiance (height, width, 3) back from the GPU; (1, 1, 3) `at` shares of the picture from its upper left."""
        width, height = self.radiance.size[:2]
        x, y = 0, 0
        if at is not None:
            x, y = min(max(int(at[0] * width), 0), width - 1), min(max(int(at[1] * height), 0), height - 1)
            width, height = 1, 1
        dtype = np.dtype(np.float16 if self.radiance.format == "rgba16float" else np.float32)
        source, layout = {"texture": self.radiance, "origin": (x, y, 0)}, {"bytes_per_row": width * 4 * dtype.itemsize}
        data = self._device.queue.read_texture(source, layout, (width, height, 1))
        assert isinstance(self.pacer.shown, FrameState)
        return self._renderer.in_units(np.frombuffer(data, dtype).reshape(height, width, 4)[..., :3], self.pacer.shown)

    @property
    def samples(self) -> int:
        """Samples that the picture has gathered: none, it is one frame."""
        return 0

    def _statistics(self, drawn: Mapping[str, Any], seconds: float, plan: Plan) -> Statistics:
        return Statistics(
            self._adapter, drawn["integrator"], frame_ms=seconds * 1e3, gpu_ms=drawn["gpu_ms"],
            draw_calls=drawn["draw_calls"], resolution=(drawn["width"], drawn["height"]),
            samples=drawn["samples_per_pixel"], scale=plan.scale, light_fields=drawn["light_fields"],
            mirrors=drawn["mirrors"] if plan.mirrors else None,
        )  # fmt: skip


class Shown(Protocol):
    """Protocol of pictures in the window; members as of `Picture`."""

    @property
    def view(self) -> Any: ...
    @property
    def readable(self) -> bool: ...
    @property
    def size(self) -> tuple[int, int]: ...
    @property
    def samples(self) -> int: ...
    @property
    def version(self) -> int: ...
    @property
    def drawing(self) -> object: ...
    @property
    def rests(self) -> bool: ...
    def wait_s(self) -> float | None: ...
    def read(self, at: tuple[float, float] | None = None) -> NDArray[np.float32]: ...
    def save(self, name: str) -> str | None: ...


class Pair(Drawing):
    """The picture A and, in a comparison, B: `shown` in this order."""

    shown: tuple[Shown, ...] = ()

    @property
    def views(self) -> tuple[Any, ...]:
        return tuple(picture.view for picture in self.shown)

    def wait_s(self) -> float | None:
        return least(*(picture.wait_s() for picture in self.shown))


def write_picture(
    screen: Screen, name: str, frame: FrameState, radiance: Floats, display: NDArray[np.uint8]
) -> str | None:
    """Write a picture as shown (PNG) and its linear radiance (EXR), called after the scene's `name`.

    Returns the files' common stem; None if they could not be written.
    """
    stem = "".join(c if c.isalnum() or c in "._-" else "-" for c in name).strip(".-") or "picture"
    stem = unused(screen.folder, stem, ".png", ".exr")
    try:
        write_image(screen.folder / f"{stem}.exr", radiance)
        write_shown(screen.folder / f"{stem}.png", scaled(display, frame))
    except (UserError, OSError) as error:
        screen.say(f"picture not saved: {error}")
        return None
    screen.say(f"saved {stem}.png and {stem}.exr")
    return stem


def is_relit(wanted: FrameState, shown: object) -> bool:
    """Whether a picture differs from the shown one in computed light alone, which follows edits by itself."""
    return isinstance(shown, FrameState) and wanted == replace(shown, maps=wanted.maps, mixed=wanted.mixed)


def size_px(place: Rect, pixel_ratio: float) -> tuple[int, int]:
    """Width and height of a frame that fills a place of the window."""
    return min(round(place.width * pixel_ratio), LARGEST_PX), min(round(place.height * pixel_ratio), LARGEST_PX)


def scaled(display: NDArray[np.uint8], frame: FrameState) -> NDArray[np.uint8]:
    """The picture to save: false colours get their scale."""
    if not frame.is_false_coloured:
        return display
    return with_scale(display, frame.scale, quantity_of(frame.show).unit)
