"""The plot of one curve: its lines, the region with its handles, and the mouse over it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from imgui_bundle import imgui, implot

from lambent.core.arrays import Floats
from lambent.editing.curves.operators import Region
from lambent.editing.session.session import Session
from lambent.materials.factored.curve import KNOTS, Curve
from lambent.viewer.modes.edit.curves.axes import END_DEG, Axes, Place
from lambent.viewer.modes.edit.curves.drags import Direction, Tool
from lambent.viewer.modes.edit.curves.lines import decimated, is_grey
from lambent.viewer.modes.edit.curves.regions import EDGES, MEANINGS, STRIP_PX, edges_deg, flags_px, grip_at
from lambent.viewer.modes.edit.curves.state import CurveState, Shown, View, whole_x
from lambent.viewer.panels.plots import BLUE, CHOSEN, DIM, GREEN, MEASURED, MODEL, RED, TEXT
from lambent.viewer.panels.widgets import Colour, shadowed

RGB: tuple[Colour, Colour, Colour] = (RED, GREEN, BLUE)
BAND, LAYER = (0.30, 0.58, 0.95), (1.0, 0.72, 0.2)
FULL = 0.16  # opacity of a region at full strength
_PLOT = implot.Flags_.no_menus | implot.Flags_.no_box_select | implot.Flags_.no_mouse_text | implot.Flags_.no_legend
_X, _Y = implot.ImAxis_.x1, implot.ImAxis_.y1
_BUTTONS = imgui.ButtonFlags_.mouse_button_left | imgui.ButtonFlags_.mouse_button_right
_BUTTONS |= imgui.ButtonFlags_.mouse_button_middle
PADDING_PX = 14.0  # half of the last angle's label
TICKS_DEG = (0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30)  # tick spacings of the angle axis
TOOL_KEYS: tuple[tuple[imgui.Key, Tool], ...] = (
    (imgui.Key.t, "translate"), (imgui.Key.a, "amplify"), (imgui.Key.d, "draw"),
)  # fmt: skip
Line = tuple[int | None, Floats, Floats]  # channel, or None for all; degrees; values


def draw(state: CurveState, session: Session, material: str, shown: Shown, name: str, size: tuple[float, float],
         over: str, outlined: Region | None) -> Axes | None:  # fmt: skip
    """Draw the plot at `size` pixels; `over` names its angle, `outlined` is a region to highlight.

    Returns its axes; None without room.
    """
    curve, original = shown.editable.curves[name], shown.original.curves[name]
    view = state.view(material, name, curve)
    if size[0] < 80 or size[1] < 60 or not implot.begin_plot("##curve", size, _PLOT | implot.Flags_.no_inputs):
        return None
    implot.push_style_var(implot.StyleVar_.plot_padding, imgui.ImVec2(PADDING_PX, 6))
    _axes(view, over)
    implot.setup_finish()
    implot.pop_style_var()
    place, extent = implot.get_plot_pos(), implot.get_plot_size()
    axes = Axes(view.x, view.y, Place(place.x, place.y, extent.x, extent.y))
    hovered = _mouse(state, session, material, shown, name, axes)
    shown = state.shown(session, material)  # after the edits of this frame
    curve = shown.editable.curves[name]
    region = _region(state, view)
    implot.push_plot_clip_rect()
    if state.tool != "draw":
        _band(axes, region, BAND)
    if outlined is not None:
        _band(axes, outlined, LAYER)
    if state.tool == "amplify":
        _base(axes, view, state.direction)
    implot.pop_plot_clip_rect()
    if state.ghost and curve is not original:
        _lines(original, axes, (MEASURED[0], MEASURED[1], MEASURED[2], 0.4), state.channels, 1.2)
    _lines(curve, axes, MODEL, state.channels, 2.0)
    implot.push_plot_clip_rect()
    if state.tool != "draw":
        _flags(state, axes, region, hovered)
    if hovered:
        _cross(axes, curve, state)
    implot.pop_plot_clip_rect()
    implot.end_plot()
    return axes


def value_at(curve: Curve, angle_deg: float) -> Floats:
    """Values (3,) of a curve at an angle in degrees from 0 to 90."""
    place = angle_deg / END_DEG * KNOTS
    low = min(int(place), KNOTS - 1)
    return np.asarray(curve.values[low] + (place - low) * (curve.values[low + 1] - curve.values[low]))


def number(value: float) -> str:
    return f"{value:.4g}"


@lru_cache(maxsize=8)
def points(curve: Curve, low_deg: float, high_deg: float, least: float) -> tuple[Line, ...]:
    """Lines of a curve, clamped to `least`: one if its channels agree, else three."""
    if is_grey(curve.values):
        return ((None, *_kept(curve.values[:, 0], low_deg, high_deg, least)),)
    return tuple((k, *_kept(curve.values[:, k], low_deg, high_deg, least)) for k in range(3))


def _kept(values: Floats, low_deg: float, high_deg: float, least: float) -> tuple[Floats, Floats]:
    x, y = decimated(values, low_deg, high_deg)
    return x, np.maximum(y, least)


def _axes(view: View, over: str) -> None:
    implot.setup_axis(_X, over)
    implot.setup_axis(_Y, None)
    implot.setup_axis_limits(_X, view.x.low, view.x.high, implot.Cond_.always)
    step = next((s for s in TICKS_DEG if (view.x.high - view.x.low) / s <= 7), TICKS_DEG[-1])
    ticks = np.arange(np.ceil(view.x.low / step - 1e-9), np.floor(view.x.high / step + 1e-9) + 1) * step
    implot.setup_axis_ticks(_X, ticks.tolist(), [f"{tick:g}°" for tick in ticks.round(6) + 0.0])
    if view.y.log:
        implot.setup_axis_scale(_Y, implot.Scale_.log10)
    implot.setup_axis_limits(_Y, view.y.low, view.y.high, implot.Cond_.always)


def _region(state: CurveState, view: View) -> Region:
    """The shown region; during a drag, the region of the layer, which may be wider."""
    layers = state.hold.layers if state.hold is not None else ()
    return layers[-1].region if layers else view.region


def _mouse(state: CurveState, session: Session, material: str, shown: Shown, name: str, axes: Axes) -> bool:
    """Handle mouse and keys over the plot; return whether the mouse is over it."""
    io, place = imgui.get_io(), axes.place
    view, before = state.views[material, name], imgui.get_cursor_screen_pos()
    imgui.set_cursor_screen_pos((place.x, place.y))
    imgui.invisible_button("##plot", (place.width, place.height), _BUTTONS)
    hovered, held = imgui.is_item_hovered(), imgui.is_item_active()
    mouse = io.mouse_pos
    if hovered:
        imgui.set_item_key_owner(imgui.Key.mouse_wheel_y)
        steps = io.mouse_wheel or io.mouse_wheel_h  # macOS scrolls sideways with Shift
        if steps:
            view.zoom(axes, (mouse.x, mouse.y), steps, values=io.key_shift or io.key_ctrl)
    imgui.set_cursor_screen_pos(before)
    values = shown.editable.curves[name].values
    if hovered and imgui.is_mouse_double_clicked(0):
        view.fit(values, whole_x())
    elif hovered and imgui.is_mouse_clicked(0):
        state.press(session, material, axes, mouse.x, mouse.y)
    elif state.hold is not None and held and imgui.is_mouse_down(0):
        state.move(session, mouse.x, mouse.y, shift=io.key_shift, ctrl=io.key_ctrl)
    elif state.hold is not None:
        state.release(session)
    if held and (imgui.is_mouse_dragging(1, 0) or imgui.is_mouse_dragging(2, 0)):
        view.pan(axes, io.mouse_delta.x, io.mouse_delta.y)
    if hovered and not io.want_text_input:
        keys(state, session, view, values)
    if hovered or state.hold is not None:
        _pointer(state, view, axes)
    return bool(hovered)


def keys(state: CurveState, session: Session, view: View, values: Floats) -> None:
    """Handle the keys that work while the mouse is over the plot."""
    io = imgui.get_io()
    if io.key_ctrl or io.key_alt:
        return
    pressed = imgui.is_key_pressed
    for key, tool in TOOL_KEYS:
        if pressed(key, False):
            state.tool = tool
    if pressed(imgui.Key.l, False):
        view.set_log(values, not view.y.log)
    if pressed(imgui.Key.f, False):
        view.fit(values)
    if pressed(imgui.Key.escape, False):
        state.cancel(session)


def _pointer(state: CurveState, view: View, axes: Axes) -> None:
    """Set the mouse pointer to the action of a press."""
    mouse = imgui.get_io().mouse_pos
    grip = state.hold.grip if state.hold is not None else grip_at(view.region, axes, mouse.x, mouse.y)
    if state.tool == "draw" or grip is None or grip == "paint":
        return
    resize = imgui.MouseCursor_.resize_all if grip == "curve" else imgui.MouseCursor_.resize_ew
    imgui.set_mouse_cursor(resize)
    if state.hold is None and grip in MEANINGS:
        imgui.set_tooltip(f"{grip}: {MEANINGS[grip]}")
    elif state.hold is None and grip == "bar":
        imgui.set_tooltip("the whole region")


def _lines(curve: Curve, axes: Axes, grey: Colour, channels: tuple[int, ...], weight: float) -> None:
    """Draw the curve's lines, dimmed for channels that are not edited."""
    ghost = weight < 2
    for channel, x, y in points(curve, axes.x.low, axes.x.high, axes.least):
        own = grey if channel is None else RGB[channel]
        alpha = 0.4 if ghost else 1.0 if channel is None or channel in channels else 0.45
        spec = implot.Spec(line_color=(*own[:3], alpha), line_weight=weight)
        implot.plot_line(f"##{'ghost' if ghost else 'curve'} {channel}", x, y, spec)


