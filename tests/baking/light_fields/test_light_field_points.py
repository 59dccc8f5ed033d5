"""Points of light fields: even and dense where they should be, off the surface, not within anything."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lambent.baking.light_fields import sampling
from lambent.baking.light_fields.placing import Placing
from lambent.baking.light_fields.sampling import (
    SurfacePoints,
    curvatures,
    densities,
    eliminated,
    spread_evenly,
    thinned,
)
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.materials.document import Material
from lambent.scenes.geometry import box, cylinder, merge, patch, placed, sphere
from lambent.scenes.geometry.teapot import teapot
from lambent.scenes.scene import Mesh, Scene, SceneObject
from tests.baking.small_scenes import MIRROR

GREY = Material(kd=0.5)
LINE = Mesh(*(np.zeros((3, n), np.float32) for n in (3, 3, 3, 2)), faces=np.array([[0, 1, 2]], np.uint32))  # of no area


def nearest_m(points: np.ndarray) -> np.ndarray:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query(points, 2)[0][:, 1])


def even_points(mesh: Mesh, count: int) -> SurfacePoints:
    """Points of a mesh that is alone: nothing is near."""
    rng = np.random.default_rng(0)
    found = spread_evenly(mesh, 8 * count, rng)
    area = float(triangle_areas(mesh.corners).sum())
    free = np.full((len(found), 1), np.inf)
    return found[thinned(found, densities(found, area, count, free), count, rng)]


def test_candidates_lie_on_the_surface_in_equal_shares_of_area() -> None:
    large, small = patch((0, 0, 0), (3, 0, 0), (0, 0, -1)), patch((0, 0, 5), (1, 0, 0), (0, 0, -1))
    found = spread_evenly(merge([large, small]), 4000, np.random.default_rng(0))
    assert (found.positions[:, 1] == 0).all() and (found.positions[:, 2] > 2).sum() == 1000
    assert np.allclose(found.normals, (0, 1, 0))
    assert found.positions[found.positions[:, 2] < 2][:, 0].mean() == pytest.approx(1.5, abs=0.05)


def test_points_keep_their_distance() -> None:
    """Blue noise: n points on an area A may be sqrt(2A/(sqrt(3) n)) apart at best; random ones come to 0.01 of it."""
    flat = patch((0, 0, 0), (1, 0, 0), (0, 0, -1))
    found = even_points(flat, 300)
    assert len(found) == 300
    best = np.sqrt(2 / (np.sqrt(3) * 300))
    apart = nearest_m(found.positions)
    assert apart.min() > 0.55 * best and apart.mean() > 0.75 * best
    random = spread_evenly(flat, 300, np.random.default_rng(0))
    assert nearest_m(random.positions).min() < 0.3 * best, "the test tells them apart"


def test_density_follows_curvature_within_its_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    """A large ball and a small one, of the same area in the end: the small one turns faster."""
    large, small = sphere(1.0, 48, 24), [placed(sphere(0.1, 24, 12), (3 + i, 0, 0)) for i in range(10)]
    mesh = merge([large, *small])
    share = {}
    for weight in (0.0, 2.0):
        monkeypatch.setattr(sampling, "DENSER_CURVED", weight)
        found = even_points(mesh, 600).positions
        share[weight] = (found[:, 0] > 2).mean()
    of_area = 10 * 0.1**2 / (1 + 10 * 0.1**2)
    assert share[0.0] == pytest.approx(of_area, abs=0.02)
    assert 1.3 * of_area < share[2.0] < 3 * of_area
    k = curvatures(spread_evenly(large, 4000, np.random.default_rng(0)))
    assert np.median(k) == pytest.approx(1.0, rel=0.1), "1/radius"


def test_points_gather_where_other_things_are_near() -> None:
    flat = spread_evenly(patch((0, 0, 0), (2, 0, 0), (0, 0, -1)), 8000, np.random.default_rng(0))
    free = np.where(flat.positions[:, :1] < 1, 1e-3, np.inf)
    density = densities(flat, 2.0, 200, free)
    assert density.mean() == pytest.approx(100) and density.max() / density.min() == pytest.approx(3, rel=0.03)
    found = flat[thinned(flat, density, 200, np.random.default_rng(1))]
    assert (found.positions[:, 0] < 1).mean() == pytest.approx(0.75, abs=0.04)


def test_both_sides_of_a_thin_sheet_have_points() -> None:
    front, back = patch((0, 0, 0), (1, 0, 0), (0, 0, -1)), patch((0, -1e-4, 0), (0, 0, -1), (1, 0, 0))
    found = even_points(merge([front, back]), 100)
    up = found.normals[:, 1] > 0
    assert up.sum() == pytest.approx(50, abs=6)
    assert nearest_m(found.positions[up]).min() > 0.06 and nearest_m(found.positions[~up]).min() > 0.06


def test_meshes_without_area_and_with_few_candidates() -> None:
    assert not len(spread_evenly(LINE, 10, np.random.default_rng(0)))
    few = SurfacePoints(np.eye(3), np.eye(3))
    assert len(eliminated(few, np.ones(3), 5)) == 3 and len(thinned(few, np.ones(3), 2, np.random.default_rng(0))) == 2
    same = SurfacePoints(np.zeros((60, 3)), np.tile([0.0, 1.0, 0.0], (60, 1)))
    assert len(eliminated(same, np.ones(60), 7)) == 7, "all in one place"


def placing_of(*objects: SceneObject) -> Placing:
    builder = SceneBuilder(Scene("s", objects, {"m": MIRROR, "d": GREY}))
    return Placing(builder, builder.build())


def test_points_of_overlapping_balls_are_outside_of_both(mi: Any) -> None:
    one, other = sphere(0.5, 48, 24), placed(sphere(0.5, 48, 24), (0.6, 0, 0))
    for first, second in (((one,), other), ((merge([one, other]),), None)):  # two objects, and one of both
        things = [SceneObject("a", first[0], "m"), *([SceneObject("b", second, "d")] if second else [])]
        found = placing_of(*things).points(first[0], 200, 0)
        for centre in ((0, 0, 0), (0.6, 0, 0)):
            assert np.linalg.norm(found.positions - centre, axis=1).min() > 0.49
        assert len(found) == 200


def test_points_of_a_ball_on_the_floor_stand_in_the_gap_or_nowhere(mi: Any) -> None:
    """At height y over the floor, the gap below the ball along its normal is y/cos: points stay below its middle."""
    ball = placed(sphere(0.5, 96, 48), (0, 0.5, 0))
    floor = SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "d")
    found = placing_of(SceneObject("ball", ball, "m"), floor).points(ball, 400, 0, offset_m=0.1)
    assert (found.positions[:, 1] > 0).all()
    height = np.linalg.norm(found.positions - (0, 0.5, 0), axis=1) - 0.5
    assert height.max() == pytest.approx(0.1, abs=2e-3) and height.min() >= 0.1 / 8 - 2e-3
    low = found.positions - height[:, None] * found.normals
    gap = low[:, 1] / np.maximum(-found.normals[:, 1], 1e-9)
    np.testing.assert_allclose(height, np.where(gap > 0, np.minimum(0.1, gap / 2), 0.1), atol=4e-3)


def test_what_is_hidden_everywhere_has_no_points_and_says_so(mi: Any) -> None:
    """A box within a box, and an object without area."""
    inner, outer = SceneObject("inner", box((0.5, 0.5, 0.5)), "m"), SceneObject("outer", box((1, 1, 1)), "d")
    placing = placing_of(inner, outer)
    assert len(placing.points(outer.mesh, 50, 0)) == 50
    for hidden in (inner.mesh, LINE):
        with pytest.raises(UserError, match="its surface is hidden everywhere"):
            placing.points(hidden, 50, 0)


def test_the_root_of_a_spout_within_an_open_vessel_has_no_points(mi: Any) -> None:
    """A lid-less cylinder is not closed; all that a ball within it sees, but for the opening, is its inner side."""
    vessel = cylinder(0.2, 1.0, 48)
    up = np.isclose(vessel.positions[vessel.faces][:, :, 1], vessel.positions[:, 1].max()).all(axis=1)
    opened = Mesh(vessel.positions, vessel.normals, vessel.tangents, vessel.uv, vessel.faces[~up])
    low, high = opened.bounds
    ball = placed(sphere(0.05, 24, 12), tuple(0.7 * low + 0.3 * high))
    placing = placing_of(SceneObject("vessel", opened, "d"), SceneObject("ball", ball, "m"))
    with pytest.raises(UserError, match="hidden everywhere"):
        placing.points(ball, 20, 0)
    assert len(placing.points(opened, 30, 0)) == 30


def test_newells_teapot_is_covered_and_points_stand_off_it_by_less_than_their_spacing(mi: Any) -> None:
    mesh = teapot(0.25, 6)
    found = placing_of(SceneObject("pot", mesh, "m")).points(mesh, 289, 0)
    assert len(found) == 289
    spacing = float(np.sqrt(triangle_areas(mesh.corners).sum() / 289))
    assert 0.001 < found.offset_m <= spacing / 2
    places = spread_evenly(mesh, 3000, np.random.default_rng(5)).positions
    away = np.linalg.norm(found.positions[None] - places[:, None], axis=-1).min(axis=1)
    assert np.quantile(away, 0.95) < 1.3 * spacing
