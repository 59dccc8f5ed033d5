"""Planar reflectors are found on large, flat, glossy surfaces alone; floor plans tell walls from open edges."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.scenes import reflectors
from lambent.scenes.floor_plan import STEPS, FloorPlan
from lambent.scenes.geometry import box, merge, patch, placed, sphere, turn
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.reflectors import find_reflectors
from lambent.scenes.scene import Mesh, ReflectorRule, Scene, SceneObject
from lambent.store.plans import plan_of, plan_record
from tests.scenes.loaders.test_toml import MATERIALS, written

GLOSSY_OR_NOT = {
    "varnish": Material(name="varnish", lobes=(Lobe(mx=0.05, my=0.05),)),
    "satin": Material(name="satin", lobes=(Lobe(mx=0.3, my=0.3),)),
    "paint": Material(name="paint", kd=0.5),
}


def scene_of(*objects: SceneObject, rules: tuple[ReflectorRule, ...] = ()) -> Scene:
    return Scene("test", objects, GLOSSY_OR_NOT, reflector_rules=rules)


def floor(name: str, x: float, material: str = "varnish", y: float = 0.0) -> SceneObject:
    return SceneObject(name, patch((x, y, 0), (0, 0, 1), (1, 0, 0)), material)


def test_parts_in_one_plane_are_one_reflector() -> None:
    (found,) = find_reflectors(
        scene_of(floor("a", 0), floor("b", 3), floor("rough", 1, "satin"), floor("mat", 2, "paint"))
    )
    np.testing.assert_allclose(found.plane, (0, 1, 0, 0), atol=1e-9)
    assert [part.object for part in found.parts] == ["a", "b"]
    assert found.area_m2 == pytest.approx(2)
    assert found.two_sided
    np.testing.assert_allclose(found.outline[:, 1], 0, atol=1e-9)
    assert sorted(map(tuple, found.outline[:, [0, 2]].round(6).tolist())) == [(0, 0), (0, 1), (4, 0), (4, 1)]
    edges = np.roll(found.outline, -1, axis=0) - found.outline
    assert (np.cross(edges, np.roll(edges, -1, axis=0))[:, 1] > 0).all()  # counter-clockwise about +y


def test_flat_parts_of_an_object_count_and_curved_ones_do_not() -> None:
    slab = placed(box((1.0, 0.05, 1.0), 0.01), (0, 0.7, 0), turn("z", 30))
    both = find_reflectors(scene_of(SceneObject("slab", merge([slab, sphere(0.9, 64, 32)]), "varnish")))
    assert sorted(np.sign(found.plane[1]) for found in both) == [-1, 1]
    for found in both:
        np.testing.assert_allclose(
            found.plane[:3], np.sign(found.plane[1]) * np.array([-0.5, np.sqrt(0.75), 0]), atol=1e-6
        )
        assert found.area_m2 == pytest.approx(0.98**2, rel=1e-3)
        assert not found.two_sided


def test_steps_of_a_few_millimetres_are_two_planes() -> None:
    found = find_reflectors(scene_of(floor("a", 0), floor("b", 1, y=0.004)))
    assert sorted(round(-r.plane[3], 6) for r in found) == [0, 0.004]


def test_slightly_uneven_floors_are_one_plane() -> None:
    found = find_reflectors(scene_of(*(floor(f"tile_{i}", i, y=0.0004 * (i % 2)) for i in range(6))))
    assert len(found) == 1
    assert found[0].deviation_m == pytest.approx(2e-4, rel=0.01)


def test_the_scene_has_the_last_word() -> None:
    small = SceneObject("plate", patch((5, 1, 0), (0, 0, 0.2), (0.2, 0, 0)), "satin")
    objects = (floor("a", 0), small)
    assert len(find_reflectors(scene_of(*objects))) == 1
    rules = (ReflectorRule("a", use=False), ReflectorRule("pl*", use=True))
    (found,) = find_reflectors(scene_of(*objects, rules=rules))
    assert [part.object for part in found.parts] == ["plate"]
    shifted = ReflectorRule("a", plane=(0, 2, 0, -0.001))
    (found,) = find_reflectors(scene_of(objects[0], rules=(shifted,)))
    np.testing.assert_allclose(found.plane, (0, 1, 0, -0.0005))


def test_scene_toml_rules(tmp_path: Path) -> None:
    text = MATERIALS.replace("white = { kd = 0.7 }", "white = { lobes = [{ mx = 0.4, my = 0.4 }] }")
    assert find_reflectors(load_scene(written(tmp_path, text))) == ()
    (found,) = find_reflectors(load_scene(written(tmp_path, text + '[[reflectors]]\nobjects = "floor"\n')))
    assert found.parts[0].object == "floor"
    with pytest.raises(UserError, match="floor"):
        load_scene(written(tmp_path, text + '[[reflectors]]\nobjects = "flor"\n'))


def test_a_part_of_something_that_transmits_is_seen_from_both_sides() -> None:
    """Of an object that goes on elsewhere one side is outside, unless light passes it."""
    bent = merge([patch((0, 0, 0), (0, 0, 1), (1, 0, 0)), patch((0, 0, 0), (1, 0, 0), (0, 0.2, 0))])
    glossy = GLOSSY_OR_NOT["varnish"]
    through = Lobe(side="transmission", mx=0.05, my=0.05, k=0.5)
    for material, both in ((glossy, False), (glossy.model_copy(update={"lobes": (*glossy.lobes, through)}), True)):
        scene = Scene("test", (SceneObject("bent", bent, "m"),), {"m": material})
        assert next(r for r in find_reflectors(scene) if abs(r.plane[1]) > 0.9).two_sided is both


def test_of_very_many_the_largest_are_kept_and_those_that_rules_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reflectors, "MOST", 4)
    monkeypatch.setattr(reflectors, "TRIED", 8)
    sides = np.linspace(0.6, 2.0, 30)
    tiles = [
        SceneObject(f"tile{i}", patch((3 * i, i, 0), (0, 0, s), (s, 0, 0)), "varnish") for i, s in enumerate(sides)
    ]
    found = find_reflectors(scene_of(*tiles, rules=(ReflectorRule("tile3", use=True),)))
    assert [r.parts[0].object for r in found] == ["tile29", "tile28", "tile27", "tile3"]


BAY = merge(
    [patch((0, 0, 0), (0, 0, 4), (4, 0, 0)), patch((1, 0, -1), (0, 0, 1), (2, 0, 0))]
)  # 4 x 4 m, a bay at z < 0


def plan(floor: Mesh, room: Mesh | None = None) -> FloorPlan | None:
    objects = [SceneObject("floor", floor, "varnish")]
    if room is not None:
        objects.append(SceneObject("room", room, "paint"))
    return find_reflectors(Scene("test", tuple(objects), GLOSSY_OR_NOT))[0].plan


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
