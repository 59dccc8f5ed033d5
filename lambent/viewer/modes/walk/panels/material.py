"""The Material panel: the objects, and every parameter of the selected object's material."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.scenes.scene import ImageTexture
from lambent.viewer.modes.walk.session.texturing import LEAST_REPEAT, MOST_SHOWN_REPEAT, Texturing
from lambent.viewer.modes.walk.session.thumbnails import SIDE, Thumbnail
from lambent.viewer.modes.walk.state import Materials, Selection
from lambent.viewer.panels import editing, parameters
from lambent.viewer.panels.widgets import buttons, explain, listed, path_field, press, slider

LISTED = 5
THUMBNAIL_PX = float(SIDE)


def draw(selection: Selection, materials: Materials, texturing: Texturing) -> None:
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
    _texture(texturing, name)
    imgui.separator()
    buttons([
        ("reset", name in edits.edited, partial(edits.reset, name), "restores the store's material"),
    ])  # fmt: skip
    _save(materials, name)
    _compare(materials, name)


def _objects(selection: Selection) -> None:
    objects = selection.objects
    height = min(len(objects), LISTED) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("objects", (0, height), imgui.ChildFlags_.nav_flattened)
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


def _texture(texturing: Texturing, name: str) -> None:
    """Draw the choice of the material's texture, and the field of an image."""
    imgui.separator()
    if name in texturing.without_uv:
        imgui.text_wrapped("no texture coordinates: bake the scene again, or add uv to show a texture")
        return
    choices, shown = texturing.choices(name), texturing.shown(name)
    meaning = "shows its own texture, none, another material's, or an image; the mean becomes the diffuse colour"
    chosen = _chosen_texture(texturing, name, meaning)
    if chosen != shown:
        texturing.choose(name, choices[chosen])
    meaning = "shows an image as the texture of this material; or drop the file onto the window"
    texturing.typed, wanted = path_field("image", texturing.typed, "show", "image file...", meaning)
    if wanted:
        texturing.open(name, texturing.typed)
    used = texturing.edits.room.textures.get(name)
    if isinstance(used, ImageTexture):
        times = slider("repeat", used.repeat, LEAST_REPEAT, MOST_SHOWN_REPEAT, "how often the image repeats", log=True)
        if times != used.repeat:
            texturing.repeat(name, times)


def _chosen_texture(texturing: Texturing, name: str, meaning: str) -> str:
    """Draw the list of textures, each with its thumbnail; return the label of the present choice."""
    chosen = texturing.shown(name)
    is_open = imgui.begin_combo("texture", chosen)
    if not is_open:
        explain(meaning)
        return chosen
    for label, of in texturing.choices(name).items():
        left = imgui.get_cursor_pos_x()
        if imgui.is_rect_visible((THUMBNAIL_PX, THUMBNAIL_PX)):
            _thumbnail(texturing.thumbnail(name, of))
        imgui.set_cursor_pos_x(left + THUMBNAIL_PX + imgui.get_style().item_spacing.x)
        if imgui.selectable(label, label == chosen, size=(0, THUMBNAIL_PX))[0]:
            chosen = label
    imgui.end_combo()
    return chosen


def _thumbnail(picture: Thumbnail | None) -> None:
    """Draw a thumbnail at the cursor; a frame alone until it is made, or if its image cannot be read."""
    lines, (x, y) = imgui.get_window_draw_list(), imgui.get_cursor_screen_pos()
    for row, colours in enumerate(() if picture is None else picture.tolist()):
        for column, (red, green, blue) in enumerate(colours):
            corner = (x + column, y + row)
            lines.add_rect_filled(corner, (corner[0] + 1, corner[1] + 1), imgui.IM_COL32(red, green, blue, 255))
    lines.add_rect((x, y), (x + THUMBNAIL_PX, y + THUMBNAIL_PX), imgui.get_color_u32(imgui.Col_.border))


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
