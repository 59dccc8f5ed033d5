"""The picture of an edited view with its interreflections: direct light plus one material's polynomial.

whole = whole_picture(store, session)
whole.show("floor", edited); whole.step(); whole.image()
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial

from lambent.core.arrays import Image
from lambent.editing.incremental import TERMS
from lambent.editing.interreflection.picture import BEYOND_DIRECT, FrozenPicture, Shown, changed
from lambent.editing.interreflection.stored import Interreflections, interreflections, samples_of
from lambent.editing.picture import EditedPicture
from lambent.editing.session.session import Session
from lambent.editing.stored import edited_picture
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable
from lambent.store.contract import scene_record
from lambent.store.store import Store

ALL_HITS = (1, BEYOND_DIRECT[1])


def whole_picture(store: Store, session: Session, hits: tuple[int, int] = ALL_HITS) -> WholePicture:
    """The picture of a session's view with the stored interreflections, drawn exactly.

    Parameters and errors are those of `editing.stored.edited_picture`; `hits` as in `WholePicture`.
    """
    whole, view = WholePicture(edited_picture(store, session)), session.document
    whole.see(hits)
    if samples_of(store, session):
        scene = {name: of_material(material) for name, material in scene_record(store).materials.items()}
        baked = {**scene, **{name: session.original(name) for name in view.materials}}
        now = {**scene, **{name: session.editable(name) for name in view.materials}}
        whole.give(interreflections(store, view.camera, view.size, baked), now)
        whole.draw()
    return whole


class WholePicture:
    """An `EditedPicture` with interreflections, if there are any.

    To edit another material, its polynomial is computed in the background, while frames show the previous one; `draw`
    waits for it.

    Parameters
    ----------
    direct
        The direct light; drawn as given.

    Attributes
    ----------
    hits : (int, int)
        Least and most surfaces on the shown paths: (1, 1) is direct light alone.
    """

    def __init__(self, direct: EditedPicture) -> None:
        self.direct = direct
        self.hits = ALL_HITS
        self._light: Interreflections | None = None
        self._now: dict[str, Editable] = {}
        self._frozen: FrozenPicture | None = None
        self._wanted: tuple[str, frozenset[str]] | None = None  # next material and curves to edit
        self._work: Future[FrozenPicture] | None = None
        self._pool = ThreadPoolExecutor(1)

    @property
    def samples(self) -> int:
        """Paths per pixel of the interreflections; 0 without any."""
        return self._light.samples if self._light is not None else 0

    def give(self, light: Interreflections, materials: Mapping[str, Editable]) -> None:
        """Add or replace interreflections; `materials` are all materials of the view as shown."""
        self._light, self._now = light, dict(materials)
        edited = self._frozen.edited if self._frozen is not None else next(iter(light.parts))
        self._wanted = self._wanted or (edited, self._active)

    def see(self, hits: tuple[int, int]) -> None:
        """Show paths with numbers of surfaces from hits[0] to hits[1]."""
        if hits != self.hits:
            self.hits = hits
            if self._frozen is not None:
                self._wanted = self._wanted or (self._frozen.edited, self._active)

    def show(self, material: str, edited: Editable) -> None:
        """Like `EditedPicture.show`, including its errors."""
        self.direct.show(material, edited)
        before, frozen = self._now.get(material, edited), self._frozen
        self._now[material] = edited
        if frozen is not None and frozen.edited == material and frozen.serves(edited):
            frozen.show(edited)
        elif self._light is not None and self._work is None:  # otherwise it is requested when that work is done
            self._wanted = material, changed(before, edited)

    def activate(self, material: str, curve: str) -> None:
        """Like `EditedPicture.activate`."""
        self.direct.activate(material, curve)
        frozen = self._frozen
        if self._light is None or material not in self._now:
            return
        if frozen is None or frozen.edited != material or not frozen.serves(self._now[material], curve):
            self._wanted = material, frozenset({curve})

    def step(self, terms: int = TERMS) -> bool:
        """Draw one frame; returns whether it replaced the interreflections."""
        self.direct.step(terms)
        taken = self._work is not None and self._work.done()
        if self._work is not None and taken:
            self._take(self._work.result())
            self._work = None
        if self._work is None and self._wanted is not None:
            work = self._freezing()
            self._work = self._pool.submit(work) if work is not None else None
        if self._frozen is not None:
            self._frozen.step(terms)
        return taken

    def draw(self) -> None:
        """Draw the exact picture at once."""
        self.direct.draw()
        if self._work is not None:
            self._take(self._work.result())
            self._work = None
        work = self._freezing() if self._wanted is not None else None
        if work is not None:
            self._take(work())
        if self._frozen is not None:
            self._frozen.draw()

    @property
    def is_exact(self) -> bool:
        """Whether the picture shows the target exactly."""
        return self.direct.is_exact and self._is_current and (self._frozen is None or self._frozen.is_exact)

    @property
    def is_settled(self) -> bool:
        """Whether another frame would not change a bit."""
        return self.direct.is_settled and self._is_current and (self._frozen is None or self._frozen.is_settled)

    @property
    def shown(self) -> Shown:
        """Layers with their scales, for composition."""
        direct = self.direct.shown if self.hits[0] <= 1 else []
        return direct + (self._frozen.shown if self._frozen is not None and self.hits[1] > 1 else [])

    def compose(self) -> None:
        """Like `EditedPicture.compose`."""
        self.direct.canvas.compose(self.shown)

    def image(self) -> Image:
        """(H, W, 3) float32, linear radiance."""
        self.compose()
        return self.direct.canvas.image()

    def direct_image(self) -> Image:
        """(H, W, 3) float32, direct light alone, regardless of `hits`."""
        self.direct.canvas.compose(self.direct.shown)
        return self.direct.canvas.image()

    def close(self) -> None:
        """End background work."""
        self._pool.shutdown(cancel_futures=True)

    @property
    def _active(self) -> frozenset[str]:
        """Currently edited curves."""
        return self._frozen.active if self._frozen is not None else frozenset()

    @property
    def _is_current(self) -> bool:
        return self._work is None and self._wanted is None

    def _freezing(self) -> Callable[[], FrozenPicture] | None:
        """The work to do; None if the stored interreflections belong to other terms than a material has now."""
        assert self._wanted is not None
        (material, active), light = self._wanted, self._light
        self._wanted = None
        if light is None or any(not same_quotients(part.start, self._now[name]) for name, part in light.parts.items()):
            self._frozen = None
            return None
        canvas, hits = self.direct.canvas, _beyond_direct(self.hits)
        return partial(FrozenPicture, light, dict(self._now), material, canvas, active, hits)

    def _take(self, frozen: FrozenPicture) -> None:
        """Switch to a polynomial; apply later edits to it, or compute it again."""
        self._frozen = frozen
        for name, made in frozen.materials.items():
            now = self._now[name]
            if now is made:
                continue
            if name == frozen.edited and frozen.serves(now):
                frozen.show(now)
            else:
                self._wanted = self._wanted or (name, changed(made, now))
        if frozen.hits != _beyond_direct(self.hits):
            self._wanted = self._wanted or (frozen.edited, self._active)


def _beyond_direct(hits: tuple[int, int]) -> tuple[int, int]:
    return max(2, hits[0]), hits[1]
