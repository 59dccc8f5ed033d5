"""Drives the panels without a window or a GPU: real Dear ImGui frames, a mouse that aims at controls by their label."""

import functools

from imgui_bundle import imgui

from lambent.viewer import layout

RECORDED = (
    "slider_float", "slider_float3", "slider_int", "combo", "checkbox", "radio_button", "button", "selectable",
    "input_text", "collapsing_header", "color_button",
)  # fmt: skip
SIZE = (1400, 1600)


class PanelDriver:
    """`rects[label]` is where a control was drawn last."""

    def __init__(self, monkeypatch, state, size=SIZE):
        self.state, self.rects = state, {}
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)
        self.io = imgui.get_io()
        self.io.set_ini_filename("")
        self.io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
        self.io.display_size = size
        layout.set_style()
        for name in RECORDED:
            monkeypatch.setattr(imgui, name, self._recording(getattr(imgui, name)))
        self.frame(2)

    def close(self):
        imgui.destroy_context(self._context)

    def _recording(self, control):
        @functools.wraps(control)
        def recorded(label, *args, **kwargs):
            result = control(label, *args, **kwargs)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self.rects[label] = (low.x, low.y, high.x, high.y)
            return result

        return recorded

    def frame(self, count=1):
        for _ in range(count):
            self.rects.clear()
            self.io.delta_time = 1 / 30
            imgui.new_frame()
            self.popup_open = layout.draw(self.state, None)
            imgui.render()

    def point(self, label, along=0.5):
        x0, y0, x1, y1 = self.rects[label]
        width = imgui_control_width(x0, x1, label)
        return x0 + along * width, (y0 + y1) / 2

    def move(self, x, y):
        self.io.add_mouse_pos_event(x, y)
        self.frame()

    def button(self, down):
        self.io.add_mouse_button_event(0, down)
        self.frame()

    def click(self, label, along=0.5):
        self.move(*self.point(label, along))
        self.button(True)
        self.button(False)
        self.frame()

    def drag(self, label, begin, end):
        self.move(*self.point(label, begin))
        self.button(True)
        x, y = self.point(label, end)
        self.move(x, y)
        self.button(False)
        self.frame(2)

    def type(self, text):
        self.io.add_input_characters_utf8(text)
        self.frame()


def imgui_control_width(x0, x1, label):
    """An item's rectangle includes its label; the part one can drag does not."""
    shown = label.split("##")[0]
    if not shown:
        return x1 - x0
    spacing = imgui.get_style().item_inner_spacing.x
    return x1 - x0 - imgui.calc_text_size(shown).x - spacing
