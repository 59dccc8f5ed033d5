"""Drives the curve editor without a window: real Dear ImGui and ImPlot frames, a mouse, keys and the wheel."""

from imgui_bundle import imgui

from lambent.core.views.camera import Camera
from lambent.editing.session.session import Session
from lambent.viewer import layout
from lambent.viewer.modes.edit.curves.editor import CurveEditor
from tests.viewer import panel_driver
from tests.viewer.panel_driver import Frames, point_of

NARROW, WIDE = (370, 1100), (1100, 700)


class Panel(Frames):
    """The editor in a window of its own."""

    def __init__(self, monkeypatch, starts, material, size=NARROW):
        camera = Camera(name="front", position=(0, 1, 3), target=(0, 1, 0))
        self.session, self.material, self.size = Session.new("room", camera, starts), material, size
        self.editor = CurveEditor()
        monkeypatch.setattr(panel_driver, "RECORDED", (*panel_driver.RECORDED, "drag_float"))
        super().__init__(monkeypatch, size)
        self.io.config_input_trickle_event_queue = False

    def draw(self):
        imgui.set_next_window_pos((0, 0))
        imgui.set_next_window_size(self.size)
        imgui.begin("window", None, layout.FIXED)
        imgui.push_item_width(-layout.LABEL_PX)
        self.editor.draw(self.session, self.material)
        imgui.pop_item_width()
        imgui.end()

    def click(self, label, along=0.5):
        super().click(label, along)
        self.io.add_mouse_pos_event(-1, -1)
        self.frame(20)  # the next press is no double click

    def pull(self, begin, *ends, which=0):
        """Drag over the plot, in degrees and values of the axes as they are at first."""
        axes = self.editor.axes
        self.move(*axes.pixel(*begin))
        self.button(True, which)
        for end in ends:
            self.move(*axes.pixel(*end))
        self.button(False, which)
        self.frame(20)

    def slide(self, label, begin, end):
        rect = self.rects[label]
        self.move(*point_of(rect, begin))
        self.button(True)
        for share in (0.5, 1.0):
            self.move(*point_of(rect, begin + share * (end - begin)))
        self.button(False)
        self.frame(20)

    def key(self, key, down):
        self.io.add_key_event(key, down)
        self.frame()

    def tap(self, key):
        self.key(key, True)
        self.key(key, False)

    def undo(self):
        self.session.undo()
        self.frame(2)

    def redo(self):
        self.session.redo()
        self.frame(2)

    @property
    def edit(self):
        return self.session.document.materials[self.material]

    def layers(self, curve="highlight"):
        return self.edit.curves[curve].layers

    @property
    def curve(self):
        state = self.editor.state
        return state.curve(self.material, state.shown(self.session, self.material))

    @property
    def view(self):
        return self.editor.state.views[self.material, self.curve]
