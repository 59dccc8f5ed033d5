"""A session: the materials of one view during editing, with undo, and its file format.

session = Session.new("room", camera, {"teapot": material})
session.change("teapot", rougher)                # a document with other numbers
session.editable("teapot")                       # terms and curves to draw
session.save(Path("teapot.edits.json"))
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from lambent.core.discovery import known
from lambent.core.errors import invalid
from lambent.core.files import place_from, write_text
from lambent.core.views.camera import Camera
from lambent.editing.session.document import EditedMaterial, SessionDocument, load_document
from lambent.editing.session.history import History, Steps
from lambent.materials.document import Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import same_quotients
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import ImageEnvironment
from lambent.store.kept.session import Surroundings


class Session:
    """Edits of the materials of one view.

    Every editing method is one step of undo, or a part of the open stroke. Unknown names of materials raise
    `UserError`.

    Parameters
    ----------
    document
        The initial state, or the steps to go on with.
    folder
        Base of its relative file names.
    """

    def __init__(self, document: SessionDocument | Steps[SessionDocument], folder: Path = Path()) -> None:
        self.history: Steps[SessionDocument] = History(document) if isinstance(document, SessionDocument) else document
        self.folder = folder
        self._made: dict[tuple[str, bool], tuple[Material, Editable]] = {}  # by name, and whether it is the start

    @classmethod
    def new(
        cls,
        scene: str,
        camera: Camera,
        materials: Mapping[str, Material],
        *,
        size: tuple[int, int] = (512, 512),
        environment: Surroundings | None = None,
    ) -> Session:
        """A new session without edits, of materials by their names in the scene."""
        begun = {name: EditedMaterial(start=material, now=material) for name, material in materials.items()}
        said = {"scene": scene, "camera": camera, "size": size, "environment": environment, "materials": begun}
        try:
            return cls(SessionDocument.model_validate(said))
        except ValidationError as error:
            raise invalid(error, "edit") from error

    @classmethod
    def open(cls, path: Path) -> Session:
        """Read a session; raises the errors of `document.load_document`."""
        return cls(load_document(path), path.parent)

    def save(self, path: Path) -> None:
        """Write the session, atomically, `placed` in its new folder."""
        write_text(path, json.dumps(self.placed(path.parent).model_dump(mode="json"), indent=1) + "\n")

    def placed(self, target: Path) -> SessionDocument:
        """The document with file names relative to the folder `target`, where possible."""
        document = self.document
        changes: dict[str, Any] = {"scene": self._moved(document.scene, target)}
        if document.environment is not None:
            file = self._moved(document.environment.file, target)
            changes["environment"] = document.environment.model_copy(update={"file": file})
        return document.model_copy(update=changes)

    @property
    def document(self) -> SessionDocument:
        """The current state."""
        return self.history.now

    def path(self, place: str) -> Path:
        """The file that a place in the document refers to."""
        return self.folder / place

    @property
    def environment(self) -> ImageEnvironment | None:
        """The image that lights the scene instead of its own environment."""
        said = self.document.environment
        return None if said is None else said.image(self.folder)

    def original(self, material: str) -> Editable:
        """The terms and curves of a material that transport is computed for."""
        return self._terms(material, self.material(material).start, is_start=True)

    def editable(self, material: str) -> Editable:
        """The terms and curves of a material with its edits."""
        return self._terms(material, self.material(material).now, is_start=False)

    def _terms(self, name: str, material: Material, *, is_start: bool) -> Editable:
        made = self._made.get((name, is_start))
        if made is None or made[0] is not material:
            made = self._made[name, is_start] = material, of_material(material)
        return made[1]

    def material(self, name: str) -> EditedMaterial:
        """A material, as baked and as edited."""
        return self.document.materials[known("material", name, self.document.materials)]

    def change(self, name: str, material: Material) -> bool:
        """Change a material; returns whether its transport is still valid."""
        before = self.material(name)
        after = changed(before, material)
        if after != before:
            materials = {**self.document.materials, name: after}
            self.history.change(self.document.model_copy(update={"materials": materials}))
        return after.start is before.start

    def reset(self, name: str) -> None:
        """Restore a material as its transport was computed for."""
        self.change(name, self.material(name).start)

    def merge(self, material: str, other: str) -> None:
        """Give all objects of a material another one; its own edits are dropped. The view needs new transport."""
        self.material(material)
        materials = {name: one for name, one in self.document.materials.items() if name != material}
        known("material", other, materials, field="merged")
        merged = {name: other if into == material else into for name, into in self.document.merged.items()}
        changes = {"materials": materials, "merged": {**merged, material: other}}
        self.history.change(self.document.model_copy(update=changes))

    def undo(self) -> None:
        self.history.undo()

    def redo(self) -> None:
        self.history.redo()

    @contextmanager
    def stroke(self) -> Iterator[None]:
        """Group edits, of several materials too, into one step of undo; if one fails, none of them is kept."""
        self.history.begin_stroke()
        try:
            yield
        except BaseException:
            self.history.restart_stroke()
            raise
        finally:
            self.history.end_stroke()

    def _moved(self, place: str, target: Path) -> str:
        """A place relative to another folder; the name of a built-in scene is unchanged."""
        path = self.path(place)
        if Path(place).is_absolute() or not path.exists():
            return place
        return place_from(target, path)


def with_materials(document: SessionDocument, materials: Mapping[str, Material]) -> SessionDocument:
    """The document with these materials as edited, by name; others stay."""
    now = {
        name: one if (material := materials.get(name, one.now)) == one.now else changed(one, material)
        for name, one in document.materials.items()
    }
    same = all(now[name] is one for name, one in document.materials.items())
    return document if same else document.model_copy(update={"materials": now})


def changed(one: EditedMaterial, material: Material) -> EditedMaterial:
    """A material after an edit. Where that changes a quotient, transport starts from there."""
    serves = one.start is material or same_quotients(of_material(one.start), of_material(material))
    return EditedMaterial(start=one.start if serves else material, now=material)
