"""A film of a path, made while the window goes on: a few frames at a time, with an end in sight, and a way out."""

from __future__ import annotations

import time
from collections.abc import Generator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lambent.core.camera import CameraPath
from lambent.core.errors import UserError
from lambent.core.files import check_place
from lambent.core.film import FILM, SEQUENCES, even_size, pictures_writer, radiance_wanted, sequence_file
from lambent.realtime.frame_state import QMC_N, FrameState
from lambent.realtime.renderer import Renderer
from lambent.scenes.camera_paths import camera_at
from lambent.viewer.picture import scaled

SIZES = {"1280 x 720": (1280, 720), "1920 x 1080": (1920, 1080), "3840 x 2160": (3840, 2160), "640 x 360": (640, 360)}
FPS = (24, 25, 30, 60)
QUALITIES = {"as in motion": 0, "refined, 64 samples": 64, "refined, 256 samples": 256}
SLICE_S = 0.03  # of work between two looks at the events
LONGEST_FRAMES = 100_000


@dataclass
class FilmOptions:
    """What the panel asks for. `quality`: qmc samples per pixel and lobe; 0 is the integrator of the window."""

    size: str = next(iter(SIZES))
    fps: int = 30
    quality: str = next(iter(QUALITIES))
    file_name: str = ""


def film_file(folder: Path, text: str) -> Path:
    """The film, or the first of a row of pictures, that a typed name means, in `folder` unless it says otherwise."""
    name = text.strip()
    path = Path(name)
    if path.suffix.lower() not in (FILM, *SEQUENCES) or not path.stem.strip(". ") or not name.isprintable():
        raise UserError("not the name of a film", got=text, expected="a name like tour.mp4, tour-####.png or .exr")
    file = folder / path.expanduser()
    if not file.parent.is_dir():
        raise UserError("no such folder", file=file.parent)
    if file.is_dir():
        raise UserError("is a folder", file=file)
    check_place(file if file.suffix.lower() == FILM else sequence_file(file, 1))
    return file


class Filming:
    """One film under way. `step` works for a moment; `error` says why it ended early.

    Parameters
    ----------
    renderer : Renderer
        Its own: the window draws with another one.
    frame : FrameState
        As the window shows it, of the film's size; its camera is replaced.
    quality : int
        Samples of `qmc` per pixel, lobe and frame; 0 keeps the frame's integrator.
    """

    def __init__(
        self, renderer: Renderer, file: Path, path: CameraPath, frame: FrameState, fps: int, quality: int = 0
    ) -> None:
        width, height = even_size(frame.width, frame.height)
        self.file, self.path = file, path
        self.total = max(2, round(path.seconds * fps))
        if self.total > LONGEST_FRAMES:
            raise UserError("the film is too long", got=f"{self.total} frames", expected=f"at most {LONGEST_FRAMES}")
        self.done = 0
        self.error: str | None = None
        self._renderer, self._fps, self._quality = renderer, fps, quality
        self._frame = replace(frame, width=width, height=height, accumulate=None)
        self._began_s = time.monotonic()
        self._work = self._run()
        self.over = False

    @property
    def share(self) -> float:
        return self.done / self.total

    @property
    def left_s(self) -> float | None:
        """Seconds until the end, as it looks now."""
        spent_s = time.monotonic() - self._began_s
        return spent_s / self.done * (self.total - self.done) if self.done else None

    def step(self) -> bool:
        """Work for about `SLICE_S`; whether it is over."""
        end_s = time.monotonic() + SLICE_S
        try:
            while time.monotonic() < end_s:
                next(self._work)
        except StopIteration:
            self.over = True
        except (UserError, OSError) as error:
            self.error, self.over = str(error), True
        return self.over

    def cancel(self) -> None:
        """Stop; a film leaves nothing behind, a row of pictures those that are done."""
        self._work.close()
        self.over = True

    def _run(self) -> Generator[None, None, None]:
        frame = self._frame
        with pictures_writer(self.file, frame.width, frame.height, self._fps) as write:
            for index in range(self.total):
                view = replace(frame, camera=camera_at(self.path, index / self._fps))
                for picture in self._picture(view):
                    if picture is None:
                        yield
                    else:
                        write(picture)
                self.done = index + 1
                yield

    def _picture(self, view: FrameState) -> Generator[Any, None, None]:
        """None between parts of the work, then the picture."""
        linear = radiance_wanted(self.file)
        if not self._quality:
            yield self._renderer.image(view) if linear else scaled(self._renderer.display_image(view), view)
            return
        parts = -(-self._quality // QMC_N)
        for index in range(parts - 1):
            self._renderer.draw(replace(view, integrator="qmc", n=QMC_N, accumulate=index))
            self._renderer.finish()
            yield None
        last = replace(view, integrator="qmc", n=QMC_N, accumulate=parts - 1)
        yield self._renderer.image(last) if linear else scaled(self._renderer.display_image(last), view)
