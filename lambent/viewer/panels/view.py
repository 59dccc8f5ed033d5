"""How the picture is made: exposure, view transform, integrator and its samples."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.panels.widgets import choice, explain, slider
from lambent.viewer.state import ViewerState

TITLE = "View"
EXPOSURE_EV = 12.0  # the slider goes this far both ways


def draw(state: ViewerState) -> None:
    state.exposure_ev = slider("exposure", state.exposure_ev, -EXPOSURE_EV, EXPOSURE_EV, unit=" EV")
    state.view_transform = choice("transform", state.view_transform, state.choices.view_transforms)
    state.show = choice("show", state.show, state.choices.shows)
    imgui.separator_text("reflections")
    state.integrator = choice("integrator", state.integrator, state.choices.integrators)
    _samples(state)
    state.lookup = choice("look-up", state.lookup, state.choices.lookups)
    explain(
        "where a reflected ray is taken to end: at the bounding planes, at the probe's distances, or infinitely far"
    )
    imgui.separator_text("quality")
    _, state.refine = imgui.checkbox("refine while nothing moves", state.refine)
    _, state.adaptive_resolution = imgui.checkbox("fewer pixels in motion where needed", state.adaptive_resolution)


def _samples(state: ViewerState) -> None:
    counts = state.choices.sample_counts
    middle = counts[len(counts) // 2]
    changed, automatic = imgui.checkbox("samples from roughness", state.n is None)
    if changed:
        state.n = None if automatic else middle
    imgui.begin_disabled(automatic)
    index = counts.index(state.n if state.n is not None else middle)
    changed, index = imgui.slider_int(
        "samples", index, 0, len(counts) - 1, "automatic" if automatic else str(counts[index])
    )
    imgui.end_disabled()
    if changed:
        state.n = counts[index]
