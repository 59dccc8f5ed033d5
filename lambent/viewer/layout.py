"""Layout of the window: the picture on the left, one column of panels on the right; in the size *show*, the picture.

A mode may show plots beside the picture and below it; the borders can be dragged.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui, implot

from lambent.viewer.mode import Drawing, Mode, SidePlots, Textures
from lambent.viewer.panels import closing
from lambent.viewer.panels.widgets import explain, px, shadowed
from lambent.viewer.screen import Rect, Screen
from lambent.viewer.sizes import draw_control, has_sizes, shown_panels

COLUMN_PX = 370  # logical pixels
MOST_SHARE, SCALED_SHARE = 1 / 3, 1 / 2  # largest share of a window's width for the column; with larger letters
LEAST_FONT = 0.8  # size of letters where the column is narrow
LABEL_PX = 88
BORDER_PX = 6  # between picture, disks and curves
LEAST_SHARE = 0.15  # least share of the window on either side of a border
FONT = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "DroidSans.ttf"
FONT_PX = 15.0
COLOURS = {
    imgui.Col_.window_bg: (0.11, 0.115, 0.125, 1.0),
    imgui.Col_.popup_bg: (0.14, 0.145, 0.155, 1.0),
    imgui.Col_.modal_window_dim_bg: (0.0, 0.0, 0.0, 0.45),
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
    | imgui.WindowFlags_.no_collapse | imgui.WindowFlags_.no_saved_settings
)  # fmt: skip
_BARE = FIXED | imgui.WindowFlags_.no_background | imgui.WindowFlags_.no_scrollbar | imgui.WindowFlags_.no_nav
SCALED = (
    "window_padding", "frame_padding", "item_spacing", "item_inner_spacing", "cell_padding", "indent_spacing",
    "scrollbar_size", "grab_min_size", "separator_text_padding",
)  # fmt: skip


@dataclass(frozen=True)
class Regions:
    """Rectangles of the picture, the column of panels, and the plots right and below, if any."""

    picture: Rect
    column: Rect
    plots: tuple[Rect, Rect] | None = None


def set_style() -> None:
    """Font and colours of the current Dear ImGui context."""
    imgui.style_colors_dark()
    imgui.get_io().fonts.add_font_from_file_ttf(str(FONT), FONT_PX)
    style = imgui.get_style()
    style.window_rounding, style.frame_rounding, style.grab_rounding = 0, 3, 3
    style.window_border_size = 0
    for part, colour in COLOURS.items():
        style.set_color_(part, colour)
    implot.create_context()  # ImPlot needs its own context
    plots = implot.get_style()
    plots.plot_border_size = 1.0
    plots.plot_padding, plots.label_padding = imgui.ImVec2(8, 6), imgui.ImVec2(4, 3)
    plots.legend_padding, plots.legend_inner_padding = imgui.ImVec2(6, 6), imgui.ImVec2(4, 2)
    for shade, value in PLOT_COLOURS.items():
        plots.set_color_(shade, value)


def scale_style(scale: float, fitting: float = 1.0) -> None:
    """Scale letters and controls by `scale`, and letters once more to be `fitting` in a narrow window."""
    style = imgui.get_style()
    style.font_scale_main = fitting
    if style.font_scale_dpi == scale:
        return
    style.font_scale_dpi, plain = scale, imgui.Style()
    for name in SCALED:
        size = getattr(plain, name)
        setattr(style, name, (scale * size.x, scale * size.y) if isinstance(size, imgui.ImVec2) else scale * size)


def regions(mode: Mode, width: float, height: float) -> Regions:
    """Divide a window of this size into regions."""
    is_shown = bool(shown_panels(mode))
    wide = _column_px(mode.screen.remembered.now.scale, width)[0] if is_shown else 0
    left, down = max(1, round(width) - wide), max(1, round(height))
    column = Rect(round(width) - wide, 0, wide, down)
    if mode.side_plots is None or not is_shown:
        return Regions(mode.drawing.within(Rect(0, 0, left, down)), column)
    across, below = round(mode.across * left), round(mode.down * down)
    right, under = across + BORDER_PX, below + BORDER_PX
    plots = Rect(right, 0, max(1, left - right), max(1, below)), Rect(0, under, left, max(1, down - under))
    return Regions(mode.drawing.within(Rect(0, 0, max(1, across), max(1, below))), column, plots)


def _column_px(scale: float, width: float) -> tuple[int, float]:
    """Width of the column in a window of this width, and the size of its letters where that is narrow."""
    wanted, most = COLUMN_PX * scale, min(MOST_SHARE * max(scale, 1.0), SCALED_SHARE) * width
    return min(round(wanted), int(most)), max(LEAST_FONT, min(1.0, most / wanted))


def draw(mode: Mode, textures: Textures | None = None) -> bool:
    """Draw the interface of one frame; return whether it captures the mouse, also over the picture."""
    textures, screen = textures or {}, mode.screen
    width, height = imgui.get_io().display_size
    screen.textures, scale = textures, screen.remembered.now.scale
    scale_style(scale, _column_px(scale, width)[1])
    shared, side_plots = regions(mode, width, height), mode.side_plots
    dragged = _pictures(mode.drawing, shared.picture, textures)
    if side_plots is not None and shared.plots is not None:
        _draw_side_plots(mode, side_plots, *shared.plots, textures)
    if shared.column.width:
        _window("panels", shared.column, FIXED)
        _column(mode)
        imgui.end()
    mode.draw_over(textures)
    closing.draw(mode)
    list_open = bool(imgui.is_popup_open("", imgui.PopupFlags_.any_popup))
    follow_keys(screen, "panels" if shared.column.width else "bar", list_open or screen.list_open)
    screen.list_open = list_open
    # Only what lies over the picture: the mouse may come from the column by one event, before a frame sees it.
    over_it = shared.picture.holds(*imgui.get_mouse_pos()) and imgui.is_window_hovered(imgui.HoveredFlags_.any_window)
    return dragged or list_open or bool(over_it)


def follow_keys(screen: Screen, window: str, list_open: bool) -> None:
    """Give the keys to the controls of a window while `screen.by_keys`.

    A click returns them to the picture, and Esc, unless it closed a list.
    """
    io, flag = imgui.get_io(), imgui.ConfigFlags_.nav_enable_keyboard
    had = bool(io.config_flags & flag)
    escaped = imgui.is_key_pressed(imgui.Key.escape, False) and not list_open and not imgui.is_any_item_active()
    if had and (escaped or imgui.is_mouse_clicked(imgui.MouseButton_.left)):
        screen.by_keys = False
    if screen.by_keys and not (had and imgui.is_window_focused(imgui.FocusedFlags_.any_window)):
        io.config_flags |= flag
        imgui.set_window_focus(window)
        imgui.set_nav_cursor_visible(True)
    elif had and not screen.by_keys:
        io.config_flags &= ~flag
        if escaped:  # a click has the focus where it is
            imgui.set_window_focus(None)


def _window(name: str, place: Rect, flags: int) -> None:
    imgui.set_next_window_pos((place.x, place.y))
    imgui.set_next_window_size((place.width, place.height))
    imgui.begin(name, None, flags)


def _column(mode: Mode) -> None:
    if has_sizes(mode):
        draw_control(mode.screen, imgui.get_content_region_avail().x)
    if mode.head is not None:
        imgui.push_item_width(-px(LABEL_PX))
        mode.head()
        imgui.pop_item_width()
    imgui.begin_child("sections", (0, 0), imgui.ChildFlags_.nav_flattened)
    imgui.push_item_width(-px(LABEL_PX))
    for panel in shown_panels(mode):
        opened = imgui.collapsing_header(panel.title, imgui.TreeNodeFlags_.default_open if panel.opened else 0)
        was_opened, top_y = imgui.is_item_toggled_open(), imgui.get_item_rect_min().y
        explain(panel.meaning)
        if opened:
            imgui.push_id(panel.title)
            panel.draw()
            imgui.pop_id()
        if was_opened:
            _scroll_to(top_y, imgui.get_cursor_screen_pos().y)
    imgui.pop_item_width()
    imgui.end_child()


def _scroll_to(top_y: float, bottom_y: float) -> None:
    """Scroll to a panel that was opened: to its end, or, if it is too long, to its beginning."""
    window_y, height = imgui.get_window_pos().y, imgui.get_window_height()
    if bottom_y - top_y > height:
        imgui.set_scroll_from_pos_y(top_y - window_y, 0.0)
    elif bottom_y > window_y + height:
        imgui.set_scroll_from_pos_y(bottom_y - window_y, 1.0)


def _pictures(drawing: Drawing, place: Rect, textures: Textures) -> bool:
    """Draw the picture, or A and B with a divider; return whether the mouse is at the divider."""
    draw_list = imgui.get_background_draw_list()
    begin, end = place.point(0, 0), place.point(1, 1)
    a, b = textures.get("picture A"), textures.get("picture B")
    if a is None:
        return False
    divider = drawing.divider
    share = divider.share if divider is not None and b is not None else 1.0
    at, _ = place.point(share, 0)
    tint, before = imgui.get_color_u32((1, 1, 1, drawing.share)), textures.get("before A")
    if before is not None:
        draw_list.add_image(before, begin, (at, end[1]), (0, 0), (share, 1))
    draw_list.add_image(a, begin, (at, end[1]), (0, 0), (share, 1), tint if before is not None else 0xFFFFFFFF)
    if b is None or divider is None:
        return False
    draw_list.add_image(b, (at, begin[1]), end, (share, 0), (1, 1))
    held, at = _border("divider", (at, place.y), place.height, upright=True)
    divider.move((at - place.x) / place.width)
    for text, x in ((divider.a_label, at - 12 - imgui.calc_text_size(divider.a_label).x), (divider.b_label, at + 12)):
        shadowed(draw_list, (x, place.y + 8), text, (1, 1, 1, 0.95))
    return held


def _draw_side_plots(mode: Mode, plots: SidePlots, right: Rect, below: Rect, textures: Textures) -> None:
    for name, place, draw_plot in (("right", right, plots.right), ("below", below, plots.below)):
        _window(name, place, FIXED | imgui.WindowFlags_.no_scroll_with_mouse | imgui.WindowFlags_.no_scrollbar)
        draw_plot(textures)
        imgui.end()
    left, down, half, picture = below.width, below.y + below.height, BORDER_PX / 2, mode.screen.picture
    _, x = _border("across", (picture.width + half, 0), picture.height, upright=True)
    _, y = _border("down", (0, picture.height + half), left, upright=False)
    mode.across = min(max((x - half) / left, LEAST_SHARE), 1 - LEAST_SHARE)
    mode.down = min(max((y - half) / down, LEAST_SHARE), 1 - LEAST_SHARE)


def _border(name: str, begin: tuple[float, float], length: float, *, upright: bool) -> tuple[bool, float]:
    """A border that can be dragged; returns whether the mouse holds it, and its position."""
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
    explain("drag to resize both sides")
    if held or hovered:
        imgui.set_mouse_cursor(imgui.MouseCursor_.resize_ew if upright else imgui.MouseCursor_.resize_ns)
    shade = 0.55 if held else 0.4 if hovered else 0.24
    end = (x, y + length) if upright else (x + length, y)
    colour, wide = imgui.get_color_u32((shade, shade, shade, 1)), 2.0 if hovered or held else 1.0
    imgui.get_window_draw_list().add_line(begin, end, colour, wide)
    imgui.end()
    imgui.pop_style_var(2)
    return held or hovered, at
