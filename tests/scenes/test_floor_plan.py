"""Floor plans: what lies past a wall is told from what lies past an open edge, along any outline."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.scenes.floor_plan import STEPS, FloorPlan
from lambent.scenes.geometry import box, merge, patch, placed, turn
from lambent.scenes.reflectors import find_reflectors
from lambent.scenes.scene import Mesh, Scene, SceneObject
from lambent.store.plans import plan_of, plan_record

MATERIALS = {"varnish": Material(name="varnish", lobes=(Lobe(mx=0.05, my=0.05),)), "paint": Material(kd=0.5)}
BAY = merge(
    [patch((0, 0, 0), (0, 0, 4), (4, 0, 0)), patch((1, 0, -1), (0, 0, 1), (2, 0, 0))]
)  # 4 x 4 m, a bay at z < 0


def plan(floor: Mesh, room: Mesh | None = None) -> FloorPlan | None:
    objects = [SceneObject("floor", floor, "varnish")]
    if room is not None:
        objects.append(SceneObject("room", room, "paint"))
    return find_reflectors(Scene("test", tuple(objects), MATERIALS))[0].plan


def distance_m(found: FloorPlan | None, *points: tuple[float, float, float]) -> np.ndarray:
    """Of points of the plane, as a texture with linear filtering that is held at its edge has it."""
    assert found is not None
    offset = (np.array(points) - found.corner) / found.cell_m
    rows, columns = found.distance.shape
    at = [(offset @ found.along).clip(0, rows - 1), (offset @ found.across).clip(0, columns - 1)]
    row, column = (np.minimum(x.astype(int), n - 2) for x, n in zip(at, (rows, columns), strict=True))
    v, u = at[0] - row, at[1] - column
    d = found.distance.astype(float)
    above, below = ((1 - u) * d[r, column] + u * d[r, column + 1] for r in (row, row + 1))
    return ((1 - v) * above + v * below) / STEPS * found.cell_m


def bay_walls() -> Mesh:
    feet = [(0, 0), (1, 0), (1, -1), (3, -1), (3, 0), (4, 0), (4, 4), (0, 4)]
    ends = [*feet[1:], feet[0]]
    return merge([patch((x, 0, z), (u - x, 0, w - z), (0, 2, 0)) for (x, z), (u, w) in zip(feet, ends, strict=True)])


def test_walls_follow_a_bay_which_the_convex_hull_passes_outside_of() -> None:
    found = plan(BAY, bay_walls())
    inside = distance_m(found, (2, 0, 2), (0.01, 0, 3.99), (1.02, 0, -0.98), (2.98, 0, -0.5), (2, 0, -0.99))
    assert (inside > 0).all()
    outside = distance_m(
        found, (0.5, 0, -0.03), (0.97, 0, -0.5), (3.03, 0, -0.9), (2, 0, -1.03), (40, 0, 2), (-9, 0, -9)
    )
    assert (outside < 0).all()


@pytest.mark.parametrize("degrees", [0, 30])
def test_the_foot_of_a_wall_is_met_within_a_cell(degrees: float) -> None:
    """All behind it is past it, and nothing six tenths of a cell before it is."""
    how = turn("y", degrees)
    found = plan(placed(BAY, (0, 0, 0), how), placed(bay_walls(), (0, 0, 0), how))
    assert found is not None
    along = np.linspace(-0.9, -0.1, 50)
    for behind, sign in ((-0.6 * found.cell_m, 1), (0.1 * found.cell_m, -1)):
        points = np.stack([np.full(50, 3 + behind), np.zeros(50), along], axis=1) @ np.asarray(how)[:3, :3].T
        assert (sign * distance_m(found, *points) > 0).all()


@pytest.mark.parametrize("degrees", [0, 30])
def test_a_floor_ends_at_the_foot_of_walls_that_stand_on_it(degrees: float) -> None:
    """It reaches 3 cm under them, which is a strip along its edge; a room beside, .5 m wide, is more than that."""
    how = turn("y", degrees)
    floor = patch((-0.03, 0, -0.03), (0, 0, 4.06), (4.06, 0, 0))
    room = [patch((0, -0.01, 0), (4, 0, 0), (0, 2, 0)), patch((0, -0.01, 0), (0, 0, 4), (0, 2, 0))]
    room += [patch((4, -0.01, 0), (0, 0, 4), (0, 2, 0)), patch((0, -0.01, 4), (4, 0, 0), (0, 2, 0))]
    room += [patch((3.5, -0.01, 0), (0, 0, 4), (0, 2, 0)), placed(box((0.1, 1, 0.1)), (1, 0.4, 1.7))]
    found = plan(placed(floor, (0, 0, 0), how), placed(merge(room), (0, 0, 0), how))
    turned = np.asarray(how)[:3, :3].T
    assert found is not None
    along = np.stack([np.linspace(0.1, 3.9, 50), np.zeros(50), np.zeros(50)], axis=1)
    for behind, sign in ((-0.7 * found.cell_m, 1), (0.3 * found.cell_m, -1), (0.02, -1), (0.1, -1)):
        assert (sign * distance_m(found, *((along - (0, 0, behind)) @ turned)) > 0).all()
    inside = np.array([(1, 0, 1.7), (3.49, 0, 2), (3.51, 0, 2), (3.98, 0, 2), (3.75, 0, 3.98)])
    assert (distance_m(found, *(inside @ turned)) > 0).all()


def test_walls_are_told_from_open_sides() -> None:
    """A room of three walls, one over part of its side, one that begins above the floor; a screen in the middle."""
    room = merge(
        [
            patch((0, 0, 0), (4, 0, 0), (0, 2, 0)),  # z = 0
            patch((0, -0.5, 0), (0, 0, 4), (0, 3, 0)),  # x = 0, reaching below
            patch((4, 0.3, 0), (0, 0, 4), (0, 2, 0)),  # x = 4, begins 30 cm above the floor
            patch((0, 0, 4), (1.5, 0, 0), (0, 2, 0)),  # z = 4, the smaller part of it
            patch((2, 0, 1), (0, 0, 2), (0, 1, 0)),
        ]
    )
    found = plan(patch((0, 0, 0), (0, 0, 4), (4, 0, 0)), room)
    assert (distance_m(found, (2, 0, -0.1), (-0.1, 0, 2), (0.7, 0, 4.1)) < 0).all()
    assert (distance_m(found, (4.1, 0, 2), (3, 0, 4.1), (1.95, 0, 2), (2.05, 0, 2)) > 0).all()


def test_a_table_a_floor_of_tiles_and_an_empty_plane_have_no_walls() -> None:
    assert plan(placed(box((1.0, 0.05, 1.0)), (0, 0.7, 0)), box((0.1, 0.7, 0.1))) is None
    tiles = merge([patch((x, 0, z), (0, 0, 0.49), (0.49, 0, 0)) for x in (0, 0.5, 1) for z in (0, 0.5, 1)])
    assert plan(tiles) is None
    walled = plan(tiles, patch((0, 0, 0), (2, 0, 0), (0, 1, 0)))
    assert (distance_m(walled, (0.495, 0, 0.7), (0.7, 0, 0.995)) > 0).all()  # joints
    assert (distance_m(walled, (0.7, 0, -0.1)) < 0).all()


def test_plans_come_back_from_their_record() -> None:
    found = plan(BAY, bay_walls())
    assert found is not None
    record = plan_record(found)
    assert len(record.packed) < 10_000
    back = plan_of(record)
    np.testing.assert_array_equal(back.distance, found.distance)
    np.testing.assert_allclose([back.corner, back.across, back.along], [found.corner, found.across, found.along])
    for broken in ({"packed": record.packed[: len(record.packed) // 2]}, {"packed": "?"}, {"rows": record.rows + 1}):
        with pytest.raises(UserError, match="broken store"):
            plan_of(record.model_copy(update=broken))
