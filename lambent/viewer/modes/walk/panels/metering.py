"""The Light meter panel, the light on the selected object, and the luminance under the mouse."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from imgui_bundle import imgui

from lambent.core.light.exposure import ev100_of
from lambent.core.light.false_colour import number
from lambent.core.light.photometry import photometric
from lambent.viewer.look import Look
from lambent.viewer.modes.walk.light.falling import FallingLight
from lambent.viewer.modes.walk.light.glare import GlareMeter
from lambent.viewer.modes.walk.light.metering import Meter
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.overlay import SHADE
from lambent.viewer.panels.widgets import explain, press, rows
from lambent.viewer.screen import Rect

GRAPH_PX = 90
AS_BAKED = "as baked: only light groups (`lambent bake --light-groups scene`) follow edits here"


def draw_falling(falling: FallingLight | None, state: WalkState) -> None:
    """Draw the illuminance on the selected object, whole and by light group."""
    parts, edits = state.selected_parts, state.materials.edits
    if not parts or falling is None:
        imgui.text_disabled("select an object for the light that falls on it")
        return
    found = falling.follow(parts, waits=edits.in_stroke)
    if found is None:
        imgui.text_disabled("..." if falling.busy else "its light is not in the light map")
        return
    by_group, (low, high) = found.illuminance_lx(edits.light), found.range_lx(edits.light)
    total = sum(by_group.values())
    table = [("on average", f"{_said(total)} lx"), ("from, to", f"{_said(low)} to {_said(high)} lx")]
    if len(by_group) > 1:
        table += [(name, f"{_said(lx)} lx, {100 * lx / total if total else 0:.0f} %") for name, lx in by_group.items()]
    rows(table, "falling")
    explain("illuminance on the lit side; 5 % of the surface gets less than the first, 5 % more than the second number")
    stays = not state.lights.groups and (edits.edited or edits.room.lamps)
    for note in (found.note, AS_BAKED if stays else ""):
        if note:
            imgui.text_wrapped(note)


def _said(lx: float) -> str:
    """An illuminance with three digits."""
    return f"{float(f'{lx:.3g}'):,.0f}" if lx >= 100 else f"{lx:.3g}"


def draw(state: WalkState, light_on_it: Callable[[], None]) -> None:
    """Draw the panel, with the illuminance on the selected object."""
    meter, look = state.meter, state.look
    light_on_it()
    imgui.separator()
    _glare(meter.glare)
    meter.wanted = True
    reading, unit = meter.reading, look.quantity.unit
    if reading is None:
        imgui.text_disabled("nothing to meter")
        return
    table = [
        ("mean", f"{number(reading.mean)} {unit}"),
        ("log-average", f"{number(reading.log_mean)} {unit}"),
        ("darkest, brightest", f"{number(reading.low)}, {number(reading.high)} {unit}"),
        *([] if look.shows_noise else [("exposure for grey", f"EV100 {ev100_of(reading.exposure_ev):.2f}")]),
    ]
    rows(table, "meter")
    counts = np.asarray(reading.counts, np.float32)
    width = imgui.get_content_region_avail().x
    imgui.plot_histogram("##luminances", counts, graph_size=(width, GRAPH_PX), scale_min=0.0)
    first, last = f"{number(reading.edges[0])}", f"{number(reading.edges[-1])} {unit}"
    imgui.text_disabled(first)
    imgui.same_line(width - imgui.calc_text_size(last).x)
    imgui.text_disabled(last)
    explain("histogram of luminance on a logarithmic axis, without black pixels")


def _glare(meter: GlareMeter) -> None:
    """Draw button and ratings; ratings of an earlier view or state are dim."""
    if press("Glare at the eye", "rates the glare for a person at this place and direction of view: DGP and UGR"):
        meter.wanted = True
    if meter.share is not None:
        imgui.same_line()
        imgui.text_disabled(f"{meter.share:.0%}")
    if (found := meter.found) is None:
        return
    colour = imgui.Col_.text_disabled if meter.is_old else imgui.Col_.text
    imgui.push_style_color(imgui.Col_.text, imgui.get_style_color_vec4(colour))
    table = [
        ("DGP", f"{found.dgp:.2f}, {found.comfort}"),
        ("UGR", f"{found.ugr:.0f}"),
        ("at the eye", f"{number(found.illuminance_lx)} lx"),
        ("glare sources", str(len(found.sources))),
        ("picture", meter.made),
    ]
    rows(table, "glare")
    imgui.pop_style_color()


def draw_readout(meter: Meter, look: Look, picture: Rect) -> None:
    """Draw the luminance under the mouse beside it."""
    if meter.under_cursor is None or meter.cursor is None:
        return
    light = float(photometric(np.array(meter.under_cursor), look.quantity))
    text = f"{number(light)} {look.quantity.unit}"
    detail = "RGB " + " ".join(f"{value:.3g}" for value in meter.under_cursor)
    draw_list = imgui.get_background_draw_list()
    line = imgui.get_text_line_height()
    wide = max(imgui.calc_text_size(row).x for row in (text, detail))
    (x, y), (right, bottom) = picture.point(*meter.cursor), picture.point(1, 1)
    x, y = min(x + 16, right - wide - 8), min(y + 16, bottom - 2 * line - 8)
    draw_list.add_rect_filled((x - 5, y - 3), (x + wide + 5, y + 2 * line + 3), imgui.get_color_u32(SHADE), 3)
    draw_list.add_text((x, y), imgui.get_color_u32((1, 1, 1, 1)), text)
    draw_list.add_text((x, y + line), imgui.get_color_u32((0.7, 0.72, 0.75, 1)), detail)
