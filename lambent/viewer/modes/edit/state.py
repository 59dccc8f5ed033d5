"""The edit mode without its window: session, picture, arriving transport, selection and comparison."""

from __future__ import annotations

import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from lambent.core.errors import UserError
from lambent.core.light.exposure import metered
from lambent.core.light.false_colour import Range, SignedRange
from lambent.core.light.photometry import photometric
from lambent.editing.session.document import SessionDocument
from lambent.materials.document import Material
from lambent.materials.factored.terms import Editable
from lambent.store.source import changed_inputs
from lambent.store.store import MANIFEST, Store
from lambent.viewer.edits.rooms_view import RoomsView
from lambent.viewer.edits.shown import Backend
from lambent.viewer.exchange import EDIT, WALK, exchanged
from lambent.viewer.look import Look
from lambent.viewer.mode import Divider
from lambent.viewer.modes.edit.baking import LIGHTS, Baking
from lambent.viewer.modes.edit.files import Files
from lambent.viewer.modes.edit.interreflections import SHOWN, Bounced
from lambent.viewer.modes.edit.loading import Loading, ViewMap
from lambent.viewer.modes.edit.painter import Frame, Materials, Painter, Wish, checked
from lambent.viewer.modes.edit.subject import Subject
from lambent.viewer.screen import Screen

OUTLINED_S = 1.0  # time that a new selection is outlined
OFF, DIRECT, UNEDITED = "off", "direct light", "as opened"
Fixed = tuple[object, ...]  # everything that transport depends on


@dataclass
class Compared:
    """The content of picture A: nothing, direct light only, the materials as opened, or a snapshot.

    With `is_difference`, B shows its difference from A, on `scale`; if None, it is fitted.
    """

    chosen: str = OFF
    is_difference: bool = False
    scale: SignedRange | None = None
    kept: dict[str, Materials] = field(default_factory=dict)
    divider: Divider = field(default_factory=Divider)

    @property
    def choices(self) -> tuple[str, ...]:
        return (OFF, DIRECT, *self.kept)

    @property
    def materials(self) -> Materials | None:
        return self.kept.get(self.chosen)

    def keep(self, materials: Materials) -> None:
        """Take a snapshot and compare with it."""
        self.chosen = f"snapshot {len(self.kept)}"
        self.kept[self.chosen] = materials

    def fit(self, frame: Frame) -> None:
        """Fit a missing scale to a frame with this A."""
        shows_a = frame.wish.compared is self.materials and frame.wish.direct == (self.chosen == DIRECT)
        if self.scale is None and self.is_difference and shows_a and frame.compared_radiance is not None:
            self.scale = SignedRange.fitting(photometric(frame.radiance - frame.compared_radiance))


