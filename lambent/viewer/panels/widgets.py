"""Controls shared by panels. Each returns the value after this frame.

Every control has a `meaning`: its tooltip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np
from imgui_bundle import imgui

from lambent.core.light.colour import srgb_decode, srgb_encode
from lambent.core.plain import Triple, triple

Colour = tuple[float, float, float, float]
Word = TypeVar("Word", bound=str)
THREE_PX = 150.0  # least width of three sliders with three digits
TOOLTIP_GAP_PX = 4.0
AMBER, DIM = (1.0, 0.75, 0.35, 1.0), (0.62, 0.65, 0.70, 1.0)


def px(size: float) -> float:
    """A size in the scale of letters and controls."""
    return float(size * imgui.get_style().font_scale_dpi)


def choice(label: str, value: Word, options: Sequence[Word], meaning: str, width: float | None = None) -> Word:
    """A drop-down list."""
    if width is not None:
        imgui.set_next_item_width(width)
    _, index = imgui.combo(label, options.index(value), list(options))
    explain(meaning)
    return options[index]


def check(label: str, value: bool, meaning: str) -> bool:
    """A check box."""
    value = imgui.checkbox(label, value)[1]
    explain(meaning)
    return value


def press(label: str, meaning: str, width: float = 0.0, *, small: bool = False) -> bool:
    """A button; returns whether it was pressed."""
    pressed = imgui.small_button(label) if small else imgui.button(label, (width, 0))
    explain(meaning)
    return pressed


def listed(label: str, on: bool, meaning: str, flags: int = 0) -> bool:
    """A selectable line of a list; returns whether it was chosen."""
    chosen = imgui.selectable(label, on, flags)[0]
    explain(meaning)
    return chosen


def slider(
    label: str, value: float, low: float, high: float, meaning: str, *, log: bool = False, unit: str = "",
    digits: int = 3,
) -> float:  # fmt: skip
    """A slider; Ctrl+click to type a number, which is clamped to the range. In `unit`, %% is the per cent sign."""
    flags = imgui.SliderFlags_.always_clamp
    if log:
        flags |= imgui.SliderFlags_.logarithmic | imgui.SliderFlags_.no_round_to_format
    changed, moved = imgui.slider_float(
        label, value, low, high, ("%.4g" if log and digits else f"%.{digits}f") + unit, flags
    )
    explain(meaning)
    return min(max(moved, low), high) if changed else value


def rgb(label: str, value: Triple, high: float, meaning: str) -> Triple:
    """Three sliders of linear coefficients and a `swatch`."""
    imgui.push_id(label)
    swatch_px = imgui.get_frame_height()
    imgui.set_next_item_width(imgui.calc_item_width() - swatch_px - imgui.get_style().item_inner_spacing.x)
    digits = "%.3f" if imgui.calc_item_width() > px(THREE_PX) else "%.2f"
    changed, moved = imgui.slider_float3("##values", list(value), 0.0, high, digits, imgui.SliderFlags_.always_clamp)
    explain(meaning)
    value = triple(moved) if changed else value
    imgui.same_line(0, imgui.get_style().item_inner_spacing.x)
    imgui.pop_id()
    return swatch(label, value, meaning, swatch_px)


def swatch(label: str, value: Triple, meaning: str, width: float | None = None) -> Triple:
    """A swatch of linear coefficients with its label; it opens a colour picker.

    The picker works on the displayed colour; coefficients above 1 keep their scale.
    """
    imgui.push_id(label)
    size = imgui.calc_item_width() if width is None else width, imgui.get_frame_height()
    scale = max(1.0, *value)
    shown = triple(srgb_encode(np.array(value) / scale))
    if imgui.color_button("##swatch", (*shown, 1.0), imgui.ColorEditFlags_.no_tooltip, size):
        imgui.open_popup("picker")
    explain(f"opens a colour picker for {label}")
    if imgui.begin_popup("picker"):
        picked, colour = imgui.color_picker3("##picker", list(shown), imgui.ColorEditFlags_.no_side_preview)
        if picked:
            value = triple(srgb_decode(np.array(colour)) * scale)
        imgui.end_popup()
    imgui.same_line(0, imgui.get_style().item_inner_spacing.x)
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(label.split("##")[0])
    explain(meaning)
    imgui.pop_id()
    return value


def path_field(label: str, text: str, button: str, hint: str, meaning: str) -> tuple[str, bool]:
    """A text field with a button; returns the text and whether it was submitted."""
    room = imgui.calc_text_size(button).x + 2 * imgui.get_style().frame_padding.x + imgui.get_style().item_spacing.x
    imgui.set_next_item_width(-room)
    flags = imgui.InputTextFlags_.enter_returns_true | imgui.InputTextFlags_.elide_left
    entered, text = imgui.input_text_with_hint(f"##{label}", hint, text, flags)
    explain(meaning)
    imgui.same_line()
    pressed = press(f"{button}##{label}", meaning, -1)
    return text, bool(entered or pressed)


def typed_field(label: str, typed: dict[str, str], button: str, hint: str, meaning: str) -> str | None:
    """A path field whose text is kept in `typed`; returns the text when submitted."""
    typed[label], wanted = path_field(label, typed.get(label, ""), button, hint, meaning)
    return typed[label] if wanted else None


def explain(text: str) -> None:
    """Tooltip of the previous control; not during a drag.

    It is placed left of the panel if there is room, so that it covers no line.
    """
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip) and not imgui.is_any_item_active():
        left = imgui.get_window_pos().x - TOOLTIP_GAP_PX
        if left > imgui.calc_text_size(text).x + 2 * imgui.get_style().window_padding.x:
            imgui.set_next_window_pos((left, imgui.get_item_rect_min().y), pivot=(1, 0))
        imgui.set_tooltip(text)


def coloured(text: str, colour: Colour) -> None:
    """A line of text."""
    imgui.push_style_color(imgui.Col_.text, colour)
    imgui.text_unformatted(text)
    imgui.pop_style_color()


def wrapped(lines: Sequence[str], colour: Colour = AMBER) -> None:
    """Wrapped texts."""
    imgui.push_text_wrap_pos()
    for line in lines:
        coloured(line, colour)
    imgui.pop_text_wrap_pos()


def status(lines: Sequence[str], longest: Sequence[str]) -> None:
    """Dim texts, wrapped, in the height of the `longest` ones, so that no control below moves with the texts.

    A text that does not fit ends with dots; its tooltip shows the whole text.
    """
    width = imgui.get_content_region_avail().x
    for line, most in zip(lines, longest, strict=True):
        height = imgui.calc_text_size(most, wrap_width=width).y
        imgui.begin_group()
        imgui.push_text_wrap_pos()
        imgui.text_disabled(fitted(line, width, height))
        imgui.pop_text_wrap_pos()
        rest = height - imgui.get_item_rect_size().y
        if rest > 0:
            imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() - imgui.get_style().item_spacing.y)
            imgui.dummy((0, rest))
        imgui.end_group()
        if line:
            explain(line)


def fitted(text: str, width: float, height: float) -> str:
    """A text, or as many of its first letters as fit with dots after them, wrapped to a width."""

    def fits(shown: str) -> bool:
        return bool(imgui.calc_text_size(shown, wrap_width=width).y <= height)

    if fits(text):
        return text
    return next((short for end in range(len(text), 0, -1) if fits(short := f"{text[:end].rstrip()}...")), "...")


def shadowed(lines: imgui.ImDrawList, at: tuple[float, float], text: str, colour: Colour, shade: float = 0.8) -> None:
    """Text with a shadow, readable over any picture."""
    lines.add_text((at[0] + 1, at[1] + 1), imgui.get_color_u32((0, 0, 0, shade)), text)
    lines.add_text(at, imgui.get_color_u32(colour), text)


def buttons(actions: Sequence[tuple[str, bool, Callable[[], None], str]], width: float = 0.0) -> None:
    """Buttons in a row: (label, enabled, action, meaning)."""
    for index, (label, possible, act, meaning) in enumerate(actions):
        if index:
            imgui.same_line()
        imgui.begin_disabled(not possible)
        if press(label, meaning, width):
            act()
        imgui.end_disabled()


def rows(pairs: Sequence[tuple[str, str]], name: str) -> None:
    """A table of two columns: names and values."""
    if not imgui.begin_table(name, 2, imgui.TableFlags_.row_bg | imgui.TableFlags_.sizing_fixed_fit):
        return
    imgui.table_setup_column("name")
    imgui.table_setup_column("value", imgui.TableColumnFlags_.width_stretch)
    for left, right in pairs:
        imgui.table_next_column()
        imgui.text_unformatted(left)
        imgui.table_next_column()
        imgui.text_wrapped(right)
    imgui.end_table()
