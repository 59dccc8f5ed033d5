"""Interreflections in the window: whether they are wanted, the bake beside the window, and what the store has."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.editing.interreflection.stored import interreflections, samples_of
from lambent.editing.session import Session
from lambent.store.store import MANIFEST, Store
from lambent.viewer.modes.edit.baking import Baking, Wanted
from lambent.viewer.modes.edit.painter import Painter
from lambent.viewer.work import Work

SERIES = ("64,1,1,1", "64,1,1", "128,8,1", "64,16")
SAMPLES = (256, 1024, 4096, 16384)
SHOWN: Mapping[str, tuple[int, int]] = {
    "all light": (1, 99), "direct light": (1, 1), "2 surfaces": (2, 2), "3 surfaces": (3, 3), "4 surfaces": (4, 4),
    "all but direct light": (2, 99),
}  # fmt: skip
MOST_EDITED = 6  # materials: tails grow with their third power


class Bounced:
    """The interreflections of a session's view.

    Attributes
    ----------
    on : bool
        Whether more samples are baked until there are `wanted`.
    series, wanted
        Of the bake; see `bake.bounces`.
    shown : str
        A key of `SHOWN`.
    samples : int
        Paths per pixel of what is shown; 0 without interreflections.
    """

    def __init__(self, painter: Painter, bake: Callable[..., Baking] = Baking) -> None:
        self.on, self.series, self.wanted, self.shown = False, SERIES[0], SAMPLES[1], "all light"
        self.samples = 0
        self.baking: Baking | None = None
        self.trouble = ""
        self._painter, self._bake = painter, bake
        self._reading: Work | None = None
        self._folder: Path | None = None
        self._given: object = None  # the view and its light, that samples belong to

    @property
    def busy(self) -> bool:
        return self._reading is not None or self.baking is not None

    @property
    def line(self) -> str:
        """How far it is; empty at rest."""
        return self.baking.line if self.baking is not None else ""

    def tick(self, session: Session, folder: Path, idle: bool, shares: Mapping[str, float]) -> None:
        """Take what arrived, and begin what is wanted; `idle`: direct light is there, and nobody writes the store."""
        if self._reading is not None and self._reading.poll():
            self._reading = None
        if self.baking is not None and self.baking.samples > self.samples and self._reading is None:
            self._read(session)
        if self.baking is not None and not self.baking.running:
            self.trouble = f"interreflections: {self.baking.error}" if self.baking.error else ""
            self.on = self.on and not self.baking.error
            self.baking = None
        source = session.document.environment, folder
        if not idle or self.busy:
            return
        if source != self._given:
            self._given, self._folder, self.samples = source, folder, 0
            if (folder / MANIFEST).exists():
                self._read(session)
            return
        if self.on and self.samples < self.wanted:
            kept = sorted(session.document.materials, key=lambda name: -shares.get(name, 0.0))[:MOST_EDITED]
            fixed = tuple(name for name in session.document.materials if name not in kept)
            self.baking = self._bake(session, folder, bounces=Wanted(self.series, self.wanted, fixed))

    def stop(self) -> None:
        """End the bake; the passes that it has finished stay in the store."""
        if self.baking is not None:
            self.baking.close()
            self.baking = None

    def begin_anew(self) -> None:
        """The store's samples no longer serve: of other terms, or of another series of bands."""
        self.stop()
        self.samples = 0

    def change(self, series: str) -> None:
        """Bake another series of bands from now on."""
        if series != self.series:
            self.begin_anew()
            self.series = series

    def close(self) -> None:
        self.stop()
        if self._reading is not None:
            self._reading.wait()
            self._reading = None

    def _read(self, session: Session) -> None:
        assert self._folder is not None
        folder, copy = self._folder, Session(session.document, session.folder)
        originals = {name: session.original(name) for name in session.document.materials}

        def run(_: object) -> None:
            store, view = Store.open(folder), copy.document
            found = samples_of(store, copy)
            if found > self.samples:
                light = interreflections(store, view.camera, view.size, originals)
                self._painter.run(partial(self._painter.give, light))
                self.samples = found

        self._reading = Work(run, lambda _: None, self._failed)

    def _failed(self, error: UserError) -> None:
        self.trouble = f"interreflections: {error}"
