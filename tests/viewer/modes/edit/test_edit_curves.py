"""The logic of the curve editor, without Dear ImGui: axes, regions, drags, lines, strokes."""

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.editing.curves.operators import Region
from lambent.editing.session.session import Session
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.curve import KNOTS, Curve, angles_rad
from lambent.materials.models import model_named
from lambent.viewer.modes.edit.curves import regions
from lambent.viewer.modes.edit.curves.axes import Axes, Axis, Place, within_curve
from lambent.viewer.modes.edit.curves.drags import Drag, painted, resized
from lambent.viewer.modes.edit.curves.lines import ANGLES_DEG, decimated, feature_deg, fitted_x, fitted_y, is_grey
from lambent.viewer.modes.edit.curves.regions import edges_deg, grip_at, region_of, with_edge
from lambent.viewer.modes.edit.curves.state import CurveState, View

PLACE = Place(100, 50, 400, 200)
LINEAR, LOG = Axis(0.0, 10.0), Axis(0.01, 100.0, log=True)
ALL = (0, 1, 2)
REGION = region_of(10, 20, 30, 40)
BRASS = Material(name="brass", kd=0.05, lobes=(Lobe(k=(0.9, 0.7, 0.3), mx=0.1, my=0.1, r0=(0.9, 0.7, 0.4)),))
PHONG = model_named("phong")(exponent=20.0)


@pytest.fixture
def session():
    camera = Camera(name="front", position=(0, 1, 3), target=(0, 1, 0))
    return Session.new("room", camera, {"brass": BRASS, "gloss": PHONG})


# axes


def test_pixels_and_back():
    axes = Axes(Axis(0, 90), LOG, PLACE)
    assert axes.pixel(45, 1.0) == pytest.approx((300, 150))
    assert axes.pixel(90, 100.0) == pytest.approx((500, 50))
    assert axes.at(300, 100) == pytest.approx((45, 10.0))
    assert axes.at(50, 250) == pytest.approx((0, 0.01)), "angles end at 0, also left of the plot"
    assert Axes(Axis(0, 90), LINEAR, PLACE).at(900, 150) == pytest.approx((90, 5.0))


def test_the_wheel_keeps_what_is_under_the_mouse():
    assert Axis(0, 90).zoomed(0.5, 0.5) == Axis(22.5, 67.5)
    zoomed = LOG.zoomed(0.25, 0.5)
    assert zoomed.value(0.25) == pytest.approx(LOG.value(0.25)) and zoomed.high / zoomed.low == pytest.approx(100)
    axis = Axis(0.0, 1.0)
    for _ in range(500):
        axis = axis.zoomed(0.3, 0.5)
    assert axis.high > axis.low, "no zoom is without length"


def test_angles_stay_within_the_curve():
    assert within_curve(Axis(-10, 50)) == Axis(0, 60)
    assert within_curve(Axis(60, 100)) == Axis(50, 90)
    assert within_curve(Axis(-30, 200)) == Axis(0, 90)
    assert within_curve(Axis(30, 30.001)).high == pytest.approx(30.05)


# regions


@pytest.mark.parametrize(
    ("edge", "to", "expected"),
    [
        ("a", 15, (15, 20, 30, 40)),
        ("b", 35, (10, 35, 35, 40)),
        ("b", 5, (4.95, 5, 30, 40)),
        ("c", 5, (4.95, 5, 5, 40)),
        ("c", 60, (10, 20, 60, 60.05)),
        ("d", 25, (10, 20, 24.95, 25)),
        ("a", -200, (-90, 20, 30, 40)),
        ("c", 120, (10, 20, 90, 90.05)),
        ("d", -5, (-0.05, 0, 0, 0.05)),
    ],
)
def test_edges_push_each_other(edge, to, expected):
    assert edges_deg(with_edge(REGION, edge, to)) == pytest.approx(expected)


