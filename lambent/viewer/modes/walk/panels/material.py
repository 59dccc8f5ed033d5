"""The Material panel: the selected object, and its material in plain words or in every number."""

from __future__ import annotations

from functools import partial

from imgui_bundle import imgui

from lambent.scenes.scene import ImageTexture
from lambent.viewer.modes.walk.session.finishes import Finish, Finishes
from lambent.viewer.modes.walk.session.texturing import LEAST_REPEAT, MOST_SHOWN_REPEAT, Texturing
from lambent.viewer.modes.walk.session.thumbnails import SIDE
from lambent.viewer.modes.walk.state import Materials, Selection, WalkState
from lambent.viewer.panels import editing, parameters
from lambent.viewer.panels.widgets import buttons, choice, explain, path_field, press, px, slider

ROWS = 2.4  # of finishes that are in sight
BALL_PX, GAP_PX = 64.0, 3.0  # least width of a finish, and between two
NOTHING = "nothing"


def draw(state: WalkState, finishes: Finishes) -> None:
    """Draw the panel of the present size of the window."""
    materials, name = state.materials, state.selection.material
    _object(state.selection)
    if name is None:
        imgui.text_wrapped("Click an object in the picture, or choose it above.")
    elif state.screen.size == "measure":
        _in_numbers(state, name)
    else:
        _words(materials, name)
        _finishes(finishes, name)
        _texture(state.texturing, name)
        _reset(materials, name)


def _in_numbers(state: WalkState, name: str) -> None:
    """Draw every parameter, or the editor if it is open on this material."""
    materials, editor = state.materials, state.materials.editor
    if editor is not None and editor.subject.name == name:
        editing.draw_head(editor)
        editing.draw(editor)
        imgui.separator_text("fit")
        editing.draw_fit(editor)
        return
    material = materials.edits.current(name)
    edited, materials.linked_roughness = parameters.edited(material, materials.linked_roughness)
    if edited != material:
        materials.edits.change(name, edited)
    _texture(state.texturing, name)
    imgui.separator()
    _reset(materials, name)
    _save(materials, name)
    _compare(materials, name)


def _object(selection: Selection) -> None:
    """Draw the selected object as a list to choose from, and who shares its material."""
    names = [item.name for item in selection.objects]
    now = NOTHING if selection.name not in names else str(selection.name)
    chosen = choice("object", now, [NOTHING, *names], "the selected object; or click it in the picture")
    if chosen != now:
        selection.choose(None if chosen == NOTHING else chosen)
    others = [o.name for o in selection.objects if o.material == selection.material and o.name != selection.name]
    if selection.material is not None:
        imgui.text_disabled(f"{selection.material}{f', on {len(others)} more' if others else ''}")
        explain(f"its material{', also of ' + ', '.join(others[:20]) if others else ''}")


def _words(materials: Materials, name: str) -> None:
    """Draw colour, shine and roughness."""
    edits = materials.edits
    material = edits.current(name)
    edited = parameters.in_words(material, edits.scene[name])
    if edited != material:
        edits.change(name, edited)


def _finishes(finishes: Finishes, name: str) -> None:
    """Draw the finish library, each on a sphere."""
    imgui.separator_text("finishes")
    usable = [finish for finish in finishes.all if not finishes.is_unusable(finish)]
    room = imgui.get_content_region_avail().x - imgui.get_style().scrollbar_size
    columns = max(1, int(room / px(BALL_PX)))
    step = room / columns
    imgui.begin_child("finishes", (0, min(-(-len(usable) // columns), ROWS) * step), imgui.ChildFlags_.nav_flattened)
    imgui.push_style_var(imgui.StyleVar_.item_spacing, (GAP_PX, GAP_PX))
    imgui.push_style_color(imgui.Col_.button, imgui.get_style_color_vec4(imgui.Col_.frame_bg))
    for number, finish in enumerate(usable):
        if number % columns:
            imgui.same_line()
        if _ball(finishes, finish, number, step - GAP_PX):
            finishes.choose(name, finish)
    imgui.pop_style_color()
    imgui.pop_style_var()
    imgui.end_child()


def _ball(finishes: Finishes, finish: Finish, number: int, size: float) -> bool:
    """Draw a finish as a button of this size, empty until its thumbnail is made."""
    textures = finishes.screen.textures
    seen = imgui.is_rect_visible((size, size))
    picture = textures.get(finishes.thumbnail(finish)) if seen else None
    if picture is None:
        pressed = imgui.button(f"##finish {number}", (size, size))
    else:
        padding = imgui.get_style().frame_padding
        pressed = imgui.image_button(f"##finish {number}", picture, (size - 2 * padding.x, size - 2 * padding.y))
    explain(f"{finish.name}, {'of this scene' if finish.file is None else finish.file.name}")
    return bool(pressed)


def _reset(materials: Materials, name: str) -> None:
    edits = materials.edits
    changed = name in edits.edited or name in edits.room.textures
    buttons([("reset", changed, partial(edits.reset, name), "restores the store's material")])


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
    chosen, side = texturing.shown(name), px(SIDE)
    is_open = imgui.begin_combo("texture", chosen)
    if not is_open:
        explain(meaning)
        return chosen
    for label, of in texturing.choices(name).items():
        left = imgui.get_cursor_pos_x()
        thumbnail = texturing.thumbnail(name, of) if imgui.is_rect_visible((side, side)) else None
        if (picture := texturing.screen.textures.get(thumbnail or "")) is not None:
            imgui.image(picture, (side, side))
            imgui.same_line()
        imgui.set_cursor_pos_x(left + side + imgui.get_style().item_spacing.x)
        if imgui.selectable(label, label == chosen, size=(0, side))[0]:
            chosen = label
    imgui.end_combo()
    return chosen


def _save(materials: Materials, name: str) -> None:
    imgui.set_next_item_width(-px(64))
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
