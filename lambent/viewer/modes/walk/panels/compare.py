"""The Compare panel: the picture beside another, or a map of their differences."""

from __future__ import annotations

from imgui_bundle import imgui

from lambent.viewer.look import INTEGRATORS, LOOKUPS
from lambent.viewer.modes.walk.at_rest.tracing import KINDS as TRACED
from lambent.viewer.modes.walk.comparison import AS_A, KINDS, MODES, Comparison
from lambent.viewer.panels.widgets import choice, rows, wrapped


def draw(comparison: Comparison) -> None:
    comparison.mode = choice(
        "compare",
        comparison.mode,
        MODES,
        "compares this picture A with another B: side by side, or as an error map",
    )
    if not comparison.on:
        return
    meaning = (
        "B: traced against the baked light, beside a drawn A; whole paths, or an integrator, beside the picture at rest"
    )
    comparison.integrator = choice("with B", comparison.integrator, (*TRACED, *INTEGRATORS), meaning)
    if comparison.traced_kind is not None:
        if comparison.fault:
            wrapped([comparison.fault])
            return
    else:
        meaning = (
            "where B looks up reflected light: as A does, or with one look-up for all objects; plain: a single probe"
        )
        comparison.look_up = choice("look-up of B", comparison.look_up, (AS_A, *LOOKUPS), meaning)
    if comparison.mode == "error map":
        meaning = "difference in luminance in per cent of B, or the difference that a viewer notices (FLIP)"
        comparison.kind = choice("map", comparison.kind, KINDS, meaning)
    figures = comparison.figures
    if figures is None:
        imgui.text_disabled("figures are computed at rest")
        return
    flip = "computing" if comparison.busy and figures.flip_mean is None else "-"
    if figures.flip_mean is not None:
        half = " at half size" if figures.flip_step > 1 else ""
        older = f", of {max(figures.flip_of)} samples" if figures.flip_of != figures.of else ""
        flip = f"{figures.flip_mean:.4f}{half}{older}"
    table = [
        ("PSNR", f"{figures.psnr_db:.1f} dB"),
        ("mean FLIP", flip),
        ("mean difference", f"{figures.difference_percent:.2f} % of B"),
        *((f"{side} so far", f"{n} samples" if n else "one frame") for side, n in zip("AB", figures.of, strict=True)),
    ]
    rows(table, "figures")
