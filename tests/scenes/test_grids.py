"""Calculation grids: cells of the standard, places on rectangles and on objects, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.scenes.geometry import box, merge, patch, placed
from lambent.scenes.grids import Grid
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.loaders.scene_toml.grids import GridSection, cells_of
from lambent.scenes.scene import SceneObject
from tests.baking.small_scenes import turned_inwards
from tests.scenes.loaders.test_toml import MATERIALS, written

SHELL = SceneObject("shell", placed(turned_inwards(box((6, 3, 4))), (0, 1.5, 0)), "grey")
DESK = SceneObject("desk", placed(box((1.6, 0.7, 0.8)), (1, 0.35, 0)), "grey")


def grid_on(*objects: SceneObject, **keys: object) -> Grid:
    return GridSection(name="g", **keys).grid(objects, Path("scene.toml"), "grids.g")


def size(grid: Grid) -> list[float]:
    return [float(side) for side in np.linalg.norm(grid.edges, axis=1)]


@pytest.mark.parametrize(("metres", "count"), [(0.4, 4), (1.0, 5), (2.0, 6), (5.0, 8), (10.0, 10), (100.0, 20)])
def test_a_square_has_as_many_cells_as_the_standard_says(metres, count):
    """d / p of EN 12464-1, 4.4, rounded; its table has 3, 5, 6, 8, 10 and 20, from a p rounded for .4 m."""
    assert cells_of(np.array([metres, metres])) == (count, count)


def test_cells_are_nearly_square_whatever_the_area():
    rng = np.random.default_rng(1)
    for size in np.exp(rng.uniform(-1, 5, (200, 2))):
        a, b = size / cells_of(size)
        assert 0.5 <= a / b <= 2 and max(a, b) <= 10 * 1.34
    assert cells_of(np.array([20.0, 4.0])) == (40, 8), "twice as long as wide: the shorter side counts"
    assert cells_of(np.array([4.0, 3.0]), 0.5) == (8, 6)


def test_a_rectangle_has_its_points_at_the_middles_of_cells():
    grid = grid_on(corner=(1, 0.8, 2), edges=((2, 0, 0), (0, 0, -1)), spacing_m=0.5)
    np.testing.assert_allclose(grid.points[:4, 0], [1.25, 1.75, 2.25, 2.75])
    assert np.unique(grid.points[:, 2]).tolist() == [1.25, 1.75] and (grid.points[:, 1] == 0.8).all()
    np.testing.assert_allclose(grid.normal, [0, 1, 0])
    same = grid_on(centre=(2, 0.3, 1.5), edges=((2, 0, 0), (0, 0, -1)), spacing_m=0.5, height_m=0.5)
    np.testing.assert_allclose(same.points, grid.points)
    inset = grid_on(corner=(1, 0.8, 2), edges=((2, 0, 0), (0, 0, -1)), margin_m=0.25, normal=(0, 0, -3))
    assert size(inset) == [1.5, 0.5] and inset.corner.tolist() == [1.25, 0.8, 1.75]
    np.testing.assert_allclose(inset.normal, [0, 0, -1])


def test_a_room_has_a_workplane_over_its_floor_without_a_band_of_half_a_metre():
    grid = grid_on(SHELL, object="shell")
    assert (grid.points[:, 1] == 0.75).all() and grid.normal.tolist() == [0, 1, 0]
    assert size(grid) == pytest.approx([5, 3])
    assert grid.inside.shape == (5, 8) and grid.inside.all()
    assert size(grid_on(SHELL, DESK, object="desk", height_m=0.0, margin_m=0.0)) == pytest.approx([1.6, 0.8])
    narrow = replace(SHELL, mesh=placed(turned_inwards(box((9, 3, 1.2))), (0, 1.5, 0)))
    assert size(grid_on(narrow, object="shell")) == pytest.approx([9 - 0.36, 0.84])


def test_the_top_is_the_floor_of_a_house_and_the_plate_of_a_table():
    house = SceneObject("house", merge([box((6.4, 3.4, 4.4)), turned_inwards(box((6, 3, 4)))]), "grey")
    assert grid_on(house, object="house").points[0, 1] == pytest.approx(-1.5 + 0.75), "not the roof"
    worn = SceneObject("worn", merge([house.mesh, placed(box((0.5, 0.1, 0.5)), (0, -1.45, 0))]), "grey")
    assert grid_on(worn, object="worn").points[0, 1] == pytest.approx(-1.5 + 0.75), "not a step on it"
    legs = [placed(box((0.05, 0.7, 0.05)), (x, 0.35, z)) for x in (-0.7, 0.7) for z in (-0.3, 0.3)]
    plate = placed(box((1.6, 0.04, 0.8)), (0, 0.72, 0))
    shelf = placed(box((1.2, 0.02, 0.4)), (0, 0.2, 0))
    table = SceneObject("table", merge([shelf, *legs, plate]), "grey")
    assert grid_on(table, object="table", height_m=0.0).points[0, 1] == pytest.approx(0.74)
    fallen = patch((0, 0, 0), (0, 0, -2), (2, 0, 0))  # faces down
    assert grid_on(SceneObject("sheet", fallen, "grey"), object="sheet", height_m=0).points[:, 1].max() == 0


def test_points_keep_within_an_l_shaped_floor_of_many_parts():
    """Seams between its parts are no outline; the missing quarter and the band along it are left out."""
    tiles = [(x, z) for x in range(6) for z in range(6) if x < 3 or z < 3]
    floor = [SceneObject(f"tile_{x}_{z}", patch((x, 0, z + 1), (1, 0, 0), (0, 0, -1)), "grey") for x, z in tiles]
    grid = grid_on(*floor, object="tile_*")
    assert grid.inside.shape == (8, 8) and not grid.inside.all()
    x, _, z = grid.points.T
    assert ((x < 2.51) | (z < 2.51)).all() and min(x.min(), z.min()) > 0.5 and max(x.max(), z.max()) < 5.5
    assert len(grid.points) == pytest.approx(64 * (25 - 9) / 25, abs=3)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ('corner = [0, 0, 0]\nedges = [[1, 0, 0], [2, 0, 0]]', "grids.a: has no area; found [[1.0, 0.0, 0.0]"),
        ('corner = [0, 0, 0]\nedges = [[0, 0, 0], [0, 0, 0]]', "grids.a: has no area"),
        ('corner = [0, 0, 0]\nedges = [[9, 0, 0], [0, 0, 9]]\nspacing_m = 0.01', "grids.a: grid has too many points; "
         "found 900 x 900 points; expected at most 100000 points"),
        ('corner = [0, 0, 0]\nedges = [[1, 0, 0], [0, 0, 1]]\nmargin_m = 0.5', "margin of 0.5 m leaves nothing of 1 m"),
        ('object = "tabel"', "grids.a: matches no object; found tabel"),
        ('object = "room"\ncorner = [0, 0, 0]', "must have one of object, corner and edges, or centre and edges"),
        ('corner = [0, 0, 0]', "must have one of object"),
        ('corner = [0, 0, 0]\nedges = [[1, 0, 0], [0, 0, 1]]\nnormal = [0, 0, 0]', "a direction cannot be zero"),
        ('corner = [0, 0, 0]\nedges = [[1, 0, 0], [0, 0, 1]]\nspacing = 1', "unknown key; did you mean 'spacing_m'?"),
        ('corner = [0, 0, 0]\nedges = [[1, 0, 0], [0, 0, 1]]\nspacing_m = 1e-300', "spacing_m"),
    ],
)  # fmt: skip
def test_a_grid_that_cannot_be_is_one_line(tmp_path, keys, words):
    with pytest.raises(UserError) as found:
        load_scene(written(tmp_path, f'{MATERIALS}[[grids]]\nname = "a"\n{keys}\n'))
    assert words in str(found.value) and "scene.toml" in str(found.value)


def test_a_scene_file_has_its_grids(tmp_path):
    corner = "corner = [-1, 0.8, 1]\nedges = [[2, 0, 0], [0, 0, -2]]\n"
    one, two = f'[[grids]]\nname = "a"\n{corner}', f'[[grids]]\nname = "b"\n{corner}spacing_m = 1\n'
    scene = load_scene(written(tmp_path, MATERIALS + one + two))
    assert [(grid.name, grid.inside.shape) for grid in scene.grids] == [("a", (6, 6)), ("b", (2, 2))]
    with pytest.raises(UserError, match="grids: name is used twice; found a"):
        load_scene(written(tmp_path, MATERIALS + one + one))


def test_walls_alone_have_no_level_top():
    wall = SceneObject("wall", patch((0, 0, 0), (2, 0, 0), (0, 2, 0)), "grey")
    with pytest.raises(UserError, match="object has no level top; found wall; give corner and edges"):
        grid_on(wall, object="wall")
