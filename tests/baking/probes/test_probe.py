"""Probes: orientation, what they see, where they stand, and their bounding planes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.probes.centre import probe_centre
from lambent.baking.probes.planes import bounding_planes
from lambent.baking.probes.probe import MOST, Surroundings, _blocks_needed, bake_probe, bake_small
from lambent.baking.reference.path_traced import render_reference
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.geometry.cubemap import face_directions, sample
from lambent.core.geometry.directions import normalize
from lambent.core.plain import Triple
from lambent.core.views.camera import Camera
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, merge, patch, placed, sphere
from lambent.scenes.scene import PointLight, Scene, SceneObject
from lambent.store.contract import FAR
from tests.baking.small_scenes import MIRROR, TINY, coloured_room, room_with_step

LEVEL, STEEP = ((1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)), ((0, 1, 0), (0, -1, 0))
VIEWS = [*((forward, (0, 1, 0)) for forward in LEVEL), *((forward, (0, 0, -1)) for forward in STEEP)]


def test_noisy_texels_get_more_paths() -> None:
    """As many as bring the relative standard error down to the noise, at most `MOST` times as many."""
    samples, mean = 16, np.repeat([[2.0, 2.0, 2.0]], 3, axis=0)
    variance = np.array([[0.0], [4.0], [1e6]])
    squares = samples * (mean**2 + variance)
    times = _blocks_needed(samples * mean, squares, samples, 0.1)
    np.testing.assert_allclose(times, [1, 4 / samples / (0.1 * 2) ** 2, MOST])


@pytest.mark.long
def test_probe_agrees_with_path_traced_views(tmp_path: Path) -> None:
    scene = room_with_step()
    small = SceneObject("ball", placed(sphere(0.02, 16, 8), (-0.8, 0.5, 0)), "mirror")  # casts next to no shadow
    scene = replace(scene, objects=(*scene.objects[:-1], small))
    quality = TINY.changed(geometry={"texels": 128}, probe={"texels": 32, "samples": 32})
    store = bake(scene, tmp_path / "s", quality=quality, only=("probe",))
    radiance = store.read("probe/ball/radiance").astype(float)
    centre = np.array(store.artefact("probe/ball/radiance").meta["centre"])
    without = replace(scene, objects=scene.objects[:-1])
    y, x = np.meshgrid(1 - (np.arange(24) + 0.5) / 12, (np.arange(24) + 0.5) / 12 - 1, indexing="ij")
    for forward, up in VIEWS:
        camera = Camera("view", tuple(centre), tuple(centre + np.array(forward)), up, 90.0)
        image, _ = render_reference(without, camera, 24, 24, 128)
        w = np.asarray(forward) + x[..., None] * np.cross(forward, up) + y[..., None] * np.asarray(up)
        seen = sample(radiance, w)
        assert np.median(np.abs(seen - image) / (image + 0.02)) < 0.08, f"towards {forward}"
        assert seen.mean() == pytest.approx(image.mean(), rel=0.05), f"towards {forward}"


def test_planes_ignore_what_stands_within_the_room() -> None:
    n = 32
    w = normalize(face_directions(n))
    distance = 2 / np.abs(w).max(axis=-1)
    normals = np.zeros((6, n, n, 3))
    for face in range(6):
        normals[face, ..., face // 2] = -(1 - 2 * (face % 2))
    pillar = np.zeros((n, n), bool)
    pillar[:, 12:18] = True
    distance[0, pillar] /= 2
    planes = bounding_planes(distance, normals)
    assert len(planes) == 6 and np.allclose(np.sort(planes[:, 3]), 2, atol=1e-3)


def test_open_sky_needs_few_planes() -> None:
    n = 16
    w = normalize(face_directions(n))
    down = w[..., 1] < -0.01
    distance = np.where(down, -1 / np.minimum(w[..., 1], -0.01), FAR)
    normals = np.where(down[..., None], (0.0, 1.0, 0.0), -w)
    planes = bounding_planes(distance, normals)
    assert np.allclose(planes[0], (0, 1, 0, 1), atol=1e-3)
    assert bounding_planes(np.full((6, n, n), FAR), -w).shape == (0, 4)


def test_given_planes_and_centre_are_kept_and_only_planes_are_made_anew(tmp_path: Path) -> None:
    centred = replace(coloured_room(), probe_centres={"ball": (0.5, 0.0, 0.0)})
    first = bake(centred, tmp_path / "s", quality=TINY, only=("probe",)).artefact("probe/ball/radiance")
    assert first.meta["centre"] == [0.5, 0, 0]
    planes = np.array([[0, 1, 0, 2.5]], np.float32)
    store = bake(replace(centred, probe_planes={"ball": planes}), tmp_path / "s", quality=TINY, only=("probe",))
    assert np.array_equal(store.read("probe/ball/planes"), planes)
    assert store.artefact("probe/ball/radiance").key == first.key


def centre_of(objects: tuple[SceneObject, ...], name: str) -> np.ndarray:
    builder = SceneBuilder(Scene("s", objects, {"m": MIRROR, "d": Material(kd=0.5)}))
    return probe_centre(builder, name, builder.build(leave_out={name}))


def test_the_floors_probe_stands_at_eye_height_in_the_room() -> None:
    floor = SceneObject("floor", placed(box((8, 0.1, 6)), (0, -0.05, 0)), "m")
    walls = SceneObject("walls", placed(box((8, 6, 6)), (0, 3, 0)), "d")
    assert np.allclose(centre_of((floor, walls), "floor"), (0, 1.6, 0), atol=1e-3)
    low = SceneObject("walls", placed(box((8, 2, 6)), (0, 1, 0)), "d")
    assert np.allclose(centre_of((floor, low), "floor"), (0, 1.0, 0), atol=2e-3), "half way to a low ceiling"


@pytest.mark.long
def test_the_probe_of_a_floor_does_not_stand_below_the_table_in_its_middle(tmp_path: Path) -> None:
    floor = SceneObject("floor", patch((-4, 0, -3), (0, 0, 6), (8, 0, 0)), "m")
    walls = SceneObject("walls", placed(box((8, 3.1, 6)), (0, 1.45, 0)), "d")
    table = SceneObject(
        "table", merge([placed(box((2.4, 0.1, 2.4)), (0, 0.4, 0)), placed(box((0.1, 0.4, 0.1)), (0.3, 0.2, 0))]), "d"
    )
    cameras = (Camera("c", (3, 1.6, 2), (-1, 0, -1)), Camera("d", (-3, 1.6, -2), (1, 0, 1)))
    lamp = PointLight((2.0, 2.8, 0.0), (9.0, 9.0, 9.0))
    scene = Scene("s", (floor, walls, table), {"m": MIRROR, "d": Material(kd=0.5)}, cameras=cameras, lights=(lamp,))
    meta = bake(scene, tmp_path / "s", quality=TINY, only=("probe",)).artefact("probe/floor/radiance").meta
    x, y, z = meta["centre"]
    assert max(abs(x), abs(z)) > 1 and 1 < y <= 1.6
    assert meta["hidden_share"] < 0.3


def tray_on_a_column() -> tuple[SceneObject, ...]:
    """High above the scene's centre, seen from above."""
    column = SceneObject("column", placed(box((0.2, 10, 0.2)), (0, -5, 0)), "d")
    return SceneObject("flat", placed(box((0.8, 0.02, 0.6)), (0, 0.02, 0)), "m"), column


