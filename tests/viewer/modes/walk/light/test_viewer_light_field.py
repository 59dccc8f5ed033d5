"""Light fields in the window: points over the picture, one of which is picked, its map, and what to do without one."""

from dataclasses import replace

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import LightField
from lambent.core.geometry.octahedral import texel_directions
from lambent.core.views.camera import camera_axes
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.viewer.cameras.picking import Geometry
from lambent.viewer.modes.walk.input import WalkInput
from lambent.viewer.modes.walk.light.light_fields import FieldView, colours_of, map_image
from lambent.viewer.modes.walk.markers import projected
from lambent.viewer.modes.walk.panels import light_field as light_field_panel
from lambent.viewer.modes.walk.panels.light_field import warn_of_look_up, without
from lambent.viewer.modes.walk.pictures import Pictures
from lambent.viewer.modes.walk.state import WalkState
from lambent.viewer.screen import Rect
from tests.realtime.lit_ball import CAMERA, ball_scene, light_field
from tests.viewer.drawn_frames import drawn
from tests.viewer.panel_driver import PanelDriver, walk_mode

SIZE = (160, 160)


@pytest.fixture(scope="module")
def field() -> LightField:
    return light_field(count=24, side=30)


@pytest.fixture(scope="module")
def renderer(adapter, field):
    return Renderer(open_device(), ball_scene(field=field))


def pixels_of(renderer, view, size=SIZE):
    data = renderer.device.queue.read_texture({"texture": view.texture}, {"bytes_per_row": 4 * size[0]}, (*size, 1))
    return np.frombuffer(data, np.uint8).reshape(size[1], size[0], 4)


def test_discs_are_drawn_where_points_are_and_hidden_by_the_ball(renderer, field):
    """A disc's middle has its colour if the point faces the eye; behind the ball nothing is drawn."""
    frame = FrameState(CAMERA, *SIZE)
    colours = colours_of(np.arange(len(field.points), dtype=float))
    count = len(field.points)
    drawn = pixels_of(
        renderer, renderer.discs().draw(frame, field.points, colours, np.full(count, 4.0), np.zeros(count))
    )
    places, _ = projected(CAMERA, field.points.astype(float), SIZE)
    towards = np.array(CAMERA.position) - field.points
    facing = (field.normals * towards).sum(axis=-1) / np.linalg.norm(towards, axis=-1)
    alone = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(places)) > 9 / SIZE[0]
    front = np.flatnonzero((facing > 0.2) & alone.all(axis=1) & (np.abs(places - 0.5) < 0.48).all(axis=1))
    assert len(front) >= 3
    for i in front:
        column, row = (places[i] * SIZE).astype(int)
        np.testing.assert_allclose(drawn[row, column, :3] / 255, colours[i], atol=0.01)
        assert drawn[row, column, 3] == 255
    behind = np.flatnonzero((facing < -0.6) & (np.abs(places - 0.5) < 0.48).all(axis=1))
    visible = [i for i in behind if np.allclose(_at(drawn, places[i])[:3] / 255, colours[i], atol=0.01)]
    assert len(behind) >= 3 and not visible
    assert (drawn[..., 3] == 0).mean() > 0.7


def _at(drawn, place):
    column, row = (place * SIZE).astype(int)
    return drawn[row, column]


def test_a_map_shows_the_light_of_its_point(field):
    """The red wall at +x is where the square has that direction; distances are ordered as their colours' scale."""
    image = map_image(field, 0, "light", "linear", 0.0)
    ahead = np.unravel_index(texel_directions(30)[..., 0].argmax(), (30, 30))
    expected = np.clip(field.radiance[0][ahead].astype(float), 0, 1)
    encoded = np.where(expected < 0.0031308, 12.92 * expected, 1.055 * expected ** (1 / 2.4) - 0.055)
    np.testing.assert_allclose(image[ahead][:3] / 255, encoded, atol=0.01)
    inverse = field.inverse_distance.copy()
    inverse[0, :5] = 0
    inverse[1] = 0
    open_above = replace(field, inverse_distance=inverse)
    far = map_image(open_above, 0, "distance", "linear", 0.0)
    assert far[:5, :, :3].max() == 0 and far[5:, :, :3].max(axis=-1).min() > 0
    assert map_image(open_above, 1, "distance", "linear", 0.0)[..., :3].max() == 0


def test_picking_takes_the_point_under_the_mouse_and_none_behind_what_is_clicked(field):
    view = FieldView({"ball": field})
    view.follow(["ball"])
    places, _ = projected(CAMERA, field.points.astype(float), SIZE)
    away = np.linalg.norm(field.points - np.array(CAMERA.position), axis=-1)
    nearest, farthest = int(away.argmin()), int(away.argmax())
    at = tuple(places[nearest] * SIZE)
    assert not view.pick(CAMERA, at, SIZE, np.inf), "points are not shown"
    view.points_on = True
    assert view.pick(CAMERA, at, SIZE, float(away[nearest]) + 0.03) and view.point == nearest and view.map_on
    view.point = 1
    assert not view.pick(CAMERA, tuple(places[farthest] * SIZE), SIZE, 0.2) and view.point == 1
    _, _, ahead = camera_axes(CAMERA)
    turned = replace(CAMERA, target=tuple(np.array(CAMERA.position) - ahead))
    assert not view.pick(turned, (80, 80), SIZE, np.inf), "behind the eye"
    view.follow([])
    assert view.chosen is None and not view.pick(CAMERA, at, SIZE, np.inf)


