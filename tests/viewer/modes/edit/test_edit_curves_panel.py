"""The curve editor drawn without a window: real Dear ImGui and ImPlot frames, a mouse that presses and moves."""

import numpy as np
import pytest
from imgui_bundle import imgui, implot

from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import KNOTS, Curve
from lambent.materials.models import model_named
from lambent.viewer.modes.edit.curves.axes import Axis
from lambent.viewer.modes.edit.curves.regions import region_of
from tests.viewer.modes.edit.curve_panel import NARROW, WIDE, Panel
from tests.viewer.panel_driver import point_of

GOLD = Material(name="gold", kd=0.05, lobes=(Lobe(k=(0.9, 0.7, 0.3), mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4)),))
ASHIKHMIN = model_named("ashikhmin-shirley")(ex=100.0, ey=1000.0)


@pytest.fixture
def open_panel(monkeypatch):
    opened = []

    def make(*args, **kwargs):
        opened.append(Panel(monkeypatch, *args, **kwargs))
        return opened[-1]

    yield make
    for panel in opened:
        panel.close()


@pytest.fixture
def panel(open_panel):
    return open_panel({"gold": GOLD, "lacquer": ASHIKHMIN}, "gold")


@pytest.mark.parametrize("log", [False, True])
def test_pixels_are_those_of_the_plot(monkeypatch, panel, log):
    if log:
        panel.click("log")
    seen = []
    end_plot = implot.end_plot

    def noted():
        seen.append([tuple(implot.plot_to_pixels(x, y)) for x, y in ((2.0, 30.0), (11.0, 0.5))])
        end_plot()

    monkeypatch.setattr(implot, "end_plot", noted)
    panel.frame()
    assert panel.editor.state.views["gold", "highlight"].y.log == log
    for (x, y), place in zip(((2.0, 30.0), (11.0, 0.5)), seen[-1], strict=True):
        assert panel.editor.axes.pixel(x, y) == pytest.approx(place, abs=1.0)


def test_a_modifier_key_answers_while_the_mouse_rests(panel):
    axes = panel.editor.axes
    panel.move(*axes.pixel(2.0, 20.0))
    panel.button(True)
    panel.move(*axes.pixel(3.0, 25.0))
    document = panel.session.document
    panel.frame(3)
    assert panel.session.document is document, "nothing is done anew while nothing moves"
    panel.key(imgui.Key.mod_shift, True)
    assert [layer.kind for layer in panel.layers()] == ["translate_y"]
    panel.key(imgui.Key.mod_shift, False)
    assert [layer.kind for layer in panel.layers()] == ["translate_y", "translate_x"]
    panel.button(False)


def test_channels_and_direction(panel):
    panel.click("R")
    panel.click("B")
    panel.click("y")
    panel.pull((2.0, 20.0), (3.0, 25.0))
    assert [(layer.kind, layer.channels) for layer in panel.layers()] == [("translate_y", (1,))]
    values = panel.session.editable("gold").curves["highlight"].values
    original = panel.session.original("gold").curves["highlight"].values
    assert np.array_equal(values[:, [0, 2]], original[:, [0, 2]]) and values[0, 1] > original[0, 1]


def test_keys_work_over_the_plot_alone(panel):
    keys = {imgui.Key.l: lambda: panel.view.y.log, imgui.Key.a: lambda: panel.editor.state.tool == "amplify"}
    keys |= {imgui.Key.d: lambda: panel.editor.state.tool == "draw"}
    panel.move(-1, -1)
    for key, done in keys.items():
        panel.tap(key)
        assert not done()
    panel.move(*panel.editor.axes.pixel(3.0, 5.0))
    for key, done in keys.items():
        panel.tap(key)
        assert done()
    panel.view.x = type(panel.view.x)(0.0, 90.0)
    panel.tap(imgui.Key.f)
    panel.tap(imgui.Key.t)
    assert panel.view.x.high < 30 and panel.editor.state.tool == "translate"


