"""What the last picture cost."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.panels.widgets import rows
from lambent.viewer.state import ViewerState

TITLE = "Statistics"


def draw(state: ViewerState) -> None:
    s = state.statistics
    width, height = s.resolution
    table = [
        ("adapter", s.adapter),
        ("integrator", s.integrator),
        ("frame", f"{s.frame_ms:.1f} ms"),
        ("picture", f"{width} x {height}" + (f" ({100 * s.scale:.0f} % of the window's)" if s.scale < 1 else "")),
        ("frame wanted", f"{state.target_ms:.0f} ms" if state.adaptive_resolution else "-"),
        ("samples per pixel", str(s.samples)),
        ("at rest", f"{s.accumulated} of {s.accumulate_to}" if s.accumulated else "-"),
        ("draw calls", str(s.draw_calls)),
        ("mirror pictures", "left out in motion" if s.mirrors is None else str(s.mirrors)),
    ]
    if state.editor is not None:
        table.append(("disks, curves, error", f"{1e3 * state.editor.shown.moving_seconds:.1f} ms while a slider moves"))
    table += [(f"GPU: {name}", f"{ms:.2f} ms") for name, ms in s.gpu_ms.items()]
    rows(table, "statistics")
    for note in state.notes:
        imgui.text_wrapped(note)
