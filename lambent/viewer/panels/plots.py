"""The editor's plots: disks right of the picture, in-plane curves and albedo below it, measured against model."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from imgui_bundle import imgui, implot

from lambent.core.arrays import Floats
from lambent.viewer.editor.editor import Editor
from lambent.viewer.editor.matrix import Matrix, matrix
from lambent.viewer.editor.shown import CHANNELS, SCALES, Curves, Plots
from lambent.viewer.mode import SidePlots, Textures
from lambent.viewer.panels.widgets import Colour, choice, coloured, explain, px

BRIGHTER_PX, BRIGHTER_STOPS = 120.0, (0.0, 20.0)
GAP_PX = 2.0  # gap around a disk
CHOSEN, RIM, TEXT, DIM = (1.0, 0.72, 0.2, 1.0), (0.33, 0.35, 0.38, 1.0), (0.8, 0.82, 0.85, 1.0), (0.6, 0.63, 0.68, 1.0)
ALBEDO_SHARE = 0.34  # share of the width below the picture
MEASURED, MODEL, OTHER, SOURCE = (0.86, 0.88, 0.9, 1), (1.0, 0.62, 0.2, 1), (0.35, 0.72, 1.0, 1), (1.0, 0.85, 0.3, 0.5)
KINDS = {"measured": MEASURED, "B": OTHER, "A": MODEL}  # drawn in this order
RED, GREEN, BLUE = (1.0, 0.42, 0.38, 1), (0.42, 0.86, 0.46, 1), (0.45, 0.62, 1.0, 1)
ONE = {"red": (0, RED), "green": (1, GREEN), "blue": (2, BLUE)}
LEAST_P = 1e-5  # 1/sr; the lower end of the logarithmic axis
TICKS = (0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
_CLAMP = imgui.SliderFlags_.always_clamp
_PLOT = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text
X, Y = implot.ImAxis_.x1, implot.ImAxis_.y1


def side_plots(editor: Editor | None) -> SidePlots | None:
    """The plots of an open editor."""
    if editor is None or not editor.plots.visible:
        return None
    return SidePlots(partial(_disks, editor), partial(_curves, editor), editor.shown.images)


def _title(editor: Editor, kind: str) -> str:
    return kind if kind == "measured" else f"model {kind}" if kind == "B" or editor.subject.compared else "model"


# Disks: every incident direction, measurement and model side by side; a click chooses a direction.


def _disks(editor: Editor, textures: Textures) -> None:
    shown, chosen = editor.shown, editor.plots.chosen
    kinds = [kind for kind in ("measured", "A", "B") if kind in shown.layout and kind in textures]
    imgui.set_next_item_width(min(BRIGHTER_PX, imgui.get_content_region_avail().x))
    meaning = "brightens all disks by this number of stops, to show dark parts beside a highlight"
    plots = editor.plots
    plots.brighter = imgui.slider_float("##brighter", plots.brighter, *BRIGHTER_STOPS, "%+.1f stops", _CLAMP)[1]
    explain(meaning)
    imgui.same_line()
    imgui.text_disabled("cube root of p")
    explain(
        "p = f cos theta_o is the transfer probability in 1/sr; theta_o runs from the centre to the rim, light comes\n"
        "from the top; white is the same in all disks; dark blue was not measured; hatched is known by symmetry\n"
        "alone; with transmission the far side stands below"
    )
    imgui.same_line()
    if shown.incidents:
        coloured(str(shown.incidents[chosen]), CHOSEN)
    origin, room = imgui.get_cursor_screen_pos(), imgui.get_content_region_avail()
    if not kinds or room.x < 80 or room.y < 40:
        return
    laid = matrix(shown.incidents, len(kinds), 2 if shown.transmits else 1, room.x, room.y)
    _words(laid, [_title(editor, kind) for kind in kinds], origin)
    lines, mouse = imgui.get_window_draw_list(), imgui.get_io().mouse_pos
    inside = laid.step - 2 * GAP_PX
    for (kind, index, far), (left, top) in laid.tiles.items():
        disks, incident = shown.layout[kinds[kind]], shown.incidents[index]
        if (index, far) not in disks.tiles:
            continue
        x, y, radius = origin.x + left + GAP_PX, origin.y + top + GAP_PX, inside / 2
        lines.add_image(textures[kinds[kind]], (x, y), (x + inside, y + inside), *disks.place(index, far))
        centre, rim = (x + radius, y + radius), (CHOSEN, 2.0) if index == chosen else (RIM, 1.0)
        lines.add_circle(centre, radius, imgui.get_color_u32(rim[0]), 0, rim[1])
        if laid.step >= 40:
            light = (centre[0], centre[1] - radius * incident.theta_deg / 90)
            lines.add_circle_filled(light, 2.5, imgui.get_color_u32(CHOSEN))
        over = 0 <= mouse.x - origin.x - left < laid.step and 0 <= mouse.y - origin.y - top < laid.step
        if over and imgui.is_window_hovered():
            imgui.set_tooltip(f"{incident}{', transmitted' if far else ''}")
            if imgui.is_mouse_clicked(0):
                editor.plots.choose(index)


def _words(laid: Matrix, kinds: list[str], origin: imgui.ImVec2) -> None:
    lines = imgui.get_window_draw_list()
    for x, y, text in laid.titles:
        words = kinds[text] if isinstance(text, int) else text
        if words.endswith("°") and laid.step < imgui.calc_text_size(words).x + 2:
            continue
        colour = imgui.get_color_u32(TEXT if isinstance(text, int) else DIM)
        lines.add_text((origin.x + x, origin.y + y), colour, words)


# Curves: measurement as dots, model as lines.


def _curves(editor: Editor, textures: Textures) -> None:
    plots, shown = editor.plots, editor.shown
    scale = choice("##axis", plots.scale, SCALES, "scale of the p axis", px(110))
    if plots.scale != scale:
        plots.scale, plots.fit_axes = scale, True
    imgui.same_line()
    plots.channel = choice("##channel", plots.channel, CHANNELS, "channels: their mean, all three, or one", px(90))
    imgui.same_line()
    if not shown.curves:  # before the first frame
        return
    words = f"in the plane of incidence, {shown.incidents[plots.chosen]}"
    if plots.channel == "RGB":
        words += "; dots measured, lines model" + (" A, thin model B" if editor.subject.compared else "")
    imgui.text_disabled(words)
    room = imgui.get_content_region_avail()
    if room.x < 120 or room.y < 60:
        return
    space = imgui.get_style().item_spacing.x
    wide = (room.x - space) * (1 - ALBEDO_SHARE)
    legend = implot.Flags_.none if plots.channel != "RGB" else implot.Flags_.no_legend  # nine curves would fill it
    if implot.begin_plot("##in plane", (wide, room.y), _PLOT | legend):
        _in_plane(editor, room.y)
        implot.end_plot()
    imgui.same_line()
    size = (room.x - space - wide, room.y)
    if shown.albedos and implot.begin_plot("##albedo", size, _PLOT | implot.Flags_.no_legend):
        _albedo(editor)
        implot.end_plot()


def _in_plane(editor: Editor, height: float) -> None:
    shown, plots, curves = editor.shown, editor.plots, editor.shown.curves
    # The axis covers the measurement, if there is one.
    tops = [p for (kind, _), (_, p) in curves.items() if kind == "measured" and len(p)]
    top = max(1e-3, *(float(p.max()) for p in tops or (curves["A", False][1], curves["A", True][1])))
    _axes("theta_o in degrees; the light is on the left", "p in 1/sr", range(-90, 91, 30))
    implot.setup_axis_limits_constraints(X, -90, 90)
    always = implot.Cond_.always if plots.fit_axes else implot.Cond_.once
    if plots.scale == "log":
        implot.setup_axis_scale(Y, implot.Scale_.log10)
        implot.setup_axis_limits(Y, max(LEAST_P, top * 1e-5), top * 2, always)
    elif plots.scale == "cube root":
        ticks = [0.0, *(t for t in TICKS if t < 3 * top)]
        between = [t * m for t in ticks[1:] for m in (2, 5)]
        places = [float(np.cbrt(t)) for t in (*ticks, *between)]
        apart = imgui.get_text_line_height() / height * 1.08 * float(np.cbrt(top))  # height of a label on the axis
        implot.setup_axis_ticks(Y, places, labels_apart(ticks, apart) + [""] * len(between))
        implot.setup_axis_limits(Y, 0, 1.08 * float(np.cbrt(top)), always)
    else:
        implot.setup_axis_limits(Y, 0, 1.08 * top, always)
    plots.fit_axes = False
    implot.setup_legend(implot.Location_.north_west)
    implot.setup_finish()
    theta_deg = shown.incidents[plots.chosen].theta_deg
    implot.plot_inf_lines("##source", np.array([-theta_deg]), spec=implot.Spec(line_color=SOURCE, line_weight=1.0))
    _series(editor, curves, plots.scale)


def labels_apart(ticks: Sequence[float], apart: float) -> list[str]:
    """Labels of ascending ticks, 0 first, of a cube root axis; empty where closer than `apart` to a larger one or 0."""
    labels, last = list[str](), np.inf
    for tick in reversed(ticks):
        place = float(np.cbrt(tick))
        fits = place == 0 or (last - place >= apart and place >= apart)
        labels.append(f"{tick:g}" if fits else "")
        last = place if fits else last
    return labels[::-1]


def _albedo(editor: Editor) -> None:
    shown, albedos = editor.shown, editor.shown.albedos
    words = "albedo" + (" (triangles, thin: transmitted)" if shown.transmits else "")
    _axes("theta_i in degrees", words, range(0, 91, 30))
    values = [v for (_, far), (_, v) in albedos.items() if len(v) and (shown.transmits or not far)]
    top = max(0.05, *(float(v.max()) for v in values))
    implot.setup_axis_limits(Y, 0, 1.15 * top, implot.Cond_.always)
    implot.setup_finish()
    if top > 0.8:
        level = implot.Spec(line_color=(0.6, 0.6, 0.6, 0.6), flags=implot.InfLinesFlags_.horizontal)
        implot.plot_inf_lines("##one", np.array([1.0]), spec=level)
    _series(editor, albedos, "linear")


def _axes(x: str, y: str, ticks: range) -> None:
    implot.setup_axis(X, x)
    implot.setup_axis(Y, y)
    implot.setup_axis_limits(X, ticks[0], ticks[-1])
    implot.setup_axis_ticks(X, list(map(float, ticks)), list(map(str, ticks)))


def _series(editor: Editor, curves: Curves, scale: str) -> None:
    """Draw the curves of both sides; triangles and thin lines are transmitted light."""
    for far in (False, True) if editor.shown.transmits else (False,):
        for kind, colour in KINDS.items():
            x, values = curves.get((kind, far), ((), np.zeros((0, 1))))
            label = _title(editor, kind) + (", transmitted" if far else "")
            for channel, y, own in _channels(editor.plots, values) if len(x) else ():
                x, y = np.ascontiguousarray(x, np.float64), _scaled(scale, y)
                if kind == "measured":
                    marker = implot.Marker_.up if far else implot.Marker_.circle
                    fill = own or colour
                    spec = implot.Spec(marker=marker, marker_size=2.6, marker_line_color=fill, marker_fill_color=fill)
                    implot.plot_scatter(label + channel, x, y, spec)
                else:
                    weight = (1.4 if far else 2.0) * (0.5 if own is not None and kind == "B" else 1.0)
                    spec = implot.Spec(line_color=own or colour, line_weight=weight)
                    implot.plot_line(label + channel, x, y, spec)


def _channels(plots: Plots, values: Floats) -> list[tuple[str, Floats, Colour | None]]:
    """(channel, values (N,), colour) of values (N, C); colour None: the colour of the kind."""
    if values.shape[1] == 1 or plots.channel == "mean":
        return [("", values.mean(axis=1), None)]
    if plots.channel == "RGB":
        return [(f" {name}", values[:, k], colour) for name, (k, colour) in ONE.items()]
    return [("", values[:, ONE[plots.channel][0]], None)]


def _scaled(scale: str, p: Floats) -> Floats:
    p = np.cbrt(p) if scale == "cube root" else np.maximum(p, LEAST_P) if scale == "log" else p
    return np.ascontiguousarray(p, np.float64)
