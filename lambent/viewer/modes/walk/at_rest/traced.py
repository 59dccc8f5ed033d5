"""Traced pictures: requested as soon as the view stands still, shown while they converge.

The picture at rest is traced against the baked light. A comparison's B can be traced so too, or by whole paths.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.false_colour import Range
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.targets import pixels
from lambent.realtime.overlays.computed_picture import UploadedPicture
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageTexture
from lambent.viewer.modes.walk.at_rest.tracing import ALL_LIGHT, MOST_SAMPLES, Kind, Traced, Tracing, Wish
from lambent.viewer.modes.walk.light.light_fields import shows_choice
from lambent.viewer.picture import write_picture
from lambent.viewer.screen import Screen

STILL_S = 0.1  # time without a change before pictures are requested
FADE_S, FADE_STEP_S = 0.2, 1 / 30  # duration and steps of the blend from one picture to the next
COARSE_SCALE = 0.5  # a drawn picture of this share of the width and height is replaced by one of half of them first
TRACEABLE = (ALL_LIGHT, "diffuse", "specular")
NO_SCENE = "there is no scene file to trace"
Textures = Mapping[str, str | ImageTexture]


@dataclass(frozen=True)
class Appearance:
    """What a frame does not say of its room.

    Attributes
    ----------
    textures : mapping
        Textures in place of materials' own.
    lamps : mapping
        Edits of lamps, by number.
    answers, rebaked : bool
        Whether light follows edited materials, and whether the copy beside the store has it.
    """

    textures: Textures
    lamps: Mapping[int, LampEdit]
    answers: bool
    rebaked: bool


class TracedPicture:
    """The present picture of a kind; `view` is None before the first."""

    def __init__(self, uploaded: UploadedPicture, screen: Screen) -> None:
        self._uploaded, self._screen = uploaded, screen
        self._taken: Traced | None = None
        self._frame: FrameState | None = None  # as it is shown
        self._wanted: tuple[int, int] | None = None  # size of what it shows
        self._before: Any = None  # view that is blended out
        self._began_s = 0.0
        self.version = 0  # counts pictures

    @property
    def taken(self) -> Traced | None:
        """The present picture."""
        return self._taken

    @property
    def view(self) -> Any:
        return None if self._taken is None else self._uploaded.view

    @property
    def size(self) -> tuple[int, int]:
        """Width and height; 0, 0 before the first picture."""
        return (0, 0) if self._taken is None else (self._taken.radiance.shape[1], self._taken.radiance.shape[0])

    @property
    def samples(self) -> int:
        """Samples per pixel; 0 before the first picture."""
        return 0 if self._taken is None else self._taken.samples

    @property
    def is_whole(self) -> bool:
        """Whether the picture has the size of what it shows."""
        return self._wanted is not None and self.size == self._wanted

    @property
    def counted(self) -> str:
        """The samples, in words."""
        if not self.is_whole:
            return "half size"
        return "1 sample" if self.samples == 1 else f"{self.samples} samples"

    @property
    def drawing(self) -> object:
        """What the picture shows: the same while it converges."""
        return None if self._taken is None else (self._taken.kind, self._taken.number)

    @property
    def readable(self) -> bool:
        return self._taken is not None

    @property
    def rests(self) -> bool:
        return self.is_whole

    @property
    def texture(self) -> Any:
        """The radiance on the GPU, rgba16float."""
        return self._uploaded.radiance

    @property
    def noise(self) -> float | None:
        """Relative standard error; None before it is known."""
        return None if self._taken is None else self._taken.noise

    def show(self, traced: Traced | None, wanted: FrameState, before: Any) -> None:
        """Show a picture, None for none, as `wanted` shows light; a new one is blended from the view `before`."""
        self._wanted = wanted.size
        if traced is not self._taken:
            self._taken, self._frame = traced, None
            if traced is None:
                self._before = None
                return
            self._before, self._began_s = before, self._screen.clock()
            self._uploaded.take(traced.radiance)
            self.version += 1
        if self._taken is not None and (self._frame is None or _display(wanted) != _display(self._frame)):
            if self._frame is not None:
                self._before = None  # shown with another exposure
            width, height = self.size
            self._frame = replace(wanted, width=width, height=height)
            self._uploaded.show(self._frame)

    @property
    def fading(self) -> tuple[Any, float]:
        """The view that is blended out, None without one, and this picture's share."""
        share = (self._screen.clock() - self._began_s) / FADE_S
        if share >= 1:
            self._before = None
        return self._before, min(max(share, 0.0), 1.0)

    def wait_s(self) -> float | None:
        return FADE_STEP_S if self._before is not None else None

    def read(self, at: tuple[float, float] | None = None) -> NDArray[np.float32]:
        """Radiance (height, width, 3); (1, 1, 3) `at` shares of the picture from its upper left."""
        assert self._taken is not None, "read before there is a picture"
        light = self._taken.radiance
        if at is None:
            return np.asarray(light, np.float32)
        column, row = (min(max(int(share * size), 0), size - 1) for share, size in zip(at, self.size, strict=True))
        return np.asarray(light[row : row + 1, column : column + 1], np.float32)

    def save(self, name: str) -> str | None:
        """Write the picture, as `Picture.save` does."""
        assert self._frame is not None, "saved before there is a picture"
        display = pixels(self._uploaded.device, self._uploaded.view.texture)
        return write_picture(self._screen, name, self._frame, self.read(), display)


