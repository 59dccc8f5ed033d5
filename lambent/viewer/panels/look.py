"""Controls of the picture: exposure, view transform, component of light, integrator, samples, pacing."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.light.exposure import ev100_of
from lambent.core.light.false_colour import LEAST, MOST, Range
from lambent.realtime.planar.planar_integrators import CHOICES as PLANARS
from lambent.viewer.edits.fitted import Fitted
from lambent.viewer.look import INTEGRATORS, LOOKUPS, MOST_EV, SAMPLE_COUNTS, VIEW_TRANSFORMS, Look
from lambent.viewer.pacing import BUDGET_S
from lambent.viewer.panels.widgets import check, choice, explain, press, slider
from lambent.viewer.screen import Pace, Screen

FRAME_MS = (8.0, 250.0)


def draw(look: Look, screen: Screen) -> None:
    """Draw the View panel of a mode without a scene."""
    draw_exposure(look)
    draw_shown(look)
    if look.is_false_coloured:
        draw_range(look, screen)
    draw_reflections(look, planar=False)
    draw_quality(screen.pace)


def draw_fitted(state: Fitted) -> None:
    """Draw the View panel of a mode with a picture of a fixed size."""
    look = state.look
    draw_exposure(look)
    draw_transform(look)
    if look.is_false_coloured:
        draw_range(look, state.screen)
    meaning = "shows one pixel of the picture as one pixel of the screen, instead of filling the window"
    state.pixel_exact = check("one pixel of the picture is one of the screen", state.pixel_exact, meaning)


def draw_exposure(look: Look, key: str = "") -> None:
    ev100 = f"EV100 {ev100_of(look.exposure_ev):.1f}"
    meaning = f"exposure in stops; now {ev100} (15 in the sun, 8 in a room by night)"
    look.exposure_ev = slider(f"exposure{key}", look.exposure_ev, -MOST_EV, MOST_EV, meaning, unit=" EV")


def draw_steps(look: Look) -> None:
    """Draw the exposure in thirds of a stop, with a button for each direction."""
    width = (imgui.get_content_region_avail().x - 2 * imgui.get_style().item_spacing.x) / 3
    if press("darker", "by 1/3 EV (-)", width):
        look.step(-1)
    imgui.same_line()
    left = imgui.get_cursor_pos_x()
    imgui.align_text_to_frame_padding()
    imgui.set_cursor_pos_x(left + (width - imgui.calc_text_size(look.said_exposure).x) / 2)
    imgui.text_unformatted(look.said_exposure)
    explain(f"exactly {look.exposure_ev:.3f} EV, EV100 {ev100_of(look.exposure_ev):.1f}; 0 is as opened or metered")
    imgui.same_line(left + width + imgui.get_style().item_spacing.x)
    if press("brighter", "by 1/3 EV (+)", width):
        look.step(1)


def draw_shown(look: Look) -> None:
    draw_transform(look)
    meaning = "all light, a part of it, the light map's irradiance, or its noise before denoising (standard error, %)"
    look.show = choice("show", look.show, look.shows, meaning)


def draw_transform(look: Look) -> None:
    meaning = "view transform: filmic and neutral roll off highlights, linear clips; or luminance in false colours"
    look.view_transform = choice("transform", look.view_transform, VIEW_TRANSFORMS, meaning)


def draw_range(look: Look, screen: Screen) -> None:
    """Draw the range of the false colours, and the choice of a logarithmic scale."""
    scale, unit = look.shown_scale, look.quantity.unit
    wanted = scale
    imgui.set_next_item_width(-imgui.calc_text_size("range").x - 90)
    changed, ends = imgui.input_float2(f"range, {unit}##range", [scale.low, scale.high], "%.4g")
    explain("values of the lowest and the highest colour; black below, white above")
    if changed:
        wanted = replace(scale, low=float(ends[0]), high=float(ends[1]))
    changed, log = imgui.checkbox("decades", scale.log)
    explain("logarithmic or linear colour scale")
    if changed:
        wanted = Range(scale.low if scale.low >= LEAST else scale.high / 1e3, scale.high, log)
    if (LEAST if wanted.log else 0.0) <= wanted.low < wanted.high <= MOST:
        look.shown_scale = wanted
    elif wanted != scale:
        screen.say(f"not a range: {wanted.low:g} to {wanted.high:g}; the first number must be smaller")


def draw_reflections(look: Look, *, planar: bool) -> None:
    """Draw integrator, samples and look-up; with `planar` also the method of planar reflectors."""
    imgui.separator_text("reflections")
    look.integrator = choice("integrator", look.integrator, INTEGRATORS, "integrator of reflections in motion")
    _samples(look)
    meaning = (
        "where reflected rays look up light: at bounding planes, at the probe's distances, infinitely far (plain), or "
        "in the object's light field"
    )
    look.lookup = choice("look-up", look.lookup, LOOKUPS, meaning)
    if planar:
        meaning = "how planar reflectors are drawn: from a mirrored picture, or (off) from their probes"
        look.planar = choice("planes", look.planar, PLANARS, meaning)


def _samples(look: Look) -> None:
    counts = SAMPLE_COUNTS
    middle = counts[len(counts) // 2]
    changed, automatic = imgui.checkbox("samples from roughness", look.n is None)
    explain("takes more samples for wider lobes; off: the same number for all")
    if changed:
        look.n = None if automatic else middle
    imgui.begin_disabled(automatic)
    index = counts.index(look.n if look.n is not None else middle)
    text = "automatic" if automatic else str(counts[index])
    changed, index = imgui.slider_int("samples", index, 0, len(counts) - 1, text)
    explain("samples per lobe and pixel in motion")
    imgui.end_disabled()
    if changed:
        look.n = counts[index]


def draw_quality(pace: Pace) -> None:
    imgui.separator_text("quality")
    meaning = "lowers the resolution in motion where frames would take too long"
    covers = "keeps wires and slats whole in motion: five depth samples per pixel; 1.5 times slower in software"
    pace.covers = check("thin things in motion", bool(pace.covers), covers)
    pace.adaptive = check("fewer pixels in motion where needed", pace.adaptive, meaning)
    imgui.begin_disabled(not pace.adaptive)
    meaning = f"target time of a frame in motion; {1e3 * BUDGET_S:.0f} ms is 15 frames a second"
    pace.target_ms = slider("frame", pace.target_ms, *FRAME_MS, meaning, log=True, unit=" ms")
    imgui.end_disabled()
