"""The Compare panel: the picture beside another integrator's, or how far the two are apart."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.look import INTEGRATORS, LOOKUPS
from lambent.viewer.modes.walk.comparison import AS_A, KINDS, MODES, TRACED, Comparison
from lambent.viewer.panels.widgets import choice, rows, wrapped


def draw(comparison: Comparison) -> None:
    comparison.mode = choice(
        "compare", comparison.mode, MODES, "shows this picture beside another integrator's, or how far they are apart"
    )
    if not comparison.on:
        imgui.text_wrapped("Off: the picture refines by itself while nothing moves.")
        return
    meaning = (
        "integrator of B; qmc is unbiased and accumulates while nothing moves, path traces the scene itself, beside "
        "the window; A stays that of motion"
    )
    comparison.integrator = choice("with B", comparison.integrator, (*INTEGRATORS, TRACED), meaning)
    if comparison.is_traced:
        if comparison.fault:
            wrapped([comparison.fault])
            return
    else:
        meaning = (
            "where B finds reflected light: as A, or of all objects by one look-up, as of the single probe by plain"
        )
        comparison.look_up = choice("look-up of B", comparison.look_up, (AS_A, *LOOKUPS), meaning)
    if comparison.mode == "error map":
        meaning = "the difference of luminance in percent of B's, or what a viewer notices (FLIP)"
        comparison.kind = choice("map", comparison.kind, KINDS, meaning)
    figures = comparison.figures
    if figures is None:
        imgui.text_disabled("figures come while nothing moves")
        return
    flip = "being computed" if comparison.busy and figures.flip_mean is None else "-"
    if figures.flip_mean is not None:
        half = " at half size" if figures.flip_step > 1 else ""
        older = f", of {figures.flip_of} samples" if figures.flip_of != figures.of else ""
        flip = f"{figures.flip_mean:.4f}{half}{older}"
    table = [
        ("PSNR", f"{figures.psnr_db:.1f} dB"),
        ("mean FLIP", flip),
        ("mean difference", f"{figures.difference_percent:.2f} % of B"),
        ("B so far", f"{figures.of} samples" if figures.of else "one frame"),
    ]
    rows(table, "figures")