def _band(axes: Axes, region: Region, colour: tuple[float, float, float]) -> None:
    """Draw a region as a shade that fades over its ramps."""
    lines, place = implot.get_plot_draw_list(), axes.place
    full, none = imgui.get_color_u32((*colour, FULL)), imgui.get_color_u32((*colour, 0.0))
    a, b, c, d = (axes.pixel(edge, 1.0)[0] for edge in edges_deg(region))
    top, bottom = place.y, place.y + place.height
    for low, high, left, right in ((a, b, none, full), (b, c, full, full), (c, d, full, none)):
        lines.add_rect_filled_multi_color((low, top), (high, bottom), left, right, right, left)
    for edge in (b, c):
        lines.add_line((edge, top), (edge, bottom), imgui.get_color_u32((*colour, 0.55)))


def _flags(state: CurveState, axes: Axes, region: Region, hovered: bool) -> None:
    """Draw the handles: b and c above, with a bar between them that moves all; a and d below."""
    lines, place, mouse = implot.get_plot_draw_list(), axes.place, imgui.get_io().mouse_pos
    grip = state.hold.grip if state.hold is not None else grip_at(region, axes, mouse.x, mouse.y) if hovered else None
    flags = flags_px(region, axes)
    if flags["c"][0] > flags["b"][1]:
        shade = imgui.get_color_u32((*BAND, 0.75 if grip == "bar" else 0.4))
        lines.add_rect_filled((flags["b"][1], place.y + 4), (flags["c"][0], place.y + STRIP_PX - 5), shade)
    for edge in EDGES:
        left, right = flags[edge]
        high = edge in "bc"
        top = place.y if high else place.y + place.height - STRIP_PX
        colour = CHOSEN if grip == edge else (*BAND, 1.0)
        lines.add_rect_filled((left, top), (right, top + STRIP_PX), imgui.get_color_u32(colour), 2.0)
        width = imgui.calc_text_size(edge).x
        lines.add_text(
            imgui.get_font(),
            12.0,
            ((left + right - 0.8 * width) / 2, top + 0.5),
            imgui.get_color_u32((0, 0, 0, 1)),
            edge,
        )


