"""What the last picture cost."""

from __future__ import annotations

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
        ("picture", f"{width} x {height}"),
        ("samples per pixel", str(s.samples)),
        ("at rest", f"{s.accumulated} of {s.accumulate_to}" if s.accumulated else "-"),
        ("draw calls", str(s.draw_calls)),
    ]
    if state.editor is not None:
        table.append(("disks, curves, error", f"{1e3 * state.editor.shown.moving_seconds:.1f} ms while a slider moves"))
    table += [(f"GPU: {name}", f"{ms:.2f} ms") for name, ms in s.gpu_ms.items()]
    rows(table, "statistics")