def test_handles_and_numbers_of_the_region(panel):
    axes, view = panel.editor.axes, panel.view
    c_deg = np.degrees(view.region.c)
    x, y = axes.pixel(c_deg, 0.0)[0] + 5, axes.place.y + 6
    panel.move(x, y)
    panel.button(True)
    panel.move(x + 50, y + 30)
    panel.button(False)
    per_px = (axes.x.high - axes.x.low) / axes.place.width
    assert np.degrees(view.region.c) == pytest.approx(c_deg + 55 * per_px, abs=2 * per_px)
    panel.frame(20)
    before = view.region
    panel.slide("##d", 0.2, 0.9)
    assert view.region.d > before.d and view.region.b == before.b
    panel.click("all##preset")
    assert view.region.b == 0 and np.degrees(view.region.c) == pytest.approx(90)
    panel.click("peak##preset")
    assert np.degrees(view.region.c) == pytest.approx(c_deg)
    assert not panel.session.history.can_undo, "regions are no edits"


def test_a_drag_beside_the_region_makes_a_new_one(panel):
    panel.pull((12.0, 20.0), (13.0, 20.0), (15.0, 22.0))
    assert np.degrees((panel.view.region.b, panel.view.region.c)) == pytest.approx((12, 15), abs=0.2)
    assert not panel.edit.curves


def test_wheel_shift_and_double_click(panel):
    view, axes = panel.view, panel.editor.axes
    panel.move(*axes.pixel(5.0, 20.0))
    panel.io.add_mouse_wheel_event(0, 2)
    panel.frame(2)
    assert view.x.high - view.x.low == pytest.approx((axes.x.high - axes.x.low) * 0.85**2)
    assert panel.editor.axes.at(*axes.pixel(5.0, 20.0))[0] == pytest.approx(5.0, abs=0.05)
    assert view.y == axes.y
    x = view.x
    panel.key(imgui.Key.mod_shift, True)
    panel.io.add_mouse_wheel_event(0, -1)
    panel.frame(2)
    panel.key(imgui.Key.mod_shift, False)
    assert view.x == x and view.y.low == 0 and view.y.high == pytest.approx(axes.y.high / 0.85)
    before = view.x.low
    panel.pull((5.0, 20.0), (4.0, 20.0), which=1)
    assert view.x.low == pytest.approx(before + 1.0, abs=0.05) and not panel.edit.curves
    panel.move(*panel.editor.axes.pixel(6.0, 20.0))
    for _ in range(2):
        panel.button(True)
        panel.button(False)
    assert (view.x.low, view.x.high) == (0, 90) and not panel.session.history.can_undo


def test_the_wheel_over_the_plot_scrolls_no_panel(open_panel):
    panel = open_panel({"gold": GOLD}, "gold", (370, 500))
    x, y = panel.rects["highlight##curve"][:2]
    top = panel.editor.axes.place.y
    panel.move(*panel.editor.axes.pixel(5.0, 20.0))
    panel.io.add_mouse_wheel_event(0, -3)
    panel.frame(3)
    assert panel.editor.axes.place.y == top and panel.rects["highlight##curve"][:2] == (x, y)


def test_another_material_ends_the_drag(panel):
    axes = panel.editor.axes
    panel.move(*axes.pixel(2.0, 20.0))
    panel.button(True)
    panel.move(*axes.pixel(3.0, 25.0))
    pulled = panel.layers()
    panel.material = "lacquer"
    panel.frame(2)
    panel.move(*axes.pixel(4.0, 28.0))
    panel.button(False)
    assert panel.editor.state.active_curve is None and not panel.edit.curves
    panel.material = "gold"
    assert panel.layers() == pulled
    panel.undo()
    assert not panel.session.history.can_undo


