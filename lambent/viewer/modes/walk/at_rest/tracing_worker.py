"""Worker process that traces views of a store's room for the window, pass after pass.

python -m lambent.viewer.modes.walk.at_rest.tracing_worker STORE DEGREES [REPLACEMENT ...]

DEGREES is the rotation of the sky. Every line on stdin is a `Wish` as a JSON object; a newer wish ends older ones at
the next pass, and the end of stdin ends the process. Every line on stdout is a JSON object: "error", a line for the
user; "what", a step, with "ready" for wishes; or "number" (of the wish), "kind", "samples", "noise", "width" and
"height", followed by the bytes of the picture, float32 (height, width, 3).
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.replacement import parse_replacements
from lambent.scenes.scene import Look
from lambent.store.source import SOURCE, scene_of
from lambent.store.store import Store
from lambent.viewer.modes.walk.at_rest.tracing import MOST_SAMPLES, Kind, Wish

if TYPE_CHECKING:
    from lambent.traced.picture import TracedPicture
    from lambent.traced.room import TracedRoom

Lamps = Mapping[int, LampEdit]
NICENESS = 10  # the window has priority
PASS_S = 0.1  # time of a pass, as far as single samples allow
PICTURE_S = 0.5  # shortest time between two pictures
COARSE = 2  # the first picture is reduced by this factor, if that is asked for
GROWTH = 0.25  # time of the samples since the last picture, as a share of all samples'
FINE = 4.0  # fine denoising, which takes twice as long as fast, from this multiple of fast denoising on


class Wishes:
    """Reads wishes from a stream; `newest` waits for a wish other than `but`, and is None at the stream's end."""

    def __init__(self, stream: Iterable[bytes]) -> None:
        self._changed = threading.Condition()
        self._last: Wish | None = None
        self._ended = False
        threading.Thread(target=self._read, args=(stream,), daemon=True).start()

    def newest(self, but: Wish | None) -> Wish | None:
        with self._changed:
            self._changed.wait_for(lambda: self._ended or self._last is not but)
            return None if self._ended else self._last

    def stands(self, wish: Wish) -> bool:
        """Whether a wish is still the newest."""
        return not self._ended and self._last is wish

    def _read(self, stream: Iterable[bytes]) -> None:
        for line in stream:
            with self._changed:
                self._last = Wish.of(json.loads(line))
                self._changed.notify()
        with self._changed:
            self._ended = True
            self._changed.notify()


class Rooms:
    """The rooms of a store in which wishes are traced, loaded when they are first needed."""

    def __init__(self, folder: Path, sky_turn_deg: float, replaced: Sequence[str]) -> None:
        self._folder, self._store, self._sky_turn_deg = folder, Store.open(folder), sky_turn_deg
        if not isinstance(self._store.documents.get(SOURCE), str):
            raise UserError(
                "the store has no path of its scene file", file=folder, hint="bake the scene again from its file"
            )
        self._scene, self._replacements = scene_of(self._store), parse_replacements(replaced)
        self._by_kind: dict[Kind, tuple[Lamps, TracedRoom]] = {}  # the last room of each kind, and its lamps
        self._rebaked: tuple[object, TracedRoom] | None = None

    @property
    def materials(self) -> Mapping[str, Material]:
        """The scene's materials, by name."""
        return self._scene.materials

    def of(self, kind: Kind, wish: Wish) -> TracedRoom:
        """The room of a kind in the state of a wish."""
        if wish.rebaked and kind == "traced":
            room = self._baked_again((wish.materials, wish.textures, wish.lamps), wish.lamps)
        else:
            room, given = self.with_lamps(kind, wish.lamps), self.materials
            room.set_materials({name: Look(given[name], of) for name, of in wish.textures.items()}, wish.materials)
            room.follow(wish.answers)
        room.mix(wish.light)
        return room

    def with_lamps(self, kind: Kind, lamps: Lamps) -> TracedRoom:
        """The room of a kind in the state of the last wish with these edits of lamps."""
        from lambent.traced.room import room_of_paths, room_of_store

        if kind not in self._by_kind or self._by_kind[kind][0] != lamps:
            _, before = self._by_kind.pop(kind, (None, None))
            how: dict[str, Any] = {"sky_turn_deg": self._sky_turn_deg, "replacements": self._replacements}
            room = (
                room_of_store(self._store, self._scene, lamps=lamps, before=before, **how)
                if kind == "traced"
                else room_of_paths(with_lamp_edits(self._scene, lamps), **how)
            )
            self._by_kind[kind] = lamps, room
        return self._by_kind[kind][1]

    def _baked_again(self, state: object, lamps: Lamps) -> TracedRoom:
        """The room of the copy beside the store, baked in a state with these lamps."""
        from lambent.baking.running.again import rebaked_copy
        from lambent.traced.room import room_of_store

        if self._rebaked is None or self._rebaked[0] != state:
            copy = Store.open(rebaked_copy(self._folder))
            self._rebaked = state, room_of_store(copy, with_lamp_edits(scene_of(copy), lamps))
        return self._rebaked[1]


