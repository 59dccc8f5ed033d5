"""The session document: a JSON file with a view and all edits of its materials.

Angles are in radians, colours linear Rec.709. File names are absolute or relative to the document's folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.inputs import parse_json, read_bytes
from lambent.core.strict import Strict
from lambent.core.surroundings import Axis, Layout
from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Operator, Region
from lambent.materials.document import Material
from lambent.materials.factored.curve import END_RAD, KNOTS, Curve, angles_rad
from lambent.scenes.sky.triangle_lights import FEWEST, MOST
from lambent.store.consistency import is_usable
from lambent.store.kept.session import FORMAT as STORES
from lambent.store.kept.session import session_from

LIMIT_BYTES, VERSION = 256 << 20, 1
MOST_MATERIALS, MOST_LAYERS, MOST_PARAMETERS = 1000, 4096, 100
MOST_PIXELS = 1 << 26
LARGEST = 1e9  # limit for curves and colours: its square still fits float32

Name = Annotated[str, Field(min_length=1, max_length=200)]
Place = Annotated[str, Field(min_length=1, max_length=4096, pattern=r"^[^\x00]*$")]
Value = Annotated[float, Field(ge=0, le=LARGEST)]
Number = Annotated[float, Field(allow_inf_nan=False)]


def _spread(value: object) -> object:
    return (value, value, value) if isinstance(value, int | float) else value


RGB = Annotated[tuple[Value, Value, Value], BeforeValidator(_spread)]


class OfDocument(Strict):
    """A material that starts as a material document."""

    kind: Literal["document"] = "document"
    material: Material


class OfModel(Strict):
    """A material that starts as a model with its parameters."""

    kind: Literal["model"] = "model"
    model: Name
    parameters: dict[Name, Number | tuple[Number, Number, Number]] = Field(
        default_factory=dict, max_length=MOST_PARAMETERS
    )


class OfTable(Strict):
    """A material that starts as the factors of a measured table, or of a file of factors."""

    kind: Literal["table"] = "table"
    file: Place
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


Source = Annotated[OfDocument | OfModel | OfTable, Field(discriminator="kind")]


class Drawn(Strict):
    """A curve drawn freehand: linear between points, constant beyond the outermost."""

    angle_rad: Annotated[tuple[Annotated[float, Field(ge=0, le=END_RAD)], ...], Field(max_length=KNOTS + 1)]
    values: Annotated[tuple[RGB, ...], Field(max_length=KNOTS + 1)]

    @model_validator(mode="after")
    def _is_a_function(self) -> Drawn:
        if not 1 <= len(self.angle_rad) == len(self.values):
            raise ValueError(f"a drawn curve has one value per angle, not {len(self.values)} for {len(self.angle_rad)}")
        if np.any(np.diff(self.angle_rad) <= 0):
            raise ValueError("the angles of a drawn curve increase")
        return self

    @classmethod
    def of(cls, curve: Curve) -> Drawn:
        """All knots of a curve."""
        return cls(angle_rad=tuple(angles_rad().tolist()), values=tuple(map(tuple, curve.values.tolist())))

    @property
    def curve(self) -> Curve:
        return Curve.through(np.array(self.angle_rad), np.array(self.values))


class CurveEdit(Strict):
    """Edits of one curve: an optional freehand curve, then operators in order."""

    drawn: Drawn | None = None
    layers: Annotated[tuple[Operator, ...], Field(max_length=MOST_LAYERS)] = ()


class EditedMaterial(Strict):
    """A material's source, the edits of its curves by name, and the colours that multiply its terms."""

    source: Source
    curves: dict[Name, CurveEdit] = Field(default_factory=dict, max_length=MOST_PARAMETERS)
    tints: dict[Name, RGB] = Field(default_factory=dict, max_length=MOST_PARAMETERS)


class Surroundings(Strict):
    """An image that lights the scene instead of its own environment; fields as in `scenes.ImageEnvironment`."""

    file: Place
    scale: Annotated[float, Field(gt=0, le=LARGEST)] = 1.0
    rotation_deg: Number = 0.0
    layout: Layout | None = None
    up: Axis = "+y"


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

    format: Literal["lambent-edit-session"] = "lambent-edit-session"
    version: Literal[1] = 1
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
    if not isinstance(data, dict) or "format" not in data:
        raise UserError("not a session of edits", file=path, expected="an object with a format")
    if (version := data.get("version", VERSION)) != VERSION:
        hint = "use the Lambent that wrote it, or a later one"
        raise UserError(
            "unsupported session version", file=path, field="version", got=version, expected=VERSION, hint=hint
        )
    try:
        return SessionDocument.model_validate(data)
    except ValidationError as error:
        kinds = (SessionDocument, Surroundings, EditedMaterial, CurveEdit, Drawn, Operator, Region, OfModel, OfTable)
        raise invalid(error, path, [field for kind in kinds for field in kind.model_fields]) from error
