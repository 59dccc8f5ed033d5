"""Where things stand in the window: the picture on the left, one column of panels on the right.

With the material editor open, its disks stand beside the picture and its curves below both; the borders can be dragged.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui, implot

from lambent.viewer.input import Rect
from lambent.viewer.panels import (
    compare,
    curves,
    disks,
    editing,
    film,
    fitting,
    help,
    marks,
    material,
    metering,
    overlay,
    preview,
    scene,
    statistics,
    view,
)
from lambent.viewer.state import ViewerState

COLUMN_PX = 370  # logical
LABEL_PX = 88
BORDER_PX = 6  # between picture, disks and curves
LEAST_SHARE = 0.15  # of the window that a border leaves on either side
FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "DroidSans.ttf"
FONT_PX = 15.0
PANELS = (scene, view, material, metering, compare, film, statistics, help)
EDITOR_PANELS = (editing, fitting, preview, view, statistics, help)
OPEN_AT_START = (scene, view, material, editing, fitting, preview)
COLOURS = {
    imgui.Col_.window_bg: (0.11, 0.115, 0.125, 1.0),
    imgui.Col_.popup_bg: (0.14, 0.145, 0.155, 1.0),
    imgui.Col_.frame_bg: (0.20, 0.21, 0.23, 1.0),
    imgui.Col_.frame_bg_hovered: (0.26, 0.28, 0.32, 1.0),
    imgui.Col_.frame_bg_active: (0.30, 0.34, 0.40, 1.0),
    imgui.Col_.plot_histogram: (0.24, 0.52, 0.88, 1.0),
}
PLOT_COLOURS = {
    implot.Col_.frame_bg: (0.11, 0.115, 0.125, 1.0),
    implot.Col_.plot_bg: (0.085, 0.09, 0.10, 1.0),
    implot.Col_.plot_border: (0.25, 0.26, 0.28, 1.0),
    implot.Col_.axis_grid: (0.5, 0.52, 0.56, 0.25),
}
FIXED = (
    imgui.WindowFlags_.no_title_bar | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_resize
    | imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings | imgui.WindowFlags_.no_nav
)  # fmt: skip
_BARE = FIXED | imgui.WindowFlags_.no_background | imgui.WindowFlags_.no_scrollbar


@dataclass(frozen=True)
class Regions:
    """What stands where, in logical pixels; disks and curves only while the editor shows them."""

    picture: Rect
    disks: Rect | None = None
    curves: Rect | None = None


def set_style() -> None:
    """Font and colours of the current Dear ImGui context."""
    imgui.style_colors_dark()
    imgui.get_io().fonts.add_font_from_file_ttf(str(FONT), FONT_PX)
    style = imgui.get_style()
    style.window_rounding, style.frame_rounding, style.grab_rounding = 0, 3, 3
    style.window_border_size = 0
    for part, colour in COLOURS.items():
        style.set_color_(part, colour)
    implot.create_context()  # of its own: ImPlot asserts without one
    plots = implot.get_style()
    plots.plot_border_size = 1.0
    plots.plot_padding, plots.label_padding = imgui.ImVec2(8, 6), imgui.ImVec2(4, 3)
    plots.legend_padding, plots.legend_inner_padding = imgui.ImVec2(6, 6), imgui.ImVec2(4, 2)
    for shade, value in PLOT_COLOURS.items():
        plots.set_color_(shade, value)


def regions(state: ViewerState, width: float, height: float) -> Regions:
    """How a window of that size is shared out."""
    column = min(COLUMN_PX, round(0.6 * width)) if state.panels_shown else 0
    left, down = max(1, round(width) - column), max(1, round(height))
    editor = state.editor
    if editor is None or not editor.plots_shown or not state.panels_shown:
        return Regions(Rect(0, 0, left, down))
    across, below = round(editor.split_across * left), round(editor.split_down * down)
    right, under = across + BORDER_PX, below + BORDER_PX
    return Regions(
        Rect(0, 0, max(1, across), max(1, below)),
        Rect(right, 0, max(1, left - right), max(1, below)),
        Rect(0, under, left, max(1, down - under)),
    )


def picture_rect(state: ViewerState, width: float, height: float) -> Rect:
    """What the panels leave of a window of that size, in logical pixels."""
    return regions(state, width, height).picture


def draw(state: ViewerState, textures: Mapping[str, imgui.ImTextureRef] | None = None) -> bool:
    """The whole interface of one frame; returns whether the mouse is the interface's, also over the picture.

    `textures` are "picture A", "picture B", and the editor's images by their names; what is not there is not drawn.
    """
    textures = textures or {}
    width, height = imgui.get_io().display_size
    shared = regions(state, width, height)
    dragged = _pictures(state, shared.picture, textures)
    if state.editor is not None and shared.disks is not None and shared.curves is not None:
        _beside(state, shared, textures)
    if state.panels_shown:
        left = width - min(COLUMN_PX, round(0.6 * width))
        imgui.set_next_window_pos((left, 0))
        imgui.set_next_window_size((width - left, height))
        imgui.begin("panels", None, FIXED)
        _column(state)
        imgui.end()
    marks.draw(state, shared.picture, textures)
    overlay.draw(state, shared.picture)
    return dragged or imgui.is_popup_open("", imgui.PopupFlags_.any_popup)


def _column(state: ViewerState) -> None:
    imgui.push_item_width(-LABEL_PX)
    state.meter.wanted = False
    alone = state.preview is not None
    if alone:
        editing.draw_head(state)
        imgui.begin_child("sections")
        imgui.push_item_width(-LABEL_PX)
    for panel in EDITOR_PANELS if alone else PANELS:
        opened = imgui.TreeNodeFlags_.default_open if panel in OPEN_AT_START and not (alone and panel is view) else 0
        if imgui.collapsing_header(panel.TITLE, opened):
            imgui.push_id(panel.TITLE)
            panel.draw(state)
            imgui.pop_id()
    if alone:
        imgui.pop_item_width()
        imgui.end_child()
    imgui.pop_item_width()


def _pictures(state: ViewerState, place: Rect, textures: Mapping[str, imgui.ImTextureRef]) -> bool:
    """The picture, or A and B with the divider between them; returns whether the mouse is at the divider."""
    behind = imgui.get_background_draw_list()
    begin, end = (place.x, place.y), (place.x + place.width, place.y + place.height)
    a, b = textures.get("picture A"), textures.get("picture B")
    if a is None:
        return False
    comparison = state.comparison
    beside = state.preview or (comparison if comparison and comparison.mode == "side by side" else None)
    if b is None or beside is None:
        behind.add_image(textures.get("error map", a), begin, end)
        return False
    at = place.x + beside.split * place.width
    behind.add_image(a, begin, (at, end[1]), (0, 0), (beside.split, 1))
    behind.add_image(b, (at, begin[1]), end, (beside.split, 0), (1, 1))
    held, at = _border("divider", (at, place.y), place.height, upright=True)
    beside.split = min(max((at - place.x) / place.width, 0.02), 0.98)
    labels = ("A", "B") if state.preview or comparison is None else (comparison.a_label, comparison.b_label)
    for text, x in ((labels[0], at - 12 - imgui.calc_text_size(labels[0]).x), (labels[1], at + 12)):
        behind.add_text((x + 1, place.y + 9), imgui.get_color_u32((0, 0, 0, 0.8)), text)
        behind.add_text((x, place.y + 8), imgui.get_color_u32((1, 1, 1, 0.95)), text)
    return held


def _beside(state: ViewerState, shared: Regions, textures: Mapping[str, imgui.ImTextureRef]) -> None:
    editor, picture = state.editor, shared.picture
    assert editor is not None and shared.disks is not None and shared.curves is not None
    for name, place, panel in (("disks", shared.disks, disks), ("curves", shared.curves, curves)):
        imgui.set_next_window_pos((place.x, place.y))
        imgui.set_next_window_size((place.width, place.height))
        imgui.begin(name, None, FIXED | imgui.WindowFlags_.no_scroll_with_mouse | imgui.WindowFlags_.no_scrollbar)
        panel.draw(editor, textures)
        imgui.end()
    left, down = shared.curves.width, shared.curves.y + shared.curves.height
    _, x = _border("across", (picture.width + BORDER_PX / 2, 0), picture.height, upright=True)
    _, y = _border("down", (0, picture.height + BORDER_PX / 2), left, upright=False)
    editor.split_across = min(max((x - BORDER_PX / 2) / left, LEAST_SHARE), 1 - LEAST_SHARE)
    editor.split_down = min(max((y - BORDER_PX / 2) / down, LEAST_SHARE), 1 - LEAST_SHARE)


def _border(name: str, begin: tuple[float, float], length: float, *, upright: bool) -> tuple[bool, float]:
    """A line that can be dragged across; returns whether the mouse has it, and where it is now."""
    x, y = begin
    half = BORDER_PX / 2
    place, size = ((x - half, y), (BORDER_PX, length)) if upright else ((x, y - half), (length, BORDER_PX))
    imgui.push_style_var(imgui.StyleVar_.window_padding, (0, 0))
    imgui.push_style_var(imgui.StyleVar_.window_min_size, (1, 1))
    imgui.set_next_window_pos(place)
    imgui.set_next_window_size(size)
    imgui.begin(f"border {name}", None, _BARE)
    imgui.invisible_button(name, (max(size[0], 1), max(size[1], 1)))
    held, hovered = imgui.is_item_active(), imgui.is_item_hovered()
    at = x if upright else y
    if held:
        mouse = imgui.get_io().mouse_pos
        at = mouse.x if upright else mouse.y
    if held or hovered:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew if upright else imgui.MouseCursor_.resize_ns)
    shade = 0.55 if held else 0.4 if hovered else 0.24
    end = (x, y + length) if upright else (x + length, y)
    imgui.get_window_draw_list().add_line(
        begin, end, imgui.get_color_u32((shade, shade, shade, 1)), 2.0 if hovered or held else 1.0
    )
    imgui.end()
    imgui.pop_style_var(2)
    return held or hovered, at
