"""Renders a film along a camera path while the window keeps running; it can be cancelled."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.files import check_place
from lambent.core.light.light_mix import Factors
from lambent.core.outputs import is_marked
from lambent.core.pictures.film import (
    FILM,
    SEQUENCES,
    even_size,
    pictures_there,
    pictures_writer,
    radiance_wanted,
    sequence_file,
)
from lambent.core.views.camera import CameraPath
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.scenes.camera_paths import camera_at
from lambent.viewer.edits.edits import file_in
from lambent.viewer.modes.walk.at_rest.traced import TracedFrames
from lambent.viewer.picture import scaled

SIZES = {"1280 x 720": (1280, 720), "1920 x 1080": (1920, 1080), "3840 x 2160": (3840, 2160), "640 x 360": (640, 360)}
FPS = (24, 25, 30, 60)
QUALITIES = {"as in motion": 0, "traced, 16 samples": 16, "traced, 64 samples": 64}
SLICE_S = 0.03  # time of work between two checks for events
LONGEST_FRAMES = 100_000


@dataclass
class Films:
    """Options of the Film panel, and the running film. `quality` is a key of `QUALITIES`."""

    size: str = next(iter(SIZES))
    fps: int = 30
    quality: str = next(iter(QUALITIES))
    file_name: str = ""
    wanted: CameraPath | None = None
    under_way: Filming | None = None


def film_file(folder: Path, text: str) -> Path:
    """File of a film or of an image sequence, from a typed name or path, in `folder` if relative."""
    name = text.strip()
    path = Path(name)
    if path.suffix.lower() not in (FILM, *SEQUENCES) or not path.stem.strip(". ") or not name.isprintable():
        raise UserError(
            "is not a film name", got=text, expected="a file name, as in tour.mp4, tour-####.png or tour-####.exr"
        )
    file = file_in(folder, name)
    check_place(file if file.suffix.lower() == FILM else sequence_file(file, 1))
    others = [there for there in pictures_there(file) if not is_marked(there)]
    if others:
        raise UserError("exists already and was not made by Lambent", file=others[0], hint="choose another name")
    return file


class Filming:
    """A running film of frames like `frame` along `path`; `error` is the reason of an early end.

    The window draws with another renderer. `traced` makes the frames instead, if given. `light` is the mix of light
    groups by time in seconds, by default the mix of `frame`. `waits`: the next frame is made elsewhere.
    """

    def __init__(
        self, renderer: Renderer, file: Path, path: CameraPath, frame: FrameState, fps: int,
        traced: TracedFrames | None = None, light: Callable[[float], Factors] | None = None,
    ) -> None:  # fmt: skip
        width, height = even_size(frame.width, frame.height)
        self.file, self.total, self.done = file, path.frames(fps), 0
        if self.total > LONGEST_FRAMES:
            raise UserError("film is too long", got=f"{self.total} frames", expected=f"at most {LONGEST_FRAMES}")
        self.error: str | None = None
        self.over = self.waits = False
        self._began_s, self._light = time.monotonic(), light
        self._work = self._run(renderer, path, replace(frame, width=width, height=height), fps, traced)

    @property
    def left_s(self) -> float | None:
        """Estimated seconds until the end."""
        spent_s = time.monotonic() - self._began_s
        return spent_s / self.done * (self.total - self.done) if self.done else None

    def step(self) -> bool:
        """Work for about `SLICE_S`; return whether the film is finished."""
        end_s = time.monotonic() + SLICE_S
        try:
            self.waits = False
            while time.monotonic() < end_s and not self.waits:
                next(self._work)
        except StopIteration:
            self.over = True
        except (UserError, OSError) as error:
            self.error, self.over = str(error), True
        return self.over

    def cancel(self) -> None:
        """Stop: a film leaves no file, an image sequence its finished images."""
        self._work.close()
        self.over = True

    def _run(
        self, renderer: Renderer, path: CameraPath, frame: FrameState, fps: int, traced: TracedFrames | None
    ) -> Generator[None, None, None]:
        """Yield after each frame and while one is awaited, so that events can be handled."""
        linear = radiance_wanted(self.file)
        with pictures_writer(self.file, frame.width, frame.height, fps) as write:
            for index in range(self.total):
                view = replace(frame, camera=camera_at(path, index / fps))
                if self._light is not None:
                    view = replace(view, light=self._light(index / fps))
                if traced is not None:
                    traced.ask(view)
                    while (light := traced.radiance) is None:
                        self.waits = True
                        yield
                    write(light if linear else scaled(traced.display(light, view), view))
                else:
                    write(renderer.image(view) if linear else scaled(renderer.display_image(view), view))
                self.done = index + 1
                yield
