"""What the material is shown on, in which light, and how bright."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.editor.preview import SHAPES
from lambent.viewer.panels.view import EXPOSURE_EV
from lambent.viewer.panels.widgets import choice, explain, path_field, slider
from lambent.viewer.state import ViewerState

TITLE = "Preview"


def draw(state: ViewerState) -> None:
    preview, editor = state.preview, state.editor
    if preview is None or editor is None:
        return
    preview.shape = choice("shape", preview.shape, tuple(SHAPES))
    preview.environment = choice("light", preview.environment, preview.environments)
    explain("every environment is scaled to the same mean radiance")
    typed, wanted = path_field(
        "environment", editor.typed.get("light", ""), "add", hint="another .hdr or .exr, lat-long..."
    )
    editor.typed["light"] = typed
    if wanted:
        editor.open(typed)
    state.exposure_ev = slider("exposure##preview", state.exposure_ev, -EXPOSURE_EV, EXPOSURE_EV, unit=" EV")
    _, editor.plots_shown = imgui.checkbox("disks and curves beside the picture", editor.plots_shown)
