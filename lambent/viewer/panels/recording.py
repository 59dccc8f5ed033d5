"""Camera paths: to follow, to record, to try out, to save."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.panels.widgets import explain, path_field, slider
from lambent.viewer.state import ViewerState

SMOOTHEST_S = 2.0
RED = (1.0, 0.35, 0.3, 1.0)


def draw(state: ViewerState) -> None:
    """The paths of the scene and the recorder; nothing where there can be neither."""
    if not state.paths and state.views is None:
        return
    imgui.separator_text("camera path")
    if state.paths:
        _follow(state)
    if state.views is not None:
        _record(state)


def _follow(state: ViewerState) -> None:
    paths = state.paths
    names = [path.name for path in paths]
    current = state.path.path if state.path else paths[0]
    index = names.index(current.name) if current.name in names else 0
    changed, index = imgui.combo("path", index, names)
    chosen = paths[index]
    if changed:
        state.scrub(chosen, 0.0)
    imgui.begin_disabled(state.recorder.on)
    if imgui.button("pause" if state.playing else "play", (64, 0)):
        state.toggle(chosen)
    imgui.end_disabled()
    imgui.same_line()
    imgui.set_next_item_width(-1)
    time_s = min(state.path.time_s, chosen.seconds) if state.path else 0.0
    moved, time_s = imgui.slider_float("##time", time_s, 0.0, chosen.seconds, "%.1f s", imgui.SliderFlags_.always_clamp)
    if moved:
        state.scrub(chosen, time_s)
    _change(state, chosen.name)


def _change(state: ViewerState, name: str) -> None:
    """Rename or delete the chosen path where it was saved."""
    from lambent.viewer.panels.scene import rename_or_delete

    views = state.views
    if views is None or name not in [path.name for path in views.paths]:
        return
    change = rename_or_delete(state, "path", name)
    if change == "delete" and views.delete_path(name):
        state.path = None
        state.say(f"deleted the path {name}")
    elif change == "rename" and views.rename_path(name, state.typed_name):
        new = state.typed_name.strip()
        state.scrub(next(path for path in views.paths if path.name == new), 0.0)
        state.renaming = None


def _record(state: ViewerState) -> None:
    recorder = state.recorder
    if recorder.on:
        imgui.push_style_color(imgui.Col_.text, RED)
        pressed = imgui.button(f"stop recording: {state.clock() - recorder.began_s:.0f} s###record", (-1, 0))
        imgui.pop_style_color()
    else:
        pressed = imgui.button("record a walk###record", (-1, 0))
    explain("follows the camera until it is pressed again (R); standing still before the first step is left out")
    if pressed:
        state.record()
    if recorder.draft is None:
        return
    smooth_s = slider("smooth", recorder.smooth_s, 0.0, SMOOTHEST_S, unit=" s")
    if smooth_s != recorder.smooth_s:
        following = state.path is not None and state.path.path == recorder.draft
        recorder.smooth(smooth_s)
        if following and recorder.draft is not None and state.path is not None:
            state.scrub(recorder.draft, state.path.time_s)
    explain("how far jerks are averaged out")
    recorder.name, wanted = path_field("path name", recorder.name, "save path", hint="name of the path")
    if wanted:
        state.save_recording()
    if recorder.draft is not None and imgui.button("throw the recording away", (-1, 0)):
        state.drop_recording()
