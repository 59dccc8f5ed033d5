"""Objects in several parts, with a probe each, and probes that are path traced whole."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.baking.probes.division import cuts_of, split
from lambent.baking.surfaces.atlas import object_records
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.solids import SolidTest, closed
from lambent.core.geometry.cubemap import texel_solid_angles
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.views.camera import Camera
from lambent.realtime.light.baked import read_baked
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.contract import scene_record, whole_objects
from tests.baking.small_scenes import BLACK, GREY, MIRROR, TINY, furnace, turned_inwards


def two_rooms() -> Scene:
    """A red and a blue room, a thin wall between them at x = 1, and a long mirror that reaches through it."""
    bar = sphere(1.0, 24, 24)
    bar = replace(bar, positions=(bar.positions * np.float32([2.5, 0.15, 0.15])).astype(np.float32))
    objects = (
        SceneObject("left", patch((-3, -2, 2), (0, 0, -4), (0, 4, 0)), "grey", emission=(1, 0, 0)),
        SceneObject("right", patch((3, -2, -2), (0, 0, 4), (0, 4, 0)), "grey", emission=(0, 0, 1)),
        SceneObject("shell", turned_inwards(box((6.2, 4, 4))), "grey"),
        SceneObject("wall", placed(box((0.1, 4, 4)), (1.0, 0, 0)), "grey"),
        SceneObject("bar", bar, "mirror"),
        SceneObject("ball", placed(sphere(0.3, 24, 24), (-1.5, 1.2, 0)), "mirror"),
    )
    return Scene("two rooms", objects, {"grey": GREY, "black": BLACK, "mirror": MIRROR})


@pytest.mark.long
def test_object_in_two_rooms_has_a_probe_in_each(tmp_path: Path) -> None:
    store = bake(two_rooms(), tmp_path / "s", quality=TINY, only=("probe",))
    objects = {o.name: o for o in scene_record(store).objects}
    parts = sorted(name for name in objects if name.startswith("bar"))
    assert "ball" in objects and len(parts) > 1 and "bar" not in objects
    positions, faces = (store.read(f"geometry/{name}") for name in ("positions", "faces"))
    owned = [faces[o.first_face : o.first_face + o.face_count] for o in (objects[name] for name in parts)]
    area = sum(triangle_areas(positions[own].astype(float)).sum() for own in owned)
    assert area == pytest.approx(triangle_areas(two_rooms().object("bar").mesh.corners).sum(), rel=1e-5)
    for name, own in zip(parts, owned, strict=True):
        (n, d), *_ = ((np.array(border[:3]), border[3]) for border in objects[name].borders)
        assert (positions[own] @ n + d).min() > -1e-5, "faces end at the border"
    colours = {}
    for name in parts:
        radiance = store.read(f"probe/{name}/radiance").astype(float)
        colours[name] = (radiance * texel_solid_angles(radiance.shape[1])[..., None]).sum(axis=(0, 1, 2))
    red, blue = (max(colours.values(), key=lambda c: c[k] / c.sum()) for k in (0, 2))
    assert red[0] > 5 * red[2] and blue[2] > 2 * blue[0], "each sees its own room"
    ball = store.artefact("probe/ball/radiance").meta
    assert ball["hidden_share"] < 0.1
    again = bake(two_rooms(), tmp_path / "s", quality=TINY, only=("probe",))
    assert {a.name: a.key for a in again.artefacts()} == {a.name: a.key for a in store.artefacts()}


@pytest.mark.long
def test_a_cut_that_viewers_do_not_see_is_not_made() -> None:
    """From a camera in the red room nobody sees the half of the bar that mirrors the blue one."""
    assert set(cuts_of(TriangleVisibility(two_rooms()))) == {"bar"}
    red = Camera("red", (-1.5, 0.5, 1.5), (-1.5, 0, 0))
    blue = replace(red, name="blue", position=(2.0, 0.5, 1.5), target=(2.0, 0.0, 0.0))
    assert not cuts_of(TriangleVisibility(replace(two_rooms(), cameras=(red,))))
    assert set(cuts_of(TriangleVisibility(replace(two_rooms(), cameras=(red, blue))))) == {"bar"}


@pytest.mark.long
def test_too_few_probes_are_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A mirror of few faces cannot be cut."""
    scene = two_rooms()
    coarse = SceneObject("bar", box((5.0, 0.3, 0.3)), "mirror")
    scene = replace(scene, objects=(*(o for o in scene.objects if o.name != "bar"), coarse))
    with caplog.at_level(logging.WARNING):
        store = bake(scene, tmp_path / "s", quality=TINY, only=("probe",))
    assert "bar" in [o.name for o in scene_record(store).objects]
    assert "object mirrors: bar (" in caplog.text and "ball" not in caplog.text


def test_missing_probes_are_one_line(tmp_path: Path) -> None:
    scene = two_rooms()
    balls = tuple(replace(scene.object("ball"), name=f"ball{k}") for k in range(9))
    store = bake(replace(scene, objects=balls), tmp_path / "s", quality=TINY, only={"geometry"})
    expected = "no probe of ball0, ball1, ball2 and 6 more: the nearest probe or the environment is used"
    assert [line for line in read_baked(store).missing if "probe" in line] == [expected]


def test_parts_of_a_solid_are_solid() -> None:
    engine()
    scene = two_rooms()
    cut = split(scene, {"bar": [((-1.0, 0.0, 0.0, 0.3),), ((1.0, 0.0, 0.0, -0.3),)]})
    assert cut.object("bar.part1").mesh.bounds[1][0] == cut.object("bar.part2").mesh.bounds[0][0] == np.float32(0.3)
    assert not closed([cut.object("bar.part1").mesh])[0]
    wholes = whole_objects(object_records(cut))
    assert [o.name for o in wholes] == [o.name for o in scene.objects]
    parts = sum(len(o.mesh.faces) for o in cut.objects if o.name.startswith("bar."))
    faces = {o.name: len(o.mesh.faces) for o in scene.objects} | {"bar": parts}  # cut faces are two or three
    assert {o.name: o.face_count for o in wholes} == faces
    builder = SceneBuilder(cut)
    within = SolidTest(builder, builder.build()).embedded(np.zeros((1, 3)), np.array([[0.0, 1.0, 0.0]]))
    assert within.all()


def test_traced_probe_of_the_furnace_has_radiance_one(tmp_path: Path) -> None:
    ball = SceneObject("ball", sphere(0.03, 16, 8), "mirror")  # takes next to nothing away
    scene = replace(furnace(), objects=(*furnace().objects, ball), materials={"grey": GREY, "mirror": MIRROR})
    store = bake(scene, tmp_path / "s", quality=TINY.changed(probe={"samples": 128}), probes="traced", only=("probe",))
    radiance = store.read("probe/ball/radiance").astype(float)
    assert radiance.mean() == pytest.approx(1.0, rel=0.01)
    assert store.artefact("probe/ball/radiance").meta["traced"]
