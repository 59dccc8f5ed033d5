"""Rebakes the light of edited materials in the background, and blends it into the picture as it arrives.

A process of low priority bakes into a copy beside the store (`baking.running.again`). Another edit stops it; the next
bake reuses finished parts of the copy. The estimated light is replaced object by object (`rebaked_light`), without a
jump.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np

from lambent.baking.running.again import KINDS, rebaked_copy
from lambent.core.errors import UserError
from lambent.core.light.light_mix import Factors, LightMix
from lambent.core.views.camera import Camera
from lambent.realtime.light.baked import BakedScene
from lambent.store.contract import TIMINGS
from lambent.store.kept.session import RoomState
from lambent.store.store import Store
from lambent.viewer.background.work import Work
from lambent.viewer.background.worker_process import WorkerProcess
from lambent.viewer.modes.walk.lanes import Lane
from lambent.viewer.modes.walk.rebake.arrivals import Arrivals, Arrived
from lambent.viewer.modes.walk.rebake.fading import Fade
from lambent.viewer.modes.walk.rebake.rebaked import Rebaking
from lambent.viewer.modes.walk.rebake.rebaked_light import Rebaked
from lambent.viewer.screen import Screen

WORKER = "lambent.viewer.modes.walk.rebake.rebaking_worker"
QUIET_S = 3.0  # time without a change before a bake starts
LOOK_S = 0.5  # interval of polling for progress
FRAME_S = 1 / 30  # time between two steps of blending


class RebakedLight:
    """Rebakes the edited room and shows the light in its lane. Call it from the window's thread only."""

    def __init__(self, store: Path, scene: BakedScene, screen: Screen, shown: Rebaking) -> None:
        self._store, self._copy, self._screen, self._shown = store, rebaked_copy(store), screen, shown
        self._scene = scene
        self._mix: Factors = {}  # factors of the last update
        self._wanted = RoomState()  # present materials and textures, with light as baked
        self._changed_s = -1e9
        self._began_s = self._first_s = 0.0  # start of the present bake, and duration of the store's own bake
        self._process: WorkerProcess | None = None
        self._step = ""  # present step of the bake
        self._arrivals = Arrivals()  # arrivals for the wanted state
        self._failed = False
        self._reading: Work | None = None
        self._light: Rebaked | None = None  # last light read for the wanted state
        self._whole: tuple[RoomState, Rebaked] | None = None  # the last complete bake and its state
        self._copied = False  # whether the copy still holds that bake
        self._fade: Fade | None = None

    def update(self, lane: Lane, light: Factors, camera: Camera, size: tuple[int, int], *, in_stroke: bool) -> None:
        """Advance the rebake for the lane's state, light mix, camera and picture `size`."""
        room, now_s = lane.room, self._screen.clock()
        mixes, self._mix = light != self._mix, light
        if self._fade is not None and not self._fade.serves(lane, light):
            self._leave()
        if (wanted := room.model_copy(update={"light": LightMix()})) != self._wanted:
            self._want(wanted, now_s)
        if not self._shown.on or not self._shown.possible or self._is_baked:
            self._stop()
            self._forgive()
            return
        if self._process is not None or not self._has_all:
            self._bake(now_s, in_stroke)
            self._read()
        if self._fade is not None and self._fade.moves:
            self._fade.step()
        elif self._light is not None and self._has_more and not (lane.busy or mixes):
            # Wait for the complete estimate, which would otherwise overwrite this light.
            self._fade = self._fade or Fade(lane, light)
            self._fade.bring(self._light, camera, size)
        self._update_line()

    def wait_s(self) -> float | None:
        """Seconds until something may have changed; None: never."""
        if self._fade is not None and self._fade.moves:
            return FRAME_S
        if self._process is not None or self._reading is not None:
            return LOOK_S
        wants = self._shown.on and self._shown.possible and not self._is_baked
        waits = wants and not self._failed and self._fade is None
        return max(0.0, self._changed_s + QUIET_S - self._screen.clock()) if waits else None

    @property
    def _is_baked(self) -> bool:
        """Whether the store has the light of the wanted state."""
        return self._wanted == RoomState()

    @property
    def _has_all(self) -> bool:
        """Whether all light of the wanted state was read."""
        return self._light is not None and self._light.arrived.whole

    @property
    def _has_more(self) -> bool:
        """Whether light was read that the picture does not show."""
        return self._fade is None or self._fade.shown is not self._light

    def is_copied(self, room: RoomState) -> bool:
        """Whether the copy has all light of a room's materials and textures, and the picture shows it."""
        state = room.model_copy(update={"light": LightMix()})
        shown = self._fade is not None and self._fade.done and self._copied
        return shown and self._whole is not None and self._whole[0] == state

    def close(self) -> None:
        """Stop the process; its finished work stays in the copy."""
        self._stop()
        if self._reading is not None:
            self._reading.wait()
            self._reading = None
        if self._fade is not None:
            self._fade.end()

    def _want(self, wanted: RoomState, now_s: float) -> None:
        """Want another state, and stop the bake of the previous one."""
        self._stop()
        self._forgive()
        self._wanted, self._changed_s = wanted, now_s
        self._arrivals = Arrivals()
        self._light = self._whole[1] if self._whole is not None and self._whole[0] == wanted else None

    def _bake(self, now_s: float, in_stroke: bool) -> None:
        """Start the process, and handle its end."""
        if self._process is None:
            quiet = now_s - self._changed_s >= QUIET_S and not in_stroke
            if quiet and not self._failed and not self._arrivals.now.whole and self._reading is None:
                self._begin()
        elif not self._process.running:
            error, self._process, self._shown.share = self._process.error, None, None
            if error or not self._arrivals.now.whole:
                self._fail(error or "the bake ended too soon")

    def _begin(self) -> None:
        self._arrivals, self._light, self._copied = Arrivals(), None, False
        self._step, self._shown.share = "starting", 0.0
        self._began_s, self._first_s = self._screen.clock(), first_bake_s(self._store)
        words = [str(self._store), str(self._copy)]
        self._process = WorkerProcess(WORKER, words, "the bake of edited materials", self._take, ends=True)
        self._process.ask(self._wanted.model_dump(mode="json"))

    def _take(self, said: Mapping[str, Any], stream: IO[bytes]) -> None:
        """Handle a line of the process; runs in its thread."""
        if not self._arrivals.take(said, stream):
            self._shown.share = share = float(said["done"]) / max(float(said["total"]), 1e-9)
            self._step = f"{said['what']} {100 * share:.0f} %"

    def _read(self) -> None:
        """Read new arrivals in a thread."""
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
                self._whole, self._copied = (wanted, light), True

        def failed(error: UserError) -> None:
            if wanted == self._wanted:  # else another bake has changed the copy
                self._fail(str(error))

        self._reading = Work(
            lambda progress: Rebaked.read(copy, scene, arrived, before, lamps=bool(wanted.lamps)), done, failed
        )

    def _fail(self, error: str) -> None:
        self._stop()
        self._failed, self._shown.line = True, f"not baked again: {error}; turn bake edits off and on to try again"

    def _forgive(self) -> None:
        """Forget a failure, so that the next bake may start."""
        if self._failed:
            self._failed, self._shown.line = False, ""

    def _update_line(self) -> None:
        """Update the line on progress, and say once that the picture is exact."""
        if self._failed:
            return
        fade, lit = self._fade, self._light.lit if self._light is not None else np.zeros(0, bool)
        if self._process is not None:
            passed = clock_time(self._screen.clock() - self._began_s)
            first = f" (first bake {clock_time(self._first_s)})" if self._first_s else ""
            shown = f"; new light on {lit.sum()} of {len(lit)} objects" if fade is not None and lit.any() else ""
            self._shown.line = f"baking again {passed}{first}: {self._step}{shown}"
        elif fade is not None and fade.done and not self._shown.said:
            self._shown.said, left = True, fade.left
            fields = [f"the light field of {name}" for name in self._scene.light_fields]
            inexact = [*([f"the probes of {', '.join(left)}"] if left else []), *fields]
            self._shown.exact = not inexact
            self._shown.line = f"exact except {', '.join(inexact)}" if inexact else "exact: baked again"
            self._screen.say(
                f"light baked for these materials: {self._shown.line}" if inexact
                else "light baked for these materials: the picture is exact again"
            )  # fmt: skip
        elif fade is not None and not fade.done:
            self._shown.line = "blending in the new light"

    def _leave(self) -> None:
        """Drop the rebaked light, which no longer belongs to the picture."""
        assert self._fade is not None, "asked for with one alone"
        self._fade.end()
        self._fade, self._shown.exact, self._shown.said, self._shown.line = None, False, False, ""

    def _stop(self) -> None:
        if self._process is not None:
            self._process.close()
            self._process, self._shown.share, self._shown.line = None, None, ""


def first_bake_s(store: Path) -> float:
    """Seconds that the store's own bake took for the same arrays; 0 if unknown."""
    timings = Store.open(store).documents.get(TIMINGS, {})
    return float(sum(timings.get(kind, 0.0) for kind in KINDS))


def clock_time(seconds: float) -> str:
    """Minutes and seconds, as in 1:05, or hours, minutes and seconds, as in 4:09:22."""
    minutes, rest_s = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{rest_s:02}" if hours else f"{minutes}:{rest_s:02}"