class TracedFrames:
    """Single pictures of a number of samples, one after the other."""

    def __init__(self, tracing: Tracing, uploaded: UploadedPicture, appearance: Appearance, samples: int) -> None:
        self._tracing, self._uploaded, self._appearance, self._samples = tracing, uploaded, appearance, samples

    def ask(self, frame: FrameState) -> None:
        """Request the picture of a frame."""
        wish = replace(_wish_of(frame, self._appearance), kinds=("traced",), samples=self._samples)
        self._tracing.ask(replace(wish, rebaked=self._appearance.rebaked))

    @property
    def radiance(self) -> Floats | None:
        """Radiance (height, width, 3) of the requested picture; None before it is there.

        Raises
        ------
        UserError
            If it will not come.
        """
        self._tracing.tick()
        if self._tracing.error:
            raise UserError(self._tracing.error)
        found = self._tracing.last("traced")
        return None if found is None else found.radiance

    def display(self, radiance: Floats, frame: FrameState) -> NDArray[np.uint8]:
        """A picture as shown (height, width, 3)."""
        self._uploaded.take(radiance)
        self._uploaded.show(frame)
        return pixels(self._uploaded.device, self._uploaded.view.texture)


class AtRest:
    """Requests pictures of the view, in one process, and shows them."""

    def __init__(
        self, uploaded: Callable[[], UploadedPicture], screen: Screen, store: Path | None, sky_turn_deg: float,
        replaced: tuple[str, ...],
    ) -> None:  # fmt: skip
        self._make, self._screen = uploaded, screen
        self._tracing = None if store is None else Tracing(store, sky_turn_deg, replaced, lambda: screen.wake())
        self._pictures: dict[Kind, TracedPicture] = {}
        self._frame: FrameState | None = None  # what is drawn, without its display
        self._lamps: Mapping[int, LampEdit] = {}
        self._of: tuple[Wish, tuple[Kind, ...]] | None = None  # what pictures depend on
        self._wish: Wish | None = None  # the request
        self._shown: Wish | None = None  # the request whose pictures are shown
        self._least: dict[Kind, int] = {}  # samples of shown pictures that are being traced again
        self._display: object = None  # exposure and view transform at the last update
        self._changed_s = 0.0
        self.still = False  # whether the view had not changed for a moment at the last `update`

    @property
    def fault(self) -> str:
        """Why nothing can be traced, in one line; else empty."""
        return NO_SCENE if self._tracing is None else self._tracing.error

    @property
    def ready(self) -> bool:
        """Whether the process can be asked for pictures."""
        return not self.fault and self._tracing is not None and self._tracing.ready

    @property
    def coming(self) -> bool:
        """Whether there are pictures of the view, or will be soon."""
        return self._of is not None and bool(self._of[1]) and self.ready

    def held(self, kind: Kind) -> TracedPicture:
        """The place of a kind's pictures, at times without one."""
        if kind not in self._pictures:
            self._pictures[kind] = TracedPicture(self._make(), self._screen)
        return self._pictures[kind]

    def picture(self, kind: Kind) -> TracedPicture | None:
        """The present picture of a kind."""
        found = self._pictures.get(kind)
        return found if found is not None and found.readable else None

    @property
    def line(self) -> str:
        """A line on the picture at rest; empty without one, and when it is done."""
        found, tracing = self.picture("traced"), self._tracing
        if found is not None and self.still:
            noise = "" if found.noise is None else f", noise {100 * found.noise:.1f} %"
            return f"traced: {found.counted}{noise}" if found.samples < MOST_SAMPLES else ""
        waits = tracing is not None and not tracing.ready and not self.fault and self._of is not None and self._of[1]
        return f"tracing at rest: {tracing.what}" if waits and tracing is not None else ""

    def frames(self, frame: FrameState, appearance: Appearance, samples: int) -> TracedFrames:
        """Single pictures like a frame, of a number of samples.

        Raises
        ------
        UserError
            If nothing can be traced, or not what the frame shows.
        """
        if self.fault or self._tracing is None:
            raise UserError(f"cannot be traced: {self.fault}")
        if not is_traceable(frame):
            raise UserError("this picture is drawn, not traced", hint="choose the quality as in motion")
        self._tracing.start()
        return TracedFrames(self._tracing, self._make(), appearance, samples)

    def start(self) -> None:
        """Start the process."""
        if self._tracing is not None:
            self._tracing.start()

    def label(self, kind: Kind) -> str:
        """Label of a picture, for the divider."""
        name, found = {"traced": "traced", "path": "path traced"}[kind], self.picture(kind)
        if self.fault:
            return f"not {name}"
        if found is None:
            return f"{name}: at rest" if self.coming or self._tracing is None else f"{name}: {self._tracing.what}"
        return f"{name}, {found.counted}"

    def update(
        self, wanted: FrameState, appearance: Appearance, kinds: tuple[Kind, ...], before: Any, *, paused: bool = False
    ) -> None:
        """Request a view in these kinds once it stands still, and show its present pictures.

        The first picture is blended from the view `before`, unless the exposure has just changed. While `paused`,
        because single pictures are traced, nothing is requested; then the view is traced again, and shown once it has
        as many samples as before.
        """
        tracing, now_s = self._tracing, self._screen.clock()
        if tracing is None:
            return
        tracing.tick()
        frame = _drawn(wanted)
        if (frame, appearance.lamps) != (self._frame, self._lamps):
            self._frame, self._lamps, self._changed_s = frame, appearance.lamps, now_s
        self.still = now_s - self._changed_s >= STILL_S
        of = _wish_of(wanted, appearance), kinds
        if of != self._of:
            self._of = of
            if self._wish is not None:
                tracing.ask(None)
            self._wish = self._shown = None
            for picture in self._pictures.values():
                picture.show(None, wanted, None)
        redisplayed, self._display = self._display != _display(wanted), _display(wanted)
        wish = replace(of[0], kinds=kinds, rebaked=appearance.rebaked)
        if paused:
            self._wish = None
        elif kinds and self.still and wish != self._wish and tracing.ready:
            self._ask(wish)
        for kind in kinds:
            found = tracing.last(kind) if self._wish is not None else None
            if found is not None and found.samples < self._least.get(kind, 0):
                found = None
            picture = self.held(kind)
            if found is not None or picture.readable:
                picture.show(found or picture.taken, wanted, None if redisplayed else picture.view or before)

    def _ask(self, wish: Wish) -> None:
        assert self._tracing is not None, "there is a process to ask"
        again = wish == self._shown
        self._least = {kind: self.held(kind).samples for kind in wish.kinds} if again else {}
        self._wish = self._shown = wish
        coarse = not again and self._screen.statistics.scale <= COARSE_SCALE
        self._tracing.ask(replace(wish, coarse=coarse))

    def wait_s(self) -> float | None:
        """Seconds until a request is due; None: never. The process wakes the window by itself."""
        asks = self._of is not None and bool(self._of[1]) and not self.still
        return max(0.0, self._changed_s + STILL_S - self._screen.clock()) if asks else None

    def close(self) -> None:
        """End the process."""
        if self._tracing is not None:
            self._tracing.close()


def is_traceable(frame: FrameState) -> bool:
    """Whether tracing can show what a frame shows.

    Paths meet what a near plane cuts away, and colours of a choice are no light.
    """
    return frame.show in TRACEABLE and frame.near_m is None and not shows_choice(frame)


def _display(frame: FrameState) -> tuple[float, str, Range]:
    return frame.exposure_ev, frame.view_transform, frame.scale


def _drawn(frame: FrameState) -> FrameState:
    """A frame without its display, and without how far its light is computed."""
    return replace(frame, exposure_ev=0.0, view_transform="linear", scale=Range(), maps=0, mixed=0)


def _wish_of(frame: FrameState, appearance: Appearance) -> Wish:
    """What pictures of a frame depend on, without their kinds and without where their light is."""
    return Wish(
        0, (), frame.camera, frame.size, dict(frame.materials), dict(appearance.textures), dict(frame.light),
        frame.show if frame.show in TRACEABLE else ALL_LIGHT, appearance.answers, lamps=dict(appearance.lamps),
    )  # fmt: skip
