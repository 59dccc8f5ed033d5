"""The window's three sizes: *show* for a client in the room, *design* by object, *measure* with every number.

A mode has them if one of its panels names sizes; a mode without shows all of its panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from imgui_bundle import imgui

from lambent.viewer.mode import Mode, Panel
from lambent.viewer.panels.widgets import explain
from lambent.viewer.screen import Screen
from lambent.viewer.settings import SIZES, Size

MEANINGS: dict[Size, str] = {
    "show": "nothing but the picture and a thin bar, for a client",
    "design": "materials and light of the object you click",
    "measure": "every number, plot and comparison",
}


@dataclass(frozen=True)
class SizedPanel(Panel):
    """A panel of some sizes of the window."""

    sizes: tuple[Size, ...] = ("design", "measure")


def has_sizes(mode: Mode) -> bool:
    """Whether the mode sorts its panels into sizes."""
    return any(isinstance(panel, SizedPanel) for panel in mode.panels)


def shown_panels(mode: Mode) -> Sequence[Panel]:
    """The panels of the present size, in their order; none if the panels are hidden."""
    if not mode.screen.panels_shown:
        return ()
    size = mode.screen.size
    return [one for one in mode.panels if not isinstance(one, SizedPanel) or size in one.sizes]


def draw_control(screen: Screen, width: float) -> None:
    """Draw one button for each size, the present one lit, in all `width` wide."""
    gap = imgui.get_style().item_inner_spacing.x
    each = (width - (len(SIZES) - 1) * gap) / len(SIZES)
    for number, size in enumerate(SIZES):
        if number:
            imgui.same_line(0, gap)
        lit = imgui.Col_.button_active if size == screen.size else imgui.Col_.frame_bg
        imgui.push_style_color(imgui.Col_.button, imgui.get_style_color_vec4(lit))
        pressed = imgui.button(f"{size}##size", (each, 0))
        imgui.pop_style_color()
        explain(f"{MEANINGS[size]} (M)")
        if pressed:
            screen.size = size
