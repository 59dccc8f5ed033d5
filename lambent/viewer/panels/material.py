"""The material of the selected object: every number of its document, at once on the screen."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.materials.document import Lobe, Material
from lambent.viewer.panels.widgets import explain, rgb, slider
from lambent.viewer.state import ViewerState

TITLE = "Material"
LISTED = 7
MEANING = {
    "kd": "diffuse reflectance",
    "kt_d": "diffuse transmittance",
    "k": "scale of the lobe",
    "r0": "reflectance at normal incidence (Fresnel)",
    "mx": "slope roughness along the brushing direction t",
    "my": "slope roughness across it, along b",
    "alpha": "exponent of the cosine product: 0 darkens towards grazing angles, 1 brightens",
}


def draw(state: ViewerState) -> None:
    _objects(state)
    name = state.selected_material
    if name is None:
        imgui.text_wrapped("Click an object in the picture or in the list.")
        return
    material = state.edits.current(name)
    imgui.separator_text(name)
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
        imgui.same_line(0.5 * imgui.get_content_region_avail().x)
        imgui.text_disabled(item.material)
    imgui.end_child()


def _edited(state: ViewerState, material: Material) -> Material:
    changes: dict[str, object] = {"kd": rgb("kd", material.kd, 1.0)}
    explain(MEANING["kd"])
    if any(material.kt_d):
        changes["kt_d"] = rgb("kt_d", material.kt_d, 1.0)
        explain(MEANING["kt_d"])
    if material.lobes:
        _, state.linked_roughness = imgui.checkbox("keep the ratio of mx and my", state.linked_roughness)
    changes["lobes"] = tuple(_lobe(state, index, lobe) for index, lobe in enumerate(material.lobes))
    return material.model_copy(update=changes)


def _lobe(state: ViewerState, index: int, lobe: Lobe) -> Lobe:
    imgui.push_id(index)
    imgui.separator_text(f"lobe {index + 1}: {lobe.side}, {lobe.distribution}")
    k = rgb("k", lobe.k, max(1.0, *(1.5 * v for v in lobe.k)))
    explain(MEANING["k"])
    r0 = rgb("r0", lobe.r0, 1.0)
    explain(MEANING["r0"])
    mx, my = _roughness(lobe, state.linked_roughness)
    alpha = slider("alpha", lobe.alpha, *RANGES["alpha"])
    explain(MEANING["alpha"])
    imgui.pop_id()
    return lobe.model_copy(update={"k": k, "r0": r0, "mx": mx, "my": my, "alpha": alpha})


def _roughness(lobe: Lobe, linked: bool) -> tuple[float, float]:
    low, high = RANGES["mx"]
    mx = slider("mx", lobe.mx, low, high, log=True)
    explain(MEANING["mx"])
    my = slider("my", lobe.my, low, high, log=True)
    explain(MEANING["my"])
    if linked and (mx, my) != (lobe.mx, lobe.my):
        scale = mx / lobe.mx if mx != lobe.mx else my / lobe.my
        mx, my = (min(max(m * scale, low), high) for m in (lobe.mx, lobe.my))
    return mx, my


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


def _range(field: str) -> tuple[float, float]:
    """Least and greatest value the document allows."""
    limits = {type(rule).__name__: rule for rule in Lobe.model_fields[field].metadata}
    return limits["Ge"].ge, limits["Le"].le


RANGES = {field: _range(field) for field in ("mx", "my", "alpha")}
