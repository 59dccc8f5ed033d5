"""How the picture is made: exposure, view transform, camera, integrator and its samples."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.store.contract import SIDES, noise_name
from lambent.viewer.panels import metering
from lambent.viewer.panels.widgets import choice, explain, slider
from lambent.viewer.quantity import is_false_coloured, shows_noise
from lambent.viewer.state import TARGET_MS, ViewerState

TITLE = "View"
EXPOSURE_EV = 12.0  # the slider goes this far both ways
FOV_DEG = (10.0, 120.0)
SPEED_M_S, EYE_M = (0.1, 10.0), (0.1, 3.0)
NEAR_M = (0.001, 5.0)
FRAME_MS = (8.0, 250.0)
AMBER = (1.0, 0.75, 0.35, 1.0)
NO_NOISE = "the store lacks it; `lambent bake` of the same scene adds it from the samples that it keeps"


def draw(state: ViewerState) -> None:
    metered = state.comparison is not None
    state.exposure_ev = slider("exposure", state.exposure_ev, -EXPOSURE_EV, EXPOSURE_EV, unit=" EV")
    if metered:
        if imgui.button("meter"):
            state.meter.expose_wanted = True
        explain("sets the exposure: the log-average of the picture becomes middle grey")
        imgui.same_line()
        if imgui.button("save picture"):
            state.screenshot_wanted = True
        explain("PNG as shown, EXR as linear radiance (P)")
    state.view_transform = choice("transform", state.view_transform, state.choices.view_transforms)
    state.show = choice("show", state.show, state.choices.shows)
    explain("all light, a part of it, the light map's irradiance, or its noise before denoising (standard error, %)")
    if shows_noise(state) and not state.light_map_noise:
        imgui.push_style_color(imgui.Col_.text, AMBER)
        imgui.text_wrapped(f"{noise_name(SIDES[0])}: {NO_NOISE}")
        imgui.pop_style_color()
    if is_false_coloured(state):
        metering.draw_range(state, metered)
    if state.preview is None:
        _camera(state)
    if metered:
        _marks(state)
    imgui.separator_text("reflections")
    state.integrator = choice("integrator", state.integrator, state.choices.integrators)
    _samples(state)
    state.lookup = choice("look-up", state.lookup, state.choices.lookups)
    explain(
        "where a reflected ray is taken to end: at the bounding planes, at the probe's distances, or infinitely far"
    )
    if state.scene.reflectors:
        state.planar = choice("planes", state.planar, state.choices.planars)
        explain("how planar reflectors are drawn: by a picture of their own, or (off) by their probes")
    imgui.separator_text("quality")
    _, state.refine = imgui.checkbox("refine while nothing moves", state.refine)
    _, state.adaptive_resolution = imgui.checkbox("fewer pixels in motion where needed", state.adaptive_resolution)
    imgui.begin_disabled(not state.adaptive_resolution)
    state.target_ms = slider("frame", state.target_ms, *FRAME_MS, log=True, unit=" ms")
    imgui.end_disabled()
    explain(f"time that a frame in motion is to take; {TARGET_MS:.0f} ms are 15 frames a second")


def _camera(state: ViewerState) -> None:
    imgui.separator_text("camera")
    fov = slider("field of view", state.camera.fov_y_deg, *FOV_DEG, unit=" deg")
    if fov != state.camera.fov_y_deg:
        state.set_fov(fov)
    explain("the whole vertical angle")
    walker = state.walker
    walker.speed_m_s = slider("speed", walker.speed_m_s, *SPEED_M_S, log=True, unit=" m/s")
    explain("walking and flying; with Shift three times that")
    low, high = min(EYE_M[0], walker.eye_height_m), max(EYE_M[1], walker.eye_height_m)
    height = slider("eye height", walker.eye_height_m, low, high, unit=" m")
    if height != walker.eye_height_m:
        state.set_eye_height(height)
    changed, automatic = imgui.checkbox("near plane by the scene's size", state.near_m is None)
    if changed:
        state.near_m = None if automatic else 0.01
    if state.near_m is not None:
        state.near_m = slider("near", state.near_m, *NEAR_M, log=True, unit=" m")
        explain("what is nearer is cut away: to look through a wall")


def _marks(state: ViewerState) -> None:
    _, state.marks.probes = imgui.checkbox("probes", state.marks.probes)
    explain("a mirror ball where each probe stands, showing what it holds")
    imgui.same_line()
    imgui.begin_disabled(not state.scene.reflectors)
    _, state.marks.reflectors = imgui.checkbox("reflectors", state.marks.reflectors)
    imgui.end_disabled()
    explain("outlines of the planar reflectors" if state.scene.reflectors else "the store names no planar reflectors")
    imgui.same_line()
    _, state.meter.readout_on = imgui.checkbox("readout", state.meter.readout_on)
    explain("luminance under the mouse")


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
