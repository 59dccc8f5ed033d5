"""Overlay of the picture: messages, the picture at rest, colour scales."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from imgui_bundle import imgui

from lambent.core.light.false_colour import Range, number, ramp
from lambent.core.plain import triple
from lambent.viewer.look import Look
from lambent.viewer.screen import Rect, Screen

MARGIN_PX = 12
BAR_PX = 16
STEPS = 96  # colours of a scale bar
SHADE = (0, 0, 0, 0.6)
# Without focus: a window that takes the focus ends the drag of a slider.
FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_focus_on_appearing | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_saved_settings
)  # fmt: skip


def draw(screen: Screen, first: Sequence[str] = (), above_px: float = 0.0) -> None:
    """Draw lines at the lower left, `above_px` its edge: `first`, the messages, and how the picture at rest was made.

    The last one has numbers that only the size *measure* shows.
    """
    last = [screen.at_rest] if screen.at_rest and screen.size == "measure" else []
    lines, picture = [*first, *(message.text for message in screen.messages), *last], screen.picture
    if not lines:
        return
    x, y = picture.point(0, 1)
    imgui.set_next_window_pos((x + MARGIN_PX, y - MARGIN_PX - above_px), imgui.Cond_.always, (0, 1))
    imgui.set_next_window_size_constraints((0, 0), (max(1, picture.width - 2 * MARGIN_PX), picture.height))
    imgui.set_next_window_bg_alpha(0.6)
    imgui.begin("messages", None, FLAGS)
    imgui.push_text_wrap_pos(max(1, picture.width - 4 * MARGIN_PX))
    for line in lines:
        imgui.text_unformatted(line)
    imgui.pop_text_wrap_pos()
    imgui.end()


def over(picture: Rect, texture: imgui.ImTextureRef | None) -> None:
    """Draw a texture with clear pixels over the whole picture, if there is one."""
    if texture is not None:
        imgui.get_background_draw_list().add_image(texture, picture.point(0, 0), picture.point(1, 1))


def false_colour_bar(picture: Rect, look: Look) -> None:
    """Draw the scale of a picture in false colours."""
    if look.is_false_coloured:
        scale_bar_of(picture, look.shown_scale, look.quantity.unit)


def scale_bar_of(picture: Rect, scale: Range, unit: str) -> None:
    """Draw a scale with round numbers."""
    marks = [(float(scale.share(np.array(value))), number(value)) for value in scale.marks()]
    scale_bar(picture, marks, scale.stops, unit)


def scale_bar(picture: Rect, marks: Sequence[tuple[float, str]], stops: np.ndarray, unit: str) -> None:
    """Draw colours (N, 3) from low to high, with numbers at shares of the scale, at the right of the picture."""
    line = imgui.get_text_line_height()
    wide = max(imgui.calc_text_size(text).x for text in (unit, *(text for _, text in marks)))
    x0 = picture.x + picture.width - wide - BAR_PX - 2 * MARGIN_PX
    y0, y1 = picture.y + MARGIN_PX + 2 * line, picture.y + picture.height - MARGIN_PX - line
    if y1 - y0 < 3 * line or x0 < picture.x:
        return
    draw_list = imgui.get_background_draw_list()
    draw_list.add_rect_filled((x0 - MARGIN_PX, picture.y), picture.point(1, 1), imgui.get_color_u32(SHADE))
    white = imgui.get_color_u32((1, 1, 1, 1))
    draw_list.add_text((x0, picture.y + MARGIN_PX), white, unit)
    height = (y1 - y0) / STEPS
    for step, colour in enumerate(ramp(1 - (np.arange(STEPS) + 0.5) / STEPS, stops)):
        begin, end = (x0, y0 + step * height), (x0 + BAR_PX, y0 + (step + 1) * height + 1)
        draw_list.add_rect_filled(begin, end, imgui.get_color_u32((*triple(colour), 1)))
    last = float("inf")
    for share, text in marks:
        y = y1 - share * (y1 - y0)
        if last - y >= line:  # skip a number that would touch the one below
            draw_list.add_line((x0 + BAR_PX - 4, y), (x0 + BAR_PX, y), white)
            draw_list.add_text((x0 + BAR_PX + 6, y - line / 2), white, text)
            last = y