def test_a_region_moves_within_the_curve():
    assert edges_deg(regions.moved(REGION, 7)) == pytest.approx((17, 27, 37, 47))
    assert edges_deg(regions.moved(REGION, -50)) == pytest.approx((-10, 0, 10, 20))
    assert edges_deg(regions.moved(REGION, 500)) == pytest.approx((70, 80, 90, 100))


def test_presets():
    bell = Curve.of(lambda x: np.exp(-(((np.degrees(x) - 40) / 10) ** 2)))
    width = 10 * np.sqrt(np.log(2))
    a, b, c, d = edges_deg(regions.peak(bell.values))
    assert (b, c) == pytest.approx((40 - width, 40 + width), abs=0.03)
    assert (a, d) == pytest.approx((40 - 15.17, 40 + 15.17), abs=0.03)
    assert edges_deg(regions.tail(bell.values))[1:3] == pytest.approx((55.17, 90), abs=0.03)
    highlight = Curve.of(lambda x: np.exp(-((np.degrees(x) / 10) ** 2)))
    a, b, c, d = edges_deg(regions.peak(highlight.values))
    assert a < b == 0 and c == pytest.approx(width, abs=0.03)
    rising = Curve.of(lambda x: x)
    assert regions.tail(rising.values) is None and edges_deg(regions.peak(rising.values))[2:] == pytest.approx(
        (90, 135)
    )
    flat = Curve.constant(0.5)
    assert regions.peak(flat.values) is None and regions.tail(flat.values) is None
    assert regions.first(flat.values), "a constant curve has a region, too"
    assert regions.spanned(50, 40) == regions.region_of(35, 40, 50, 55) and regions.spanned(40, 40.01) is None


def test_what_is_under_the_mouse():
    axes = Axes(Axis(0, 80), LINEAR, PLACE)  # 5 pixels per degree
    at = {"a": (149, 245), "b": (196, 55), "c": (253, 55), "d": (303, 245), "bar": (225, 55), "curve": (225, 150)}
    for grip, (x, y) in at.items():
        assert grip_at(REGION, axes, x, y) == grip
    assert grip_at(REGION, axes, 120, 150) is None and grip_at(REGION, axes, 225, 20) is None
    wide = region_of(-10, 0, 85, 100)  # its ends are outside of the plot
    assert [grip_at(wide, axes, *p) for p in ((105, 55), (105, 245), (495, 55), (495, 245))] == ["b", "a", "c", "d"]
    narrow = region_of(19, 20, 20, 21)
    assert grip_at(narrow, axes, 194, 55) == "b" and grip_at(narrow, axes, 206, 55) == "c"
    assert grip_at(narrow, axes, 200, 150) == "curve"


# drags


def drag(tool="translate", begin=(25.0, 2.0), y=LINEAR, region=REGION, base=(0.0, 0.0), channels=ALL):
    return Drag(tool, region, channels, begin, y, Axis(0.0, 90.0), base)


@pytest.mark.parametrize("y", [LINEAR, LOG])
def test_translation_follows_the_mouse(y):
    up, across = drag(y=y).operators((28.0, 5.0), "x and y")
    assert (up.kind, up.size, across.kind) == ("translate_y", 3.0, "translate_x")
    assert across.size == pytest.approx(np.radians(3)) and up.channels == ALL
    assert edges_deg(across.region) == pytest.approx((10, 20, 30, 40)), "there is room"
    assert [o.kind for o in drag(y=y).operators((28.0, 5.0), "x")] == ["translate_x"]
    assert [o.kind for o in drag(y=y).operators((28.0, 5.0), "y")] == ["translate_y"]
    assert drag(y=y).operators((25.0, 2.0), "x and y") == (), "back where it began"


