"""Interreflections in the window: the choice of materials, the background bake, and the stored light."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path

from lambent.baked.transport.tails import FIXED
from lambent.baking.interreflection.proposal import Proposal
from lambent.baking.interreflection.settings import Bounces
from lambent.core.errors import UserError
from lambent.editing.interreflection.noise import light_of, noise, noted_noise
from lambent.editing.interreflection.picture import BEYOND_DIRECT
from lambent.editing.interreflection.stored import Interreflections, interreflections, samples_of, series_of
from lambent.editing.interreflection.whole import ALL_HITS
from lambent.editing.products import Pixels
from lambent.editing.session.session import Session
from lambent.materials.factored.terms import Editable
from lambent.store.store import MANIFEST, Store
from lambent.viewer.background.work import Work, pending
from lambent.viewer.modes.edit.baking import Baking
from lambent.viewer.modes.edit.painter import Painter

SERIES = ("64,1,1,1", "64,1,1", "128,8,1", "64,16")
SAMPLES = (256, 1024, 4096, 16384)
SHOWN: Mapping[str, tuple[int, int]] = {
    "all light": ALL_HITS, "direct light": (1, 1), "1 to 2 surfaces": (1, 2), "1 to 3 surfaces": (1, 3),
    "2 surfaces only": (2, 2), "3 surfaces only": (3, 3), "4 surfaces only": (4, 4),
    "indirect light": BEYOND_DIRECT,
}  # fmt: skip


class Bounced:
    """The interreflections of a session's view.

    Attributes
    ----------
    on : bool
        Whether samples are baked up to `wanted`.
    series, wanted
        Series of bands and samples of the bake; see `baking.interreflection.settings`.
    fixed : frozenset of str or None
        Materials whose edits do not change the light on others: from the store, the proposal, or the user; None
        before that.
    proposal : Proposal or None
        Costs of a bake with this choice.
    shown : str
        A key of `SHOWN`.
    samples : int
        Paths per pixel of the shown light; 0 without interreflections.
    noise : float or None
        Standard error of a point's shown interreflections relative to their mean: measured between passes or, before
        that, noted by the bake. None if unknown.
    """

    def __init__(self, painter: Painter, bake: Callable[..., Baking]) -> None:
        self.on, self.series, self.wanted, self.shown = False, SERIES[0], SAMPLES[1], "all light"
        self.samples = 0
        self.noise: float | None = None
        self.fixed: frozenset[str] | None = None
        self.proposal: Proposal | None = None
        self.baking: Baking | None = None
        self.trouble = ""
        self._painter, self._bake = painter, bake
        self._proposing: Baking | None = None
        self._asked: Bounces | None = None  # input of the present proposal
        self._is_own = False  # whether the user chose what is fixed
        self._reading: Work | None = None
        self._folder: Path | None = None
        self._source: object = None  # view and light of the samples
        self._light: tuple[int, Pixels] | None = None  # samples and light of the last pass

    @property
    def busy(self) -> bool:
        return self._reading is not None or self.baking is not None or self.is_measuring

    @property
    def is_measuring(self) -> bool:
        """Whether a proposal is being made."""
        return self._proposing is not None

    @property
    def line(self) -> str:
        """Progress of the bake as a line; empty without one."""
        return self.baking.line if self.baking is not None else ""

    @property
    def bounces(self) -> Bounces:
        """Input of the next bake."""
        return Bounces(Bounces.of_text(self.series), self.wanted, self.fixed or frozenset())

    @property
    def is_measured(self) -> bool:
        """Whether the proposal matches the present choice."""
        return self.proposal is not None and not self.is_measuring and self._asked == self.bounces

    def tick(self, session: Session, folder: Path, idle: bool) -> None:
        """Take finished work and start wanted work; `idle`: direct light is done and nothing else writes the store."""
        self._reading = pending(self._reading)
        if self.baking is not None and self.baking.samples > self.samples and self._reading is None:
            self._read(session)
        if self.baking is not None and not self.baking.running and self._reading is None:
            self._failed_of(self.baking)
            self.baking = None
            self.on = self.on and self.samples < self.wanted
        self._take_proposal()
        self._keep_to(session.document.materials)
        source = session.document.environment, folder
        if not idle or self._reading is not None or self.baking is not None:
            return
        if source != self._source:
            self._source, self._folder = source, folder
            self.begin_anew()
            if (folder / MANIFEST).exists():
                self._read(session)
            return
        if self.on and self.samples < self.wanted and self.fixed is not None:
            self._stop_proposing()
            self.baking = self._bake(session, folder, bounces=self.bounces)
        elif self._asked != self.bounces:
            self._propose(session, folder)

    def start(self) -> None:
        """Start or continue the bake, as soon as materials are chosen."""
        self.on, self.trouble = True, ""

    def stop(self) -> None:
        """Stop the bake; its finished passes stay in the store."""
        self.on = False
        if self.baking is not None:
            self.baking.close()
            self.baking = None

    def begin_anew(self) -> None:
        """Forget the store's samples, which are for other terms, materials or bands."""
        if self.baking is not None:
            self.baking.close()
            self.baking = None
        self._stop_proposing()
        self.samples, self.noise, self._light, self._asked = 0, None, None, None

    def change(self, series: str) -> None:
        """Use another series of bands from the next bake on."""
        if series != self.series:
            self.begin_anew()
            self.series = series
            if not self._is_own:
                self.fixed = None

    def choose(self, material: str, edited: bool) -> None:
        """Choose from the next bake on whether edits of a material change the light on others."""
        assert self.fixed is not None
        self.begin_anew()
        self._is_own = True
        self.fixed = self.fixed - {material} if edited else self.fixed | {material}

    def close(self) -> None:
        self.stop()
        self._stop_proposing()
        if self._reading is not None:
            self._reading.wait()
            self._reading = None

    def _propose(self, session: Session, folder: Path) -> None:
        """Measure the costs of the choice; without a choice, propose one that includes all edited materials."""
        self._stop_proposing()
        materials = session.document.materials
        changed = {name for name, one in materials.items() if one.now != one.start}
        kept = changed if self.fixed is None else materials.keys() - self.fixed
        self._asked = self.bounces
        self._proposing = self._bake(session, folder, bounces=self._asked, proposing=kept)

    def _keep_to(self, materials: Collection[str]) -> None:
        """Drop merged materials from the choice, and an old proposal."""
        if self.fixed is not None:
            self.fixed &= frozenset(materials)
        if self.proposal is not None and {row.material for row in self.proposal.rows} != {*materials}:
            self.proposal = None

    def _take_proposal(self) -> None:
        if self._proposing is None or self._proposing.running:
            return
        self._failed_of(self._proposing)
        found, self._proposing = self._proposing.proposal, None
        if found is None:
            return
        self.proposal = found
        if self.fixed is None:
            self.fixed, self._asked = found.bounces.fixed, found.bounces

    def _stop_proposing(self) -> None:
        if self._proposing is not None:
            self._proposing.close()
            self._proposing, self._asked = None, None

    def _read(self, session: Session) -> None:
        assert self._folder is not None
        folder, copy = self._folder, Session(session.document, session.folder)
        originals = {name: session.original(name) for name in session.document.materials}

        def run(_: object) -> None:
            store, view = Store.open(folder), copy.document
            found = samples_of(store, copy)
            if found <= self.samples:
                return
            light = interreflections(store, view.camera, view.size, originals)
            self._painter.run(partial(self._painter.give, light))
            if self.baking is None:  # the next bake continues the store's samples
                self.series = ",".join(map(str, series_of(store, copy)))
                self.fixed = frozenset(originals) - {name for name, side in light.tails.slots if side != FIXED}
            self._see_noise(light, originals)
            if self.noise is None:
                self.noise = noted_noise(store, view.camera, view.size, found)
            self.samples = found

        self._reading = Work(run, lambda _: None, self._failed)

    def _see_noise(self, light: Interreflections, originals: Mapping[str, Editable]) -> None:
        before, self._light = self._light, (light.samples, light_of(light, originals))
        if before is not None and 0 < before[0] < light.samples:
            self.noise = noise(before[1], self._light[1], (before[0], light.samples))

    def _failed(self, error: UserError) -> None:
        self.trouble, self.on = f"interreflections: {error}", False

    def _failed_of(self, work: Baking) -> None:
        self.trouble = f"interreflections: {work.error}" if work.error else ""
        self.on = self.on and not work.error
