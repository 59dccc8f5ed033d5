"""Path tracing beside the window: what is asked of the process that does it, and the last picture it sent."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.core.progress import Progress
from lambent.materials.document import Material
from lambent.viewer.work import Work, pending

WORKER = "lambent.viewer.modes.walk.tracing_worker"
MOST_SAMPLES = 1024  # a pixel: then it rests
LAST_CHARACTERS = 300  # of what the process wrote before it died


@dataclass(frozen=True)
class Wish:
    """A view to trace, numbered; without a `camera`, nothing. `materials` stand in for the scene's, by name."""

    number: int
    camera: Camera | None = None
    size: tuple[int, int] = (1, 1)
    materials: Mapping[str, Material] = field(default_factory=dict)

    def said(self) -> dict[str, Any]:
        """As a JSON object."""
        worn = {name: material.model_dump(mode="json") for name, material in self.materials.items()}
        camera = None if self.camera is None else asdict(self.camera)
        return {"number": self.number, "camera": camera, "size": list(self.size), "materials": worn}

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Wish:
        """From `said`."""
        camera = said["camera"]
        if camera is not None:
            places = {name: tuple(camera[name]) for name in ("position", "target", "up")}
            camera = Camera(**{**camera, **places})
        worn = {name: Material.model_validate(one) for name, one in said["materials"].items()}
        return cls(int(said["number"]), camera, (int(said["size"][0]), int(said["size"][1])), worn)


@dataclass(frozen=True, eq=False)
class Traced:
    """Mean radiance (height, width, 3) of `samples` paths a pixel, of the wish of that number."""

    number: int
    samples: int
    radiance: Floats


class Tracing:
    """The process, from the first wish to `close`.

    Attributes
    ----------
    what : str
        What the process does before its first picture.
    error : str
        Why it ended, in a line; empty while it has not.
    """

    def __init__(self, store: Path, sky_turn_deg: float, replaced: Sequence[str] = ()) -> None:
        self._words = (str(store), str(sky_turn_deg), *replaced)
        self._last: Traced | None = None
        self.what, self.error = "starting", ""
        self._wish = Wish(0)
        self._process: subprocess.Popen[bytes] | None = None
        self._work: Work | None = None

    @property
    def last(self) -> Traced | None:
        """The last picture of the wish that stands."""
        found = self._last
        return found if found is not None and found.number == self._wish.number else None

    @property
    def busy(self) -> bool:
        """Whether another picture is to come."""
        last = self.last
        samples = 0 if last is None else last.samples
        return self._work is not None and self._wish.camera is not None and samples < MOST_SAMPLES

    def tick(self) -> None:
        """Take the end of the process."""
        self._work = pending(self._work)

    def ask(self, camera: Camera | None, size: tuple[int, int], materials: Mapping[str, Material]) -> None:
        """Trace this view from now on; without a camera, none."""
        if self.error or (self._process is None and camera is None):
            return
        self._wish = Wish(self._wish.number + 1, camera, size, dict(materials))
        if self._process is None:
            self._log = tempfile.TemporaryFile()  # noqa: SIM115 - as long as the process
            command = [sys.executable, "-m", WORKER, *self._words]
            self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log)
            self._work = Work(self._listen, lambda _: None, self._failed)
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(self._wish.said()).encode() + b"\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            self.what = "ended"  # `_listen` tells why

    def close(self) -> None:
        """End the process."""
        if self._work is not None:
            self._work.cancel()
            if self._process is not None:
                self._process.kill()
            self._work.wait()
            self._work = None

    def _failed(self, error: UserError) -> None:
        self.error = str(error)

    def _listen(self, progress: Progress) -> None:
        """Take what the process writes, until it ends."""
        process = self._process
        assert process is not None and process.stdout is not None
        try:
            for line in iter(process.stdout.readline, b""):
                progress(0, 1, "")
                self._take(json.loads(line), process.stdout)
        finally:
            process.kill()
            code = process.wait()
        progress(1, 1, "")  # raises where it was cancelled
        self._log.seek(0)
        words = self._log.read().decode(errors="replace").strip()[-LAST_CHARACTERS:].splitlines()
        raise UserError(f"path tracing ended with {code} ({words[-1] if words else 'no word'})")

    def _take(self, said: Mapping[str, Any], stream: IO[bytes]) -> None:
        if "error" in said:
            raise UserError(str(said["error"]))
        if "what" in said:
            self.what = str(said["what"])
            return
        height, width = int(said["height"]), int(said["width"])
        radiance = np.frombuffer(stream.read(height * width * 12), np.float32).reshape(height, width, 3)
        self._last = Traced(int(said["number"]), int(said["samples"]), radiance)