def test_the_window_has_discs_and_a_map_of_the_selected_object(renderer, screen, field):
    state = WalkState.of(renderer.scene.record, "walk", screen)
    state.fields.fields = renderer.scene.light_fields
    state.navigation.camera = CAMERA
    state.fields.points_on = state.fields.map_on = True
    pictures = Pictures(renderer, state)
    drawn(pictures, state, SIZE)
    assert "points" not in pictures.images and "map" not in pictures.images, "nothing is selected"
    state.selection.choose("ball")
    drawn(pictures, state, SIZE)
    discs, square = pictures.images["points"], pictures.images["map"]
    assert square.shape == (30, 30, 4)
    drawn(pictures, state, SIZE)
    assert pictures.images["points"] is discs and pictures.images["map"] is square, "made once"
    state.fields.point, state.fields.shows = 5, "distance"
    drawn(pictures, state, SIZE)
    assert pictures.images["points"] is not discs and not np.array_equal(pictures.images["map"], square)


def test_a_light_field_is_compared_with_the_single_probe(renderer, screen):
    """B finds its light by the look-up chosen for it, whatever A's objects have."""
    state = WalkState.of(renderer.scene.record, "walk", screen)
    state.navigation.camera, state.look.lookups["ball"] = CAMERA, "light_field"
    comparison = state.comparison
    comparison.mode, comparison.integrator, comparison.look_up = "side by side", "rings", "plain"
    pictures = Pictures(renderer, state)
    for _ in range(3):
        drawn(pictures, state, SIZE)
    a, b = (picture.read() for picture in pictures.shown)
    frame = replace(pictures._frame(SIZE), integrator="rings", lookups={})
    np.testing.assert_allclose(b, renderer.image(replace(frame, lookup="plain")), rtol=0.02, atol=0.02)
    assert np.abs(a - b).max() > 0.3 and "plain" in comparison.divider.b_label


def test_the_panel_picks_a_point_and_says_what_bakes_a_light_field(monkeypatch, state, geometry, field):
    driver = PanelDriver(monkeypatch, walk_mode(state, geometry))
    try:
        state.fields.fields = {"table": field}
        driver.click("Light field", 0.3)
        driver.frame(2)
        assert "point" not in driver.rects
        state.selection.choose("table")
        driver.frame(2)
        driver.click("map", 0.1)
        driver.click("points", 0.1)
        driver.drag("point", 0.02, 0.5)
        assert state.fields.map_on and state.fields.points_on and 5 < state.fields.point < 18
        state.selection.choose("floor")
        driver.frame(2)
        assert "point" not in driver.rects and state.fields.chosen is None
    finally:
        driver.close()
    assert "--light-fields floor" in without("floor", ("table",), "room.store") and "table" in without(
        None, ("table",), ""
    )


def test_an_object_without_a_light_field_is_warned_of_unless_one_of_its_parts_has_one(
    monkeypatch, scene, screen, field
):
    parts = tuple(scene.objects[1].model_copy(update={"name": f"table {k}", "part_of": "table"}) for k in range(2))
    state = WalkState.of(scene.model_copy(update={"objects": parts}), "walk", screen)
    state.selection.name, state.look.lookup, said = "table", "light_field", []
    monkeypatch.setattr(light_field_panel, "wrapped", said.extend)
    for fields, warned in ({}, 1), ({"table 1": field}, 1):
        state.fields.fields = fields
        warn_of_look_up(state)
        assert len(said) == warned and "table has no light field" in said[0]


def test_a_click_on_a_disc_keeps_the_selection(state, geometry, field):
    """It picks a point; the same click without discs selects what is there."""
    state.navigation.camera = CAMERA
    state.fields.fields = {"table": field}
    state.selection.choose("table")
    state.fields.follow(["table"])
    state.fields.points_on = True
    state.screen.picture = Rect(10, 20, *SIZE)
    empty = Geometry(geometry.triangles.reshape(-1, 3)[:0], np.zeros((0, 3), int), ())
    walk = WalkInput(state, empty)
    places, _ = projected(CAMERA, field.points[3:4].astype(float), SIZE)
    (x, y) = places[0] * SIZE + (10, 20)
    walk.clicked(x, y)
    assert state.selection.name == "table" and state.fields.map_on
    state.fields.points_on = False
    walk.clicked(x, y)
    assert state.selection.name is None
