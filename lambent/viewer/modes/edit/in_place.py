"""A store's session with the edits of one of its views, and the room's materials as they start from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.session.document import EditedMaterial, OfDocument, SessionDocument, document_from, load_document
from lambent.editing.session.session import Session
from lambent.materials.document import Material
from lambent.store.kept.session import FILE, EditedView, KeptView, WalkSession
from lambent.viewer.edits.session_file import SOON_S, SessionFile
from lambent.viewer.look import Look
from lambent.viewer.screen import Screen


class InPlace(SessionFile):
    """The session file of a store, whose edited view is the `Session` of `begin`.

    Attributes
    ----------
    store : Path
        The store's folder.
    lines : list of str
        Lines on problems.
    """

    def __init__(self, store: Path, screen: Screen, soon_s: float = SOON_S) -> None:
        super().__init__(store, screen, soon_s)
        self.store, self.lines = store, [line for line in self.read(store) if line != self.fault]
        self._now = now = self.opened.now
        parts = {"light mix": now.light.groups, "lamps": now.lamps, "textures": now.textures}
        if other := [what for what, changed in parts.items() if changed]:
            self.lines.append(f"shown as baked here: the room's {', '.join(other)}")
        self._foreign: dict[str, EditedMaterial] = {}  # materials of the view that the scene lacks
        self._edited: Session | None = None
        self._look = Look()
        self._begun: SessionDocument | None = None  # as it need not be written
        self._of: tuple[object, object] | None = None  # document and materials of the section
        self._section: EditedView | None = None
        self._shown: dict[str, EditedMaterial] = {}  # materials as the room shows them
        self._left: dict[str, object] = {}  # of the view, for the mode that comes next

    def material(self, name: str, of_scene: Material) -> Material:
        """The material of the room."""
        return self._now.materials.get(name, of_scene)

    def view(self, camera: Camera, materials: Mapping[str, Material], former: Path) -> Session | None:
        """The edits of a view, from the session or else once from a `former` file; None if there are none.

        `materials` are the scene's, by name. One that was edited in the room since then starts from there.

        Raises
        ------
        UserError
            If the edits cannot be used.
        """
        edited, file = self.opened.edited, self.store / FILE
        there = (one for one in edited.values() if _place(one.document.get("camera")) == _place(asdict(camera)))
        if (said := edited.get(camera.name) or next(there, None)) is None:  # a saved view may have been renamed
            return self._former(camera, former)
        document = document_from(said.document, file)
        self._foreign = {name: one for name, one in document.materials.items() if name not in materials}
        known = {name: one for name, one in document.materials.items() if name in materials}
        place = {"scene": str(self.store.resolve()), "camera": camera, "materials": known}
        session = Session.of(document.model_copy(update=place), file)
        for name in known:
            before, now = said.room.get(name, materials[name]), self.material(name, materials[name])
            if now != before:
                if known[name].source != OfDocument(material=before):  # the room shows the edits
                    session.reset(name)
                session.become(name, now)
        return Session(session.document, self.store)

    def _former(self, camera: Camera, like: Path) -> Session | None:
        """The last of the files `like` NAME-001.edits.json that edits this view of the store."""
        for file in sorted(like.parent.glob(f"{like.name}-*.edits.json"), reverse=True):
            try:
                document = load_document(file)
                if (file.parent / document.scene).resolve() == self.store.resolve() and document.camera == camera:
                    found = Session.of(document, file).placed(self.store)
                    self.lines.append(f"the edits of {file.name} are in the store's session from now on")
                    return Session(found.model_copy(update={"scene": str(self.store.resolve())}), self.store)
            except UserError as error:
                self.lines.append(f"not taken into the store's session: {error}")
        return None

    def begin(self, session: Session, look: Look) -> None:
        """Keep these edits, and the exposure and view transform of the `look`, which are the session's first."""
        history, now = self._screen.histories.pop((self.store, session.document.camera), None), session.document
        if history is not None and history.now.size == now.size:
            history.change(now)
            session.history = history
        self._edited, self._look, view = session, look, self.opened.view
        said, materials = self.opened.edited.get(session.document.camera.name), session.document.materials
        plain = {name for name, one in materials.items() if one == EditedMaterial(source=one.source)}
        self._begun = session.document if said is not None or len(plain) == len(materials) else None
        shown = plain if said is None else set(said.shown)
        self._shown = {name: one for name, one in materials.items() if name in shown}
        if view is not None:
            look.view_transform, look.scale = view.look.view_transform, view.look.scale
        if view is not None and view.look.exposure_ev is not None:
            look.exposure_ev, look.base_ev = view.look.exposure_ev, view.look.base_ev

    @property
    def unshown(self) -> list[str]:
        """Materials that the room shows otherwise than as edited."""
        now = {} if self._edited is None else self._edited.document.materials
        return [name for name, one in now.items() if one != self._shown.get(name)]

    def leave(self, camera: Camera, selected: str | None) -> None:
        """Let the room be shown from a camera, with an object selected."""
        self._left = {"camera": camera, "selected": selected}

    @property
    def has_exposure(self) -> bool:
        """Whether the session has an exposure."""
        return self.opened.view is not None and self.opened.view.look.exposure_ev is not None

    def close(self) -> None:
        if self._screen.exchanging and self._edited is not None:
            self._edited.history.end_stroke()
            self._screen.histories[self.store, self._edited.document.camera] = self._edited.history
        super().close()

    def show_in_room(self, name: str, material: Material) -> None:
        """Let the room have a material as it is edited here."""
        self._now = self._now.model_copy(update={"materials": {**self._now.materials, name: material}})
        self._begun = None  # to be written
        if self._edited is not None:
            self._shown[name] = self._edited.document.materials[name]

    @property
    def session(self) -> WalkSession:
        changes: dict[str, object] = {"now": self._now}
        if self.opened.view is not None:
            view, look = self.opened.view, self._look
            shown: dict[str, object] = {"view_transform": look.view_transform, "scale": look.scale}
            shown |= {"exposure_ev": look.exposure_ev, "base_ev": look.base_ev} if self.has_exposure else {}
            changes["view"] = view.model_copy(update={"look": view.look.model_copy(update=shown), **self._left})
        elif self._left:
            changes["view"] = KeptView.model_validate(self._left)
        if self._edited is not None and self._edited.document is not self._begun:
            section, name = self._section_of(self._edited), self._edited.document.camera.name
            changes["edited"] = {**self.opened.edited, name: section}
        return self.opened.model_copy(update=changes)

    def _section_of(self, session: Session) -> EditedView:
        of = session.document, self._now
        if self._section is None or self._of is None or any(a is not b for a, b in zip(of, self._of, strict=True)):
            document = session.placed(self.store)
            materials = {**self._foreign, **document.materials}
            whole = document.model_copy(update={"scene": ".", "materials": materials})  # also of a store that moves
            room = {name: one for name, one in self._now.materials.items() if name in document.materials}
            shown = tuple(name for name in document.materials if name not in self.unshown)
            self._of, self._section = of, EditedView(document=whole.model_dump(mode="json"), room=room, shown=shown)
        return self._section


def _place(camera: object) -> object:
    """A camera of a document without its name."""
    numbers = (
        ((k, tuple(v) if isinstance(v, list) else v) for k, v in camera.items()) if isinstance(camera, dict) else ()
    )
    return {name: value for name, value in numbers if name != "name"}
