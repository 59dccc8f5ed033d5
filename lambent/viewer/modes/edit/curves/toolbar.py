"""Tools, channels, axes and the region's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal

import numpy as np
from imgui_bundle import imgui

from lambent.core.arrays import Floats
from lambent.editing.curves.operators import Region
from lambent.materials.factored.curve import Curve
from lambent.viewer.modes.edit.curves import regions
from lambent.viewer.modes.edit.curves.axes import END_DEG
from lambent.viewer.modes.edit.curves.drags import Direction, Tool
from lambent.viewer.modes.edit.curves.plot import RGB
from lambent.viewer.modes.edit.curves.regions import EDGES, LIMITS, MEANINGS
from lambent.viewer.modes.edit.curves.state import CurveState, View, whole_x
from lambent.viewer.panels.widgets import Colour, explain

TOOLS: dict[Tool, str] = {
    "translate": "translate: drag the curve within its region, by angle and value (T, over the plot)",
    "amplify": "amplify: scale the curve within its region about a base (A, over the plot)",
    "draw": "draw: draw the curve freehand, which merges its layers (D, over the plot)",
}
DIRECTIONS: dict[Direction, str] = {
    "x and y": "dragging changes angles and values",
    "x": "dragging changes angles only (hold Ctrl)",
    "y": "dragging changes values only (hold Shift)",
}
CHANNELS: tuple[tuple[Literal[0, 1, 2], str, str], ...] = ((0, "R", "red"), (1, "G", "green"), (2, "B", "blue"))
KEYS = """Over the plot:
left drag in the region: pull the curve; Shift: values only, Ctrl: angles only
left drag beside the region: new region
handles a b c d, the bar between b and c: the region
wheel: zoom angles; with Shift or Ctrl: zoom values
right or middle drag: pan
double-click: show all angles and values
T A D: translate, amplify, draw;  L: log;  F: fit;  Esc: cancel the drag"""
ON = (0.24, 0.42, 0.66, 1.0)
GROUP_PX = 14.0  # between groups of buttons


class _Flow:
    """Lays out groups of buttons in lines, as many per line as fit."""

    def __init__(self) -> None:
        self.right = imgui.get_cursor_screen_pos().x + imgui.get_content_region_avail().x
        self.begun = False

    def group(self, labels: Sequence[str]) -> None:
        """Place a group of these buttons in this line if it fits, else in the next."""
        style = imgui.get_style()
        width = sum(imgui.calc_text_size(label).x + 2 * style.frame_padding.x for label in labels)
        width += (len(labels) - 1) * 2
        if self.begun and imgui.get_item_rect_max().x + GROUP_PX + width <= self.right:
            imgui.same_line(0, GROUP_PX)
        self.begun = True


def draw(state: CurveState, view: View, values: Floats, edited: bool) -> None:
    """Draw tool, direction, channels, and the shown range."""
    flow = _Flow()
    flow.group(list(TOOLS))
    for index, (tool, meaning) in enumerate(TOOLS.items()):
        if _toggle(tool, state.tool == tool, meaning, first=not index):
            state.tool = tool
    flow.group(list(DIRECTIONS))
    imgui.begin_disabled(state.tool == "draw")
    for index, (direction, meaning) in enumerate(DIRECTIONS.items()):
        if _toggle(direction, state.direction == direction, meaning, first=not index):
            state.direction = direction
    imgui.end_disabled()
    flow.group([letter for _, letter, _ in CHANNELS])
    for channel, letter, colour in CHANNELS:
        meaning = f"whether edits act on the {colour} channel"
        if _toggle(letter, channel in state.channels, meaning, first=not channel, text=RGB[channel]):
            state.toggle(channel)
    flow.group(["log", "fit", "0..90°", "original"])
    if _toggle("log", view.y.log, "logarithmic axis of values (L, over the plot)", first=True):
        view.set_log(values, not view.y.log)
    if _toggle("fit", False, "fits the plot to the part where the curve changes (F, over the plot)"):
        view.fit(values)
    if _toggle("0..90°", False, "shows all angles and values (double-click on the plot)"):
        view.fit(values, whole_x())
    imgui.begin_disabled(not edited)
    if _toggle("original", state.ghost, "shows the unedited curve as a thin line"):
        state.ghost = not state.ghost
    imgui.end_disabled()
    flow.group(["?"])
    imgui.align_text_to_frame_padding()
    imgui.text_disabled("?")
    explain(KEYS)


@lru_cache(maxsize=8)
def presets(curve: Curve) -> tuple[Region | None, Region | None]:
    """Region presets: peak and tail."""
    return regions.peak(curve.values), regions.tail(curve.values)


def draw_region(state: CurveState, view: View, curve: Curve) -> None:
    """Draw the four angles of the region, its presets, and the base of amplification."""
    imgui.begin_disabled(state.tool == "draw")
    space, room = imgui.get_style().item_spacing.x, imgui.get_content_region_avail().x
    width = (room - (len(EDGES) - 1) * space) / len(EDGES)
    for index, (edge, angle) in enumerate(zip(EDGES, regions.edges_deg(view.region), strict=True)):
        if index:
            imgui.same_line()
        imgui.set_next_item_width(width)
        flags = imgui.SliderFlags_.always_clamp
        changed, typed = imgui.drag_float(f"##{edge}", angle, 0.05, *LIMITS[edge], f"{edge} %.2f°", flags)
        explain(f"{MEANINGS[edge]}; drag, or double-click to type")
        if changed:
            view.region = regions.with_edge(view.region, edge, typed)
    peak, tail = presets(curve)
    options = (
        ("peak", peak, "around the largest value, down to half of it"),
        ("tail", tail, "from where the curve has fallen to a tenth, to 90°"),
        ("shown", regions.shown(view.x), "the range that the plot shows"),
        ("all", regions.whole(), "the whole curve evenly"),
    )
    for index, (label, region, meaning) in enumerate(options):
        if index:
            imgui.same_line()
        imgui.begin_disabled(region is None)
        if imgui.button(f"{label}##preset", (width, 0)) and region is not None:
            view.region = region
        imgui.end_disabled()
        explain(meaning)
    imgui.end_disabled()
    if state.tool == "amplify":
        _base(view, (room - space) / 2)


def _base(view: View, width: float) -> None:
    angle, value = view.base
    imgui.set_next_item_width(width)
    changed, typed = imgui.drag_float(
        "##base x", angle, 0.1, 0.0, END_DEG, "about %.1f°", imgui.SliderFlags_.always_clamp
    )
    explain("centre about which angles are scaled")
    angle = typed if changed else angle
    imgui.same_line()
    imgui.set_next_item_width(width)
    _, value = imgui.drag_float("##base y", value, 0.002 * max(view.y.high, 1e-6), 0.0, 0.0, "about %.4g")
    explain("value about which values are scaled; 0 multiplies them")
    view.base = angle, max(value, 0.0) if np.isfinite(value) else 0.0


def _toggle(label: str, on: bool, meaning: str, *, first: bool = False, text: Colour | None = None) -> bool:
    """Draw a toggle button; return whether it was pressed."""
    if not first:
        imgui.same_line(0, 2)
    if on:
        imgui.push_style_color(imgui.Col_.button, ON)
    else:
        imgui.push_style_color(imgui.Col_.button, imgui.get_style().color_(imgui.Col_.frame_bg))
    if text is not None:
        imgui.push_style_color(imgui.Col_.text, text if on else (*text[:3], 0.4))
    pressed = imgui.button(label)
    imgui.pop_style_color(2 if text is not None else 1)
    explain(meaning)
    return bool(pressed)
