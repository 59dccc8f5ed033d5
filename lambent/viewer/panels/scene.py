"""Where the viewer stands: cameras, camera paths, walking or orbiting; and what the store lacks."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.state import ViewerState

TITLE = "Scene"
LISTED = 6


def draw(state: ViewerState) -> None:
    _movement(state)
    if state.scene.cameras:
        _cameras(state)
    if state.scene.paths:
        _path(state)
    for warning in (*state.scene.warnings, *state.missing):
        imgui.push_style_color(imgui.Col_.text, (1.0, 0.75, 0.35, 1.0))
        imgui.push_text_wrap_pos()
        imgui.text_unformatted(warning)
        imgui.pop_text_wrap_pos()
        imgui.pop_style_color()


def _movement(state: ViewerState) -> None:
    if imgui.radio_button("walk", state.mode == "walk"):
        state.mode = "walk"
    imgui.same_line()
    if imgui.radio_button("orbit", state.mode == "orbit"):
        state.mode = "orbit"
    if state.mode == "walk":
        imgui.same_line()
        _, state.flying = imgui.checkbox("fly", state.flying)


def _cameras(state: ViewerState) -> None:
    imgui.separator_text("cameras")
    cameras = state.scene.cameras
    height = min(len(cameras), LISTED) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("cameras", (0, height))
    for index, camera in enumerate(cameras):
        key = f"{index + 1}  " if index < 9 else "    "
        if imgui.selectable(f"{key}{camera.name}##{index}", camera == state.camera)[0]:
            state.jump(camera)
    imgui.end_child()


def _path(state: ViewerState) -> None:
    imgui.separator_text("camera path")
    paths = state.scene.paths
    current = state.path.path if state.path else paths[0]
    index = paths.index(current)
    changed, index = imgui.combo("path", index, [path.name for path in paths])
    chosen = paths[index]
    if changed:
        state.scrub(chosen, 0.0)
    if imgui.button("pause" if state.playing else "play", (64, 0)):
        state.toggle(chosen)
    imgui.same_line()
    imgui.set_next_item_width(-1)
    time_s = state.path.time_s if state.path else 0.0
    moved, time_s = imgui.slider_float("##time", time_s, 0.0, chosen.seconds, "%.1f s", imgui.SliderFlags_.always_clamp)
    if moved:
        state.scrub(chosen, time_s)
