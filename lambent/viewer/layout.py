"""Where things stand in the window: the picture on the left, one column of panels on the right."""

from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

from lambent.viewer.input import Rect
from lambent.viewer.panels import help, material, overlay, scene, statistics, view
from lambent.viewer.state import ViewerState

COLUMN_PX = 370  # logical
LABEL_PX = 88
FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "DroidSans.ttf"
FONT_PX = 15.0
PANELS = (scene, view, material, statistics, help)
OPEN_AT_START = (scene, view, material)
COLOURS = {
    imgui.Col_.window_bg: (0.11, 0.115, 0.125, 1.0),
    imgui.Col_.popup_bg: (0.14, 0.145, 0.155, 1.0),
    imgui.Col_.frame_bg: (0.20, 0.21, 0.23, 1.0),
    imgui.Col_.frame_bg_hovered: (0.26, 0.28, 0.32, 1.0),
    imgui.Col_.frame_bg_active: (0.30, 0.34, 0.40, 1.0),
}
_COLUMN = (
    imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_nav
)  # fmt: skip


def set_style() -> None:
    """Font and colours of the current Dear ImGui context."""
    imgui.style_colors_dark()
    imgui.get_io().fonts.add_font_from_file_ttf(str(FONT), FONT_PX)
    style = imgui.get_style()
    style.window_rounding, style.frame_rounding, style.grab_rounding = 0, 3, 3
    style.window_border_size = 0
    for part, colour in COLOURS.items():
        style.set_color_(part, colour)


def picture_rect(state: ViewerState, width: float, height: float) -> Rect:
    """What the panels leave of a window of that size, in logical pixels."""
    column = min(COLUMN_PX, round(0.6 * width)) if state.panels_shown else 0
    return Rect(0, 0, max(1, round(width) - column), max(1, round(height)))


def draw(state: ViewerState, texture: imgui.ImTextureRef | None) -> bool:
    """The whole interface of one frame; returns whether a popup is open, so that it owns the mouse."""
    width, height = imgui.get_io().display_size
    picture = picture_rect(state, width, height)
    if texture is not None:
        end = (picture.x + picture.width, picture.y + picture.height)
        imgui.get_background_draw_list().add_image(texture, (picture.x, picture.y), end)
    if state.panels_shown:
        imgui.set_next_window_pos((picture.width, 0))
        imgui.set_next_window_size((width - picture.width, height))
        imgui.begin("panels", None, _COLUMN)
        imgui.push_item_width(-LABEL_PX)
        for panel in PANELS:
            opened = imgui.TreeNodeFlags_.default_open if panel in OPEN_AT_START else 0
            if imgui.collapsing_header(panel.TITLE, opened):
                imgui.push_id(panel.TITLE)
                panel.draw(state)
                imgui.pop_id()
        imgui.pop_item_width()
        imgui.end()
    overlay.draw(state, picture)
    return imgui.is_popup_open("", imgui.PopupFlags_.any_popup)
