"""The polar matrix: every incident direction as a disk, measured and model beside each other; a click chooses one."""

from __future__ import annotations

from collections.abc import Mapping

from imgui_bundle import imgui

from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.matrix import Matrix, matrix
from lambent.viewer.panels.widgets import explain

GAP_PX = 2.0
AMBER, RIM, TEXT, DIM = (1.0, 0.72, 0.2, 1.0), (0.33, 0.35, 0.38, 1.0), (0.8, 0.82, 0.85, 1.0), (0.6, 0.63, 0.68, 1.0)
TITLES = {"measured": "measured", "A": "model", "B": "model B"}


def draw(editor: Editor, textures: Mapping[str, imgui.ImTextureRef]) -> None:
    shown = editor.shown
    kinds = [kind for kind in TITLES if kind in shown.layout and kind in textures]
    titles = [TITLES[kind] for kind in kinds]
    if "B" in kinds:
        titles[kinds.index("A")] = "model A"
    imgui.text_disabled("cube root of p = f cos theta_o")
    explain(
        "p is the transfer probability in 1/sr; theta_o runs from the centre to the rim, light comes from the top;\n"
        "white is the same in all disks; dark blue was not measured; with transmission the far side stands below"
    )
    imgui.same_line()
    incident = shown.incidents[editor.chosen] if shown.incidents else None
    if incident is not None:
        imgui.push_style_color(imgui.Col_.text, AMBER)
        imgui.text_unformatted(f"theta_i {incident.theta_deg:g}°, phi_i {incident.phi_deg:g}°")
        imgui.pop_style_color()
    if not kinds:
        return
    origin, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail()
    if room.x < 80 or room.y < 40:
        return
    laid = matrix(shown.incidents, len(kinds), 2 if shown.transmits else 1, room.x, room.y)
    _titles(laid, titles, (origin.x, origin.y))
    for (kind, index, side), (x, y) in laid.tiles.items():
        disks = shown.layout[kinds[kind]]
        tile = disks.tiles.index((index, bool(side))) if (index, bool(side)) in disks.tiles else None
        if tile is None:
            continue
        low, high = disks.place(tile)
        _disk(editor, textures[kinds[kind]], (low, high), index, (origin.x + x, origin.y + y), laid.step)
    _click(editor, laid, (origin.x, origin.y))


def _disk(
    editor: Editor,
    texture: imgui.ImTextureRef,
    place: tuple[tuple[float, float], tuple[float, float]],
    index: int,
    corner: tuple[float, float],
    step: float,
) -> None:
    inside = step - 2 * GAP_PX
    x, y = corner[0] + GAP_PX, corner[1] + GAP_PX
    lines = imgui.get_window_draw_list()
    lines.add_image(texture, (x, y), (x + inside, y + inside), *place)
    centre, radius = (x + inside / 2, y + inside / 2), inside / 2
    chosen = index == editor.chosen
    lines.add_circle(centre, radius, imgui.get_color_u32(AMBER if chosen else RIM), 0, 2.0 if chosen else 1.0)
    if step >= 40:
        source = (centre[0], centre[1] - radius * editor.shown.incidents[index].theta_deg / 90)
        lines.add_circle_filled(source, 2.5, imgui.get_color_u32(AMBER))


def _titles(laid: Matrix, kinds: list[str], origin: tuple[float, float]) -> None:
    lines = imgui.get_window_draw_list()
    for x, y, text in laid.titles:
        of_kind = text.startswith("kind ")
        words = kinds[int(text[5:])] if of_kind else text
        if text.endswith("°") and laid.step < imgui.calc_text_size(words).x + 2:
            continue
        lines.add_text((origin[0] + x, origin[1] + y), imgui.get_color_u32(TEXT if of_kind else DIM), words)


def _click(editor: Editor, laid: Matrix, origin: tuple[float, float]) -> None:
    """The disk under the mouse is chosen by a click, and named."""
    if not imgui.is_window_hovered():
        return
    mouse = imgui.get_io().mouse_pos
    for (_, index, side), (x, y) in laid.tiles.items():
        if 0 <= mouse.x - origin[0] - x < laid.step and 0 <= mouse.y - origin[1] - y < laid.step:
            incident = editor.shown.incidents[index]
            far = ", transmitted" if side else ""
            imgui.set_tooltip(f"theta_i {incident.theta_deg:g}°, phi_i {incident.phi_deg:g}°{far}")
            if imgui.is_mouse_clicked(0):
                editor.choose(index)
            return
