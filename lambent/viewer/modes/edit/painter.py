"""Draws the edited picture in its own thread, from wishes to frames.

When new transport arrives, for more lights or another environment, the picture blends over in `FADE_S`: the difference
from the previous picture is added and fades out, and every frame shows the edits.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from lambent.core.arrays import Image
from lambent.core.light.false_colour import Range, SignedRange
from lambent.editing.interreflection.stored import Interreflections
from lambent.editing.interreflection.whole import ALL_HITS, WholePicture
from lambent.editing.picture import EditedPicture, Part, TransportNeeded
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable
from lambent.realtime.edited.commands import OutOfGpuMemory
from lambent.viewer.edits.shown import Backend, Fading, OnHost, Shown, faded

FADE_S = 0.5
FRAME_S = 0.05  # time after which a frame that was not taken is replaced
Materials = Mapping[str, Editable]


@dataclass(frozen=True)
class Wish:
    """The wanted picture: B, the materials with their edits, and A to compare with, if any.

    A has other materials, or B's materials in `direct` light. With `difference`, B shows its difference from A.
    """

    now: Materials = field(default_factory=dict)
    compared: Materials | None = None
    direct: bool = False
    difference: SignedRange | None = None
    view: str = "filmic"
    exposure_ev: float = 0.0
    scale: Range = field(default_factory=Range)
    surfaces: tuple[int, int] = ALL_HITS  # least and most surfaces on the shown light paths


@dataclass(frozen=True)
class Frame:
    """A frame: the picture B, the picture A that it is compared `against`, and the wish that it shows.

    `needed` are materials whose transport does not apply to the wish; they are shown without the edit.
    """

    number: int
    wish: Wish
    shown: Shown
    against: Shown | None = None
    needed: frozenset[str] = frozenset()
    settled: bool = False
    seconds: float = 0.0

    @property
    def radiance(self) -> Image:
        """(H, W, 3) of B."""
        return self.shown.radiance

    @property
    def compared(self) -> Shown | None:
        """A, if shown beside B; None for a difference."""
        return self.against if self.wish.difference is None else None

    @property
    def compared_radiance(self) -> Image | None:
        return self.against.radiance if self.against is not None else None


class Painter:
    """Draws frames of `size` (height, width) until it is closed. `frame` is the last one, `error` an error, and
    `notice` a line for the user.

    Only this thread touches the picture; `run` executes a function in it between two frames. The next frame starts only
    when the last one was taken or another one is wanted, so that no frame is drawn that a slower window never shows.
    """

    def __init__(self, size: tuple[int, int], backend: Backend | None = None) -> None:
        self.frame: Frame | None = None
        self.error: Exception | None = None
        self.notice = ""
        self._taken: Frame | None = None
        self._clock: Callable[[], float] = time.monotonic
        self._backend = backend if backend is not None else OnHost()
        self._light: Interreflections | None = None
        self._picture = self._anew(np.zeros((*size, 3), np.float32))
        self._parts: dict[str, list[Part]] = {}  # the present one first, then earlier ones
        self._in_picture: dict[str, Editable] = {}  # materials last passed to the picture
        self._fade: Image | None = None
        self._fade_from_s = 0.0
        self._compared: tuple[Materials, Image] | None = None
        self._wish, self._tasks, self._closed = Wish(), deque[Callable[[], None]](), False
        self._at_task = False  # a task has run that no frame shows yet
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def want(self, wish: Wish) -> None:
        """Show this from the next frame on."""
        with self._changed:
            self._wish = wish
            self._changed.notify()

    def take(self) -> Frame | None:
        """Take the last frame to show it."""
        with self._changed:
            if self._taken is not self.frame:
                self._taken = self.frame
                self._changed.notify()
            return self._taken

    def run(self, task: Callable[[], None]) -> None:
        """Run a function in the thread of the picture, before the next frame."""
        with self._changed:
            self._tasks.append(task)
            self._changed.notify()

    @property
    def busy(self) -> bool:
        """Whether another frame is coming."""
        frame = self.frame
        return bool(self._tasks) or self._at_task or frame is None or frame.wish is not self._wish or not frame.settled

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()
        self._picture.close()

    # Functions for `run`.

    def begin(self, backdrop: Image) -> None:
        """Restart with the backdrop and without transport, which does not apply to the new light."""
        before = self._image()
        self._picture.close()
        self._parts, self._in_picture, self._light, self._compared = {}, {}, None, None
        self._picture = self._anew(backdrop)
        if before.any():
            self._fade_over(before)

    def put(self, material: str, part: Part) -> None:
        """Add the transport of a material, or replace it."""
        before = self._image()
        kept = [one for one in self._parts.get(material, []) if not same_quotients(one.start, part.start)]
        self._parts[material] = [part, *kept]
        self._place(material, part, self._wish.now.get(material))
        self._compared = None
        self._fade_over(before)

    def give(self, light: Interreflections) -> None:
        """Add interreflections, or replace them with less noisy ones."""
        self._light = light
        self._picture.give(light, {name: self._in_picture.get(name, part.start) for name, part in light.parts.items()})
        self._compared = None

    def _work(self) -> None:
        try:
            while self._turn():
                pass
        except Exception as error:  # noqa: BLE001 raised in the thread of the window
            self.error = error

    def _turn(self) -> bool:
        """Draw a frame if one is due; return False when the painter is closed."""
        with self._changed:
            while not (self._closed or self._tasks or self.busy):
                self._changed.wait()
            if self._closed:
                return False
            wish, task = self._wish, self._tasks.popleft() if self._tasks else None
            self._at_task = task is not None
        began_s = self._clock()
        try:
            if task is not None:
                task()
            self._draw(wish, began_s)
        except OutOfGpuMemory as error:
            self.notice = f"{error.message}: the CPU draws the picture"
            self._go_on_without_gpu(wish)
            self._draw(wish, began_s)
        with self._changed:
            self._at_task = False
            self._changed.wait_for(
                lambda: self._taken is self.frame or wish is not self._wish or self._tasks or self._closed, FRAME_S
            )
        return True

    def _draw(self, wish: Wish, began_s: float) -> None:
        needed = frozenset(name for name, made in wish.now.items() if not self._show(name, made))
        self._picture.see(wish.surfaces)
        if self._picture.step() and self.frame is not None:
            self._fade_over(self.frame.radiance)
        look = wish.view, wish.exposure_ev, wish.scale
        image = self._image_of(wish.compared, wish.now) if wish.compared is not None else None
        image = self._picture.direct_image() if wish.direct else image
        against = self._backend.still(image, look) if image is not None else None
        self._picture.compose()
        shown = self._backend.show(self._picture.direct.canvas, look, self._fading())
        if against is not None and wish.difference is not None:
            shown = self._backend.difference(shown, against, wish.difference)
        settled = self._picture.is_settled and self._fade is None and not self._tasks
        number, seconds = self.frame.number + 1 if self.frame else 1, self._clock() - began_s
        self.frame = Frame(number, wish, shown, against, needed, settled, seconds)

    def _show(self, name: str, made: Editable) -> bool:
        """Change the picture to a material; return False without transport for it."""
        if name not in self._parts or self._in_picture.get(name) is made:
            return True
        with suppress(TransportNeeded):
            self._picture.show(name, made)
            self._in_picture[name] = made
            return True
        part = next((one for one in self._parts[name][1:] if same_quotients(one.start, made)), None)
        if part is None:
            return False
        self._parts[name].remove(part)
        self._parts[name].insert(0, part)
        self._place(name, part, made)
        return True

    def _place(self, name: str, part: Part, made: Editable | None) -> None:
        self._picture.direct.put(name, part)
        self._in_picture.pop(name, None)
        if made is not None and self._show(name, made):
            self._picture.draw()

    def _image_of(self, materials: Materials, now: Materials) -> Image:
        """The picture of A, drawn once; materials without transport are shown as in B."""
        if self._compared is None or self._compared[0] is not materials:
            for name, made in materials.items():
                self._show(name, made)
            self._picture.draw()
            image = self._picture.image()
            for name, made in now.items():
                self._show(name, made)
            self._picture.draw()
            self._compared = materials, image
        return self._compared[1]

    def _image(self) -> Image:
        """The present picture with the rest of the fading difference."""
        return faded(self._picture.image(), self._fading())

    def _fading(self) -> Fading | None:
        left = 1 - (self._clock() - self._fade_from_s) / FADE_S
        if self._fade is None or left <= 0:
            self._fade = None
            return None
        return self._fade, left * left * (3 - 2 * left)

    def _anew(self, backdrop: Image) -> WholePicture:
        self._backdrop = backdrop
        return WholePicture(EditedPicture(backdrop, {}, self._backend.canvas))

    def _go_on_without_gpu(self, wish: Wish) -> None:
        """Continue on the CPU with everything in the picture."""
        self._picture.close()
        self._backend, self._in_picture = self._backend.without_gpu(), {}
        self._picture, self._compared = self._anew(self._backdrop), None
        for name, (part, *_) in self._parts.items():
            self._place(name, part, wish.now.get(name))
        if self._light is not None:
            self.give(self._light)

    def _fade_over(self, before: Image) -> None:
        """Start to blend from an image to the present picture."""
        self._fade, self._fade_from_s = before - self._picture.image(), self._clock()


def checked(painter: Painter) -> None:
    """Raise an error of the thread."""
    if painter.error is not None:
        error, painter.error = painter.error, None
        raise error
