"""The light of edited materials, baked anew beside the window, and brought into the picture as it arrives.

A process of low priority bakes into a copy beside the store (`bake.again`). Another edit ends it; the copy goes on from
what it has. What the window has estimated until then is replaced object by object (`rebaked_light`), without a jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from lambent.bake.again import KINDS, copy_beside
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.core.light_mix import Factors, LightMix
from lambent.realtime.baked import BakedScene
from lambent.store.contract import TIMINGS
from lambent.store.session import RoomState
from lambent.store.store import Store
from lambent.viewer.modes.walk.arrivals import Arrivals, Arrived
from lambent.viewer.modes.walk.fading import Fade
from lambent.viewer.modes.walk.lanes import Lane
from lambent.viewer.modes.walk.rebaked import Rebaking
from lambent.viewer.modes.walk.rebaked_light import Rebaked
from lambent.viewer.screen import Screen
from lambent.viewer.work import Work
from lambent.viewer.worker_process import WorkerProcess

WORKER = "lambent.viewer.modes.walk.rebaking_worker"
QUIET_S = 3.0  # without a change, before a bake begins
LOOK_S = 0.5  # between two looks at its progress
FRAME_S = 1 / 30  # between two steps of light that comes in


class RebakedLight:
    """Bakes for the room that is edited, and shows the result in its lane. All calls come from the window's thread."""

    def __init__(self, store: Path, scene: BakedScene, screen: Screen, shown: Rebaking) -> None:
        self._store, self._copy, self._screen, self._shown = store, copy_beside(store), screen, shown
        self._scene = scene
        self._mix: Factors = {}  # of the last update
        self._wanted = RoomState()  # materials and textures as they are, under light as baked
        self._changed_s = -1e9
        self._began_s = self._first_s = 0.0  # of the bake under way
        self._process: WorkerProcess | None = None
        self._step = ""  # of the bake under way, in words
        self._arrivals = Arrivals()  # of what is wanted
        self._failed = False
        self._reading: Work | None = None
        self._light: Rebaked | None = None  # the last that was read for what is wanted
        self._whole: tuple[RoomState, Rebaked] | None = None  # the last bake that was read whole, and what for
        self._fade: Fade | None = None

    def update(self, lane: Lane, light: Factors, camera: Camera, size: tuple[int, int], *, in_stroke: bool) -> None:
        """Go on for what the lane shows, in a mix of light groups, seen by a camera in a picture of `size`."""
        room, now_s = lane.room, self._screen.clock()
        mixes, self._mix = light != self._mix, light
        if self._fade is not None and not self._fade.serves(lane, light):
            self._leave()
        if (wanted := room.model_copy(update={"light": LightMix()})) != self._wanted:
            self._want(wanted, now_s)
        if not self._shown.on or not self._shown.possible or self._is_baked:
            self._stop()
            return
        if self._process is not None or not self._has_all:
            self._bake(now_s, in_stroke)
            self._read()
        if self._fade is not None and self._fade.moves:
            self._fade.step()
        elif self._light is not None and self._has_more and not (lane.busy or mixes):
            # not before the estimate is whole: what is computed late would be drawn over this
            self._fade = self._fade or Fade(lane, light)
            self._fade.bring(self._light, camera, size)
        self._tell()

    def wait_s(self) -> float | None:
        """Seconds until there may be something new; None: never."""
        if self._fade is not None and self._fade.moves:
            return FRAME_S
        if self._process is not None or self._reading is not None:
            return LOOK_S
        wants = self._shown.on and self._shown.possible and not self._is_baked
        waits = wants and not self._failed and self._fade is None
        return max(0.0, self._changed_s + QUIET_S - self._screen.clock()) if waits else None

    @property
    def _is_baked(self) -> bool:
        """Whether the store itself has the light of what is wanted."""
        return self._wanted == RoomState()

    @property
    def _has_all(self) -> bool:
        """Whether all light of what is wanted was read."""
        return self._light is not None and self._light.arrived.whole

    @property
    def _has_more(self) -> bool:
        """Whether light was read that the picture does not have."""
        return self._fade is None or self._fade.shown is not self._light

    def close(self) -> None:
        """End the process; what it has finished stays in the copy."""
        self._stop()
        if self._reading is not None:
            self._reading.wait()
            self._reading = None
        if self._fade is not None:
            self._fade.end()

    def _want(self, wanted: RoomState, now_s: float) -> None:
        """Other materials: a bake of the last ones ends."""
        self._stop()
        self._wanted, self._changed_s, self._failed = wanted, now_s, False
        self._arrivals = Arrivals()
        self._light = self._whole[1] if self._whole is not None and self._whole[0] == wanted else None

    def _bake(self, now_s: float, in_stroke: bool) -> None:
        """Begin the process, and notice its end."""
        if self._process is None:
            quiet = now_s - self._changed_s >= QUIET_S and not in_stroke
            if quiet and not self._failed and not self._arrivals.now.whole and self._reading is None:
                self._begin()
        elif not self._process.running:
            error, self._process, self._shown.share = self._process.error, None, None
            if error or not self._arrivals.now.whole:
                self._fail(error or "the bake ended early")

    def _begin(self) -> None:
        self._arrivals, self._light = Arrivals(), None
        self._step, self._shown.share = "starting", 0.0
        self._began_s, self._first_s = self._screen.clock(), first_bake_s(self._store)
        words = [str(self._store), str(self._copy)]
        self._process = WorkerProcess(WORKER, words, "the bake of edited materials", self._take, ends=True)
        said = self._wanted.model_dump(mode="json")
        self._process.ask({"materials": said["materials"], "textures": dict(self._wanted.textures)})

    def _take(self, said: Mapping[str, Any], stream: IO[bytes]) -> None:
        """In the thread of the process: a line of it."""
        if not self._arrivals.take(said, stream):
            self._shown.share = share = float(said["done"]) / max(float(said["total"]), 1e-9)
            self._step = f"{said['what']} {100 * share:.0f} %"

    def _read(self) -> None:
        """Read, in a thread, what has arrived and was not read yet."""
        if self._reading is not None:
            if not self._reading.poll():
                return
            self._reading = None
        arrived, before = self._arrivals.now, self._light
        if self._failed or arrived == (Arrived() if before is None else before.arrived):
            return
        wanted, copy, scene = self._wanted, self._copy, self._scene

        def done(light: Rebaked) -> None:
            if wanted == self._wanted:
                self._light = light
            if light.arrived.whole:
                self._whole = wanted, light

        def failed(error: UserError) -> None:
            if wanted == self._wanted:  # else another bake has changed the copy
                self._fail(str(error))

        self._reading = Work(lambda progress: Rebaked.read(copy, scene, arrived, before), done, failed)

    def _fail(self, error: str) -> None:
        self._stop()
        self._failed, self._shown.line = True, f"not baked anew: {error}"

    def _tell(self) -> None:
        """Say in a line how far it is, and once that the picture is exact."""
        if self._failed:
            return
        fade, lit = self._fade, self._light.lit if self._light is not None else np.zeros(0, bool)
        if self._process is not None:
            passed = minutes(self._screen.clock() - self._began_s)
            first = f" ({minutes(self._first_s)} the first time)" if self._first_s else ""
            shown = f"; new light on {lit.sum()} of {len(lit)} objects" if fade is not None and lit.any() else ""
            self._shown.line = f"baking anew {passed}{first}: {self._step}{shown}"
        elif fade is not None and fade.done and not self._shown.said:
            self._shown.said, left = True, fade.left
            fields = [f"the light field of {name}" for name in self._scene.light_fields]
            inexact = [*([f"the probes of {', '.join(left)}"] if left else []), *fields]
            self._shown.exact = not inexact
            self._shown.line = f"exact but for {', '.join(inexact)}" if inexact else "exact: baked anew"
            self._screen.say(
                f"the light was baked for these materials: {self._shown.line}" if inexact
                else "the light is exact again: it was baked for these materials"
            )  # fmt: skip
        elif fade is not None and not fade.done:
            self._shown.line = "the light that was baked anew comes in"

    def _leave(self) -> None:
        """The light that was baked anew is no longer that of the picture."""
        assert self._fade is not None, "asked for with one alone"
        self._fade.end()
        self._fade, self._shown.exact, self._shown.said, self._shown.line = None, False, False, ""

    def _stop(self) -> None:
        if self._process is not None:
            self._process.close()
            self._process, self._shown.share, self._shown.line = None, None, ""


def first_bake_s(store: Path) -> float:
    """Seconds that the store's own bake took for the same arrays; 0 where it does not say."""
    timings = Store.open(store).documents.get(TIMINGS, {})
    return float(sum(timings.get(kind, 0.0) for kind in KINDS))


def minutes(seconds: float) -> str:
    """As 1:05."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
