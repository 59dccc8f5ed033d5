"""Planar reflectors are found where a scene has large, flat, glossy surfaces, and nowhere else."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lambent.core.errors import UserError
from lambent.materials.document import Lobe, Material
from lambent.scenes import load_scene, reflectors
from lambent.scenes.geometry import box, merge, patch, placed, sphere, turn
from lambent.scenes.reflectors import find_reflectors
from lambent.scenes.scene import ReflectorRule, Scene, SceneObject
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
