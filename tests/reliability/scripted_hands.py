"""What `long_window` does: actions of a user of one window, drawn at random. Each yields once a frame."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.light.light_mix import GroupMix
from lambent.materials.document import Material
from lambent.store.kept.session import FILE, read_session
from lambent.store.kept.views import read_views
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.modes.edit.mode import EditMode
from lambent.viewer.modes.relight.mode import RelightMode
from lambent.viewer.modes.walk.mode import WalkMode
from lambent.viewer.modes.walk.session.leaving import edit_view, relight_view
from tests.viewer.panel_driver import point_of

WALKING = ("w", "a", "s", "d", "ArrowUp", "ArrowLeft", "ArrowDown", "ArrowRight")
SIZES = ((480, 360), (640, 480), (900, 600), (1100, 800))
MOST_KEPT = 8  # views, walks, states
PATIENCE_S = 600.0  # for the first bake of a view, a written session, another mode
REBAKE_S, RELIT_S = 60.0, 10.0
REST_S = (1.0, 8.0)
Frames = Iterator[None]


class Hands:
    """Actions on a window, by its events and by what its panels call.

    Attributes
    ----------
    done : Counter
        Actions by name; "checks" are comparisons of the edits with the session on disk.
    lost : list of str
        Edits that a comparison did not find, one line each.
    waits : bool
        Whether background work is waited for: frames would only take its time.
    """

    def __init__(self, window: Any, store: Path, seed: int) -> None:
        self._window, self._store, self._random = window, store, np.random.default_rng(seed)
        self.done: Counter[str] = Counter()
        self.lost: list[str] = []
        self.waits = False

    def frames(self, until_s: float) -> Frames:
        """Act until a moment of the monotonic clock; compare with the session after every twenty actions."""
        actions = {
            self.walk: 6, self.look: 6, self.wheel: 2, self.pick: 5, self.edit: 10, self.pull_slider: 8,
            self.undo: 5, self.redo: 4, self.mix_light: 5, self.states: 4, self.expose: 3, self.show: 2,
            self.resize: 2, self.save_view: 2, self.record: 1, self.rest: 3, self.edit_in_place: 0.5,
            self.relight: 0.3, self.rebake: 0.5, self.save_picture: 0.3,
        }  # fmt: skip
        names: list[Callable[[], Frames]] = list(actions)
        shares = np.array(list(actions.values())) / sum(actions.values())
        while time.monotonic() < until_s:
            for _ in range(20):
                act = names[self._random.choice(len(names), p=shares)]
                yield from act()
                self.done[act.__name__] += 1
                yield from self._settled(2)
            yield from self.check()

    # the window

    @property
    def _mode(self) -> Any:
        return self._window.mode

    @property
    def _edits(self) -> MaterialEdits:
        edits: MaterialEdits = self._mode.input.edits
        return edits

    def _send(self, kind: str, **words: Any) -> None:
        more = {"modifiers": (), "time_stamp": time.perf_counter()}
        if kind.startswith("pointer"):
            more |= {"button": 1, "buttons": (1,), "ntouches": 0, "touches": {}}
        self._window.canvas.submit_event({"event_type": kind, **more, **words})

    def _key(self, key: str, *modifiers: str) -> Frames:
        self._send("key_down", key=key, modifiers=modifiers)
        yield
        self._send("key_up", key=key, modifiers=modifiers)
        yield

    def _drag(self, begin: tuple[float, float], end: tuple[float, float]) -> Frames:
        (x, y), (right, down) = begin, end
        self._send("pointer_move", x=x, y=y, buttons=())
        yield from self._settled(2)
        self._send("pointer_down", x=x, y=y)
        yield
        for share in np.linspace(0.2, 1.0, self._random.integers(2, 8)):
            self._send("pointer_move", x=x + share * (right - x), y=y + share * (down - y))
            yield
        self._send("pointer_up", x=right, y=down)
        yield

    @staticmethod
    def _settled(frames: int) -> Frames:
        for _ in range(frames):
            yield

    def _until(self, condition: Callable[[], bool], patience_s: float = PATIENCE_S) -> Frames:
        """Few frames until a condition is met, or patience ends."""
        end_s, self.waits = time.monotonic() + patience_s, True
        while not condition() and time.monotonic() < end_s:
            yield
        self.waits = False

    def _place(self) -> tuple[float, float]:
        """A point of the picture."""
        x, y = self._random.uniform(0.1, 0.9, 2)
        place: tuple[float, float] = self._window.screen.picture.point(x, y)
        return place

    # actions of the walk

    def walk(self) -> Frames:
        key = str(self._random.choice(WALKING))
        self._send("key_down", key=key)
        yield from self._settled(self._random.integers(2, 15))
        self._send("key_up", key=key)
        yield

    def look(self) -> Frames:
        if self._random.random() < 0.1:
            yield from self._key("o")
        yield from self._drag(self._place(), self._place())

    def wheel(self) -> Frames:
        x, y = self._place()
        self._send("wheel", x=x, y=y, dx=0.0, dy=float(self._random.choice((-100, 100))), buttons=())
        yield

    def pick(self) -> Frames:
        at = self._place()
        yield from self._drag(at, at)

    def edit(self) -> Frames:
        """Change a material's colour, or a lobe, over a few frames of one stroke."""
        name = str(self._random.choice(list(self._edits.scene)))
        for _ in range(self._random.integers(1, 6)):
            self._change(name)
            yield

    def _change(self, name: str) -> None:
        material = self._edits.current(name)
        colour = tuple(float(value) for value in self._random.uniform(0.02, 0.8, 3))
        if material.lobes and self._random.random() < 0.7:
            width = float(self._random.uniform(0.05, 0.5))
            lobe = material.lobes[0].model_copy(update={"mx": width, "my": width, "r0": colour})
            changed: Material = material.model_copy(update={"lobes": (lobe, *material.lobes[1:])})
        else:
            changed = material.model_copy(update={"kd": colour})
        if isinstance(self._mode, EditMode):
            self._mode.state.change(name, changed)
        else:
            self._edits.change(name, changed)

    def pull_slider(self) -> Frames:
        """Drag a slider that the panels show."""
        rects = dict(self._window.rects)
        if not rects:
            yield from self._key("m")
            return
        label = str(self._random.choice(sorted(rects)))
        begin, end = self._random.uniform(0.05, 0.95, 2)
        yield from self._drag(point_of(rects[label], begin), point_of(rects[label], end))

    def undo(self) -> Frames:
        for _ in range(self._random.integers(1, 5)):
            yield from self._key("z", "Control")

    def redo(self) -> Frames:
        for _ in range(self._random.integers(1, 5)):
            yield from self._key("y", "Control")

    def mix_light(self) -> Frames:
        lights = self._mode.state.lights
        group = str(self._random.choice([group.name for group in lights.groups]))
        warm = float(self._random.uniform(2000, 9000)) if self._random.random() < 0.5 else None
        for _ in range(self._random.integers(1, 6)):
            mix = GroupMix(bool(self._random.random() < 0.8), float(self._random.uniform(0.1, 4.0)), warm)
            lights.mix = lights.mix.changed(group, mix)
            yield

    def states(self) -> Frames:
        states, edits = self._mode.state.states, self._edits
        what = self._random.choice(("store", "compare", "one", "exchange"))
        if what == "store":
            states.store()
        elif what == "compare":
            states.compare(str(self._random.choice(list(states.all))))
        elif what == "one":
            states.split = False
        else:
            yield from self._key("x")
        if len(edits.stored) > MOST_KEPT:
            edits.forget(next(iter(edits.stored)))
        yield

    def expose(self) -> Frames:
        yield from self._key(str(self._random.choice(("+", "-"))))

    def show(self) -> Frames:
        """Another view transform, or another size of the window."""
        look = self._mode.state.look
        if self._random.random() < 0.5:
            yield from self._key("m")
        else:
            look.view_transform = str(self._random.choice(("filmic", "neutral", "linear", "false-colour")))
            yield

    def resize(self) -> Frames:
        self._window.canvas.set_logical_size(*SIZES[self._random.integers(len(SIZES))])
        yield from self._settled(3)

    def save_view(self) -> Frames:
        recordings = self._mode.state.recordings
        yield from self._key("v")
        for kind, saved in (("camera", recordings.views.saved.cameras), ("path", recordings.views.saved.paths)):
            if len(saved) > MOST_KEPT:
                recordings.views.delete(kind, saved[0].name)
        yield from self._key(str(self._random.integers(1, 1 + min(9, len(recordings.cameras)))))

    def record(self) -> Frames:
        yield from self._key("r")
        yield from self.walk()
        yield from self.look()
        yield from self._key("r")
        self._mode.state.recordings.drop()

    def rest(self) -> Frames:
        """Wait, so that the picture is traced, the light baked again, and the session written."""
        end_s = time.monotonic() + self._random.uniform(*REST_S)
        yield from self._until(lambda: time.monotonic() > end_s)

    def rebake(self) -> Frames:
        """Let the light of the edits be baked completely."""
        rebaking, start_s = self._mode.state.rebaking, time.monotonic()

        def ended() -> bool:
            return rebaking.exact or (not rebaking.line and time.monotonic() > start_s + 5)

        yield from self._until(ended, REBAKE_S)
        self.done["baked again"] += rebaking.exact

    def save_picture(self) -> Frames:
        yield from self._key("p")
        yield from self._settled(3)
        for file in (*self._window.screen.folder.glob("*.exr"), *self._window.screen.folder.glob("*.png")):
            file.unlink()

    # the other modes, always at the first camera: its view is baked once

    def edit_in_place(self) -> Frames:
        yield from self._left(edit_view, EditMode)
        if not isinstance(self._mode, EditMode):
            return
        state = self._mode.state
        yield from self._until(lambda: not state.busy)
        for _ in range(self._random.integers(2, 6)):
            yield from self._in_place(str(self._random.choice(list(state.session.document.materials))))
        yield from self._back()

    def _in_place(self, name: str) -> Frames:
        if self._random.random() < 0.3:
            yield from self.undo()
        for _ in range(self._random.integers(1, 4)):
            material = self._edits.current(name)
            kd = tuple(float(value) for value in self._random.uniform(0.02, 0.8, 3))
            if any(material.kd):  # others need new transport
                self._mode.state.change(name, material.model_copy(update={"kd": kd}))
            yield
        yield from self._settled(3)

    def relight(self) -> Frames:
        yield from self._left(relight_view, RelightMode)
        if not isinstance(self._mode, RelightMode):
            return
        state = self._mode.state
        yield from self._until(lambda: state.is_current and not state.busy, RELIT_S)  # edits are baked anew each time
        yield from self._drag(self._place(), self._place())
        yield from self._until(lambda: not state.busy, RELIT_S)
        yield from self._back()

    def _left(self, leave: Callable[[Any], None], mode: type) -> Frames:
        yield from self._key("1")
        self._mode.state.states.split = False
        yield from self.check()  # what is unsaved would hold the window here
        leave(self._mode.state)
        yield from self._until(lambda: isinstance(self._mode, mode))

    def _back(self) -> Frames:
        yield from self._settled(3)
        self._edits.end_stroke()
        before = self._edits.room
        self._mode.state.enter_room()
        yield from self._until(lambda: isinstance(self._mode, WalkMode))
        self._compare("room, back from another mode", before, self._edits.room)
        yield from self._settled(3)

    # what must not be lost

    def check(self) -> Frames:
        """Wait for the session to be written, read it anew, and compare it with the edits."""
        yield from self._settled(3)
        keeper, edits = self._mode.state.session, self._edits
        yield from self._until(lambda: keeper.kept == keeper.session and not edits.in_stroke)
        again, read = MaterialEdits(edits.scene), read_session(self._store / FILE)
        if read is not None:
            again.begin_from(read)
        self._compare("room", edits.room, again.room)
        self._compare("stored states", edits.stored, again.stored)
        self._compare("state beside", edits.other, again.other)
        self._compare("saved views", self._mode.state.recordings.views.saved, read_views(self._store))
        self.done["checks"] += 1

    def _compare(self, what: str, made: object, kept: object) -> None:
        if made != kept:
            self.lost.append(f"{what} after {self.done.total()} actions: made {made}, kept {kept}")