def test_amplification_about_a_base():
    (scaled,) = drag("amplify").operators((25.0, 5.0), "y")
    assert (scaled.kind, scaled.size, scaled.base) == ("amplify_y", 2.5, 0.0)
    (based,) = drag("amplify", base=(0.0, 1.0)).operators((25.0, 5.0), "y")
    assert (based.size, based.base) == (4.0, 1.0), "(5 - 1) / (2 - 1)"
    (logged,) = drag("amplify", begin=(25.0, 0.1), y=LOG).operators((25.0, 10.0), "y")
    assert logged.size == pytest.approx(100), "a factor of the value under the mouse, whatever the axis"
    (down,) = drag("amplify").operators((25.0, -50.0), "y")
    assert down.size == 0, "never below"
    (near,) = drag("amplify", begin=(25.0, 0.01)).operators((25.0, 1.01), "y")
    assert near.size == pytest.approx(3), "close to the base, by a twentieth of the axis: 1 + 1 / .5"


def test_stretching_about_an_angle():
    region = region_of(-10, 0, 40, 60)
    (stretched,) = drag("amplify", region=region, begin=(20.0, 2.0)).operators((30.0, 2.0), "x")
    assert stretched.kind == "amplify_x" and stretched.size == pytest.approx(1.5)
    line = Curve.of(lambda x: x)
    assert stretched.applied(line).at(np.radians(30.0))[0] == pytest.approx(np.radians(20)), "what was grabbed is here"
    based = drag("amplify", region=region, begin=(20.0, 2.0), base=(10.0, 0.0)).operators((30.0, 2.0), "x")
    assert based[0].size == pytest.approx(2)


def test_stretching_stops_before_the_curve_folds():
    (squeezed,) = drag("amplify", region=region_of(-10, 0, 40, 60), begin=(30.0, 2.0)).operators((2.0, 2.0), "x")
    assert 2 / 30 < squeezed.size < 1
    with pytest.raises(ValueError, match="folds"):
        type(squeezed)(**{**squeezed.model_dump(), "size": 0.99 * squeezed.size})


def test_a_layer_of_another_size():
    (across,) = drag().operators((28.0, 2.0), "x")
    wider = resized(across, float(np.radians(30)))
    assert np.degrees(wider.size) == pytest.approx(30) and wider.region.a < REGION.a and wider.region.d == REGION.d
    (stretched,) = drag("amplify", region=region_of(-10, 0, 40, 60), begin=(20.0, 2.0)).operators((30.0, 2.0), "x")
    assert resized(stretched, 2.0).size == 2.0 and resized(stretched, 2.0).base == stretched.base
    with pytest.raises(UserError, match="folds"):
        resized(stretched, 0.01)


@pytest.mark.parametrize("log", [False, True])
def test_freehand(log):
    values = np.ones((KNOTS + 1, 3))
    drawn = painted(values, (40.0, 4.0), (20.0, 1.0), (0, 2), log)
    half = np.abs(ANGLES_DEG - 30).argmin()
    assert drawn[half, 0] == pytest.approx(2.0 if log else 2.5, rel=2e-3), "straight on the axis that is shown"
    assert np.all(drawn[:, 1] == 1) and np.all(drawn[ANGLES_DEG < 19.9] == 1) and np.all(drawn[ANGLES_DEG > 40.1] == 1)
    dot = painted(values, (30.0, 4.0), (30.0, 7.0), ALL, log)
    assert (dot != 1).any(axis=1).sum() == 1 and dot.max() == pytest.approx(7)
    assert painted(values, (30.0, 1.0), (50.0, -3.0), ALL, log).min() >= 0
    assert values.min() == values.max() == 1, "the curve before is left as it was"


# lines


