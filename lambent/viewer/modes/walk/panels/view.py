"""The View, Camera and Drawing panels: exposure and view transform; camera and marks; integrator and its samples."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.core.light.exposure import ev100_of
from lambent.store.contract import SIDES, noise_name
from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.look import LOOKUPS, Look
from lambent.viewer.modes.walk.input import FOV_DEG
from lambent.viewer.modes.walk.light.metering import Meter
from lambent.viewer.modes.walk.markers import Marks
from lambent.viewer.modes.walk.panels import light_field
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.panels.look import (
    draw_exposure,
    draw_quality,
    draw_range,
    draw_reflections,
    draw_shown,
    draw_steps,
    draw_transform,
)
from lambent.viewer.panels.widgets import check, choice, explain, press, slider, wrapped

SPEED_M_S, EYE_M = (0.1, 10.0), (0.1, 3.0)
NEAR_M = (0.001, 5.0)
NO_NOISE = "the store lacks it; `lambent bake` of the same scene adds it from the stored samples"


def draw(state: WalkState) -> None:
    """Draw the choice of the shown light, exposure and view transform."""
    look, meter, screen = state.look, state.meter, state.screen
    in_numbers = screen.size == "measure"
    draw_steps(look)
    if in_numbers:
        draw_exposure(look)
    if press("meter", "sets the exposure so that the picture's log-average becomes middle grey"):
        meter.expose_wanted = True
    imgui.same_line()
    if press("save picture", "writes a PNG as shown, and an EXR of linear radiance (P)"):
        screen.save_wanted = True
    if in_numbers:
        imgui.same_line()
        imgui.text_disabled(f"EV100 {ev100_of(look.exposure_ev):.1f}")
    if in_numbers:
        draw_shown(look)
    else:
        draw_transform(look)
    if look.shows_noise and not state.knows_noise:
        wrapped([f"{noise_name(SIDES[0])}: {NO_NOISE}"])
    if look.is_false_coloured:
        draw_range(look, screen)
        imgui.same_line()
        if press("fit to the picture", "fits the range to the picture"):
            meter.fit_wanted = True


def draw_camera(state: WalkState) -> None:
    """Draw the controls of camera, walker, and marks over the picture."""
    navigation, look = state.navigation, state.look
    meaning = "vertical field of view"
    fov = slider("field of view", navigation.camera.fov_y_deg, *FOV_DEG, meaning, unit=" deg")
    if fov != navigation.camera.fov_y_deg:
        navigation.set_fov(fov)
    _walker(navigation)
    _near_plane(look)
    _marks(state.marks, state.meter, bool(state.scene.reflectors))


def draw_drawing(state: WalkState) -> None:
    """Draw the controls of reflections and pacing."""
    draw_reflections(state.look, planar=bool(state.scene.reflectors))
    if state.selection.name is not None:
        _look_up_of(state.selection.name, state.look)
        light_field.warn_of_look_up(state)
    pace = state.screen.pace
    draw_quality(pace)
    meaning = "replaces the drawn picture at rest by one traced against the baked light, which gets sharper"
    pace.traces = check("trace while nothing moves", pace.traces, meaning)


def _look_up_of(name: str, look: Look) -> None:
    """Draw the selected object's own look-up; auto: the look-up of all objects."""
    meaning = f"look-up for {name} only; auto: its light field where it has one, else its probe"
    chosen = choice("selected##look-up", look.lookups.get(name, LOOKUPS[0]), LOOKUPS, meaning)
    if chosen != LOOKUPS[0]:
        look.lookups[name] = chosen
    else:
        look.lookups.pop(name, None)


def _walker(navigation: Navigation) -> None:
    walker = navigation.walker
    meaning = "speed of walking and flying; three times as fast with Shift"
    walker.speed_m_s = slider("speed", walker.speed_m_s, *SPEED_M_S, meaning, log=True, unit=" m/s")
    low, high = min(EYE_M[0], walker.eye_height_m), max(EYE_M[1], walker.eye_height_m)
    height = slider("eye height", walker.eye_height_m, low, high, "eye height above the floor", unit=" m")
    if height != walker.eye_height_m:
        navigation.set_eye_height(height)


def _near_plane(look: Look) -> None:
    changed, automatic = imgui.checkbox("near plane by scene size", look.near_m is None)
    explain("chooses the near clipping plane by the scene's size")
    if changed:
        look.near_m = None if automatic else 0.01
    if look.near_m is not None:
        meaning = "clips everything nearer, for instance to look through a wall"
        look.near_m = slider("near", look.near_m, *NEAR_M, meaning, log=True, unit=" m")


def _marks(marks: Marks, meter: Meter, reflectors: bool) -> None:
    marks.probes = check("probes", marks.probes, "shows each probe as a mirror ball at its place")
    imgui.same_line()
    imgui.begin_disabled(not reflectors)
    meaning = "outlines the planar reflectors" if reflectors else "the store has no planar reflectors"
    marks.reflectors = check("reflectors", marks.reflectors, meaning)
    imgui.end_disabled()
    imgui.same_line()
    meter.readout_on = check("readout", meter.readout_on, "shows the luminance under the mouse")
