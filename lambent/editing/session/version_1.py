"""Sessions of version 1: edits as layers of operators on the curves of a document, a model or a measured table.

An operator translates or amplifies a region of a curve, in x or in y (Ben-Artzi 2007, chapter 9). It has full effect in
[b, c], fades smoothly to none at a and d, and changes nothing outside. Angles are in radians.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationError, model_validator

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError, invalid
from lambent.core.inputs import sha256_of
from lambent.core.plain import triple
from lambent.core.strict import Strict
from lambent.editing.session.as_document import as_document
from lambent.materials.document import Material
from lambent.materials.factored.curve import END_RAD, Curve, angles_rad
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.of_models import editable, same_quotients
from lambent.materials.factored.opening import editable_of
from lambent.materials.factored.terms import Editable
from lambent.materials.models import model_named
from lambent.materials.models.kurt import Kurt
from lambent.materials.models.lambert import Lambert

LARGEST = 1e9  # of a curve: its square still fits float32
Finite = Annotated[float, Field(allow_inf_nan=False)]
Value = Annotated[float, Field(ge=0, le=LARGEST)]


def _spread(value: object) -> object:
    return (value, value, value) if isinstance(value, int | float) else value


RGB = Annotated[tuple[Value, Value, Value], BeforeValidator(_spread)]


class Region(Strict):
    """Where an operator acts: a < b <= c < d. The ends may lie outside the curve."""

    a: Finite
    b: Finite
    c: Finite
    d: Finite

    @model_validator(mode="after")
    def _in_order(self) -> Region:
        if not self.a < self.b <= self.c < self.d:
            raise ValueError(f"a region has a < b <= c < d, not {self.a:g}, {self.b:g}, {self.c:g}, {self.d:g}")
        return self

    def weight(self, x: Floats) -> Floats:
        """Strength (...) of an operator at x: 1 in [b, c], 0 outside (a, d), smooth in between."""
        return smooth_step(np.minimum((x - self.a) / (self.b - self.a), (self.d - x) / (self.d - self.c)))


class Operator(Strict):
    """One edit of a curve.

    translate_y: f(x) + size. amplify_y: base + size (f(x) - base). translate_x: moved by `size` radians to larger
    angles. amplify_x: stretched about the angle `base` by the factor `size`.
    """

    kind: Literal["translate_x", "translate_y", "amplify_x", "amplify_y"]
    region: Region
    size: Finite
    base: Finite = 0.0
    channels: tuple[Literal[0, 1, 2], ...] = (0, 1, 2)

    def applied(self, curve: Curve) -> Curve:
        """The edited curve, clamped at 0."""
        x = angles_rad()
        weight = self.region.weight(x)
        if self.kind == "translate_y":
            edited = curve.values + self.size * weight[:, None]
        elif self.kind == "amplify_y":
            edited = curve.values + (curve.values - self.base) * (self.size - 1) * weight[:, None]
        elif self.kind == "translate_x":
            edited = curve.at(np.clip(x - self.size * weight, 0.0, END_RAD))
        else:
            edited = curve.at(np.clip(x + (x - self.base) * (1 / self.size - 1) * weight, 0.0, END_RAD))
        chosen = np.isin(range(3), self.channels) & (weight > 0)[:, None]
        return Curve(np.clip(np.where(chosen, edited, curve.values), 0.0, LARGEST))


class Drawn(Strict):
    """A curve drawn freehand: linear between points, constant beyond the outermost."""

    angle_rad: Annotated[tuple[Annotated[float, Field(ge=0, le=END_RAD)], ...], Field(min_length=1)]
    values: tuple[RGB, ...]


class CurveEdit(Strict):
    """Edits of one curve: an optional freehand curve, then operators in order."""

    drawn: Drawn | None = None
    layers: tuple[Operator, ...] = ()

    def applied(self, curve: Curve) -> Curve:
        if self.drawn is not None:
            curve = Curve.through(np.array(self.drawn.angle_rad), np.array(self.drawn.values))
        for layer in self.layers:
            curve = layer.applied(curve)
        return curve


class Source(Strict):
    """What a material started as: a document, a model with its parameters, or a measured table."""

    kind: Literal["document", "model", "table"]
    material: Material = Material()
    model: str = ""
    parameters: dict[str, Finite | tuple[Finite, Finite, Finite]] = Field(default_factory=dict)
    file: str = ""
    sha256: str = ""


class Edited(Strict):
    """A material's source, the edits of its curves by name, and the colours that multiply its terms."""

    source: Source
    curves: dict[str, CurveEdit] = Field(default_factory=dict)
    tints: dict[str, RGB] = Field(default_factory=dict)


