"""Cost of the last frame."""

from __future__ import annotations

from collections.abc import Sequence

from imgui_bundle import imgui

from lambent.viewer.editor.editor import Editor
from lambent.viewer.panels.widgets import rows
from lambent.viewer.screen import Screen


def draw(screen: Screen, editor: Editor | None, notes: Sequence[str] = ()) -> None:
    s, pace = screen.statistics, screen.pace
    width, height = s.resolution
    table = [
        ("adapter", s.adapter),
        ("integrator", s.integrator),
        ("frame", f"{s.frame_ms:.1f} ms"),
        ("picture", f"{width} x {height}" + (f" ({100 * s.scale:.0f} % of the window's)" if s.scale < 1 else "")),
        ("target", f"{pace.target_ms:.0f} ms" if pace.adaptive else "-"),
        ("samples per pixel", str(s.samples)),
        ("at rest", screen.at_rest or "-"),
        ("draw calls", str(s.draw_calls)),
        ("planar reflections", "skipped in motion" if s.mirrors is None else str(s.mirrors)),
    ]
    if editor is not None:
        table.append(("plots", f"{1e3 * editor.shown.moving_seconds:.1f} ms while a slider moves"))
    if maps := s.light_fields:
        table.append(("light fields", f"{maps['resident']} of {maps['maps']} maps, {maps['resident_mb']:.1f} MB"))
        share = maps["misses"] / max(maps["hits"] + maps["misses"], 1)
        table.append(("map reads", f"{maps['hits']} hits, {maps['misses']} misses ({100 * share:.1f} %)"))
        table.append(("maps in view", f"{maps['wanted']}, {maps['no_room']} of them without room"))
        table.append(("cache", str(maps["cache"])))
    table += [(f"GPU: {name}", f"{ms:.2f} ms") for name, ms in s.gpu_ms.items()]
    rows(table, "statistics")
    for note in notes:
        imgui.text_wrapped(note)
