"""The material of the selected object: every number of its document, at once on the screen."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.materials.document import Lobe, Material
from lambent.materials.models.kurt import Kurt
from lambent.materials.models.model import Parameter, Value
from lambent.viewer.panels.widgets import explain, rgb, slider
from lambent.viewer.state import ViewerState

TITLE = "Material"
LISTED = 7
LOBE = {parameter.name: parameter for parameter in Kurt.parameters}
DIFFUSE = {"kd": "diffuse reflectance", "kt_d": "diffuse transmittance"}


def draw(state: ViewerState) -> None:
    _objects(state)
    name = state.selected_material
    if name is None:
        imgui.text_wrapped("Click an object in the picture or in the list.")
        return
    material = state.edits.current(name)
    imgui.separator_text(f"{state.selected}: {name}")
    edited = _edited(state, material)
    if edited != material:
        state.edits.change(name, edited)
    elif not imgui.is_any_item_active():
        state.edits.end_stroke()
    _history(state, name)
    _save(state, name)


def _objects(state: ViewerState) -> None:
    objects = state.scene.objects
    imgui.begin_child("objects", (0, min(len(objects), LISTED) * imgui.get_text_line_height_with_spacing()))
    for index, item in enumerate(objects):
        if imgui.selectable(f"{item.name}##{index}", item.name == state.selected)[0]:
            state.selected = item.name
        if item.name == state.selected and state.reveal_selected:
            imgui.set_scroll_here_y()
            state.reveal_selected = False
        imgui.same_line(0.5 * imgui.get_content_region_avail().x)
        imgui.text_disabled(item.material)
    imgui.end_child()


def _edited(state: ViewerState, material: Material) -> Material:
    changes: dict[str, object] = {}
    for name in ("kd", "kt_d") if any(material.kt_d) else ("kd",):
        changes[name] = rgb(name, getattr(material, name), 1.0, DIFFUSE[name])
    if material.lobes:
        _, state.linked_roughness = imgui.checkbox("keep the ratio of mx and my", state.linked_roughness)
    changes["lobes"] = tuple(_lobe(state, index, lobe) for index, lobe in enumerate(material.lobes))
    return material.model_copy(update=changes)


def _lobe(state: ViewerState, index: int, lobe: Lobe) -> Lobe:
    imgui.push_id(index)
    imgui.separator_text(f"lobe {index + 1}: {lobe.side}, {lobe.distribution}")
    edited = lobe.model_copy(update={name: _parameter(parameter, lobe) for name, parameter in LOBE.items()})
    imgui.pop_id()
    return _linked(lobe, edited) if state.linked_roughness else edited


def _parameter(parameter: Parameter, lobe: Lobe) -> Value:
    """Its control, with the range, scale and unit that the model gives it."""
    value = getattr(lobe, parameter.name)
    meaning = parameter.meaning if parameter.unit == "1" else f"{parameter.meaning} ({parameter.unit})"
    if parameter.rgb:
        return rgb(parameter.name, value, max(parameter.high, *value), meaning)
    low, high = min(parameter.low, value), max(parameter.high, value)
    value = slider(parameter.name, value, low, high, log=parameter.scale == "log")
    explain(meaning)
    return value


def _linked(before: Lobe, after: Lobe) -> Lobe:
    """Both roughnesses scaled as the one that was moved."""
    if (before.mx, before.my) == (after.mx, after.my):
        return after
    scale = after.mx / before.mx if after.mx != before.mx else after.my / before.my
    low, high = LOBE["mx"].low, LOBE["mx"].high
    mx, my = (min(max(m * scale, low), high) for m in (before.mx, before.my))
    return after.model_copy(update={"mx": mx, "my": my})


def _history(state: ViewerState, name: str) -> None:
    imgui.separator()
    edits = state.edits
    for label, possible, act in (
        ("undo", edits.can_undo, edits.undo),
        ("redo", edits.can_redo, edits.redo),
        ("reset", name in edits.edited, lambda: edits.reset(name)),
    ):
        imgui.begin_disabled(not possible)
        if imgui.button(label):
            act()
        imgui.end_disabled()
        imgui.same_line()
    imgui.new_line()


def _save(state: ViewerState, name: str) -> None:
    imgui.set_next_item_width(-64)
    changed, file_name = imgui.input_text("##file", state.file_name(name))
    if changed:
        state.file_names[name] = file_name
    imgui.same_line()
    if imgui.button("save", (-1, 0)):
        state.save_material(name)