def panel_under_a_mast() -> tuple[SceneObject, ...]:
    """A ceiling panel far below the scene's centre, seen from below."""
    mast = SceneObject("mast", placed(box((0.2, 20, 0.2)), (2, 12, 0)), "d")
    return SceneObject("flat", placed(box((0.8, 0.02, 0.6)), (0, 2.0, 0)), "m"), mast


@pytest.mark.long
@pytest.mark.parametrize(
    ("objects", "eye", "side"),
    [(tray_on_a_column(), (0.3, 1.2, 1.5), (0, 1, 0)), (panel_under_a_mast(), (0.3, 0.5, 1.5), (0, -1, 0))],
    ids=["tray", "panel"],
)
def test_the_probe_of_a_flat_thing_stands_where_viewers_see_it(
    tmp_path: Path, objects: tuple[SceneObject, ...], eye: Triple, side: Triple
) -> None:
    """Also where the scene's centre lies on its other side."""
    flat = objects[0].mesh
    middle = np.mean(flat.bounds, axis=0)
    camera = Camera("c", eye, (float(middle[0]), float(middle[1]), float(middle[2])))
    lamp = PointLight((0.5, 0.9, 3.0), (9.0, 9.0, 9.0))
    scene = Scene("s", objects, {"m": MIRROR, "d": Material(kd=0.5)}, cameras=(camera,), lights=(lamp,))
    assert (np.mean(scene.bounds, axis=0) - middle) @ side < 0
    meta = bake(scene, tmp_path / "s", quality=TINY, only={"probe"}).artefact("probe/flat/radiance").meta
    assert (np.array(meta["centre"]) - middle) @ side > 0.02


