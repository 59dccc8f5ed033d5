"""A session: the materials of one view during editing, with undo, and its file format.

session = Session.new("room", camera, {"teapot": material})
session.pull("teapot", "highlight", Region(a=0, b=0.1, c=0.2, d=0.4), y=2.0)
session.editable("teapot")                       # terms and curves to draw
session.save(Path("teapot.edits.json"))
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ValidationError

from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.files import write_text
from lambent.core.inputs import sha256_of
from lambent.core.plain import Triple, triple
from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Operator, Region, room_for, translation
from lambent.editing.session.document import (
    LARGEST,
    CurveEdit,
    Drawn,
    EditedMaterial,
    OfDocument,
    OfModel,
    OfTable,
    SessionDocument,
    Surroundings,
    load_document,
)  # fmt: skip
from lambent.editing.session.history import History
from lambent.materials.document import Material
from lambent.materials.factored.curve import Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable, same_quotients
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.terms import Editable
from lambent.materials.models import model_named
from lambent.materials.models.model import Model
from lambent.scenes.scene import ImageEnvironment

Factorise = Callable[[Path], Editable]
Start = Material | Model | Path  # a material document, a model with its parameters, or a table to factorise
ALL: tuple[Literal[0, 1, 2], ...] = (0, 1, 2)


def _curves_of(file: Path) -> Editable:
    return editable_of(file).editable


class Session:
    """Edits of the materials of one view.

    Every editing method is one step of undo, or a part of the open stroke. Unknown names of materials, curves, terms
    and parameters raise `UserError`, as do edits that no curve can follow.

    Parameters
    ----------
    document
        The initial state.
    folder
        Base of its relative file names.
    factorise
        Converts a table's file to terms and curves; by default `editable_of`.
    """

    def __init__(self, document: SessionDocument, folder: Path = Path(), factorise: Factorise | None = None) -> None:
        self.history = History(document)
        self.folder = folder
        self._factorise = factorise or _curves_of
        self._originals: dict[str, tuple[BaseModel, Editable]] = {}

    @classmethod
    def new(
        cls,
        scene: str,
        camera: Camera,
        materials: Mapping[str, Start],
        *,
        size: tuple[int, int] = (512, 512),
        environment: Surroundings | None = None,
        factorise: Factorise | None = None,
    ) -> Session:
        """A new session without edits, of materials by their names in the scene."""
        sources = {name: EditedMaterial(source=_source(start)) for name, start in materials.items()}
        made = _checked(
            SessionDocument, scene=scene, camera=camera, size=size, environment=environment, materials=sources
        )
        return cls(made, factorise=factorise)

    @classmethod
    def open(cls, path: Path, factorise: Factorise | None = None) -> Session:
        """Read a session, and create the curves of all its materials, so that nothing fails later.

        Raises
        ------
        UserError
            If the document is unusable (`document.load_document`), names curves, terms or parameters that its materials
            do not have, or a table that is missing or has changed.
        """
        return cls.of(load_document(path), path, factorise)

    @classmethod
    def of(cls, document: SessionDocument, path: Path, factorise: Factorise | None = None) -> Session:
        """A session of a document in the file `path`, with all curves; raises as `open`."""
        session = cls(document, path.parent, factorise)
        for name in session.document.materials:
            try:
                session.editable(name)
            except UserError as error:
                field = f"materials.{name}" + (f".{error.field}" if error.field else "")
                raise UserError(
                    error.message, file=error.file or path, field=field, got=error.got, expected=error.expected,
                    hint=error.hint,
                ) from error  # fmt: skip
        return session

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
        changes["materials"] = {name: self._moved_source(one, target) for name, one in document.materials.items()}
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
        if said is None:
            return None
        return ImageEnvironment(self.path(said.file).resolve(), **said.model_dump(exclude={"file"}))

    def original(self, material: str) -> Editable:
        """The terms and curves of a material before its edits."""
        source = self._material(material).source
        made = self._originals.get(material)
        if made is None or made[0] != source:
            made = self._originals[material] = source, self._made(source)
        return made[1]

    def editable(self, material: str) -> Editable:
        """The terms and curves of a material with its edits."""
        one, start = self._material(material), self.original(material)
        for term in one.tints:
            known("term", term, [t.name for t in start.terms], field=f"tints.{term}")
        curves = dict(start.curves)
        for name, edit in one.curves.items():
            known("curve", name, curves, field=f"curves.{name}")
            curves[name] = _edited(curves[name], edit, f"curves.{name}")
        tinted = ((term, triple(np.multiply(term.scale, one.tints.get(term.name, 1.0)))) for term in start.terms)
        terms = tuple(replace(term, scale=scale) for term, scale in tinted)
        return Editable(start.name, terms, curves, start.fixed)

    def pull(
        self,
        material: str,
        curve: str,
        region: Region,
        x: float = 0.0,
        y: float = 0.0,
        channels: tuple[Literal[0, 1, 2], ...] = ALL,
    ) -> None:
        """Drag a region of a curve by x radians and y; ramps widen where the curve would fold over."""
        self.apply(material, curve, *_made(translation, room_for(region, x), x, y, channels))

    def apply(self, material: str, curve: str, *operators: Operator) -> None:
        """Add operators on top of a curve's layers."""
        edit = self._curve(material, curve)
        self._change_curve(material, curve, layers=(*edit.layers, *operators))

    def remove(self, material: str, curve: str, layer: int) -> None:
        """Remove one layer (0 is the lowest)."""
        layers = self._curve(material, curve).layers
        if not 0 <= layer < len(layers):
            raise UserError("layer index out of range", field=curve, got=layer, expected=f"0 to {len(layers) - 1}")
        self._change_curve(material, curve, layers=layers[:layer] + layers[layer + 1 :])

    def draw(self, material: str, curve: str, drawn: Curve | Drawn) -> None:
        """Replace a curve by a freehand one; its layers are removed."""
        self._curve(material, curve)
        self._change_curve(
            material, curve, drawn=drawn if isinstance(drawn, Drawn) else _made(Drawn.of, drawn), layers=()
        )

    def collapse(self, material: str, curve: str) -> None:
        """Flatten a curve and its layers to one freehand curve, which parameters no longer change."""
        if self._curve(material, curve).layers:
            self.draw(material, curve, self.editable(material).curves[curve])

    def set(self, material: str, **parameters: object) -> bool:
        """Set parameters of a material that started as a model; returns the result of `become`."""
        source = self._material(material).source
        if not isinstance(source, OfModel):
            raise UserError("has no parameters", field=material, got=f"a {source.kind}", expected="a model")
        return self.become(material, model_named(source.model)(**{**source.parameters, **parameters}))

    def become(self, material: str, start: Start) -> bool:
        """Change the source of a material: a document with other numbers, a model, or a table.

        Edits of curves and terms that both sources have are kept; the others are dropped. Returns whether transport
        computed for the previous material is still valid (`same_quotients`).
        """
        before, one = self.original(material), self._material(material)
        after = self._made(source := _source(start))
        curves = {name: edit for name, edit in one.curves.items() if name in after.curves}
        names = {term.name for term in after.terms}
        tints = {name: tint for name, tint in one.tints.items() if name in names}
        self._change(material, EditedMaterial(source=source, curves=curves, tints=tints))
        self._originals[material] = source, after
        return same_quotients(before, after)

    def tint(self, material: str, term: str, colour: float | Triple) -> None:
        """Multiply a term by a colour, replacing its previous tint; (1, 1, 1) is the original."""
        one = self._material(material)
        known("term", term, [t.name for t in self.original(material).terms])
        checked = _checked(EditedMaterial, source=one.source, tints={term: colour})
        self._change(material, one.model_copy(update={"tints": {**one.tints, **checked.tints}}))

    def reset(self, material: str, curve: str | None = None) -> None:
        """Drop the edits of a curve, or of all curves and terms of a material."""
        one = self._material(material)
        if curve is None:
            self._change(material, EditedMaterial(source=one.source))
        else:
            self._curve(material, curve)
            self._change_curve(material, curve, drawn=None, layers=())

    def merge(self, material: str, other: str) -> None:
        """Give all objects of a material another one; its own edits are dropped. The view needs new transport."""
        self._material(material)
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

    def _material(self, name: str) -> EditedMaterial:
        return self.document.materials[known("material", name, self.document.materials)]

    def _curve(self, material: str, curve: str) -> CurveEdit:
        known("curve", curve, self.original(material).curves)
        return self._material(material).curves.get(curve, CurveEdit())

    def _change_curve(self, material: str, curve: str, **changes: Any) -> None:
        one = self._material(material)
        fields = {"drawn": self._curve(material, curve).drawn, **changes}
        edit = _checked(CurveEdit, **fields)
        _edited(self.original(material).curves[curve], edit, f"curves.{curve}")
        curves = {**one.curves, curve: edit}
        if edit == CurveEdit():
            del curves[curve]
        self._change(material, one.model_copy(update={"curves": curves}))

    def _change(self, name: str, one: EditedMaterial) -> None:
        materials = {**self.document.materials, name: one}
        self.history.change(self.document.model_copy(update={"materials": materials}))

    def _made(self, source: OfDocument | OfModel | OfTable) -> Editable:
        if isinstance(source, OfDocument):
            return of_material(source.material)
        if isinstance(source, OfModel):
            return editable(model_named(source.model)(**source.parameters))
        file = self.path(source.file)
        if not file.is_file():
            raise UserError("file does not exist", file=file, field="source.file")
        if sha256_of(file) != source.sha256:
            raise UserError("the table has changed since it was edited", file=file, field="source.sha256")
        return self._factorise(file)

    def _moved(self, place: str, target: Path) -> str:
        """A place relative to another folder; the name of a built-in scene is unchanged."""
        path = self.path(place)
        if Path(place).is_absolute() or not path.exists():
            return place
        try:
            return Path(os.path.relpath(path.resolve(), target.resolve())).as_posix()
        except ValueError:  # another drive on Windows
            return str(path.resolve())

    def _moved_source(self, one: EditedMaterial, target: Path) -> EditedMaterial:
        if not isinstance(one.source, OfTable):
            return one
        source = one.source.model_copy(update={"file": self._moved(one.source.file, target)})
        return one.model_copy(update={"source": source})


