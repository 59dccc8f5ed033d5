"""The colours of a material's terms, and the parameters of its original document or model."""

from __future__ import annotations

from functools import partial
from typing import Any

from imgui_bundle import imgui

from lambent.core.plain import triple
from lambent.editing.session.document import OfDocument, OfModel, OfTable
from lambent.editing.session.session import Session
from lambent.materials.models.model import Parameter
from lambent.viewer.modes.edit.curves.state import CurveState, Shown
from lambent.viewer.panels import parameters
from lambent.viewer.panels.widgets import rgb, slider, wrapped

MOST_TINT = 2.0
LABEL_PX = 88.0
NO_TRANSPORT = "The material's parameters have changed: its transport must be baked again."


def draw_tints(state: CurveState, session: Session, material: str, shown: Shown) -> None:
    """Draw the colour that multiplies each term."""
    longest = max((imgui.calc_text_size(term.name).x for term in shown.original.terms), default=0.0)
    labels = min(longest + 2 * imgui.get_style().item_spacing.x, 0.5 * imgui.get_content_region_avail().x)
    imgui.push_item_width(-max(labels, LABEL_PX))
    for term in shown.original.terms:
        tint = triple(shown.document.tints.get(term.name, (1.0, 1.0, 1.0)))
        meaning = f"linear colour that multiplies the term {term.name}; 1, 1, 1 leaves it unchanged"
        changed = rgb(term.name, tint, max(MOST_TINT, *tint), meaning)
        if changed != tint:
            state.strokes.replace(session, partial(session.tint, material, term.name, changed))
    imgui.pop_item_width()


def draw_numbers(state: CurveState, session: Session, material: str, shown: Shown) -> None:
    """Draw the parameters of a model or document; a measured table has none."""
    source = shown.document.source
    if not shown.serves:
        wrapped([NO_TRANSPORT])
    if isinstance(source, OfModel):
        _model(state, session, material, shown)
    elif isinstance(source, OfDocument):
        changed, state.linked_roughness = parameters.edited(source.material, state.linked_roughness)
        if changed != source.material:
            state.strokes.replace(session, partial(session.become, material, changed))


def title(shown: Shown) -> str | None:
    """Title above the parameters; None without parameters."""
    source = shown.document.source
    if isinstance(source, OfTable):
        return None
    return f"model {shown.original.name}" if isinstance(source, OfModel) else "material document"


def _model(state: CurveState, session: Session, material: str, shown: Shown) -> None:
    model = shown.model
    assert model is not None, "a material that begins as a model has one"
    for parameter in model.parameters:
        value = model.values[parameter.name]
        changed = _parameter(parameter, value)
        if changed != value:
            state.strokes.replace(session, partial(session.set, material, **{parameter.name: changed}))


def _parameter(parameter: Parameter, value: Any) -> Any:
    unit = "" if parameter.unit == "1" else f" ({parameter.unit})"
    if parameter.rgb:
        return rgb(parameter.name, value, parameter.high, parameter.meaning + unit)
    low, high, meaning = parameter.low, parameter.high, parameter.meaning + unit
    return slider(parameter.name, value, low, high, meaning, log=parameter.scale == "log")
