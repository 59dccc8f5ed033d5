"""Path tracing in another process: the requests, and the last picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.scene import ImageTexture
from lambent.store.session import RoomState
from lambent.viewer.worker_process import WorkerProcess

WORKER = "lambent.viewer.modes.walk.tracing_worker"
MOST_SAMPLES = 1024  # samples per pixel after which tracing stops


@dataclass(frozen=True)
class Wish:
    """A numbered request to trace a view; without a `camera`, a request to stop.

    `materials` replace the scene's, by name. `textures` maps a material to the one whose textures it gets, to "" for
    none, or to an image with its path.
    """

    number: int
    camera: Camera | None = None
    size: tuple[int, int] = (1, 1)
    materials: Mapping[str, Material] = field(default_factory=dict)
    textures: Mapping[str, str | ImageTexture] = field(default_factory=dict)

    def said(self) -> dict[str, Any]:
        """As a JSON object."""
        room = RoomState(materials=dict(self.materials), textures=dict(self.textures))
        camera = None if self.camera is None else asdict(self.camera)
        view = {"number": self.number, "camera": camera, "size": list(self.size)}
        return {**view, "room": room.model_dump(mode="json")}

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Wish:
        """From `said`."""
        camera = said["camera"]
        if camera is not None:
            places = {name: tuple(camera[name]) for name in ("position", "target", "up")}
            camera = Camera(**{**camera, **places})
        room = RoomState.model_validate(said["room"])
        size = int(said["size"][0]), int(said["size"][1])
        return cls(int(said["number"]), camera, size, room.materials, room.textures)


@dataclass(frozen=True, eq=False)
class Traced:
    """Mean radiance (height, width, 3) of `samples` paths per pixel, for the wish `number`."""

    number: int
    samples: int
    radiance: Floats


class Tracing:
    """The process, from the first wish to `close`.

    Attributes
    ----------
    what : str
        Step of the process before its first picture.
    """

    def __init__(self, store: Path, sky_turn_deg: float, replaced: Sequence[str] = ()) -> None:
        self._words = (str(store), str(sky_turn_deg), *replaced)
        self._last: Traced | None = None
        self.what = "starting"
        self._wish = Wish(0)
        self._process: WorkerProcess | None = None

    @property
    def error(self) -> str:
        """Reason for the end of the process, in one line; empty while it runs."""
        return "" if self._process is None else self._process.error

    @property
    def last(self) -> Traced | None:
        """The last picture of the present wish."""
        found = self._last
        return found if found is not None and found.number == self._wish.number else None

    @property
    def busy(self) -> bool:
        """Whether another picture will come."""
        last = self.last
        samples = 0 if last is None else last.samples
        runs = self._process is not None and self._process.running
        return runs and self._wish.camera is not None and samples < MOST_SAMPLES

    def tick(self) -> None:
        """Handle the end of the process."""
        if self._process is not None:
            _ = self._process.running

    def ask(
        self,
        camera: Camera | None,
        size: tuple[int, int],
        materials: Mapping[str, Material],
        textures: Mapping[str, str | ImageTexture],
    ) -> None:
        """Trace this view from now on; without a camera, stop tracing."""
        if self.error or (self._process is None and camera is None):
            return
        self._wish = Wish(self._wish.number + 1, camera, size, dict(materials), dict(textures))
        if self._process is None:
            self._process = WorkerProcess(WORKER, self._words, "path tracing", self._take, ends=False)
        if not self._process.ask(self._wish.said()):
            self.what = "ended"

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.close()

    def _take(self, said: Mapping[str, Any], stream: IO[bytes]) -> None:
        if "what" in said:
            self.what = str(said["what"])
            return
        height, width = int(said["height"]), int(said["width"])
        radiance = np.frombuffer(stream.read(height * width * 12), np.float32).reshape(height, width, 3)
        self._last = Traced(int(said["number"]), int(said["samples"]), radiance)
