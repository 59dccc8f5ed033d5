"""Points of light fields on Bezier patches: even by true area, on the surface, outside of the triangles; by patch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lambent.bake.bake import bake
from lambent.bake.light_fields import sampling
from lambent.bake.light_fields.on_patches import exact_places, surface_areas
from lambent.bake.light_fields.sampling import densities, spread_evenly, thinned, turning_of
from lambent.core.geometry import triangle_areas
from lambent.scenes.geometry import bezier, merge, patch, teapot, transformed
from lambent.scenes.geometry.tessellation import tessellated
from lambent.scenes.mesh import Mesh
from lambent.scenes.scene import LightFieldWish, SceneObject
from lambent.store.contract import light_field_name
from tests.bake.small_scenes import TINY, coloured_room, turned_inwards
from tests.bake.test_light_field_points import placing_of
from tests.scenes.test_bezier import TEAPOT, octant, quarter_cylinder, sheet

MIRRORED = np.diag([-1.0, 1.0, 1.0, 1.0])


def bunched() -> np.ndarray:
    """A flat unit square whose u is dense at one side: x = u^2, so that area is 2 u du dv."""
    points = sheet()
    points[..., 0] = [0, 0, 1 / 3, 1]
    return points


def spread(mesh: Mesh, count: int = 4000, **more: Any) -> Any:
    return spread_evenly(mesh, count, np.random.default_rng(0), **more)


def facets_of(mesh: Mesh) -> Mesh:
    return replace(mesh, patches=None)


@pytest.mark.parametrize("steps", [1, 2, 8])
def test_areas_are_those_of_the_surface(steps: int) -> None:
    ball = tessellated(octant()[None], steps)
    true = float(bezier.areas(octant()))
    assert surface_areas(ball).sum() == pytest.approx(true, rel=2e-2 if steps == 1 else 1e-3)
    assert steps == 8 or triangle_areas(ball.corners).sum() < 0.95 * true, "facets cut corners"
    pot = tessellated(TEAPOT, 6)
    assert surface_areas(pot).sum() == pytest.approx(bezier.areas(TEAPOT).sum(), rel=1e-3)
    other = merge([patch((0, 0, 0), (2, 0, 0), (0, 3, 0)), ball])
    assert surface_areas(other)[:2].sum() == pytest.approx(6), "triangles of no patch are themselves"


def test_points_are_even_by_true_area_whatever_the_parameters() -> None:
    """Two triangles of a bunched square: places even over them are 2 u du at x = u^2, until they are drawn again."""
    flat = tessellated(bunched()[None], 1)
    x = np.sort(spread(flat).positions[:, 0])
    even = (np.arange(len(x)) + 0.5) / len(x)
    assert np.abs(x - even).max() < 0.03, "Kolmogorov: 1.6 / sqrt(4000)"
    many = tessellated(np.array([bunched(), np.add(bunched(), (1, 0, 0))]), 4)
    counts = np.histogram(spread(many).positions[:, 0], 20, (0, 2))[0]
    assert ((counts - 200.0) ** 2 / 200).sum() < 45, "chi-square of 19 degrees of freedom"


@pytest.mark.parametrize("matrix", [np.eye(4), MIRRORED, np.diag([2.0, 2.0, 2.0, 1.0])])
def test_points_and_normals_are_exact(matrix: np.ndarray) -> None:
    """A ball in 2 x 2 steps: its triangles are 8 % beneath it, and normals between theirs lean."""
    ball = transformed(tessellated(octant()[None], 2), matrix)
    radius = abs(matrix[0, 0])
    found = spread(ball)
    distance = np.linalg.norm(found.positions, axis=1)
    assert np.allclose(distance, radius, rtol=1e-3)
    assert (found.normals * found.positions / distance[:, None]).sum(axis=1).min() > 0.999
    z = np.sort(found.positions[:, 2]) / radius  # even, as on every ball, up to its pole
    assert np.abs(z - (np.arange(len(z)) + 0.5) / len(z)).max() < 0.03
    assert np.allclose(turning_of(found), 1 / radius, rtol=0.1)
    facets = spread(facets_of(ball))
    assert np.linalg.norm(facets.positions, axis=1).min() < 0.96 * radius, "the test tells them apart"
    turned = spread(turned_inwards(ball))
    assert (turned.normals * turned.positions).sum(axis=1).max() < 0, "normals follow a mesh that is turned about"


def test_points_are_not_behind_triangles_that_bulge_over_the_surface(mi: Any) -> None:
    """Inside of a coarse tube, whose chords are up to 7 % of the radius nearer to the axis than the surface."""
    tube = turned_inwards(tessellated(quarter_cylinder(1.0, 1.0)[None], 2))
    found = spread(tube)
    at = found.positions[:, :2]
    phi = np.arctan2(at[:, 1], at[:, 0]) % (np.pi / 4) - np.pi / 8
    chord = np.cos(np.pi / 8) / np.cos(phi)
    assert np.abs(np.linalg.norm(at, axis=1) - chord).max() < 2e-3
    radial = (found.normals[:, :2] * at).sum(axis=1) / np.linalg.norm(at, axis=1)
    assert radial.max() < -0.999, "normals are those of the surface nevertheless"
    thing = SceneObject("tube", tube, "m")
    placed = placing_of(thing).points(tube, 100, 0, offset_m=0.005)
    assert len(placed) == 100
    height = np.linalg.norm(placed.positions[:, :2], axis=1)
    phi = np.arctan2(placed.positions[:, 1], placed.positions[:, 0]) % (np.pi / 4) - np.pi / 8
    over = np.cos(np.pi / 8) / np.cos(phi) - height
    assert over.min() > 0.002 and over.max() < 0.008, "at the offset over the triangles"


def test_curvature_is_exact_in_the_density(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a flat square, the ends of a bump turn fast: more points there than by area, unlike without emphasis."""
    both = tessellated(np.array([np.add(sheet(), (3, 0, 0)), octant(0.5)]), 4)
    share = {}
    for weight in (0.0, 2.0):
        rng, count = np.random.default_rng(0), 300
        found = spread_evenly(both, 8 * count, rng)
        area = float(surface_areas(both).sum())
        free = np.full((len(found), 1), np.inf)
        monkeypatch.setattr(sampling, "DENSER_CURVED", weight)
        kept = thinned(found, densities(found, area, count, free), count, rng)
        share[weight] = (found.positions[kept][:, 0] < 1).mean()
    ball = np.pi / 8
    assert share[0.0] == pytest.approx(ball / (1 + ball), abs=0.02)
    spacing = np.sqrt((1 + ball) / 300)
    denser = 1 + 2 * (2 * spacing) / (1 + 2 * spacing)
    assert share[2.0] == pytest.approx(denser * ball / (1 + denser * ball), abs=0.02)