def _source(start: Start) -> OfDocument | OfModel | OfTable:
    if isinstance(start, Material):
        return OfDocument(material=start)
    made: OfModel | OfTable
    if isinstance(start, Model):
        made = _checked(OfModel, model=start.name, parameters=start.values)
        return made
    if not start.is_file():
        raise UserError("file does not exist", file=start, expected="a measured table")
    made = _checked(OfTable, file=str(start.resolve()), sha256=sha256_of(start))
    return made


def _edited(curve: Curve, edit: CurveEdit, field: str) -> Curve:
    """The curve with its edit; intermediate steps are cached, so that a drag computes only its own layer."""
    if edit.drawn is not None:
        curve = _drawn(edit.drawn)
    try:
        for layer in edit.layers:
            curve = _step(curve, layer)
    except (ValueError, FloatingPointError) as error:
        raise UserError("the edit leaves no finite curve", field=field) from error
    if curve.values.max() > LARGEST:
        raise UserError("the edited curve is too large", field=field, got=curve.values.max(), expected=f"{LARGEST:g}")
    return curve


@lru_cache(maxsize=256)
def _step(curve: Curve, layer: Operator) -> Curve:
    with np.errstate(over="raise", invalid="raise"):
        return layer.applied(curve)


@lru_cache(maxsize=64)
def _drawn(drawn: Drawn) -> Curve:
    return drawn.curve


def _made(make: Callable[..., Any], *arguments: Any) -> Any:
    """`make(...)`; pydantic's errors become `UserError`."""
    try:
        return make(*arguments)
    except ValidationError as error:
        raise invalid(error, "edit") from error


def _checked(kind: Any, **fields: Any) -> Any:
    return _made(lambda: kind(**fields))
