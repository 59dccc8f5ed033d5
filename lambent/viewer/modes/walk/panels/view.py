"""The View panel: exposure, view transform, camera, marks, integrator and its samples."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.store.contract import SIDES, noise_name
from lambent.viewer.look import Look
from lambent.viewer.modes.walk.markers import Marks
from lambent.viewer.modes.walk.metering import Meter
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.navigation import Navigation
from lambent.viewer.panels.look import draw_exposure, draw_quality, draw_range, draw_reflections, draw_shown
from lambent.viewer.panels.widgets import check, explain, slider, wrapped

FOV_DEG = (10.0, 120.0)
SPEED_M_S, EYE_M = (0.1, 10.0), (0.1, 3.0)
NEAR_M = (0.001, 5.0)
NO_NOISE = "the store lacks it; `lambent bake` of the same scene adds it from the samples that it keeps"


def draw(state: WalkState) -> None:
    look, meter, screen = state.look, state.meter, state.screen
    draw_exposure(look)
    if imgui.button("meter"):
        meter.expose_wanted = True
    explain("sets the exposure: the log-average of the picture becomes middle grey")
    imgui.same_line()
    if imgui.button("save picture"):
        screen.save_wanted = True
    explain("PNG as shown, EXR as linear radiance (P)")
    draw_shown(look)
    if look.shows_noise and not state.knows_noise:
        wrapped([f"{noise_name(SIDES[0])}: {NO_NOISE}"])
    if look.is_false_coloured:
        draw_range(look, screen)
        imgui.same_line()
        if imgui.button("fit to the picture"):
            meter.fit_wanted = True
    _camera(state.navigation, look)
    reflectors = bool(state.scene.reflectors)
    _marks(state.marks, meter, reflectors)
    draw_reflections(look, planar=reflectors)
    draw_quality(screen.pace)


def _camera(navigation: Navigation, look: Look) -> None:
    imgui.separator_text("camera")
    fov = slider("field of view", navigation.camera.fov_y_deg, *FOV_DEG, unit=" deg")
    if fov != navigation.camera.fov_y_deg:
        navigation.set_fov(fov)
    explain("the whole vertical angle")
    walker = navigation.walker
    walker.speed_m_s = slider("speed", walker.speed_m_s, *SPEED_M_S, log=True, unit=" m/s")
    explain("walking and flying; with Shift three times that")
    low, high = min(EYE_M[0], walker.eye_height_m), max(EYE_M[1], walker.eye_height_m)
    height = slider("eye height", walker.eye_height_m, low, high, unit=" m")
    if height != walker.eye_height_m:
        navigation.set_eye_height(height)
    changed, automatic = imgui.checkbox("near plane by the scene's size", look.near_m is None)
    if changed:
        look.near_m = None if automatic else 0.01
    if look.near_m is not None:
        look.near_m = slider("near", look.near_m, *NEAR_M, log=True, unit=" m")
        explain("what is nearer is cut away: to look through a wall")


def _marks(marks: Marks, meter: Meter, reflectors: bool) -> None:
    marks.probes = check("probes", marks.probes)
    explain("a mirror ball where each probe stands, showing what it holds")
    imgui.same_line()
    imgui.begin_disabled(not reflectors)
    marks.reflectors = check("reflectors", marks.reflectors)
    imgui.end_disabled()
    explain("outlines of the planar reflectors" if reflectors else "the store names no planar reflectors")
    imgui.same_line()
    meter.readout_on = check("readout", meter.readout_on)
    explain("luminance under the mouse")
