"""The Film panel: size, rate and quality of a film along a camera path, its progress, and cancelling."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.core.plain import plain_name
from lambent.viewer.modes.walk.rebake.rebaking import clock_time
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.views.filming import FPS, QUALITIES, SIZES, Filming
from lambent.viewer.panels.widgets import choice, path_field, press


def draw(state: WalkState) -> None:
    films = state.films
    if films.under_way is not None:
        if _progress(films.under_way):
            films.under_way.cancel()
            state.screen.say(f"film cancelled after {films.under_way.done} frames")
            films.under_way = None
        return
    paths, followed = state.recordings.paths, state.navigation.path
    if not paths:
        imgui.text_wrapped("No camera path: record one in the Scene panel.")
        return
    path = followed.path if followed and followed.path.name in [p.name for p in paths] else paths[0]
    imgui.text_disabled(f"along {path.name}, {path.seconds:.1f} s (chosen under Scene)")
    films.size = choice("size", films.size, tuple(SIZES), "width and height of the film in pixels")
    films.fps = int(choice("frames/s", str(films.fps), tuple(map(str, FPS)), "frames of the film per second"))
    meaning = (
        "as in motion: drawn as the Drawing panel says; traced: as the picture at rest, seconds to a minute a frame"
    )
    films.quality = choice("quality", films.quality, tuple(QUALITIES), meaning)
    text = films.file_name or f"{plain_name(path.name)}.mp4"
    hint = "tour.mp4, tour-####.png or .exr"
    meaning = "draws the film as .mp4, or as numbered images: tour-####.png as shown, .exr with linear radiance"
    films.file_name, wanted = path_field("film file", text, "make film", hint, meaning)
    if wanted:
        films.wanted = path


def _progress(film: Filming) -> bool:
    """Draw the progress; return whether to cancel the film."""
    left = "" if film.left_s is None else f", {clock_time(film.left_s)} left"
    imgui.progress_bar(film.done / film.total, (-1, 0), f"frame {film.done} of {film.total}{left}")
    imgui.text_disabled(film.file.name)
    return press("cancel the film", "stops the film; finished images of a sequence are kept", -1)