def test_decimation_keeps_every_peak():
    rng = np.random.default_rng(3)
    values = rng.random(KNOTS + 1)
    values[1234], values[3000], values[KNOTS - 1] = 7.0, -2.0, 9.0
    x, y = decimated(values, 0.0, 90.0)
    assert len(x) <= 514 and np.all(np.diff(x) > 0) and (x[0], x[-1]) == (0.0, 90.0)
    assert {7.0, -2.0, 9.0} <= set(y) and np.array_equal(y, np.interp(x, ANGLES_DEG, values))
    for blocks in (3, 100, 255):
        edges = np.linspace(0, KNOTS, blocks + 1).astype(int)
        inside, _ = decimated(values, ANGLES_DEG[edges[1]], ANGLES_DEG[edges[2]])
        assert inside[0] <= ANGLES_DEG[edges[1]] and inside[-1] >= ANGLES_DEG[edges[2]] and len(inside) <= 514
    few, exact = decimated(values, 10.0, 12.0)
    assert len(few) == np.count_nonzero((ANGLES_DEG >= 10) & (ANGLES_DEG <= 12)) + 2
    assert np.array_equal(exact, np.interp(few, ANGLES_DEG, values)), "all knots where there is room"


def test_shown_ranges():
    narrow = Curve.of(lambda x: 50 * np.exp(-((np.degrees(x) / 2) ** 2)))
    assert feature_deg(narrow.values) == pytest.approx(2 * np.sqrt(-np.log(0.002)), abs=0.05)
    assert fitted_x(narrow.values).high < 8 and fitted_x(Curve.constant().values) == Axis(0, 90)
    assert fitted_x(Curve.of(lambda x: 1 - np.cos(x)).values) == Axis(0, 90)
    assert fitted_y(narrow.values, Axis(0, 90), log=False) == Axis(0.0, 62.5)
    log = fitted_y(narrow.values, Axis(0, 90), log=True)
    assert log.log and log.high > 50 and 0 < log.low <= 50e-5
    for is_log in (False, True):
        zero = fitted_y(np.zeros((KNOTS + 1, 3)), Axis(0, 90), is_log)
        assert zero.high > zero.low >= 0
    assert is_grey(Curve.constant(3.0).values) and is_grey(np.zeros((KNOTS + 1, 3)))
    assert not is_grey(Curve.of(lambda x: np.stack([x, x, 0.9 * x], axis=1)).values)


# state: what the mouse does to a session


def axes_of(state, session, material="brass"):
    name = state.curve(material, state.shown(session, material))
    view = state.view(material, name, session.editable(material).curves[name])
    return Axes(view.x, view.y, PLACE)


def pull(state, session, begin, *ends, material="brass", **keys):
    axes = axes_of(state, session, material)
    state.press(session, material, axes, *axes.pixel(*begin))
    for end in ends:
        state.move(session, *axes.pixel(*end), **keys)
    state.release(session)


def layers_of(session, curve="highlight", material="brass"):
    return session.document.materials[material].curves[curve].layers


def test_a_drag_is_one_step_and_does_not_accumulate(session):
    state, direct = CurveState(), CurveState()
    other = Session(session.document)
    wandering = [(2 + k / 7, 20 + (k % 13)) for k in range(50)]
    pull(state, session, (2.0, 20.0), *wandering, (3.0, 25.0))
    pull(direct, other, (2.0, 20.0), (3.0, 25.0))
    assert layers_of(session) == layers_of(other) and len(layers_of(session)) == 2
    up, across = layers_of(session)
    assert up.size == pytest.approx(5) and np.degrees(across.size) == pytest.approx(1)
    assert state.active_curve is None and state.views["brass", "highlight"].region.b == pytest.approx(across.size)
    session.undo()
    assert not session.history.can_undo and not session.document.materials["brass"].curves
    session.redo()
    assert len(layers_of(session)) == 2


def test_a_drag_that_comes_back_is_no_step(session):
    state = CurveState()
    pull(state, session, (2.0, 20.0), (3.0, 30.0), (2.0, 20.0))
    assert not session.history.can_undo and not session.document.materials["brass"].curves


def test_one_channel_at_least_is_edited():
    state = CurveState(channels=(1,))
    state.toggle(1)
    assert state.channels == ALL
    state.toggle(0)
    assert state.channels == (1, 2)