def test_the_probe_of_a_thing_within_another_is_moved_out() -> None:
    block = SceneObject("block", box((2, 2, 2)), "d")
    ball = SceneObject("ball", placed(sphere(0.5, 24, 12), (0.7, 0, 0)), "m")
    assert np.allclose(centre_of((block, ball), "ball"), (1.02, 0, 0), atol=0.06)


@pytest.mark.long
def test_a_glossy_room_of_one_mesh_sees_itself(tmp_path: Path) -> None:
    scene = room_with_step()
    glossy = Material(kd=0.5, lobes=(Lobe(mx=0.3, my=0.3),))
    scene = replace(scene, materials={**scene.materials, "grey": glossy})
    store = bake(scene, tmp_path / "s", quality=TINY, only=("probe",))
    assert not store.artefact("probe/shell/radiance").meta["object_left_out"]
    assert store.artefact("probe/block/radiance").meta["object_left_out"]


def test_a_coupled_wall_darkens_towards_grazing() -> None:
    """The cached light of a wall is kd t(cos_o) E/pi; the other wall's is kd E/pi."""
    import mitsuba as mi

    from lambent.baking.light.cache import LightMapCache

    walls = tuple(SceneObject(name, patch((x, 0, 0), (1, 0, 0), (0, 1, 0)), name) for x, name in ((0, "a"), (5, "b")))
    uv2 = {wall.name: np.full((len(wall.mesh.positions), 2), 0.5) for wall in walls}
    kd = (0.2, 0.4, 0.6)
    builder = SceneBuilder(Scene("s", walls, {"a": Material(kd=kd, kd_coupled=True), "b": Material(kd=kd)}), uv2)
    cache, scene = LightMapCache(builder, np.full((4, 4, 3), np.pi), None), builder.build()
    towards = normalize(np.array([0.9, 0.1, 0.25]))
    for x, factor in ((0.0, under_fresnel(towards[2])), (5.0, 1.0)):
        start = np.array([x + 0.5, 0.5, 0]) + towards
        si = scene.ray_intersect(mi.Ray3f(mi.Point3f(start), mi.Vector3f(-towards)))
        seen = np.array(cache(si, si.is_valid())).ravel()
        np.testing.assert_allclose(seen, np.array(kd) * factor, rtol=1e-4)


def test_probes_of_several_places_are_those_of_each() -> None:
    whole = SceneBuilder(coloured_room()).build()
    around, centres = Surroundings(whole, whole, None, 2), np.array([(0.0, 0.5, 0.0), (0.9, -0.2, 0.4)])
    for probe, centre in zip(bake_small(around, centres, 8, 16, 0), centres, strict=True):
        alone = bake_probe(around, centre, 8, 16, 0, noise=np.inf)
        np.testing.assert_allclose(probe.radiance.mean(axis=(1, 2)), alone.radiance.mean(axis=(1, 2)), atol=0.02)
        np.testing.assert_array_equal(probe.distance, alone.distance)
        np.testing.assert_array_equal(probe.normals, alone.normals)
