"""Where the viewer stands: walking or orbiting, cameras and saved views, camera paths; and what the store lacks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from imgui_bundle import imgui

from lambent.viewer.panels import recording
from lambent.viewer.panels.widgets import explain, path_field
from lambent.viewer.state import ViewerState

TITLE = "Scene"
LISTED = 6
WARNINGS = 3  # more are folded away: the panels below them would be out of sight


def draw(state: ViewerState) -> None:
    _movement(state)
    if state.cameras:
        _cameras(state)
    _saving(state)
    recording.draw(state)
    imgui.push_style_color(imgui.Col_.text, (1.0, 0.75, 0.35, 1.0))
    _lines(state.missing)
    loaded = state.scene.warnings
    if len(loaded) <= WARNINGS:
        _lines(loaded)
    elif imgui.tree_node(f"{len(loaded)} notes on the scene's file###warnings"):
        _lines(loaded)
        imgui.tree_pop()
    imgui.pop_style_color()


def _lines(texts: Sequence[str]) -> None:
    imgui.push_text_wrap_pos()
    for text in texts:
        imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()


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
    cameras, own = state.cameras, len(state.scene.cameras)
    height = min(len(cameras), LISTED) * imgui.get_text_line_height_with_spacing()
    imgui.begin_child("cameras", (0, height))
    for index, camera in enumerate(cameras):
        key = f"{index + 1}  " if index < 9 else "    "
        mark = "  (saved)" if index >= own else ""
        if imgui.selectable(f"{key}{camera.name}{mark}##{index}", camera == state.camera)[0]:
            state.jump(camera)
    imgui.end_child()


def _saving(state: ViewerState) -> None:
    views = state.views
    if views is None:
        return
    state.view_name, wanted = path_field("view name", state.view_name, "save view", hint="name of this view...")
    explain("keeps where you stand, beside the store (V); `lambent render --camera NAME` shows it")
    if wanted:
        state.save_view()
    chosen = next((c.name for c in views.cameras if c == state.camera), None)
    if chosen is None:
        return
    change = rename_or_delete(state, "camera", chosen)
    if change == "delete" and views.delete_camera(chosen):
        state.jump(replace(state.camera, name="free"))
        state.say(f"deleted the view {chosen}")
    elif change == "rename" and views.rename_camera(chosen, state.typed_name):
        state.jump(replace(state.camera, name=state.typed_name.strip()))
        state.renaming = None


def rename_or_delete(state: ViewerState, kind: str, name: str) -> str | None:
    """Two buttons for what was saved; "rename" once a new name stands in `typed_name`, "delete", or None."""
    if state.renaming == (kind, name):
        state.typed_name, done = path_field(f"new {kind} name", state.typed_name, "rename", hint="new name")
        if imgui.is_key_pressed(imgui.Key.escape):
            state.renaming = None
        return "rename" if done else None
    if imgui.small_button(f"rename...##{kind}"):
        state.renaming, state.typed_name = (kind, name), name
    imgui.same_line()
    deleted = imgui.small_button(f"delete##{kind}")
    imgui.same_line()
    imgui.text_disabled(name)
    return "delete" if deleted else None
