"""Scenes of very many objects are traced as a few shapes, and rays still find each object and triangle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, transformed
from lambent.scenes.scene import Scene, SceneObject

COUNT, ROW = 150, 50
LAMP, LEFT_OUT = 7, 8
PLACES = np.array([(i % ROW, 0.0, i // ROW) for i in range(COUNT)])


@pytest.fixture(scope="module", autouse=True)
def _engine() -> Iterator[None]:
    engine()
    from lambent.baking.tracing import shapes

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shapes, "MOST_ALONE", 100)
        yield


def boxes(count: int = COUNT) -> Scene:
    """Boxes of .5 m over a floor, in turns of two materials; one of them is a lamp."""
    ground = SceneObject("ground", patch((-1, -1, 100), (100, 0, 0), (0, 0, -101)), "light")
    found = [ground]
    for i in range(count):
        moved = np.eye(4)
        moved[:3, 3] = PLACES[i]
        material = ("light", "dark")[i % 2]
        found.append(SceneObject(f"box{i}", transformed(box((0.5, 0.5, 0.5)), moved), material))
    found[1 + LAMP] = replace(found[1 + LAMP], emission=(1.0, 1.0, 1.0))
    return Scene("boxes", tuple(found), {"light": Material(kd=0.8), "dark": Material(kd=0.2)})


def seen_from_above(builder: Any, whole: Any, count: int = COUNT) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Objects, triangles and heights that rays down on each box find."""
    at = PLACES[:count] + np.array([0.1, 5, 0.05])
    ray = mi.Ray3f(mi.Point3f(at.T.astype(np.float32)), mi.Vector3f(0, -1, 0))
    found = []
    for hit in (whole.ray_intersect(ray), whole.ray_intersect_preliminary(ray)):
        valid = hit.is_valid()
        assert dr.all(valid)
        found.append((np.array(builder.numbers.at(hit, valid)), np.array(builder.numbers.faces(hit, valid))))
    assert np.array_equal(found[0], found[1])
    return *found[0], 5 - np.array(hit.t)


def test_a_shape_of_each_material_and_lamp() -> None:
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = boxes()
    builder = SceneBuilder(scene)
    whole = builder.build()
    assert len(whole.shapes()) == 3
    assert len(builder.emitters()) == 1
    met, face, height = seen_from_above(builder, whole)
    assert np.array_equal(met, 1 + np.arange(COUNT)), "object by object, across the shapes"
    assert np.allclose(height, 0.25)
    corners = scene.corners[face]
    assert np.allclose(corners[..., 1], 0.25), "the upper side"
    assert np.all(np.abs(corners - PLACES[:, None]) < 0.26)


def test_objects_left_out_of_a_shape() -> None:
    from lambent.baking.tracing.scene_builder import SceneBuilder

    builder = SceneBuilder(boxes())
    whole = builder.build()
    rest = builder.build(leave_out={f"box{LAMP}", f"box{LEFT_OUT}"})
    met, _, height = seen_from_above(builder, rest)
    expected = 1 + np.arange(COUNT)
    expected[[LAMP, LEFT_OUT]] = 0
    assert np.array_equal(met, expected), "the floor below the two, all else as it was"
    assert np.allclose(height[[LAMP, LEFT_OUT]], -1)
    assert np.array_equal(seen_from_above(builder, whole)[0], 1 + np.arange(COUNT))
    alone = builder.build(leave_out={name for name in builder.meshes if name not in ("ground", "box3")})
    assert np.array_equal(np.flatnonzero(seen_from_above(builder, alone)[0]), [3])


def test_light_map_colours_of_merged_objects() -> None:
    """Each object shows its own place of the light map, and its own material."""
    from lambent.baking.light.cache import LightMapCache
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = boxes()
    side = 64
    places = {o.name: ((i % side + 0.5) / side, (i // side + 0.5) / side) for i, o in enumerate(scene.objects)}
    uv2 = {o.name: np.tile(np.array(places[o.name]), (len(o.mesh.positions), 1)) for o in scene.objects}
    light = np.random.default_rng(1).random((side, side, 3)).astype(np.float32)
    builder = SceneBuilder(scene, uv2, diffuse=False)
    whole = builder.build()
    assert len(whole.shapes()) == 2, "without diffuse terms the two materials are alike"
    at = PLACES + np.array([0.1, 5, 0.05])
    si = whole.ray_intersect(mi.Ray3f(mi.Point3f(at.T.astype(np.float32)), mi.Vector3f(0, -1, 0)))
    shown = np.array(LightMapCache(builder, light, None)(si, si.is_valid())).T
    kd = np.where(np.arange(COUNT) % 2, 0.2, 0.8)[:, None]
    number = 1 + np.arange(COUNT)
    assert np.allclose(shown, kd / np.pi * light[number // side, number % side], rtol=1e-3, atol=1e-5)


def test_of_many_shiny_objects_the_largest_are_judged_for_probes(monkeypatch: pytest.MonkeyPatch) -> None:
    from lambent.baking.probes import sharing
    from lambent.baking.tracing.scene_builder import SceneBuilder

    scene = boxes()
    mirror = Material(lobes=(Lobe(mx=0.01, my=0.01, r0=0.9),))
    objects = [scene.objects[0]]
    for i, o in enumerate(scene.objects[1:]):
        shrunk = np.diag([0.2, 0.2, 0.2, 1.0]) if i % 2 else np.eye(4)
        shrunk[:3, 3] = PLACES[i] - shrunk[:3, :3] @ PLACES[i]
        objects.append(replace(o, mesh=transformed(o.mesh, shrunk), material="mirror", emission=(0.0, 0.0, 0.0)))
    scene = replace(scene, objects=tuple(objects), materials=scene.materials | {"mirror": mirror})
    names = [o.name for o in objects[1:]]
    monkeypatch.setattr(sharing, "JUDGED", 20)
    builder = SceneBuilder(scene)
    whole = builder.build()
    places = PLACES.mean(axis=0) + np.random.default_rng(2).normal(size=(64, 3)) + np.array([0.0, 3.0, 0.0])
    found = sharing.shared(builder, whole, places, names)
    own = set(names) - found.owners.keys()
    assert 0 < len(own) <= sharing.MOST
    assert set(found.owners.values()) <= own, "whose probe is shown has one"
    assert len(found.held) >= COUNT - 20, "what is not judged stays in every probe"
    assert not [name for name in own if int(name.removeprefix("box")) % 2], "small ones have none"
