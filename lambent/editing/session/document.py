"""The session document: a JSON file with a view and its materials, as baked and as edited.

File names are absolute or relative to the document's folder. Files of version 1, whose edits were layers of curves, are
read by `session.version_1`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError, model_validator

from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.inputs import parse_json, read_bytes
from lambent.core.strict import Strict
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.sky.triangle_lights import FEWEST, MOST
from lambent.store.consistency import is_usable
from lambent.store.kept.session import FORMAT as STORES
from lambent.store.kept.session import Place, Surroundings, session_from

FORMAT: Literal["lambent-edit-session"] = "lambent-edit-session"
LIMIT_BYTES = 256 << 20
VERSION: Literal[2] = 2
MOST_MATERIALS = 1000
MOST_PIXELS = 1 << 26

Name = Annotated[str, Field(min_length=1, max_length=200)]


class EditedMaterial(Strict):
    """A material: `start`, which transport is computed for, and `now`, as edited."""

    start: Material
    now: Material


class SessionDocument(Strict):
    """A whole session.

    Attributes
    ----------
    scene
        Folder of a store, file of a scene, or name of a built-in one.
    size
        Width and height of the picture in pixels.
    lights
        Number of triangles that the environment is divided into.
    merged
        Replaced materials: name of the replacement, by material.
    crease_deg
        Angle in degrees above which edges of the scene's meshes are sharp; None to use the normals of its files.
    """

    format: Literal["lambent-edit-session"] = FORMAT
    version: Literal[2] = VERSION
    scene: Place
    camera: Camera
    size: tuple[Annotated[int, Field(ge=1)], Annotated[int, Field(ge=1)]] = (512, 512)
    environment: Surroundings | None = None
    lights: Annotated[int, Field(ge=FEWEST, le=MOST)] = 400
    materials: dict[Name, EditedMaterial] = Field(default_factory=dict, max_length=MOST_MATERIALS)
    merged: dict[Name, Name] = Field(default_factory=dict, max_length=MOST_MATERIALS)
    crease_deg: Annotated[float, Field(ge=0, le=180)] | None = None

    @model_validator(mode="after")
    def _can_be_drawn(self) -> SessionDocument:
        if not is_usable(self.camera):
            raise ValueError("the camera is not within 1e9 m, or sees no angle")
        if self.size[0] * self.size[1] > MOST_PIXELS:
            raise ValueError(f"a picture has at most {MOST_PIXELS} pixels, not {self.size[0]} x {self.size[1]}")
        for name in self.merged:
            if name in self.materials or name in self.merged.values():
                raise ValueError(f"{name!r} is merged with another material, and has no edits or parts of its own")
        return self


def load_document(path: Path) -> SessionDocument:
    """Read a session document, or that of a view of a store's session: STORE/session.json, or session.json:CAMERA.

    Raises
    ------
    UserError
        If the file is not JSON, not a session, of another version, too large, or has an unknown or invalid field.
    """
    named = not path.exists() and ":" in path.name
    file, view = (path.with_name(path.name.rpartition(":")[0]), path.name.rpartition(":")[2]) if named else (path, None)
    data = parse_json(read_bytes(file, LIMIT_BYTES), file)
    if not (isinstance(data, dict) and data.get("format") == STORES):
        return document_from(data, path)
    edited = session_from(data, file).edited
    if view is None and len(edited) != 1:
        raise UserError(
            "which edited view?", file=file, got=", ".join(edited) or "none", expected=f"{file.name}:CAMERA"
        )
    name = next(iter(edited)) if view is None else known("view", view, edited)
    return document_from(edited[name].document, file)


def document_from(data: Any, path: Path) -> SessionDocument:
    """The session of a parsed document; errors, which are those of `load_document`, name `path`."""
    from lambent.editing.session.version_1 import upgraded

    if not isinstance(data, dict) or "format" not in data:
        raise UserError("not a session of edits", file=path, expected="an object with a format")
    version = data.get("version", VERSION)
    if version not in (1, VERSION):
        hint = "use the Lambent that wrote it, or a later one"
        raise UserError(
            "unsupported session version", file=path, field="version", got=version, expected=VERSION, hint=hint
        )
    if version == 1:
        said = data.get("materials", {})
        rest = {name: {"start": {}, "now": {}} for name in said} if isinstance(said, dict) else said
        _validated({**data, "version": VERSION, "materials": rest}, path)  # before lobes are fitted to curves
        data = upgraded(data, path)
    return _validated(data, path)


def _validated(data: dict[str, Any], path: Path) -> SessionDocument:
    try:
        return SessionDocument.model_validate(data)
    except ValidationError as error:
        fields = [field for kind in (SessionDocument, Surroundings, EditedMaterial) for field in kind.model_fields]
        raise invalid(error, path, fields) from error
