"""The Scene panel: walking or orbiting, cameras and saved views, camera paths, warnings."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.cameras.navigation import Navigation
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.modes.walk.views.recording import Recordings
from lambent.viewer.modes.walk.views.views import Kind
from lambent.viewer.panels.widgets import check, explain, listed, path_field, press, slider, wrapped

LISTED = 6
SMOOTHEST_S = 2.0
RED = (1.0, 0.35, 0.3, 1.0)
UNFOLDS = "shows what the loader said about the scene file"
WARNINGS = 3  # more warnings are folded, to keep the panels below in sight


def draw(state: WalkState) -> None:
    navigation, recordings, warnings = state.navigation, state.recordings, state.scene.warnings
    _movement(navigation)
    if recordings.cameras:
        _cameras(navigation, recordings)
    _saving(navigation, recordings)
    imgui.separator_text("camera path")
    if recordings.paths:
        _follow(recordings)
    _record(recordings)
    wrapped(state.missing)
    if len(warnings) <= WARNINGS:
        wrapped(warnings)
    elif imgui.tree_node(f"{len(warnings)} notes on the scene file###warnings"):
        explain(UNFOLDS)
        wrapped(warnings)
        imgui.tree_pop()
    else:
        explain(UNFOLDS)


def _movement(navigation: Navigation) -> None:
    if imgui.radio_button("walk", navigation.movement == "walk"):
        navigation.movement = "walk"
    explain("the mouse looks around, the keys walk (O)")
    imgui.same_line()
    if imgui.radio_button("orbit", navigation.movement == "orbit"):
        navigation.movement = "orbit"
    explain("the mouse turns about the selected object or the camera's target (O)")
    if navigation.movement == "walk":
        imgui.same_line()
        navigation.flying = check("fly", navigation.flying, "leaves the floor and passes through walls (G)")


def _cameras(navigation: Navigation, recordings: Recordings) -> None:
    imgui.separator_text("cameras")
    cameras, own = recordings.cameras, len(recordings.views.scene.cameras)
    height = min(len(cameras), LISTED) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("cameras", (0, height), imgui.ChildFlags_.nav_flattened)
    for index, camera in enumerate(cameras):
        key = f"{index + 1}  " if index < 9 else "    "
        mark = "  (saved)" if index >= own else ""
        meaning = f"jumps to {camera.name}" + (f" ({index + 1})" if index < 9 else "")
        if listed(f"{key}{camera.name}{mark}##{index}", camera == navigation.camera, meaning):
            recordings.visit(camera)
    imgui.end_child()


def _saving(navigation: Navigation, recordings: Recordings) -> None:
    views, hint = recordings.views, "name of this view..."
    meaning = "saves this view in the store (V); `lambent render --camera NAME` draws it"
    recordings.view_name, wanted = path_field("view name", recordings.view_name, "save view", hint, meaning)
    if wanted:
        recordings.save_view()
    chosen = next((c.name for c in views.saved.cameras if c == navigation.camera), None)
    if chosen is not None:
        _rename_or_delete(recordings, "camera", chosen)


def _rename_or_delete(recordings: Recordings, kind: Kind, name: str) -> None:
    """Draw two buttons, or the field for a new name."""
    views = recordings.views
    if views.renaming == (kind, name):
        meaning = f"renames {name}; Esc cancels"
        views.typed_name, wanted = path_field(f"new {kind} name", views.typed_name, "rename", "new name", meaning)
        if imgui.is_key_pressed(imgui.Key.escape):
            views.renaming = None
        if wanted:
            recordings.rename(kind, name)
        return
    if press(f"rename...##{kind}", f"renames {name}", small=True):
        views.renaming, views.typed_name = (kind, name), name
    imgui.same_line()
    if press(f"delete##{kind}", f"deletes {name} from the store; this cannot be undone", small=True):
        recordings.delete(kind, name)
    imgui.same_line()
    imgui.text_disabled(name)


def _follow(recordings: Recordings) -> None:
    paths, navigation = recordings.paths, recordings.navigation
    names = [path.name for path in paths]
    name = navigation.path.path.name if navigation.path else names[0]
    changed, index = imgui.combo("path", names.index(name) if name in names else 0, names)
    explain("the camera path to play and to film")
    chosen = paths[index]
    if changed:
        navigation.scrub(chosen, 0.0)
    imgui.begin_disabled(recordings.recorder.on)
    if press("pause" if navigation.playing else "play", "plays or pauses the camera path", 64):
        navigation.toggle(chosen)
    imgui.end_disabled()
    imgui.same_line()
    imgui.set_next_item_width(-1)
    time_s = min(navigation.path.time_s, chosen.seconds) if navigation.path else 0.0
    moved, time_s = imgui.slider_float("##time", time_s, 0.0, chosen.seconds, "%.1f s", imgui.SliderFlags_.always_clamp)
    held = imgui.is_item_activated()  # a click at the shown time goes there too: the camera may be elsewhere
    explain("time along the camera path; drag to go there")
    if moved or held:
        navigation.scrub(chosen, time_s)
    if chosen.name in [path.name for path in recordings.views.saved.paths]:
        _rename_or_delete(recordings, "path", chosen.name)


def _record(recordings: Recordings) -> None:
    recorder, navigation = recordings.recorder, recordings.navigation
    if recorder.on:
        imgui.push_style_color(imgui.Col_.text, RED)
        seconds = recordings.screen.clock() - recorder.began_s
        pressed = imgui.button(f"stop recording: {seconds:.0f} s###record", (-1, 0))
        imgui.pop_style_color()
    else:
        pressed = imgui.button("record a walk###record", (-1, 0))
    explain("records the camera until pressed again (R); leaves out the rest before the first step")
    if pressed:
        recordings.record()
    if recorder.draft is None:
        return
    smooth_s = slider(
        "smooth", recorder.smooth_s, 0.0, SMOOTHEST_S, "time over which the motion is averaged", unit=" s"
    )
    if smooth_s != recorder.smooth_s:
        played = navigation.path if navigation.path and navigation.path.path == recorder.draft else None
        recorder.smooth(smooth_s)
        if played is not None:
            navigation.scrub(recorder.draft, played.time_s)
    meaning = "saves the recorded walk in the store"
    recorder.name, wanted = path_field("path name", recorder.name, "save path", "name of the path", meaning)
    if wanted:
        recordings.save()
    if recorder.draft is not None and press("discard the recording", "discards the recorded walk", -1):
        recordings.drop()
