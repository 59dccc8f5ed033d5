"""The sample map: by texel of the charts the nearest points above the horizon, exactly."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import CANDIDATES, NO_POINT
from lambent.baked.light_fields.nearest_points import HORIZON_DEG, nearest_points
from lambent.baking.light_fields.sample_map import GUTTER, LONGEST, MOST_TEXELS, finer_by, sample_map, with_gutters
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize


def by_brute_force(places: Floats, normals: Floats, points: Floats) -> np.ndarray:
    found = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    for i, (t, n) in enumerate(zip(places, normals, strict=True)):
        offset = points - t
        distance = np.linalg.norm(offset, axis=1)
        above = np.flatnonzero(offset @ n > np.cos(np.radians(HORIZON_DEG)) * distance)
        best = above[np.argsort(distance[above], kind="stable")][:CANDIDATES]
        found[i, : len(best)] = best
    return found


@pytest.mark.parametrize("count", [0, 1, 3, 4, 5, 60, 900])
def test_entries_are_those_of_brute_force(count: int) -> None:
    """Also where few points are above the horizon, so that many more have to be asked for."""
    rng = np.random.default_rng(count)
    points = normalize(rng.standard_normal((count, 3)))
    places = np.concatenate([0.99 * normalize(rng.standard_normal((300, 3))), rng.uniform(-2, 2, (100, 3))])
    normals = normalize(np.concatenate([places[:300], rng.standard_normal((100, 3))]))
    np.testing.assert_array_equal(nearest_points(places, normals, points), by_brute_force(places, normals, points))


def test_points_on_a_grid_tie_and_the_first_is_taken() -> None:
    grid = np.stack(np.meshgrid(np.arange(6.0), [0.5], np.arange(6.0), indexing="ij"), axis=-1).reshape(-1, 3)
    places = np.stack(np.meshgrid(np.arange(11) / 2, [0.0], np.arange(11) / 2, indexing="ij"), axis=-1).reshape(-1, 3)
    up = np.broadcast_to([0.0, 1.0, 0.0], places.shape)
    np.testing.assert_array_equal(nearest_points(places, up, grid), by_brute_force(places, up, grid))


def quad(width: float, uv_low: tuple[float, float], uv_high: tuple[float, float]) -> dict[str, Floats]:
    """A square on the floor, (x, z) from 0 to `width`, that takes a rectangle of the light map."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float)
    low, high = np.array(uv_low), np.array(uv_high)
    return {
        "positions": (corners[:, [0, 0, 1]] * (width, 0, width)).astype(np.float32),
        "normals": np.tile(np.array([0, 1, 0], np.float32), (4, 1)),
        "uv2": (low + corners * (high - low)).astype(np.float32),
        "faces": np.array([[0, 2, 1], [0, 3, 2]], np.uint32),
    }


def test_texels_name_the_points_above_them() -> None:
    """uv2 = (column, row) over the grid grows with x and z: the texel's centre is where its nearest point is."""
    geometry = quad(1.0, (0.25, 0.5), (0.5, 0.75))
    x = (np.arange(8) + 0.5) / 8
    points = np.stack(np.meshgrid(x, [0.1], x, indexing="ij"), axis=-1).reshape(-1, 3)
    found = sample_map(geometry, np.arange(2), (64, 32), points, 1 / 8)
    rows, columns = found.grid
    top, left = found.corner
    assert rows / columns == 32 / 64 and rows % 32 == 0, "as many times as fine along both"
    at = np.stack(np.meshgrid((np.arange(40) + 0.5) / 40, (np.arange(40) + 0.5) / 40), axis=-1).reshape(-1, 2)
    uv2 = np.array([0.25, 0.5]) + 0.25 * at
    entry = found.entries[(uv2[:, 1] * rows).astype(int) - top, (uv2[:, 0] * columns).astype(int) - left]
    place = np.stack([at[:, 0], np.zeros(len(at)), at[:, 1]], axis=-1)
    away = np.linalg.norm(points[entry[:, 0]] - place, axis=1)
    best = np.linalg.norm(points[None] - place[:, None], axis=-1).min(axis=1)
    assert (away <= best + 1 / 8 / 4).all(), "to a texel's width"
    outside = found.entries[:1], found.entries[-1:]
    assert found.entries.shape[0] <= rows // 4 + 2 * GUTTER + 2, "cropped to the charts"
    assert all((edge[..., 0] != NO_POINT).any() for edge in outside), "gutters are filled"


@pytest.mark.parametrize(("size", "spacing_m"), [((160, 160), 1e-3), ((4096, 8), 1e-3), ((2048, 2048), 1e-6)])
def test_a_map_has_room_however_large_the_object_is(size: tuple[int, int], spacing_m: float) -> None:
    """Never coarser than the light map, and as fine as the points ask for or as there is room."""
    square = quad(1000.0, (0.0, 0.0), (1.0, 1.0))
    positions, corners = square["positions"][square["faces"]], square["uv2"][square["faces"]] * size
    scale = finer_by(positions, corners, spacing_m)
    width, height = scale * size[0], scale * size[1]
    assert scale == 1 or (max(width, height) <= LONGEST and width * height <= MOST_TEXELS)
    assert 2 * max(width, height) > LONGEST or 4 * width * height > MOST_TEXELS, "no room for twice the size"
    assert finer_by(positions, corners, 1e9) == 1


def test_gutters_have_the_entries_of_the_nearest_texel() -> None:
    entries, covered = np.full((9, 9, CANDIDATES), NO_POINT, np.uint16), np.zeros((9, 9), bool)
    entries[4, 4], covered[4, 4] = (7, 5, NO_POINT, NO_POINT), True
    filled = with_gutters(entries, covered, NO_POINT)
    assert (filled[2:7, 4] == entries[4, 4]).all() and (filled[4, 2:7] == entries[4, 4]).all()
    assert (filled[[0, 1, 7, 8]] == NO_POINT).all()


def test_points_behind_a_wall_are_left_out_where_others_are_seen() -> None:
    """A wall at x = 0: places see points of their own side; one that sees none has the nearest of all."""
    rng = np.random.default_rng(2)
    points = np.concatenate([rng.random((200, 3)), rng.random((200, 3)) * [-1, 1, 1]])
    places, up = np.array([[0.05, 0.5, 0.0], [-0.05, 0.5, 0.0], [0.5, 0.5, 0.0]]), np.tile([0.0, 0, 1], (3, 1))

    def same_side(p: Floats, n: Floats, q: Floats) -> np.ndarray:
        return (p[:, 0] > 0) == (q[:, 0] > 0)

    found = nearest_points(places, up, points, same_side)
    assert (points[found[0], 0] > 0).all() and (points[found[1], 0] < 0).all()
    by_hand = by_brute_force(places[:1], up[:1], np.where(points[:, :1] > 0, points, 1e6))
    np.testing.assert_array_equal(found[:1], by_hand)
    blind = nearest_points(places, up, points, lambda p, n, q: np.zeros(len(p), bool))
    np.testing.assert_array_equal(blind, by_brute_force(places, up, points))
    few = nearest_points(places[:1], up[:1], points[:3], same_side)
    np.testing.assert_array_equal(few, by_brute_force(places[:1], up[:1], points[:3]))
