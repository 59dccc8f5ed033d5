"""A view of a store, edited in place: its materials are the room's, in the store's session."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.session.document import SessionDocument, document_from, load_document
from lambent.editing.session.session import Session, with_materials
from lambent.materials.document import Material
from lambent.store.kept.session import FILE, EditedView, WalkSession
from lambent.viewer.edits.edits import MaterialEdits


def kept_view(opened: WalkSession, camera: Camera, place: Path, edits: MaterialEdits) -> SessionDocument | None:
    """The view at a camera as a store's session has it; None without one.

    Its materials are those of the room, but for edits of version 1 that the room did not show yet.

    Raises
    ------
    UserError
        If the view cannot be used.
    """
    edited, file = opened.edited, place / FILE
    there = (one for one in edited.values() if _place(one.document.get("camera")) == _place(asdict(camera)))
    if (said := edited.get(camera.name) or next(there, None)) is None:  # a saved view may have been renamed
        return None
    document = document_from(said.document, file)
    known = {name: one for name, one in document.materials.items() if name in edits.scene}
    document = document.model_copy(update={"scene": str(place.resolve()), "camera": camera, "materials": known})
    unshown = _unshown(document, said, edits) if said.document.get("version") == 1 else {}
    return with_materials(document, {name: edits.current(name) for name in known.keys() - unshown.keys()})


def _unshown(document: SessionDocument, said: EditedView, edits: MaterialEdits) -> Mapping[str, Material]:
    """Materials of a view of version 1 whose edits the room lacks, unless the room's have changed since then."""
    return {
        name: one.now
        for name, one in document.materials.items()
        if name not in said.shown and edits.current(name) == said.room.get(name, edits.scene[name])
    }


def former_view(camera: Camera, place: Path, like: Path) -> tuple[SessionDocument | None, list[str]]:
    """The last of the files `like` NAME-001.edits.json that edits this view of a store, and lines on problems."""
    lines: list[str] = []
    for file in sorted(like.parent.glob(f"{like.name}-*.edits.json"), reverse=True):
        try:
            document = load_document(file)
            if (file.parent / document.scene).resolve() == place.resolve() and document.camera == camera:
                found = Session(document, file.parent).placed(place)
                lines.append(f"the edits of {file.name} are in the store's session from now on")
                return found.model_copy(update={"scene": str(place.resolve())}), lines
        except UserError as error:
            lines.append(f"not taken into the store's session: {error}")
    return None, lines


def _place(camera: object) -> object:
    """A camera of a document without its name."""
    numbers = (
        ((k, tuple(v) if isinstance(v, list) else v) for k, v in camera.items()) if isinstance(camera, dict) else ()
    )
    return {name: value for name, value in numbers if name != "name"}
