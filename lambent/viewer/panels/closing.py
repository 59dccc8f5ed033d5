"""The question about unsaved work before the window closes."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.mode import Mode
from lambent.viewer.panels.widgets import AMBER, buttons, wrapped

TITLE = "Close the window?"
WIDE_PX = 340.0
HIGH = 0.4  # top of the question, as a share of the window's height
FLAGS = imgui.WindowFlags_.no_resize | imgui.WindowFlags_.no_move | imgui.WindowFlags_.no_saved_settings


def draw(mode: Mode) -> None:
    """Draw the question while it is asked; the answers are save, discard, and stay."""
    screen = mode.screen
    if not screen.asks_to_close:
        return
    if not imgui.is_popup_open(TITLE):
        imgui.open_popup(TITLE)
    size = imgui.get_io().display_size
    # Fixed at its top: messages below the buttons must not move them from under the pointer.
    imgui.set_next_window_pos((size.x / 2, HIGH * size.y), imgui.Cond_.always, (0.5, 0.0))
    imgui.set_next_window_size((min(WIDE_PX, size.x), 0))
    if not imgui.begin_popup_modal(TITLE, None, FLAGS)[0]:
        return

    def stay() -> None:
        screen.asks_to_close = False
        imgui.close_current_popup()

    def discard() -> None:
        mode.discard()
        screen.closes = True
        stay()

    def save() -> None:
        mode.save()
        if not mode.unsaved:
            screen.closes = True
            stay()

    wrapped([f"not saved: {', '.join(mode.unsaved)}"])
    imgui.spacing()
    gap = imgui.get_style().item_spacing.x
    buttons([
        ("save##closing", True, save, "saves everything and closes (Enter)"),
        ("discard##closing", True, discard, "closes without saving"),
        ("stay##closing", True, stay, "returns to the window (Esc)"),
    ], (imgui.get_content_region_avail().x - 2 * gap) / 3)  # fmt: skip
    wrapped([message.text for message in screen.messages], AMBER)  # reasons for failed saves
    if screen.asks_to_close and imgui.is_key_pressed(imgui.Key.escape, False):
        stay()
    elif screen.asks_to_close and imgui.is_key_pressed(imgui.Key.enter, False):
        save()
    imgui.end_popup()
