"""The list of layers of a curve's edit: descriptions, sizes, removal, merging, reset."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from imgui_bundle import imgui

from lambent.editing.curves.operators import Operator, Region
from lambent.editing.session.document import LARGEST
from lambent.editing.session.session import Session
from lambent.viewer.modes.edit.curves.drags import STRETCH, resized
from lambent.viewer.modes.edit.curves.regions import edges_deg
from lambent.viewer.modes.edit.curves.state import ALL, CurveState, Shown
from lambent.viewer.panels.widgets import buttons, explain

MOST_ROWS = 6
LETTERS = "RGB"


def words(layer: Operator) -> str:
    """Description of an operator, without its region."""
    size, base = layer.size, layer.base
    if layer.kind == "translate_x":
        return f"x {np.degrees(size):+.2f}°"
    if layer.kind == "translate_y":
        return f"y {size:+.4g}"
    about = f"{np.degrees(base):.1f}°" if layer.kind == "amplify_x" else f"{base:.4g}"
    return f"{layer.kind[-1]} × {size:.4g}" + (f" about {about}" if base else "")


def where(layer: Operator) -> str:
    """Description of a layer's region and channels."""
    _, b, c, _ = edges_deg(layer.region)
    channels = "" if layer.channels == ALL else " " + "".join(LETTERS[k] for k in sorted(layer.channels))
    return f"{b:.1f}..{c:.1f}°{channels}"


def draw(state: CurveState, session: Session, material: str, shown: Shown, name: str) -> Region | None:
    """Draw the list; return the region of the layer under the mouse."""
    edit = shown.edit(name)
    under = _list(state, session, material, name, edit.layers, edit.drawn is not None)
    edited = edit.drawn is not None or bool(edit.layers)
    once, any_edit = partial(state.strokes.once, session), bool(shown.document.curves or shown.document.tints)
    actions: list[tuple[str, bool, Callable[[], None], str]] = [
        ("collapse", bool(edit.layers), partial(once, partial(session.collapse, material, name)),
         "merges all layers into one drawn curve, which numbers no longer change"),
        ("reset curve", edited, partial(once, partial(session.reset, material, name)),
         "removes all edits of this curve; undo restores them"),
        ("reset material", any_edit, partial(once, partial(session.reset, material)),
         "removes the edits of all curves and colours of this material; undo restores them"),
    ]  # fmt: skip
    room, space = imgui.get_content_region_avail().x, imgui.get_style().item_spacing.x
    buttons(actions, (room - (len(actions) - 1) * space) / len(actions))
    return under


def _list(
    state: CurveState, session: Session, material: str, name: str, layers: tuple[Operator, ...], drawn: bool
) -> Region | None:
    under: Region | None = None
    count = len(layers) + drawn
    if not count:
        imgui.text_disabled("no layers: drag the curve in its region")
        return None
    line = imgui.get_frame_height() + 2 * imgui.get_style().cell_padding.y
    flags = imgui.TableFlags_.row_bg | imgui.TableFlags_.scroll_y | imgui.TableFlags_.sizing_stretch_prop
    if not imgui.begin_table("layers", 4, flags, (0, line * min(count, MOST_ROWS) + 2)):
        return None
    imgui.table_setup_column("number", imgui.TableColumnFlags_.width_fixed, imgui.get_frame_height())
    for title, share in (("size", 0.5), ("where", 0.5)):
        imgui.table_setup_column(title, imgui.TableColumnFlags_.width_stretch, share)
    imgui.table_setup_column("out", imgui.TableColumnFlags_.width_fixed, imgui.get_frame_height())
    for index in reversed(range(len(layers))):  # the last one acts on the others and is listed first
        layer = layers[index]
        imgui.table_next_row()
        imgui.table_next_column()
        across = imgui.SelectableFlags_.span_all_columns | imgui.SelectableFlags_.allow_overlap
        imgui.align_text_to_frame_padding()
        if imgui.selectable(f"{index + 1}##layer {index}", False, across, (0, imgui.get_frame_height()))[0]:
            state.views[material, name].region = layer.region
        if imgui.is_item_hovered():
            under = layer.region
        explain(f"{layer.kind.replace('_', ' in ')}: {words(layer)}, {where(layer)}\nclick to select its region")
        imgui.table_next_column()
        size = _size(f"##size {index}", layer, 0.002 * state.views[material, name].y.high)
        if size != layer.size:
            state.strokes.replace(session, partial(resize, session, material, name, index, size))
        imgui.table_next_column()
        imgui.align_text_to_frame_padding()
        imgui.text_disabled(where(layer))
        imgui.table_next_column()
        if imgui.small_button(f"x##layer {index}"):
            state.strokes.once(session, partial(session.remove, material, name, index))
        explain("removes this layer; the layers above it stay")
    if drawn:
        imgui.table_next_row()
        imgui.table_next_column()
        imgui.table_next_column()
        imgui.align_text_to_frame_padding()
        imgui.text_unformatted("drawn curve")
        explain("drawn freehand, or collapsed from layers; 'reset curve' removes it")
    imgui.end_table()
    return under


def resize(session: Session, material: str, curve: str, index: int, size: float) -> None:
    """Change the size of a layer; layers above it stay."""
    layers = session.document.materials[material].curves[curve].layers
    changed = resized(layers[index], size)
    for above in reversed(range(index, len(layers))):
        session.remove(material, curve, above)
    session.apply(material, curve, changed, *layers[index + 1 :])


def _size(label: str, layer: Operator, value_step: float) -> float:
    """Draw the control of a layer's size: degrees, a value, or a factor."""
    steps = {"translate_x": 0.02, "translate_y": value_step}
    turn = np.degrees(1.0) if layer.kind == "translate_x" else 1.0
    formats = {"translate_x": "x %+.2f°", "translate_y": "y %+.4g"}
    pattern = formats.get(layer.kind, f"{layer.kind[-1]} × %.4g")
    low, high = STRETCH if layer.kind == "amplify_x" else (0.0, LARGEST) if layer.kind == "amplify_y" else (0.0, 0.0)
    imgui.set_next_item_width(-1)
    flags = imgui.SliderFlags_.clamp_on_input | imgui.SliderFlags_.no_round_to_format
    changed, size = imgui.drag_float(label, layer.size * turn, steps.get(layer.kind, 0.005), low, high, pattern, flags)
    explain(f"size of this layer; drag, or double-click to type\n{words(layer)}")
    return float(size / turn) if changed else layer.size
