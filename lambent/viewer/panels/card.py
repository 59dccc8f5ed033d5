"""The card of the first start: four lines, over the picture."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from lambent.viewer.panels.widgets import press
from lambent.viewer.screen import Screen

FLAGS = (
    imgui.WindowFlags_.no_decoration | imgui.WindowFlags_.always_auto_resize | imgui.WindowFlags_.no_saved_settings
    | imgui.WindowFlags_.no_focus_on_appearing
)  # fmt: skip


def draw(screen: Screen, lines: Sequence[str]) -> None:
    """Draw the card while it is shown; the first time, remember that it was."""
    if not screen.remembered.now.card_seen:
        screen.card_shown = True
        screen.remembered.set(card_seen=True)
    if not screen.card_shown:
        return
    imgui.set_next_window_pos(screen.picture.point(0.5, 0.4), imgui.Cond_.always, (0.5, 0.5))
    imgui.set_next_window_bg_alpha(0.92)
    imgui.begin("card", None, FLAGS)
    imgui.push_text_wrap_pos(max(screen.picture.width * 0.8, 1.0))
    for line in lines:
        imgui.text_unformatted(line)
    imgui.pop_text_wrap_pos()
    if press("begin", "closes the card (F1, Esc); F1 shows it again", -1):
        screen.card_shown = False
    imgui.end()
