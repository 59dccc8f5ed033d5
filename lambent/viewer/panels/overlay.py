"""What is said over the picture: messages, and how far it is refined."""

from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from lambent.core.false_colour import STOPS, number
from lambent.core.photometry import photometric
from lambent.viewer.comparison import error_scale
from lambent.viewer.input import Rect
from lambent.viewer.panels.metering import unit_of
from lambent.viewer.quantity import is_false_coloured, shown_quantity, shown_scale
from lambent.viewer.state import ViewerState

MARGIN_PX = 12
BAR_PX = 16
STEPS = 96  # of a scale bar
# Without focus: a window that takes it when it appears ends the drag of a slider.
FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_focus_on_appearing | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_saved_settings
)  # fmt: skip


def draw(state: ViewerState, picture: Rect) -> None:
    lines = [message.text for message in state.messages]
    s = state.statistics
    if 0 < s.accumulated < s.accumulate_to and state.filming is None:  # which has the adapter to itself
        lines.append(f"refining: {s.accumulated} of {s.accumulate_to}")
    _scale_bar(state, picture)
    _readout(state, picture)
    if state.recorder.on:
        lines.insert(0, f"recording {state.clock() - state.recorder.began_s:.0f} s   (R stops)")
    if state.filming is not None:
        lines.insert(0, f"film: frame {state.filming.done} of {state.filming.total}")
    if not lines:
        return
    corner = (picture.x + MARGIN_PX, picture.y + picture.height - MARGIN_PX)
    imgui.set_next_window_pos(corner, imgui.Cond_.always, (0, 1))
    imgui.set_next_window_size_constraints((0, 0), (max(1, picture.width - 2 * MARGIN_PX), picture.height))
    imgui.set_next_window_bg_alpha(0.6)
    imgui.begin("messages", None, FLAGS)
    imgui.push_text_wrap_pos(max(1, picture.width - 4 * MARGIN_PX))
    for line in lines:
        imgui.text_unformatted(line)
    imgui.pop_text_wrap_pos()
    imgui.end()


def _scale_bar(state: ViewerState, picture: Rect) -> None:
    """The colours and their numbers, at the right of the picture: of false colour, or of an error map."""
    comparison = state.comparison
    if comparison is not None and comparison.mode == "error map" and comparison.figures is not None:
        marks, stops, unit = error_scale(comparison.kind)
    elif is_false_coloured(state):
        scale, unit, stops = shown_scale(state), unit_of(state), STOPS
        marks = [(float(scale.share(np.array(value))), number(value)) for value in scale.marks()]
    else:
        return
    line = imgui.get_text_line_height()
    wide = max(imgui.calc_text_size(text).x for _, text in (*marks, (0.0, unit)))
    x0 = picture.x + picture.width - wide - BAR_PX - 2 * MARGIN_PX
    y0, y1 = picture.y + MARGIN_PX + 2 * line, picture.y + picture.height - MARGIN_PX - line
    if y1 - y0 < 3 * line or x0 < picture.x:
        return
    behind = imgui.get_background_draw_list()
    right = (picture.x + picture.width, picture.y + picture.height)
    behind.add_rect_filled((x0 - MARGIN_PX, picture.y), right, imgui.get_color_u32((0, 0, 0, 0.6)))
    white = imgui.get_color_u32((1, 1, 1, 1))
    behind.add_text((x0, picture.y + MARGIN_PX), white, unit)
    height = (y1 - y0) / STEPS
    for step in range(STEPS):
        at = (1 - (step + 0.5) / STEPS) * (len(stops) - 1)
        red, green, blue = (float(np.interp(at, np.arange(len(stops)), channel)) for channel in stops.T)
        begin, end = (x0, y0 + step * height), (x0 + BAR_PX, y0 + (step + 1) * height + 1)
        behind.add_rect_filled(begin, end, imgui.get_color_u32((red, green, blue, 1)))
    last = float("inf")
    for share, text in marks:
        y = y1 - share * (y1 - y0)
        if last - y >= line:  # a number that would touch the one below is left out
            behind.add_line((x0 + BAR_PX - 4, y), (x0 + BAR_PX, y), white)
            behind.add_text((x0 + BAR_PX + 6, y - line / 2), white, text)
            last = y


def _readout(state: ViewerState, picture: Rect) -> None:
    """What is under the mouse, beside it."""
    meter = state.meter
    if meter.under_cursor is None or meter.cursor is None:
        return
    light = np.array(meter.under_cursor)
    text = f"{number(float(photometric(light, shown_quantity(state))))} {unit_of(state)}"
    detail = "RGB " + " ".join(f"{value:.3g}" for value in meter.under_cursor)
    behind = imgui.get_background_draw_list()
    line = imgui.get_text_line_height()
    wide = max(imgui.calc_text_size(row).x for row in (text, detail))
    x = picture.x + meter.cursor[0] * picture.width + 16
    y = picture.y + meter.cursor[1] * picture.height + 16
    x = min(x, picture.x + picture.width - wide - 8)
    y = min(y, picture.y + picture.height - 2 * line - 8)
    behind.add_rect_filled((x - 5, y - 3), (x + wide + 5, y + 2 * line + 3), imgui.get_color_u32((0, 0, 0, 0.6)), 3)
    behind.add_text((x, y), imgui.get_color_u32((1, 1, 1, 1)), text)
    behind.add_text((x, y + line), imgui.get_color_u32((0.7, 0.72, 0.75, 1)), detail)
