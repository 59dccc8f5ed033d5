"""In-plane curves of the chosen incident direction, measured (dots) against model (lines), and the albedo."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from imgui_bundle import imgui, implot

from lambent.viewer.editor.editor import CHANNELS, SCALES, Editor
from lambent.viewer.editor.readings import ALBEDO_THETA_DEG, THETA_O_DEG, Floats
from lambent.viewer.panels.widgets import explain

Colour = tuple[float, float, float, float]

ALBEDO_SHARE = 0.34
MEASURED, MODEL, OTHER, SOURCE = (0.86, 0.88, 0.9, 1), (1.0, 0.62, 0.2, 1), (0.35, 0.72, 1.0, 1), (1.0, 0.85, 0.3, 0.5)
RED, GREEN, BLUE = (1.0, 0.42, 0.38, 1), (0.42, 0.86, 0.46, 1), (0.45, 0.62, 1.0, 1)
ONE = {"red": (0, RED), "green": (1, GREEN), "blue": (2, BLUE)}
LEAST_P = 1e-5  # 1/sr; the lower end of the logarithmic axis
TICKS = (0.001, 0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)
_PLOT = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text


def draw(editor: Editor, textures: Mapping[str, imgui.ImTextureRef]) -> None:
    _choices(editor)
    room = imgui.get_content_region_avail()
    if room.x < 120 or room.y < 60:
        return
    space = imgui.get_style().item_spacing.x
    wide = (room.x - space) * (1 - ALBEDO_SHARE)
    _in_plane(editor, (wide, room.y))
    imgui.same_line()
    _albedo(editor, (room.x - space - wide, room.y))


def _choices(editor: Editor) -> None:
    imgui.set_next_item_width(110)
    _, index = imgui.combo("##axis", SCALES.index(editor.scale), list(SCALES))
    if editor.scale != SCALES[index]:
        editor.scale, editor.fit_axes = SCALES[index], True
    explain("scale of the axis of p")
    imgui.same_line()
    imgui.set_next_item_width(90)
    _, index = imgui.combo("##channel", CHANNELS.index(editor.channel), list(CHANNELS))
    editor.channel = CHANNELS[index]
    explain("mean over the channels, all three, or one")
    imgui.same_line()
    shown = editor.shown
    if shown.incidents:
        incident = shown.incidents[editor.chosen]
        words = f"in the plane of incidence, theta_i {incident.theta_deg:g}°, phi_i {incident.phi_deg:g}°"
        if editor.channel == "RGB":
            words += "; dots measured, lines model" + (" A, thin model B" if editor.compared else "")
        imgui.text_disabled(words)


def _lines(editor: Editor, values: Floats) -> list[tuple[str, Floats, Colour | None]]:
    """(channel, values (N,), colour) of values (N, C); colour None: that of the kind."""
    if values.shape[1] == 1 or editor.channel == "mean":
        return [("", values.mean(axis=1), None)]
    if editor.channel == "RGB":
        return [(f" {name}", values[:, k], colour) for name, (k, colour) in ONE.items()]
    k = ONE[editor.channel][0]
    return [("", values[:, k], None)]


def _scaled(editor: Editor, p: Floats) -> Floats:
    p = np.cbrt(p) if editor.scale == "cube root" else np.maximum(p, LEAST_P) if editor.scale == "log" else p
    return np.ascontiguousarray(p, np.float64)


def _in_plane(editor: Editor, size: tuple[float, float]) -> None:
    shown = editor.shown
    if not shown.incidents or not implot.begin_plot("##in plane", size, _flags(editor)):
        return
    top = _top(editor)
    implot.setup_axis(implot.ImAxis_.x1, "theta_o in degrees; the light is on the left")
    implot.setup_axis(implot.ImAxis_.y1, "p in 1/sr")
    implot.setup_axis_limits(implot.ImAxis_.x1, -90, 90)
    implot.setup_axis_limits_constraints(implot.ImAxis_.x1, -90, 90)
    ticks = [-90.0, -60.0, -30.0, 0.0, 30.0, 60.0, 90.0]
    implot.setup_axis_ticks(implot.ImAxis_.x1, ticks, [f"{t:g}" for t in ticks])
    always = implot.Cond_.always if editor.fit_axes else implot.Cond_.once
    if editor.scale == "log":
        implot.setup_axis_scale(implot.ImAxis_.y1, implot.Scale_.log10)
        implot.setup_axis_limits(implot.ImAxis_.y1, max(LEAST_P, top * 1e-5), top * 2, always)
    elif editor.scale == "cube root":
        roots = [0.0, *(float(np.cbrt(t)) for t in TICKS if t < 3 * top)]
        names = ["0", *(f"{t:g}" for t in TICKS if t < 3 * top)]
        between = [float(np.cbrt(t * m)) for t in TICKS if t < 3 * top for m in (2, 5)]
        implot.setup_axis_ticks(implot.ImAxis_.y1, [*roots, *between], [*names, *[""] * len(between)])
        implot.setup_axis_limits(implot.ImAxis_.y1, 0, 1.08 * float(np.cbrt(top)), always)
    else:
        implot.setup_axis_limits(implot.ImAxis_.y1, 0, 1.08 * top, always)
    editor.fit_axes = False
    implot.setup_legend(implot.Location_.north_west)
    implot.setup_finish()
    incident, a = shown.incidents[editor.chosen], "model A" if editor.compared else "model"
    implot.plot_inf_lines("##source", np.array([-incident.theta_deg]), spec=_spec(SOURCE, 1.0))
    for far in (False, True) if shown.transmits else (False,):
        word = ", transmitted" if far else ""
        if far in shown.measured_curve and editor.measurement is not None:
            x, p = shown.measured_curve[far]
            if len(x):
                _dots(editor, f"measured{word}", x, p, far)
        for name, title, colour in (("B", "model B", OTHER), ("A", a, MODEL)):
            if (name, far) in shown.curves:
                _line(editor, f"{title}{word}", THETA_O_DEG, shown.curves[name, far], colour, far)
    implot.end_plot()


def _flags(editor: Editor) -> int:
    """Of the plot: nine colours need no legend, they say it themselves."""
    return _PLOT | implot.Flags_.no_legend if editor.channel == "RGB" else _PLOT


def _top(editor: Editor) -> float:
    """The largest value that the axis of p has to hold: of the measurement where there is one."""
    shown = editor.shown
    values = [p for _, p in shown.measured_curve.values() if len(p)] if editor.measurement is not None else []
    values = values or [shown.curves["A", False], shown.curves["A", True]]
    return max(max(float(p.max()) for p in values), 1e-3)


def _dots(editor: Editor, label: str, x: Floats, values: Floats, far: bool, *, scale: bool = True) -> None:
    marker = implot.Marker_.up if far else implot.Marker_.circle
    for channel, y, colour in _lines(editor, values):
        colour = colour or MEASURED
        spec = implot.Spec(marker=marker, marker_size=2.6, marker_line_color=colour, marker_fill_color=colour)
        y = _scaled(editor, y) if scale else np.ascontiguousarray(y, np.float64)
        implot.plot_scatter(label + channel, np.ascontiguousarray(x, np.float64), y, spec)


def _line(
    editor: Editor, label: str, x: Floats, values: Floats, of_kind: Colour, far: bool, *, scale: bool = True
) -> None:
    for channel, y, colour in _lines(editor, values):
        y = _scaled(editor, y) if scale else np.ascontiguousarray(y, np.float64)
        weight = (1.4 if far else 2.0) * (0.5 if colour is not None and of_kind == OTHER else 1.0)
        implot.plot_line(label + channel, np.ascontiguousarray(x), y, _spec(colour or of_kind, weight))


def _spec(colour: Colour, weight: float) -> implot.Spec:
    return implot.Spec(line_color=colour, line_weight=weight)


def _albedo(editor: Editor, size: tuple[float, float]) -> None:
    shown = editor.shown
    if not shown.albedos or not implot.begin_plot("##albedo", size, _PLOT | implot.Flags_.no_legend):
        return
    implot.setup_axis(implot.ImAxis_.x1, "theta_i in degrees")
    implot.setup_axis(implot.ImAxis_.y1, "albedo" + (" (triangles, thin: transmitted)" if shown.transmits else ""))
    ticks = [0.0, 30.0, 60.0, 90.0]
    implot.setup_axis_ticks(implot.ImAxis_.x1, ticks, [f"{t:g}" for t in ticks])
    implot.setup_axis_limits(implot.ImAxis_.x1, 0, 90)
    values = [v for (_, far), v in shown.albedos.items() if shown.transmits or not far]
    values += [v for far, (_, v) in shown.measured_albedo.items() if editor.measurement is not None and len(v)]
    top = max(0.05, *(float(v.max()) for v in values))
    implot.setup_axis_limits(implot.ImAxis_.y1, 0, 1.15 * top, implot.Cond_.always)
    implot.setup_finish()
    if top > 0.8:
        implot.plot_inf_lines(
            "##one",
            np.array([1.0]),
            spec=implot.Spec(line_color=(0.6, 0.6, 0.6, 0.6), flags=implot.InfLinesFlags_.horizontal),
        )
    a = "model A" if editor.compared else "model"
    for far in (False, True) if shown.transmits else (False,):
        word = "transmitted" if far else "reflected"
        if far in shown.measured_albedo and editor.measurement is not None:
            theta, albedo = shown.measured_albedo[far]
            _dots(editor, f"measured, {word}", theta, albedo, far, scale=False)
        for name, title, colour in (("B", "model B", OTHER), ("A", a, MODEL)):
            if (name, far) in shown.albedos:
                _line(editor, f"{title}, {word}", ALBEDO_THETA_DEG, shown.albedos[name, far], colour, far, scale=False)
    implot.end_plot()
