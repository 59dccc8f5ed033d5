"""Visibility by coherence (Ben-Artzi 2007, chapter 8): order, cells, and predictions against brute force."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.core.arrays import Flags
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from lambent.scenes.sky.triangle_lights import TriangleLights, environment_triangles
from tests.baking.small_scenes import GREY

OUTSIDE = -1

SIZE = 65
# Most per cent of wrong predictions, and of rays traced, where 65 pixels show a ball and a box on a floor.
LIMITS = {
    "SWB": (0.005, 50), "GWB": (0.1, 33), "GNB": (0.15, 33), "GWU": (0.02, 28), "GNU": (0.01, 28),
}  # fmt: skip


@pytest.fixture(scope="module")
def method(mi: Any) -> Any:
    from lambent.published import visibility

    return visibility


@pytest.mark.parametrize("order", ["grid", "scanline"])
@pytest.mark.parametrize(("width", "height"), [(65, 33), (50, 37), (3, 40), (1, 1)])
def test_every_pixel_is_evaluated_once_after_its_informers(method: Any, order: str, width: int, height: int) -> None:
    done = np.zeros(width * height, int)
    for step in getattr(method, order)(width, height):
        inside = step.informers[step.informers != OUTSIDE]
        assert done[inside].all()
        at, of = (np.stack(np.divmod(pixels, width)) for pixels in (step.pixels, step.informers))
        if width == 65 and order == "grid" and step.informers.size:
            middle = (step.informers != OUTSIDE).all(axis=1)
            assert (of[:, middle].mean(axis=-1) == at[:, middle]).all()
        done[step.pixels] += 1
    assert (done == 1).all()


def some_directions(count: int) -> np.ndarray:
    return normalize(np.random.default_rng(3).normal(size=(count, 3)))


def test_neighbours_are_the_cells_that_touch(method: Any) -> None:
    """A triangulation of a sphere has 3 M - 6 edges; cells side by side in the table are joined by one of them."""
    directions = some_directions(80)
    table, cells = method.neighbours(directions), method.CellTable(directions)
    joined = np.zeros((80, 80), bool)
    joined[np.arange(80)[:, None], table] = True
    assert (joined == joined.T).all()
    np.fill_diagonal(joined, False)
    assert joined.sum() == 2 * (3 * 80 - 6)
    assert (cells.at(3 * directions) == np.arange(80)).all()
    cell = cells.at(lat_long_directions(720, 1440).reshape(-1, 3)).reshape(720, 1440)
    for a, b in ((cell[1:], cell[:-1]), (cell[:, 1:], cell[:, :-1])):
        assert (joined[a, b] | (a == b)).mean() > 0.9999  # cells that meet in a point excepted
    touching = np.zeros_like(joined)
    touching[cell[1:], cell[:-1]] = touching[cell[:, 1:], cell[:, :-1]] = True
    assert ((touching | touching.T) & joined).sum() > 0.97 * joined.sum()  # others share less than a texel


def test_cells_are_those_of_the_nearest_light(method: Any) -> None:
    directions, w = some_directions(80), some_directions(5000)
    nearest = np.argmax(w @ directions.T, axis=1)
    assert (method.CellTable(directions).at(w) == nearest).mean() > 0.97


def ball_and_box() -> Scene:
    objects = {
        "floor": patch((-3, 0, 3), (6, 0, 0), (0, 0, -6)),
        "ball": placed(sphere(0.5, 96, 48), (0.3, 0.5, 0)),
        "box": placed(box((0.5, 0.5, 0.5)), (-0.6, 0.25, 0.4)),
    }
    return Scene("still life", tuple(SceneObject(n, mesh, "grey") for n, mesh in objects.items()), {"grey": GREY})


@pytest.fixture(scope="module")
def view(mi: Any) -> tuple[Any, Any, TriangleLights, Flags]:
    """The traced scene, the points of its view, whose corners show no surface, the lights, and which are seen."""
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.baking.transport.view_points import view_points
    from lambent.baking.transport.visibility import visibility

    w = lat_long_directions(48, 96).reshape(-1, 3)
    weight = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, 49))), 96) * np.pi / 48
    lights = environment_triangles(w, weight, 1 + np.clip(w @ [[2.0], [3.0], [1.0]], 0, None) * [1, 1, 1], 100)
    builder = SceneBuilder(ball_and_box())
    traced = builder.build()
    points = view_points(builder, traced, Camera("above", (0.5, 3.6, 3.4), (0, 0.2, 0)), SIZE, SIZE)
    assert 0.8 * SIZE**2 < len(points) < SIZE**2
    words, m = visibility(traced, points, lights), np.arange(len(lights))
    truth = ((words[m // 32] >> (m % 32)[:, None].astype(np.uint32)) & 1 == 1).T
    return traced, points, lights, truth


def test_rays_are_those_of_the_transport(method: Any, view: Any) -> None:
    traced, points, lights, truth = view
    rays = method.ShadowRays(traced, points, lights.centres)
    point, light = np.nonzero(rays.facing)
    blocked, place = rays.blockers(point, light)
    assert (blocked == ~truth[rays.facing]).all() and blocked.mean() > 0.05
    assert (rays.blocked(point, light) == blocked).all()
    assert rays.count == 2 * rays.facing.sum()
    offset = place[blocked] - points.p[point[blocked]]
    far = np.linalg.norm(offset, axis=1) > 0.01
    assert np.allclose(normalize(offset[far]), lights.centres[light[blocked]][far], atol=5e-3)
    towards = points.flat * np.sign((points.flat * points.n).sum(axis=1))[:, None]
    assert (rays.facing == (towards @ lights.centres.T.astype(np.float32) > 0)).all()


@pytest.mark.parametrize("name", LIMITS)
def test_predictions_are_wrong_no_more_often_than_stated(method: Any, view: Any, name: str) -> None:
    traced, points, lights, truth = view
    found = method.predicted_visibility(traced, points, lights.centres, SIZE, SIZE, method.VARIANTS[name])
    most_wrong, most_traced = LIMITS[name]
    assert not (found.seen & ~found.facing).any()
    assert found.wrong_percent(truth) < most_wrong
    assert 5 < found.traced_percent < most_traced
    assert found.wrong_percent(~truth) > 90


def test_warped_blockers_stand_where_the_next_point_sees_them(method: Any) -> None:
    """A blocker one metre above a point is at 45 degrees for a point one metre aside."""
    directions = normalize(np.array([[0, 1, 0], [-1, 1, 0], [1, 1, 0], [0, -1, 0], [0, 0.3, 1], [0, 0.3, -1.0]]))
    p = np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 0, 0]], np.float32)
    seen, facing = np.ones((4, 6), bool), np.ones((4, 6), bool)
    warped = method.Warped(p, directions)
    warped.keep(np.array([0]), np.array([0]), np.array([[0, 1, 0]], np.float32))
    seen[0, 0] = False
    votes, voters = warped.count(seen, facing, np.array([1, 2, 3]), np.array([[0, 3], [0, OUTSIDE], [0, 0]]))
    assert votes.tolist() == [[0, 1, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [2, 0, 0, 0, 0, 0]]
    assert voters[:, 0].tolist() == [2, 1, 2]
    seen[1, 1] = False  # a point that has been told of a blocker tells of it, from where it really stands
    votes, _ = warped.count(seen, facing, np.array([2]), np.array([[1]]))
    assert votes.tolist() == [[0, 0, 1, 0, 0, 0]]