def _base(axes: Axes, view: View, direction: Direction) -> None:
    """Draw the lines that amplification leaves in place."""
    lines, place, colour = implot.get_plot_draw_list(), axes.place, imgui.get_color_u32((*CHOSEN[:3], 0.7))
    x, y = axes.pixel(*view.base)
    if direction != "x":
        lines.add_line((place.x, y), (place.x + place.width, y), colour)
    if direction != "y":
        lines.add_line((x, place.y), (x, place.y + place.height), colour)


def _cross(axes: Axes, curve: Curve, state: CurveState) -> None:
    """Draw a line at the mouse's angle, dots on the curve, and their values."""
    lines, place, mouse = implot.get_plot_draw_list(), axes.place, imgui.get_io().mouse_pos
    angle, value = axes.at(mouse.x, mouse.y)
    lines.add_line((mouse.x, place.y), (mouse.x, place.y + place.height), imgui.get_color_u32((1, 1, 1, 0.16)))
    values, grey = value_at(curve, angle), len(points(curve, axes.x.low, axes.x.high, axes.least)) == 1
    words: list[tuple[str, Colour]] = [(f"{angle:.2f}°", TEXT)]
    for channel in (0,) if grey else (0, 1, 2):
        colour = MODEL if grey else RGB[channel]
        lines.add_circle_filled(
            axes.pixel(angle, max(float(values[channel]), 1e-300)), 3.0, imgui.get_color_u32(colour)
        )
        words.append((number(float(values[channel])), colour))
    words.append((f"mouse {number(value)}", DIM))
    gap = 10.0
    width = sum(imgui.calc_text_size(text).x + gap for text, _ in words)
    x, y = place.x + place.width - width, place.y + STRIP_PX + 4
    for text, colour in words:
        shadowed(lines, (x, y), text, colour)
        x += imgui.calc_text_size(text).x + gap
