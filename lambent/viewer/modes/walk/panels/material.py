"""The Material panel: the objects, and every parameter of the selected object's material."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.viewer.modes.walk.state import Materials, Selection
from lambent.viewer.panels import editing, parameters
from lambent.viewer.panels.widgets import buttons, explain, listed, path_field, press

LISTED = 5


def draw(selection: Selection, materials: Materials) -> None:
    _objects(selection)
    name, editor = selection.material, materials.editor
    if name is None:
        imgui.text_wrapped("Click an object in the picture or in the list.")
        return
    imgui.separator_text(f"{selection.name}: {name}")
    if editor is not None and editor.subject.name == name:
        editing.draw_head(editor)
        editing.draw(editor)
        imgui.separator_text("fit")
        editing.draw_fit(editor)
        return
    edits = materials.edits
    material = edits.current(name)
    edited, materials.linked_roughness = parameters.edited(material, materials.linked_roughness)
    if edited != material:
        edits.change(name, edited)
    imgui.separator()
    buttons([
        ("reset", name in edits.edited, partial(edits.reset, name), "restores the store's material"),
    ])  # fmt: skip
    _save(materials, name)
    _compare(materials, name)


def _objects(selection: Selection) -> None:
    objects = selection.objects
    imgui.begin_child("objects", (0, min(len(objects), LISTED) * imgui.get_text_line_height_with_spacing()))
    for index, item in enumerate(objects):
        if listed(f"{item.name}##{index}", item.name == selection.name, f"selects {item.name}, of {item.material}"):
            selection.choose(item.name)
            selection.reveal = False  # it is in sight
        if item.name == selection.name and selection.reveal:
            imgui.set_scroll_here_y()
            selection.reveal = False
        imgui.same_line(0.5 * imgui.get_content_region_avail().x)
        imgui.text_disabled(item.material)
    imgui.end_child()


def _save(materials: Materials, name: str) -> None:
    imgui.set_next_item_width(-64)
    changed, file_name = imgui.input_text("##file", materials.file_name(name))
    explain("file name of the material document")
    if changed:
        materials.file_names[name] = file_name
    imgui.same_line()
    if press("save", "saves the material as a document; the store does not change", -1):
        materials.save(name)


def _compare(materials: Materials, name: str) -> None:
    """Draw the field of a measured file that opens the material editor."""
    meaning = "opens the material editor: disks, curves and error against a measurement, and the fit"
    hint = "compare with a measured file..."
    materials.typed_measurement, wanted = path_field(
        "measurement", materials.typed_measurement, "compare", hint, meaning
    )
    if wanted:
        materials.open_editor(name)