def test_cancel_and_undo_within_a_drag(session):
    state = CurveState()
    axes = axes_of(state, session)
    region = state.views["brass", "highlight"].region
    state.press(session, "brass", axes, *axes.pixel(2.0, 20.0))
    state.move(session, *axes.pixel(4.0, 30.0))
    assert len(layers_of(session)) == 2
    state.cancel(session)
    assert not session.history.can_undo and not session.document.materials["brass"].curves
    assert state.views["brass", "highlight"].region == region
    state.press(session, "brass", axes, *axes.pixel(2.0, 20.0))
    state.move(session, *axes.pixel(4.0, 30.0))
    session.undo()
    state.move(session, *axes.pixel(4.0, 31.0))
    assert state.hold is None and not session.document.materials["brass"].curves, "the drag ends with the undo"


def test_errors_are_a_line(session):
    state = CurveState()
    strokes = state.strokes
    strokes.once(session, lambda: session.remove("brass", "highlight", 3))
    assert "layer index out of range" in strokes.message and not session.history.can_undo
    region = Region(a=-0.1, b=0.0, c=0.1, d=0.2)
    strokes.replace(session, lambda: session.pull("brass", "highlight", region, y=2.0))
    assert strokes.message == ""
    strokes.replace(session, lambda: session.pull("brass", "highlight", region, y=1e12))
    assert "too large" in strokes.message and layers_of(session)[0].size == 2.0, "the drag stays where it was possible"
    strokes.end(session)
    session.undo()
    assert not session.history.can_undo


def test_whether_transport_serves(session):
    state = CurveState()
    assert state.shown(session, "gloss").serves
    session.set("gloss", exponent=50.0)
    assert state.shown(session, "gloss").serves and state.shown(session, "gloss").model.values["exponent"] == 50.0
    rough = BRASS.model_copy(update={"lobes": (BRASS.lobes[0].model_copy(update={"my": 0.3}),)})
    assert state.shown(session, "brass").serves
    session.become("brass", rough)
    assert not state.shown(session, "brass").serves
    session.undo()
    assert state.shown(session, "brass").serves
    session.redo()
    state.transported(session, "brass")
    assert state.shown(session, "brass").serves
    assert state.curve("brass", state.shown(session, "brass")).startswith("highlight ")


def test_a_material_is_made_anew_only_when_it_changes(session):
    state = CurveState()
    first = state.shown(session, "brass")
    assert state.shown(session, "brass") is first
    session.tint("gloss", "specular", 0.5)
    assert state.shown(session, "brass") is first
    session.tint("brass", "specular", 0.5)
    assert state.shown(session, "brass") is not first
    session.become("brass", PHONG)
    assert not state.shown(session, "brass").serves
    other = Session(session.document)
    assert state.shown(other, "brass").serves, "another session begins anew"


def test_views():
    values = Curve.of(lambda x: np.exp(-((x / 0.05) ** 2))).values
    view = View.of(values)
    assert view.x.high < 15 and not view.y.log and view.y.high == 1.25
    view.set_log(values, True)
    view.fit(values, Axis(0.0, 90.0))
    assert view.y.log and view.x.high == 90
    axes = Axes(view.x, view.y, PLACE)
    view.zoom(axes, (PLACE.x, PLACE.y), 1, values=False)
    assert view.x == Axis(0.0, pytest.approx(90 * 0.85))
    view.pan(Axes(view.x, view.y, PLACE), -40, 0)
    assert view.x.low == pytest.approx(7.65)
    view.set_log(values, False)
    view.zoom(Axes(view.x, view.y, PLACE), (PLACE.x, PLACE.y), 1, values=True)
    assert view.y.low == 0, "0 stays at the bottom"
    assert angles_rad()[-1] == pytest.approx(np.radians(ANGLES_DEG[-1]))