def test_density_by_patch(mi: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three squares of equal area: twice as dense as the rest, not at all, and by area alone."""
    squares = np.array([sheet(), np.add(sheet(), (2, 0, 0)), np.add(sheet(), (4, 0, 0))])
    floor = merge([tessellated(squares, 2), patch((6, 0, 0), (1, 0, 0), (0, 1, 0))])
    placing = placing_of(SceneObject("floor", floor, "m"))
    monkeypatch.setattr(sampling, "DENSER_NEAR", 0.0)
    density = (8.0, 0.0, 1.0)
    x = placing.points(floor, 400, 0, patch_density=density).positions[:, 0]
    counts = [int(((x > left) & (x < left + 1)).sum()) for left in (0, 2, 4, 6)]
    assert sum(counts) == 400 and counts[1] == 0
    assert np.allclose(counts, [320, 0, 40, 40], atol=8)
    even = placing.points(floor, 400, 0).positions[:, 0]
    assert [int(((even > left) & (even < left + 1)).sum()) for left in (0, 2, 4, 6)] == pytest.approx([100] * 4, abs=8)


def test_trials_ask_for_the_same_density(monkeypatch: pytest.MonkeyPatch) -> None:
    """The number of points that an error needs is found with points that lie as those of the bake."""
    from lambent.bake.light_fields import choosing

    wish = LightFieldWish(error=0.1, patch_density=(4.0, 1.0))
    scene = replace(coloured_room(), light_fields={"ball": wish})
    asked: dict[str, Any] = {}
    monkeypatch.setattr(choosing, "probe_light", lambda *_: None)
    monkeypatch.setattr(choosing, "tried", lambda *_, **more: asked.update(more))
    monkeypatch.setattr(choosing, "turned_to_viewers", lambda mesh, *_: mesh)
    nothing: Any = None
    around: Any = SimpleNamespace(scene=None)
    choosing.Chooser(scene, nothing, nothing, around, np.zeros((0, 3)), 16, 0).trial("ball", nothing, 1.0)
    assert asked == {"patch_density": (4.0, 1.0)}


def test_points_of_the_teapot_are_on_it_and_nothing_is_lost(mi: Any) -> None:
    """The tessellation is up to .1 % of its length off; points stand at their offset over one of both."""
    pot = teapot(0.3, 6)
    assert pot.patches is not None
    placing = placing_of(SceneObject("teapot", pot, "m"))
    found = placing.points(pot, 400, 0, offset_m=0.002)
    assert len(found) == 400
    fine = teapot(0.3, 64)
    from scipy.spatial import cKDTree

    apart = cKDTree(fine.positions).query(found.positions)[0]
    assert apart.max() < 0.006, "the offset, and the distance to a vertex of the fine mesh"


def test_folded_patches_fall_back_to_triangles() -> None:
    """A patch that folds back across a triangle's normal: its triangles are the surface there."""
    mesh = tessellated(sheet()[None], 2)
    assert mesh.patches is not None
    upright = sheet()[..., [0, 2, 1]]
    wrong = replace(mesh, patches=replace(mesh.patches, control=upright[None]))
    faces = np.zeros(10, np.int64)
    weights = np.random.default_rng(0).dirichlet((1, 1, 1), 10)
    assert not exact_places(wrong, faces, weights).found.any()
    assert np.isfinite(spread(wrong).positions).all()


def test_a_bake_puts_points_on_patches(tmp_path: Path) -> None:
    """A mirror ball of octants in coarse steps: points are off the true ball, most of them on the first octant."""
    quarter = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    upper = [0.3 * octant() @ np.linalg.matrix_power(quarter, k) for k in range(4)]
    control = np.array([*upper, *(points[:, ::-1] * (1, 1, -1) for points in upper)])
    room = coloured_room()
    ball = replace(room.object("ball"), mesh=tessellated(control, 3))
    wish = LightFieldWish(points=48, texels=16, offset_m=0.01, patch_density=(4.0, *[1.0] * 7))
    scene = replace(room, objects=(*room.objects[:-1], ball), light_fields={"ball": wish})
    store = bake(scene, tmp_path / "s", quality=TINY, only=("light_field",))
    points, normals = (store.read(light_field_name("ball", part)) for part in ("points", "normals"))
    distance = np.linalg.norm(points, axis=1)
    assert np.allclose(distance, 0.31, rtol=1e-3), "facets of these steps are 3 % lower"
    assert (normals * points / distance[:, None]).sum(axis=1).min() > 0.999
    first = (points > 0).all(axis=1)
    assert first.sum() == pytest.approx(48 * 4 / 11, abs=4)
