"""A film of a camera path: what is asked for, how far it is, and the way out."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.core.plain import plain_name
from lambent.viewer.filming import FPS, QUALITIES, SIZES
from lambent.viewer.panels.widgets import choice, explain, path_field
from lambent.viewer.state import ViewerState

TITLE = "Film"


def draw(state: ViewerState) -> None:
    options = state.film
    if options is None:
        return
    if state.filming is not None:
        _progress(state)
        return
    if not state.paths:
        imgui.text_wrapped("There is no camera path: record one.")
        return
    path = state.path.path if state.path and state.path.path.name in [p.name for p in state.paths] else state.paths[0]
    imgui.text_disabled(f"along {path.name}, {path.seconds:.1f} s (chosen under Scene)")
    options.size = choice("size", options.size, tuple(SIZES))
    rates = tuple(str(fps) for fps in FPS)
    options.fps = int(choice("frames/s", str(options.fps), rates))
    options.quality = choice("quality", options.quality, tuple(QUALITIES))
    explain("the integrator and samples chosen under View, or the unbiased one: slow, without grain at 256")
    text = options.file_name or f"{plain_name(path.name)}.mp4"
    options.file_name, wanted = path_field("film file", text, "make film", hint="tour.mp4, tour-####.png or .exr")
    explain(".mp4, or pictures in a row: tour-####.png as shown, tour-####.exr as linear radiance")
    if wanted:
        state.film_wanted = path


def _progress(state: ViewerState) -> None:
    film = state.filming
    assert film is not None
    left = "" if film.left_s is None else f", {_clock(film.left_s)} left"
    imgui.progress_bar(film.share, (-1, 0), f"frame {film.done} of {film.total}{left}")
    imgui.text_disabled(film.file.name)
    if imgui.button("cancel the film", (-1, 0)):
        film.cancel()
        state.filming = None
        state.say(f"film cancelled after {film.done} frames")


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"