class Converging:
    """A picture of a wish that gets better, with the times of its samples and of its denoising.

    With a number of `samples`, it is sent once it has them; `fine`: the last picture is denoised well.
    """

    def __init__(self, kind: Kind, picture: TracedPicture, samples: int, *, fine: bool = True) -> None:
        self.kind, self.picture, self._fine = kind, picture, fine
        self._once, self._most = samples > 0, samples or MOST_SAMPLES
        self._all_s = self._since_s = self._sample_s = self._fast_s = 0.0
        self._noise: tuple[int, float] | None = None  # samples, and noise then
        self.begun = False  # whether a picture was sent, this one or a coarse one before it

    def sample(self) -> None:
        """Trace a pass."""
        began, before = time.monotonic(), self.picture.samples
        first = self._most if self._once else 1
        most = first if before == 0 else max(1, int(PASS_S / max(self._sample_s, 1e-6)))
        count = self.picture.sample(min(most, self._most - before))
        seconds = time.monotonic() - began
        self._sample_s = seconds / count
        self._all_s, self._since_s = self._all_s + seconds, self._since_s + seconds

    @property
    def done(self) -> bool:
        return self.picture.samples >= self._most

    @property
    def due(self) -> bool:
        """Whether the samples since the last picture are worth another one."""
        if self._once or self.done:
            return self.done
        return not self.begun or self._since_s >= max(PICTURE_S, self._fast_s, GROWTH * self._all_s)

    def image(self) -> Floats:
        """The picture so far (height, width, 3): whole paths as they are, others denoised."""
        if self.picture.path:
            image = self.picture.mean()
        else:
            began, soon = time.monotonic(), self._since_s < FINE * self._fast_s or self._fast_s == 0.0
            fast = soon and not (self.done and self._fine)
            image = self.picture.denoised(fast=fast)
            if fast:
                self._fast_s = time.monotonic() - began
        self._since_s, self.begun = 0.0, True
        return image

    @property
    def noise(self) -> float | None:
        """Noise of the picture by the last estimate."""
        return None if self._noise is None else self._noise[1] * (self._noise[0] / self.picture.samples) ** 0.5

    def estimate_noise(self) -> None:
        """Estimate the noise anew if the samples have doubled."""
        samples = self.picture.samples
        if samples >= 2 * (self._noise[0] if self._noise is not None else 1):
            noise = self.picture.noise(denoised=not self.picture.path)
            self._noise = (samples, noise) if np.isfinite(noise) else self._noise


def main(folder: Path, sky_turn_deg: float, replaced: Sequence[str], wishes: Wishes, out: BinaryIO) -> None:
    """Trace wishes until the stream ends; `replaced` as `scenes.replacement` reads it."""
    say(out, what="loading the scene", ready=False)
    rooms = Rooms(folder, sky_turn_deg, replaced)
    warm_up(rooms)
    say(out, what="ready", ready=True)
    wish = wishes.newest(None)
    while wish is not None:
        if wish.kinds:
            trace(rooms, wish, wishes, out)
        wish = wishes.newest(wish)


def warm_up(rooms: Rooms) -> None:
    """Compile what pictures against the baked light need, also of edited materials, by small ones."""
    from lambent.traced.picture import ENDED, TracedPicture

    room = rooms.with_lamps("traced", {})
    for materials in (dict(list(rooms.materials.items())[:1]), {}):
        room.set_materials({}, materials)
        picture = TracedPicture(room.tracer, Wish(0).camera, (8, 8))
        while picture.samples <= ENDED:
            picture.sample()
        picture.denoised(fast=True)


def trace(rooms: Rooms, wish: Wish, wishes: Wishes, out: BinaryIO) -> None:
    """Write pictures of a wish with more and more samples, in turns by kind, while it is the newest."""
    from lambent.traced.picture import TracedPicture

    def picture(kind: Kind, size: tuple[int, int]) -> TracedPicture:
        path = kind == "path"
        tracer = rooms.of(kind, wish).tracer
        return TracedPicture(tracer, wish.camera, size, path=path, part="full" if path else wish.show)

    pictures = [Converging(kind, picture(kind, wish.size), wish.samples) for kind in wish.kinds]
    if wish.coarse and wishes.stands(wish):
        width, height = (max(1, round(side / COARSE)) for side in wish.size)
        first = Converging(wish.kinds[0], picture(wish.kinds[0], (width, height)), COARSE**2, fine=False)
        while not first.done:
            first.sample()
        send(out, wish, first)
        pictures[0].begun = True
    while pictures:
        for one in pictures:
            if not wishes.stands(wish):
                return
            one.sample()
            if wishes.stands(wish) and one.due:
                send(out, wish, one)
                if not wish.samples:
                    one.estimate_noise()
        pictures = [one for one in pictures if not one.done]


def say(out: BinaryIO, **words: object) -> None:
    """Write a line."""
    out.write(json.dumps(words).encode() + b"\n")
    out.flush()  # BrokenPipeError ends this process when the window is gone


def send(out: BinaryIO, wish: Wish, one: Converging) -> None:
    """Write a picture."""
    image = one.image()
    height, width = image.shape[:2]
    say(
        out, number=wish.number, kind=one.kind, samples=one.picture.samples, noise=one.noise, width=width, height=height
    )
    out.write(np.ascontiguousarray(image, np.float32).tobytes())
    out.flush()


if __name__ == "__main__":
    if hasattr(os, "nice"):
        os.nice(NICENESS)
    own = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries' output must not mix with the pictures
    try:
        main(
            Path(sys.argv[1]), float(sys.argv[2]), sys.argv[3:], Wishes(os.fdopen(os.dup(0), "rb", buffering=0)), own
        )  # no lock to end with
    except UserError as error:
        say(own, error=str(error))
