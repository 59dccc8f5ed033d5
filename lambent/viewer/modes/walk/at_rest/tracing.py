"""Tracing in another process: the requests, and the last pictures."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import IO, Any, Literal, get_args

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.light.light_mix import Factors
from lambent.core.plain import triple
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import ImageTexture
from lambent.store.kept.session import RoomState
from lambent.viewer.background.worker_process import WorkerProcess

WORKER = "lambent.viewer.modes.walk.at_rest.tracing_worker"
MOST_SAMPLES = 1024  # samples per pixel after which tracing stops
Kind = Literal["traced", "path"]  # against the baked light, or by whole paths
KINDS: tuple[Kind, ...] = get_args(Kind)
ALL_LIGHT = "full"  # the only part of the light that whole paths have


@dataclass(frozen=True)
class Wish:
    """A numbered request to trace a view in these kinds of pictures; without kinds, a request to stop.

    Attributes
    ----------
    materials, textures : mapping
        What replaces the scene's, by material: documents, and as in `store.kept.session.RoomState` with images' paths.
    light : mapping
        Factors of light groups; groups left out are as baked.
    show : str
        Part of the light: full, diffuse or specular.
    answers : bool
        Whether light between surfaces follows edited materials, in pictures against the baked light.
    rebaked : bool
        Whether the copy beside the store has the light of these materials and textures.
    samples : int
        Samples of the one wanted picture; 0: pictures with more and more.
    coarse : bool
        Whether the first picture may have half the width and height, to appear at once.
    lamps : mapping
        Edits of lamps, by their place among the scene's lights.
    """

    number: int
    kinds: tuple[Kind, ...] = ()
    camera: Camera = field(default_factory=lambda: Camera("", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0)))
    size: tuple[int, int] = (1, 1)
    materials: Mapping[str, Material] = field(default_factory=dict)
    textures: Mapping[str, str | ImageTexture] = field(default_factory=dict)
    light: Factors = field(default_factory=dict)
    show: str = ALL_LIGHT
    answers: bool = True
    rebaked: bool = False
    samples: int = 0
    coarse: bool = False
    lamps: Mapping[int, LampEdit] = field(default_factory=dict)

    def numbered(self, number: int) -> Wish:
        """The same request under another number."""
        return replace(self, number=number)

    def said(self) -> dict[str, Any]:
        """As a JSON object."""
        room = RoomState(materials=dict(self.materials), textures=dict(self.textures), lamps=dict(self.lamps))
        plain = {
            name: getattr(self, name)
            for name in ("number", "kinds", "size", "show", "answers", "rebaked", "samples", "coarse")
        }
        return {
            **plain, "camera": asdict(self.camera), "room": room.model_dump(mode="json"),
            "light": {name: list(factor) for name, factor in self.light.items()},
        }  # fmt: skip

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Wish:
        """From `said`."""
        camera, room = said["camera"], RoomState.model_validate(said["room"])
        places = {name: tuple(camera[name]) for name in ("position", "target", "up")}
        return cls(
            int(said["number"]), tuple(said["kinds"]), Camera(**{**camera, **places}),
            (int(said["size"][0]), int(said["size"][1])), room.materials, room.textures,
            {name: triple(factor) for name, factor in said["light"].items()}, str(said["show"]),
            bool(said["answers"]), bool(said["rebaked"]),
            int(said["samples"]), bool(said["coarse"]), room.lamps,
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Traced:
    """Radiance (height, width, 3) of `samples` per pixel, for the wish `number`.

    `noise` is its relative standard error, None before it is known.
    """

    number: int
    kind: Kind
    samples: int
    noise: float | None
    radiance: Floats


class Tracing:
    """The process, from `start` to `close`; what it reports counts from the next `tick` on.

    `wake` is called in another thread when there is something for `tick`.

    Attributes
    ----------
    what : str
        Step of the process before it is `ready` for wishes.
    """

    def __init__(
        self, store: Path, sky_turn_deg: float, replaced: Sequence[str] = (), wake: Callable[[], None] = lambda: None
    ) -> None:
        self._words, self._wake = (str(store), str(sky_turn_deg), *replaced), wake
        self._last: dict[Kind, Traced] = {}
        self._reports: deque[Traced | tuple[str, bool]] = deque()  # pictures, and steps with whether it is ready
        self.what, self.ready = "starting", False
        self._wish = Wish(0)
        self._process: WorkerProcess | None = None

    @property
    def error(self) -> str:
        """Reason for the end of the process, in one line; empty while it runs."""
        return "" if self._process is None else self._process.error

    def last(self, kind: Kind) -> Traced | None:
        """The last picture of the present wish."""
        found = self._last.get(kind)
        return found if found is not None and found.number == self._wish.number else None

    def start(self) -> None:
        """Start the process, which loads the room; once."""
        if self._process is None:
            self._process = WorkerProcess(WORKER, self._words, "tracing", self._take, ends=False, wake=self._wake)

    def tick(self) -> None:
        """Take what the process has reported, and its end."""
        if self._process is not None:
            _ = self._process.running
        while self._reports:
            report = self._reports.popleft()
            if isinstance(report, Traced):
                self._last[report.kind] = report
            else:
                self.what, self.ready = report

    def ask(self, wish: Wish | None) -> None:
        """Trace a wish, whose number is replaced, from now on; None: stop tracing."""
        self._wish = Wish(self._wish.number + 1) if wish is None else wish.numbered(self._wish.number + 1)
        if self._process is not None and not self.error:
            self._process.ask(self._wish.said())  # of a process that has ended, `tick` learns the reason

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.close()

    def _take(self, said: Mapping[str, Any], stream: IO[bytes]) -> None:
        """Handle a line of the process; runs in its thread."""
        if "what" in said:
            self._reports.append((str(said["what"]), bool(said["ready"])))
            return
        height, width, kind = int(said["height"]), int(said["width"]), said["kind"]
        data = stream.read(height * width * 12)
        if len(data) == height * width * 12:  # less if the process has ended meanwhile
            radiance = np.frombuffer(data, np.float32).reshape(height, width, 3)
            self._reports.append(Traced(int(said["number"]), kind, int(said["samples"]), said["noise"], radiance))
