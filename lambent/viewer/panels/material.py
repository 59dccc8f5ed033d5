"""The material of the selected object: every number of its document, at once on the screen."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.editor.editor import Editor
from lambent.viewer.panels import editing, fitting, parameters
from lambent.viewer.panels.widgets import explain, path_field
from lambent.viewer.state import ViewerState

TITLE = "Material"
LISTED = 7


def draw(state: ViewerState) -> None:
    _objects(state)
    name = state.selected_material
    if name is None:
        imgui.text_wrapped("Click an object in the picture or in the list.")
        return
    material = state.edits.current(name)
    imgui.separator_text(f"{state.selected}: {name}")
    if state.editor is not None and state.editor.name == name:
        editing.draw_head(state)
        editing.draw(state)
        imgui.separator_text("fit")
        fitting.draw(state)
        return
    edited, state.linked_roughness = parameters.edited(material, state.linked_roughness)
    if edited != material:
        state.edits.change(name, edited)
    elif not imgui.is_any_item_active():
        state.edits.end_stroke()
    _history(state, name)
    _save(state, name)
    _compare(state, name)


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


def _compare(state: ViewerState, name: str) -> None:
    """The door to the editor: a measured file to hold against this material."""
    typed, wanted = path_field(
        "measurement", state.typed_measurement, "compare", hint="compare with a measured file..."
    )
    state.typed_measurement = typed
    explain("opens the material editor: disks, curves and error of this material against a measurement, and the fit")
    if wanted:
        if state.editor is not None:
            state.editor.close()
        state.editor = Editor(state.edits, name, state.folder, state.say, file_name=state.file_name(name))
        state.editor.leave = state.close_editor
        if typed.strip():
            state.editor.open(typed)