def upgraded(data: dict[str, Any], path: Path) -> dict[str, Any]:
    """The session of version 1 in the file `path`, as data of the present version.

    Raises
    ------
    UserError
        If materials are invalid, or a measured table is missing or has changed.
    """
    materials = {}
    for name, said in data.get("materials", {}).items():
        try:
            one = Edited.model_validate(said)
            materials[name] = _upgraded(name, one, path)
        except ValidationError as error:
            raise _within(invalid(error, path), name, path) from error
        except UserError as error:
            raise _within(error, name, path) from error
        except (ValueError, ArithmeticError) as error:  # of curves that no operator makes
            raise UserError("the edits leave no finite curve", file=path, field=f"materials.{name}") from error
    return {**data, "version": 2, "materials": materials}


def _within(error: UserError, name: str, path: Path) -> UserError:
    field = f"materials.{name}" + (f".{error.field}" if error.field else "")
    return UserError(
        error.message, file=error.file or path, field=field, got=error.got, expected=error.expected, hint=error.hint
    )


def _upgraded(name: str, one: Edited, path: Path) -> dict[str, Any]:
    document, start = _start(one.source, path.parent)
    if document is None or one.curves or one.tints:
        now = as_document(name, document, start, _with_edits(start, one))
    else:
        now = document
    serves = document is not None and same_quotients(of_material(document), of_material(now))
    return {"start": document if serves else now, "now": now}


def _start(source: Source, folder: Path) -> tuple[Material | None, Editable]:
    """The document that a material started as, None if no document is exactly that, and its curves."""
    if source.kind == "document":
        return source.material, of_material(source.material)
    if source.kind == "model":
        model = model_named(source.model)(**source.parameters)
        exact = None
        if isinstance(model, Kurt):
            exact = Material(lobes=(model.lobe,))
        elif isinstance(model, Lambert):
            exact = Material(kd=triple(model.rgb("kd")))
        return exact, editable(model)
    file = folder / source.file
    if not file.is_file():
        raise UserError("file does not exist", file=file, field="source.file")
    if sha256_of(file) != source.sha256:
        raise UserError("the table has changed since it was edited", file=file, field="source.sha256")
    return None, editable_of(file).editable


def _with_edits(start: Editable, one: Edited) -> Editable:
    for term in one.tints:
        known("term", term, [t.name for t in start.terms], field=f"tints.{term}")
    curves = dict(start.curves)
    for name, edit in one.curves.items():
        known("curve", name, curves, field=f"curves.{name}")
        curves[name] = edit.applied(curves[name])
    scales = (triple(np.multiply(term.scale, one.tints.get(term.name, 1.0))) for term in start.terms)
    terms = tuple(replace(term, scale=scale) for term, scale in zip(start.terms, scales, strict=True))
    return replace(start, terms=terms, curves=curves)


def smooth_step(t: Floats) -> Floats:
    """0 for t <= 0, 1 for t >= 1, in between e(t) / (e(t) + e(1 - t)) with e(t) = exp(-1/(2t)^2): C-infinity."""
    inside = np.clip(t, 1e-3, 1 - 1e-3)  # beyond, the step is 0 or 1 in float64
    difference = 1 / (2 * inside) ** 2 - 1 / (2 * (1 - inside)) ** 2
    step = 1 / (1 + np.exp(np.clip(difference, -700, 700)))
    return np.where(t <= 0, 0.0, np.where(t >= 1, 1.0, step))
