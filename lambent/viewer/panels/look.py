"""Controls of the picture: exposure, view transform, component of light, integrator, samples, pacing."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from lambent.core.exposure import ev100_of
from lambent.core.false_colour import LEAST, MOST, Range
from lambent.realtime.planar_integrators import CHOICES as PLANARS
from lambent.viewer.look import INTEGRATORS, LOOKUPS, SAMPLE_COUNTS, VIEW_TRANSFORMS, Look
from lambent.viewer.pacing import BUDGET_S
from lambent.viewer.panels.widgets import check, choice, explain, slider
from lambent.viewer.screen import Pace, Screen

EXPOSURE_EV = 12.0  # the slider goes this far both ways
FRAME_MS = (8.0, 250.0)


def draw(look: Look, screen: Screen) -> None:
    """The View panel of a mode that has no scene."""
    draw_exposure(look)
    draw_shown(look)
    if look.is_false_coloured:
        draw_range(look, screen)
    draw_reflections(look, planar=False)
    draw_quality(screen.pace)


def draw_exposure(look: Look, key: str = "") -> None:
    ev100 = f"EV100 {ev100_of(look.exposure_ev):.1f}"
    meaning = f"stops on radiance, brighter or darker; now {ev100}: 15 in the sun, 8 in a room by night"
    look.exposure_ev = slider(f"exposure{key}", look.exposure_ev, -EXPOSURE_EV, EXPOSURE_EV, meaning, unit=" EV")
    imgui.text_disabled(ev100)


def draw_shown(look: Look) -> None:
    draw_transform(look)
    meaning = "all light, a part of it, the light map's irradiance, or its noise before denoising (standard error, %)"
    look.show = choice("show", look.show, look.shows, meaning)


def draw_transform(look: Look) -> None:
    meaning = "how light becomes a picture: with highlights rolled off, as it is, or luminance in false colours"
    look.view_transform = choice("transform", look.view_transform, VIEW_TRANSFORMS, meaning)


def draw_range(look: Look, screen: Screen) -> None:
    """The ends of the false colours' scale, and its steps."""
    scale, unit = look.shown_scale, look.quantity.unit
    wanted = scale
    imgui.set_next_item_width(-imgui.calc_text_size("range").x - 90)
    changed, ends = imgui.input_float2(f"range, {unit}##range", [scale.low, scale.high], "%.4g")
    explain("numbers of the lowest and of the highest colour; what is below is black, above white")
    if changed:
        wanted = replace(scale, low=float(ends[0]), high=float(ends[1]))
    changed, log = imgui.checkbox("decades", scale.log)
    explain("even steps of the logarithm, or of the number itself")
    if changed:
        wanted = Range(scale.low if scale.low >= LEAST else scale.high / 1e3, scale.high, log)
    if (LEAST if wanted.log else 0.0) <= wanted.low < wanted.high <= MOST:
        look.shown_scale = wanted
    elif wanted != scale:
        screen.say(f"not a range: {wanted.low:g} to {wanted.high:g}; the first number is to be the smaller one")


def draw_reflections(look: Look, *, planar: bool) -> None:
    """Integrator, samples and look-up; with `planar` the method of planar reflectors."""
    imgui.separator_text("reflections")
    look.integrator = choice("integrator", look.integrator, INTEGRATORS, "how reflections are summed in motion")
    _samples(look)
    meaning = (
        "where a reflected ray is taken to end: at the bounding planes, at the probe's distances, or infinitely far; "
        "light_field: by the maps over the object, where it has them"
    )
    look.lookup = choice("look-up", look.lookup, LOOKUPS, meaning)
    if planar:
        meaning = "how planar reflectors are drawn: by a picture of their own, or (off) by their probes"
        look.planar = choice("planes", look.planar, PLANARS, meaning)


def _samples(look: Look) -> None:
    counts = SAMPLE_COUNTS
    middle = counts[len(counts) // 2]
    changed, automatic = imgui.checkbox("samples from roughness", look.n is None)
    explain("takes more samples for wider lobes, instead of as many for all")
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
    pace.refine = check(
        "refine while nothing moves", pace.refine, "averages unbiased frames until the picture is clean"
    )
    meaning = "draws a smaller picture in motion where the adapter is too slow for the frame time"
    covers = "keeps wires and slats whole in motion: each pixel shows five places; half as slow again in software"
    pace.covers = check("thin things in motion", bool(pace.covers), covers)
    pace.adaptive = check("fewer pixels in motion where needed", pace.adaptive, meaning)
    imgui.begin_disabled(not pace.adaptive)
    meaning = f"time that a frame in motion is to take; {1e3 * BUDGET_S:.0f} ms are 15 frames a second"
    pace.target_ms = slider("frame", pace.target_ms, *FRAME_MS, meaning, log=True, unit=" ms")
    imgui.end_disabled()