class EditState:
    """State of the edit mode; see the module. `trouble` is a line on a failure, else empty."""

    def __init__(
        self,
        subject: Subject,
        screen: Screen,
        lights: Sequence[int] = LIGHTS,
        bake: Callable[..., Baking] = Baking,
        backend: Backend | None = None,
    ) -> None:
        self.subject, self.session, self.screen, self.lights = subject, subject.session, screen, tuple(lights)
        self.look = Look(exposure_ev=subject.scene.exposure_ev or 0.0, shows=("full",))
        self._metered = subject.scene.exposure_ev is not None
        self.pixel_exact = False
        self.material = next(iter(self.session.document.materials), "")
        self.pointed: tuple[str, str] | None = None  # object and material under the mouse
        self.selected_s = -1e9  # when the selection was made
        self.trouble = ""
        self.painter = Painter(self.session.document.size[::-1], backend=backend)
        self.loading = Loading(self.painter, subject.store)
        self.baking: Baking | None = None
        self.files = Files(subject, screen)
        self.room: RoomsView | None = None
        if subject.keeper is not None:
            self.room = RoomsView(subject.keeper, self.look)
            self._metered = self._metered or self.room.has_exposure
            of = (o.material for o in subject.scene.objects if o.name == self.room.selected)
            self.material = next((name for name in of if name in self.session.document.materials), self.material)
        self._bake = bake
        self.bounced = Bounced(self.painter, bake)
        self._sources: Sequence[object] = ()  # sources of materials at the last check of transport
        self._fixed: Fixed | None = None
        self._weighed: Baking | None = None  # the bake that has the shares of materials in the view
        self._document: SessionDocument | None = None
        self._now: dict[str, Editable] = {}
        self._wish = Wish()
        names = self.session.document.materials
        self.compared = Compared(kept={UNEDITED: {name: self.session.editable(name) for name in names}})
        if (subject.store / MANIFEST).exists():
            self._load(None)

    @property
    def name(self) -> str:
        """Name of the scene."""
        return self.subject.name

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture in pixels."""
        return self.session.document.size

    def take(self) -> Frame | None:
        """The last frame, to show it."""
        return self.painter.take()

    @property
    def busy(self) -> bool:
        """Whether background work with visible progress runs."""
        return self.baking is not None or self.loading.busy or self.files.fitting.busy or self.bounced.busy

    @property
    def is_difference(self) -> bool:
        """Whether the difference of B from A is shown."""
        return self.compared.is_difference and self.compared.chosen != OFF

    @property
    def scale(self) -> Range | None:
        """Scale of the picture's false colours, if any."""
        if self.is_difference:
            return self.compared.scale
        return self.look.scale if self.look.is_false_coloured else None

    @property
    def now(self) -> Materials:
        """The materials with their present edits."""
        return self._wish.now

    @property
    def materials(self) -> tuple[str, ...]:
        """Selectable materials: those in view or, before these are known, all."""
        view = self.loading.view
        return view.materials if view is not None and view.materials else tuple(self.session.document.materials)

    @property
    def selected(self) -> str | None:
        """The material to edit, if it has not been merged with another."""
        return self.material if self.material in self.session.document.materials else None

    @property
    def outlined(self) -> tuple[str, ...]:
        """Outlined objects: the one under the mouse and, for a moment, the objects of a new selection."""
        view = self.loading.view
        if view is not None and self.selection_is_new:
            return tuple(name for name, material in view.objects if material == self.material)
        return (self.pointed[0],) if self.pointed is not None else ()

    @property
    def selection_is_new(self) -> bool:
        return self.screen.clock() - self.selected_s < OUTLINED_S

    def select(self, material: str) -> None:
        """Edit this material."""
        self.material, self.selected_s = material, self.screen.clock()

    def change(self, name: str, material: Material) -> None:
        """Change a material within the present stroke, or begin one."""
        if material != self.subject.edits.current(name):
            if not self.subject.edits.in_stroke:
                self.session.history.begin_stroke()
            self.session.change(name, material)

    def select_next(self) -> None:
        """Select the next material in view."""
        names = self.materials
        at = names.index(self.material) + 1 if self.material in names else 0
        self.select(names[at % len(names)])

    def tick(self) -> None:
        """Take results of background work, and update the picture to the session."""
        checked(self.painter)
        self.files.poll()
        self.loading.poll()
        self._take_edits()
        self._take_baked()
        if not (self.loading.busy or self.subject.edits.in_stroke):  # a drag needs transport where it ends
            self._have_transport()
        direct = bool(self.loading.lights) and self.baking is None and not self.loading.busy
        self.bounced.tick(self.session, self.loading.folder, direct)

    def enter_room(self) -> None:
        """Go to the room, at the camera of this view."""
        if (room := self.room) is not None:
            names = [o.name for o in self.subject.scene.objects if o.material == self.material]
            selected = room.selected if room.selected in names else next(iter(names), None)
            room.leave(self.session.document.camera, selected)
            store = self.session.path(self.session.document.scene)
            self.screen.enter = partial(exchanged, store=store, before=EDIT, name=WALK)

    def close(self) -> None:
        """Stop background work; finished work stays in the store."""
        self.stop_baking()
        self.bounced.close()
        self.files.close()
        self.loading.close()
        self.painter.close()

    def _take_edits(self) -> None:
        document, look = self.session.document, self.look
        if document is not self._document:
            self._now = {name: self.session.editable(name) for name in document.materials}
            self._document = document
            self.material = document.merged.get(self.material, self.material)
        surfaces = SHOWN[self.bounced.shown]
        compared, at_rest = self.compared, not self.painter.busy
        if at_rest and (frame := self.painter.frame) is not None:  # read after, or it may be one from before
            compared.fit(frame)
            if not self._metered and not self.loading.busy:  # a half-loaded picture is darker
                found = metered(frame.radiance)  # None before there is light
                self._metered = found is not None
                if found is not None and look.exposure_ev == 0.0:  # not chosen by hand meanwhile
                    look.exposure_ev = found
        wish = Wish(
            self._now, compared.materials, compared.chosen == DIRECT, compared.scale if self.is_difference else None,
            look.view_transform, look.exposure_ev, look.scale, surfaces,
        )  # fmt: skip
        if not same(wish, self._wish):
            self._wish = wish
            self.painter.want(wish)

    def _take_baked(self) -> None:
        if self.baking is None:
            return
        if self.loading.view is not None and self._weighed is not self.baking:
            self._weighed = self.baking
            self.baking.weigh(self.loading.view.shares)
        if not self.loading.busy and self.baking.arrived:
            self._load(self.baking.arrived.pop(0))
        elif not self.loading.busy and self.baking.has_view and self.loading.view is None:
            self._load(0)
        elif not self.baking.running and not self.baking.arrived:
            self.trouble = f"not baked: {self.baking.error}" if self.baking.error else ""
            self.baking = None

    def _have_transport(self) -> None:
        """Bake missing transport if a material's source has changed."""
        document = self.session.document
        sources = (document.environment, document.merged, *(one.start for one in document.materials.values()))
        if len(sources) == len(self._sources) and all(map(operator.is_, sources, self._sources)):
            return
        folder = self.subject.store_for(document.environment)
        if folder != self.loading.folder:
            self.stop_baking()
            self.loading = Loading(self.painter, folder, begins=False)
            if (folder / MANIFEST).exists():
                self._load(None)
                return
        self._sources, before, self._fixed = sources, self._fixed, self._needs()
        if self._fixed == before:
            return
        self.stop_baking()
        if self._is_complete():
            return
        if before is not None:
            self.screen.say("this edit needs new transport; it is being baked in the background")
        if self.loading.view is not None and not self._shows_objects(self.loading.view):
            self.loading = Loading(self.painter, folder, begins=False)
        self.bounced.begin_anew()
        self.baking = self._bake(self.session, folder, self.lights)

    def _shows_objects(self, view: ViewMap) -> bool:
        """Whether the objects of a view have the session's materials, merges included."""
        objects = self.subject.scene.merged(self.session.document.merged).objects
        return view.objects == tuple((o.name, o.material) for o in objects)

    def _is_complete(self) -> bool:
        view = self.loading.view
        if view is None or not self._shows_objects(view):
            return False
        materials = self.materials
        made = {name: self.session.original(name) for name in materials}
        if not made or not all(self.loading.has(name, one, self.lights[-1]) for name, one in made.items()):
            return False
        return not changed_inputs(Store.open(self.loading.folder), self.subject.scene)

    def stop_baking(self) -> None:
        """Stop the bake; finished work stays in the store."""
        if self.baking is not None:
            self.baking.close()
            self.baking = None

    def _load(self, lights: int | None) -> None:
        self.loading.start(self.session, lights, self._not_loaded)

    def _not_loaded(self, error: UserError) -> None:
        if self.baking is not None:  # else it is baked now
            self.trouble = f"not loaded: {error}"

    def _originals(self) -> dict[str, Editable]:
        return {name: self.session.original(name) for name in self.session.document.materials}

    def _needs(self) -> Fixed:
        document = self.session.document
        terms = tuple((name, term.fixed) for name, one in self._originals().items() for term in one.terms)
        return (document.environment, *document.merged.items(), *terms)


def same(one: Wish, other: Wish) -> bool:
    """Whether two wishes have identical materials."""
    parts: list[Any] = [(w.view, w.exposure_ev, w.scale, w.surfaces, w.direct, w.difference) for w in (one, other)]
    return one.now is other.now and one.compared is other.compared and parts[0] == parts[1]