def test_layers(panel):
    panel.pull((2.0, 20.0), (3.0, 25.0))
    up, across = panel.layers()
    panel.click("x##layer 1")
    assert panel.layers() == (up,)
    panel.undo()
    panel.click("x##layer 0")
    assert panel.layers() == (across,)
    panel.undo()
    panel.click("collapse")
    assert panel.edit.curves["highlight"].drawn is not None and panel.layers() == ()
    panel.click("reset curve")
    assert not panel.edit.curves
    panel.undo()
    panel.undo()
    assert panel.layers() == (up, across)
    name = "2##layer 1"
    panel.move(*point_of(panel.rects[name], 0.0))
    panel.frame()
    assert panel.editor._outlined == across.region, "the region of the layer under the mouse is shown"
    panel.editor.state.views["gold", "highlight"].region = up.region.model_copy(update={"d": 1.0})
    panel.click(name, 0.0)
    assert panel.view.region == across.region, "a click takes the layer's region"
    panel.click("reset material")
    assert not panel.edit.curves


def test_curves_are_chosen_in_the_list(panel):
    assert panel.curve == "highlight", "the one that changes most"
    panel.click("fresnel##curve", 0.1)
    assert panel.curve == "fresnel"
    place = panel.editor.axes.place
    panel.move(place.x + 0.95 * place.width, place.y + 0.5 * place.height)
    panel.button(True)
    panel.move(place.x + 0.95 * place.width, place.y + 0.6 * place.height)
    assert panel.editor.state.active_curve == "fresnel"
    panel.button(False)
    assert panel.layers("fresnel")[0].size < 0
    panel.frame()
    assert "fresnel *##curve" in panel.rects and "highlight##curve" in panel.rects


def test_numbers_of_a_document(panel):
    panel.slide("mx", 0.5, 0.7)
    lobe = panel.edit.source.material.lobes[0]
    assert lobe.mx == lobe.my > 0.15 and panel.editor.state.shown(panel.session, "gold").serves
    panel.slide("alpha", 0.1, 0.3)
    assert panel.edit.source.material.lobes[0].mx == lobe.mx and panel.edit.source.material.lobes[0].alpha > 0
    panel.undo()
    assert panel.edit.source.material.lobes[0] == lobe, "each slider is a step"
    panel.undo()
    assert panel.edit.source.material == GOLD and not panel.session.history.can_undo
    panel.click("keep the ratio of mx and my", 0.1)
    panel.slide("mx", 0.5, 0.7)
    assert not panel.editor.state.shown(panel.session, "gold").serves, "two curves in place of one"
    panel.frame(2)


@pytest.mark.parametrize("size", [NARROW, WIDE, (200, 300), (60, 40)])
def test_every_size_is_drawn(open_panel, size):
    panel = open_panel({"gold": GOLD}, "gold", size)
    panel.pull((2.0, 20.0), (3.0, 25.0)) if panel.editor.axes else None
    panel.frame(3)


@pytest.mark.parametrize("top", [0.0, 1e-25, 1e-9, 5e8])
@pytest.mark.parametrize("log", [False, True])
def test_values_of_every_size(panel, top, log):
    values = np.zeros((KNOTS + 1, 3))
    values[2000:] = top  # a step
    panel.session.draw("gold", "highlight", Curve(values))
    panel.view.fit(values, Axis(0.0, 90.0))
    panel.view.set_log(values, log)
    panel.frame(2)
    axes = panel.editor.axes
    panel.view.region = region_of(20, 30, 60, 70)
    panel.frame()
    middle = axes.y.value(0.5)
    panel.pull((45.0, middle), (45.0, axes.y.value(0.6)))
    expected = [axes.y.value(0.6) - middle]
    assert [layer.size for layer in panel.layers()] == pytest.approx(expected, rel=0.08)  # a pixel is a seventeenth
    panel.io.add_mouse_wheel_event(0, 100)
    panel.frame(3)
    panel.io.add_mouse_wheel_event(0, -100)
    panel.frame(3)
