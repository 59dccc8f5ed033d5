"""Reads the data of a view from a store in a thread, and passes it to the painter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Image
from lambent.core.errors import UserError
from lambent.editing.session.document import SessionDocument
from lambent.editing.session.session import Session
from lambent.editing.stored import parts_of
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable
from lambent.store.contract import transport_lights, view_artefact_name
from lambent.store.store import Store
from lambent.viewer.background.work import Work, pending
from lambent.viewer.modes.edit.painter import Materials, Painter


@dataclass(frozen=True)
class ViewMap:
    """Backdrop and objects in the pixels of a view.

    Attributes
    ----------
    backdrop : (H, W, 3) float32
    object : (H, W) int32
        Index of the object; -1 for none.
    objects : tuple of (name, material)
    """

    backdrop: Image
    object: NDArray[np.int32]
    objects: tuple[tuple[str, str], ...]

    @cached_property
    def materials(self) -> tuple[str, ...]:
        """Visible materials, in the order of the objects."""
        seen = [self.objects[number][1] for number in np.unique(self.object) if number >= 0]
        return tuple(dict.fromkeys(seen))

    @cached_property
    def shares(self) -> dict[str, float]:
        """Share of the points with each material."""
        numbers = self.object[self.object >= 0]
        counts = np.bincount(numbers, minlength=len(self.objects)) / max(len(numbers), 1)
        shares: dict[str, float] = {}
        for (_, material), share in zip(self.objects, counts, strict=True):
            shares[material] = shares.get(material, 0.0) + float(share)
        return shares

    def at(self, x: float, y: float) -> tuple[str, str] | None:
        """Object and material at shares of the picture."""
        height, width = self.object.shape
        number = self.object[min(max(int(y * height), 0), height - 1), min(max(int(x * width), 0), width - 1)]
        return self.objects[number] if number >= 0 else None

    def outline(self, objects: set[str]) -> NDArray[np.uint8]:
        """(H, W, 4): white at the edges of objects, clear elsewhere."""
        chosen = [k for k, (name, _) in enumerate(self.objects) if name in objects]
        mask = np.pad(np.isin(self.object, chosen), 1)
        inner = mask[1:-1, :-2] & mask[1:-1, 2:] & mask[:-2, 1:-1] & mask[2:, 1:-1]
        out = np.zeros((*self.object.shape, 4), np.uint8)
        out[mask[1:-1, 1:-1] & ~inner] = (255, 255, 255, 210)
        return out


def read_view(store: Store, view: SessionDocument) -> ViewMap | None:
    """The map of a view; None if the store does not have it yet."""
    names = [view_artefact_name(view.camera, *view.size, "view_points", n) for n in ("pixel", "object", "backdrop")]
    if any(name not in store for name in names):
        return None
    pixel, number, backdrop = (store.read(name) for name in names)
    numbers = np.full(view.size[0] * view.size[1], -1, np.int32)
    numbers[pixel] = number
    objects = tuple((str(name), str(material)) for name, material in store.artefact(names[1]).meta["objects"])
    return ViewMap(backdrop.astype(np.float32), numbers.reshape(view.size[::-1]), objects)


class Loading:
    """Feeds the painter from one store, reading in the background; `begins` shows the view before its transport.

    Attributes
    ----------
    view : ViewMap or None
    lights : int
        Number of lights of the shown transport; 0 without any.
    """

    def __init__(self, painter: Painter, folder: Path, *, begins: bool = True) -> None:
        self._painter, self.folder, self._begins = painter, folder, begins
        self.view: ViewMap | None = None
        self.lights = 0
        self._loaded: dict[str, list[tuple[int, Editable]]] = {}
        self._work: Work | None = None

    @property
    def busy(self) -> bool:
        return self._work is not None

    def poll(self) -> None:
        """Take finished reads."""
        self._work = pending(self._work)

    def close(self) -> None:
        """Wait for the present read."""
        if self._work is not None:
            self._work.wait()
            self._work = None

    def start(self, session: Session, lights: int | None, failed: Callable[[UserError], None]) -> None:
        """Read the transport for a number of lights; None: the most available, 0: only the view."""
        view, wanted = session.document, {name: session.original(name) for name in session.document.materials}
        copy = Session(view, session.folder)

        def run(_: object) -> None:
            store = Store.open(self.folder)
            if self.view is None and (found := read_view(store, view)) is not None:
                self.view = found
                if self._begins:
                    self._painter.run(partial(self._painter.begin, found.backdrop))
            there = transport_lights(store, view.camera, *view.size)
            chosen = max(there, default=0) if lights is None else lights
            if chosen in there:
                self._read(store, copy, wanted, chosen)

        self._work = Work(run, lambda _: None, failed)

    def _read(self, store: Store, session: Session, wanted: Materials, lights: int) -> None:
        for name, made in wanted.items():
            if self.has(name, made, lights):
                continue
            parts = parts_of(store, session, {name: made}, lights)
            if not self._begins and self.view is not None:
                self._painter.run(partial(self._painter.begin, self.view.backdrop))
                self._begins = True
            for material, part in parts.items():
                self._painter.run(partial(self._painter.put, material, part))
            self._loaded.setdefault(name, []).append((lights, made))
        self.lights = max(self.lights, lights)

    def has(self, name: str, made: Editable, lights: int) -> bool:
        """Whether transport that applies to a material was read for at least this number of lights."""
        return any(count >= lights and same_quotients(one, made) for count, one in self._loaded.get(name, []))
