"""Drives the panels without a window or a GPU: real Dear ImGui frames, a mouse that aims at controls by their label."""

import functools

from imgui_bundle import imgui, implot

from lambent.viewer import layout
from lambent.viewer.mode import Drawing
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.mode import WalkMode

RECORDED = (
    "slider_float", "slider_float3", "slider_int", "combo", "checkbox", "radio_button", "button", "selectable",
    "input_text", "input_text_with_hint", "collapsing_header", "color_button", "small_button", "drag_float_range2",
    "begin_combo",
)  # fmt: skip
SIZE = (1400, 1600)


class Frames:
    """Dear ImGui frames of what `draw` draws.

    `rects[label]` is where a control was drawn last; the one in `focused` has the keys.
    """

    def __init__(self, monkeypatch, size):
        self.rects, self.focused = self.new_rects(), set()
        self._context = imgui.create_context()
        imgui.set_current_context(self._context)
        self.io = imgui.get_io()
        self.io.set_ini_filename("")
        self.io.backend_flags |= imgui.BackendFlags_.renderer_has_textures
        self.io.display_size = size
        layout.set_style()
        recording(monkeypatch.setattr, self.rects, self.focused)
        self._note_disabled(monkeypatch)
        self.frame(2)

    def close(self):
        implot.destroy_context()
        imgui.destroy_context(self._context)

    def _note_disabled(self, monkeypatch):
        """Keep labels of controls that are greyed out from `rects` in `greyed`."""
        begin, end, before = imgui.begin_disabled, imgui.end_disabled, []
        self.greyed = set()

        def begin_noted(disabled=True):
            before.append((disabled, set(self.rects)))
            begin(disabled)

        def end_noted():
            disabled, known = before.pop()
            self.greyed |= set(self.rects) - known if disabled else set()
            end()

        monkeypatch.setattr(imgui, "begin_disabled", begin_noted)
        monkeypatch.setattr(imgui, "end_disabled", end_noted)

    def new_rects(self):
        return {}

    def draw(self):
        raise NotImplementedError

    def frame(self, count=1):
        for _ in range(count):
            self.rects.clear()
            self.focused.clear()
            self.io.delta_time = 1 / 30
            imgui.new_frame()
            self.draw()
            imgui.render()

    def point(self, label, along=0.5):
        return point_of(self.rects[label], along)

    def move(self, x, y):
        self.io.add_mouse_pos_event(x, y)
        self.frame()

    def button(self, down, which=0):
        self.io.add_mouse_button_event(which, down)
        self.frame()

    def click(self, label, along=0.5):
        self.move(*self.point(label, along))
        self.button(True)
        self.button(False)
        self.frame()


class PanelDriver(Frames):
    """The window of a mode."""

    def __init__(self, monkeypatch, mode, size=SIZE):
        self.mode, self.state = mode, mode.state
        super().__init__(monkeypatch, size)

    def draw(self):
        self.state.screen.picture = layout.regions(self.mode, *self.io.display_size).picture
        self.popup_open = layout.draw(self.mode)

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


def walk_mode(state, geometry):
    """The walk mode without a drawing."""
    return WalkMode(state, WalkInput(state, geometry), Drawing(None))


def recording(setattr_of, rects, focused=None):
    """Make Dear ImGui's controls note (x0, y0, x1, y1, width of the label) in `rects`, and their focus in `focused`."""

    def recorded(control):
        @functools.wraps(control)
        def call(label, *args, **kwargs):
            result = control(label, *args, **kwargs)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            if focused is not None and imgui.is_item_focused():
                focused.add(label)
            rects[label] = (low.x, low.y, high.x, high.y, label_width(label))
            return result

        return call

    for name in RECORDED:
        setattr_of(imgui, name, recorded(getattr(imgui, name)))


def point_of(rect, along):
    """Where to aim: `along` the part of the control that can be dragged, or anywhere on a button."""
    x0, y0, x1, y1, label = rect
    return x0 + along * max(x1 - x0 - label, 8), (y0 + y1) / 2


def label_width(label):
    """An item's rectangle includes its label at the right; what one can drag does not."""
    shown = label.split("##")[0]
    return imgui.calc_text_size(shown).x + imgui.get_style().item_inner_spacing.x if shown else 0.0
