"""What is said over the picture: messages, and how far it is refined."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.input import Rect
from lambent.viewer.state import ViewerState

MARGIN_PX = 12
# Without focus: a window that takes it when it appears ends the drag of a slider.
FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.no_inputs | imgui.WindowFlags_.always_auto_resize
    | imgui.WindowFlags_.no_focus_on_appearing | imgui.WindowFlags_.no_nav | imgui.WindowFlags_.no_saved_settings
)  # fmt: skip


def draw(state: ViewerState, picture: Rect) -> None:
    lines = [message.text for message in state.messages]
    s = state.statistics
    if 0 < s.accumulated < s.accumulate_to:
        lines.append(f"refining: {s.accumulated} of {s.accumulate_to}")
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
