"""The exposure meter and its histogram; the range of the false colours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from imgui_bundle import imgui

from lambent.core.false_colour import LEAST, MOST, Range, number
from lambent.viewer.panels.widgets import explain, rows
from lambent.viewer.quantity import set_shown_scale, shown_quantity, shown_scale, shows_noise
from lambent.viewer.state import ViewerState

TITLE = "Light meter"
GRAPH_PX = 90


def draw(state: ViewerState) -> None:
    meter = state.meter
    meter.wanted = True
    reading, unit = meter.reading, unit_of(state)
    if reading is None:
        imgui.text_disabled("nothing to meter")
        return
    rows(
        [
            ("mean", f"{number(reading.mean)} {unit}"),
            ("log-average", f"{number(reading.log_mean)} {unit}"),
            ("darkest, brightest", f"{number(reading.low)}, {number(reading.high)} {unit}"),
            *([] if shows_noise(state) else [("log-average is grey at", f"{reading.exposure_ev:+.2f} EV")]),
        ],
        "meter",
    )
    counts = np.asarray(reading.counts, np.float32)
    width = imgui.get_content_region_avail().x
    imgui.plot_histogram("##luminances", counts, graph_size=(width, GRAPH_PX), scale_min=0.0)
    decades = f"{number(reading.edges[0])}", f"{number(reading.edges[-1])} {unit}"
    imgui.text_disabled(decades[0])
    imgui.same_line(width - imgui.calc_text_size(decades[1]).x)
    imgui.text_disabled(decades[1])
    explain("pixels by luminance, in even steps of its logarithm; what is black is left out")


def draw_range(state: ViewerState, metered: bool) -> None:
    """The ends of the scale, its steps, and the button that fits it to the picture."""
    scale, unit = shown_scale(state), unit_of(state)
    imgui.set_next_item_width(-imgui.calc_text_size("range").x - 90)
    changed, ends = imgui.input_float2(f"range, {unit}##range", [scale.low, scale.high], "%.4g")
    explain("numbers of the lowest and of the highest colour; what is below is black, above white")
    if changed:
        _take(state, replace(scale, low=float(ends[0]), high=float(ends[1])))
    changed, log = imgui.checkbox("decades", scale.log)
    explain("even steps of the logarithm, or of the number itself")
    if changed:
        _take(state, Range(scale.low if scale.low >= LEAST else scale.high / 1e3, scale.high, log))
    if metered:
        imgui.same_line()
        if imgui.button("fit to the picture"):
            state.meter.fit_wanted = True


def unit_of(state: ViewerState) -> str:
    """Of what the picture shows."""
    return shown_quantity(state).unit


def _take(state: ViewerState, scale: Range) -> None:
    """Use a range where it is one."""
    least = LEAST if scale.log else 0.0
    if least <= scale.low < scale.high <= MOST:
        set_shown_scale(state, scale)
    else:
        state.say(f"not a range: {scale.low:g} to {scale.high:g}; the first number is to be the smaller one")
