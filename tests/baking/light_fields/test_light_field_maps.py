"""Light fields: what their points see, in scenes whose answer is known by hand, and what a store holds of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_POINT
from lambent.baked.light_fields.stored import read_light_field
from lambent.baking.artefacts import light_field
from lambent.baking.artefacts.light_map import finished_maps
from lambent.baking.bake import bake
from lambent.baking.bake import found as kinds
from lambent.baking.context import BakeContext
from lambent.baking.light_fields.acquisition import (
    Surroundings,
    TracedMaps,
    covered_distances,
    direction,
    inverse_distances,
    radiance_maps,
)
from lambent.baking.light_fields.surroundings import around
from lambent.baking.methods import chosen
from lambent.baking.quality import Quality
from lambent.baking.sky.sun import sun_of
from lambent.baking.tracing.lights.sun import Sun
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.octahedral import from_square, texel_directions, texel_solid_angles
from lambent.core.progress import Cancelled
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import patch
from lambent.scenes.scene import ConstantEnvironment, DirectionalLight, LightFieldWish, Scene, SceneObject, SunSky
from lambent.store.contract import light_field_name
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, COLOURS, TINY, coloured_room, plane, room_with_step

SMALL = TINY.changed("small", light_field={"points": 24, "texels": 14, "strata": 1})
PARTS = ("points", "normals", "blocks", "distances", "sample_map")


def baked(scene: Scene, folder: Path, quality: Quality = SMALL, **more: Any) -> Store:
    return bake(scene, folder, quality=quality, only=("light_field",), **more)


def with_field(scene: Scene, **asked: Any) -> Scene:
    return replace(scene, light_fields={"ball": LightFieldWish(**asked)})


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """The coloured room with a light field of the ball, baked in four chunks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(light_field, "PATHS_OF_A_CHUNK", 6 * 14 * 14)
        yield baked(with_field(coloured_room()), tmp_path_factory.mktemp("field") / "s")


def read(store: Store, part: str) -> np.ndarray:
    return store.read(light_field_name("ball", part))


def light(store: Store) -> np.ndarray:
    return np.asarray(read_light_field(store, "ball").radiance, float)


def test_directions_are_those_of_core(mi: Any) -> None:
    uv = np.random.default_rng(0).random((1000, 2))
    found = direction(mi.Point2f(mi.Float(uv[:, 0]), mi.Float(uv[:, 1])))
    np.testing.assert_allclose(np.array(found).T, from_square(uv), atol=2e-6)


def test_every_texel_sees_the_wall_behind_it(mi: Any) -> None:
    """Walls 2 m from the origin; from any point within, by hand, which one a direction meets and how far it is."""
    room = coloured_room()
    scene = SceneBuilder(replace(room, objects=room.objects[:-1])).build()
    points, n = np.array([[0.0, 0, 0], [1.5, -0.7, 0.3], [-1.9, 1.9, -1.9]]), 32
    radiance, _ = radiance_maps(Surroundings(scene, None, 1), points, n, 2, 0)
    inverse = inverse_distances(scene, points, n)
    for p, light, nearness in zip(points, radiance, inverse, strict=True):
        w = texel_directions(n)
        w = np.where(np.abs(w) < 1e-12, 1e-12, w)
        t = (2 * np.sign(w) - p) / w
        axis, distance = t.argmin(axis=-1), t.min(axis=-1)
        side = np.take_along_axis(w, axis[..., None], axis=-1)[..., 0] < 0
        np.testing.assert_allclose(nearness * distance, 1, rtol=1e-3)
        wall = np.array(COLOURS, float)[2 * axis + side]
        alike = np.ones((n, n), bool)  # texels that lie in one wall: so do all their neighbours' centres
        for shift in [(i, j) for i in (-1, 0, 1) for j in (-1, 0, 1)]:
            alike &= (np.roll(wall, shift, axis=(0, 1)) == wall).all(axis=-1)
        alike[[0, -1]] = alike[:, [0, -1]] = False
        assert alike.mean() > 0.5
        np.testing.assert_allclose(light[alike], wall[alike], atol=1e-5)
        assert np.isin(light.round(5)[~alike] * 4, range(5)).all(), "a texel on an edge is a mean over its four strata"


def test_what_is_open_is_at_no_distance_and_shows_the_sky(mi: Any) -> None:
    floor = SceneObject("floor", patch((-50, 0, 50), (100, 0, 0), (0, 0, -100)), "black")
    sky = ConstantEnvironment((0.25, 0.5, 1.0))
    scene = SceneBuilder(Scene("s", (floor,), {"black": BLACK}, environment=sky)).build()
    point, n = np.array([[0.0, 1e-4, 0.0]]), 16
    up = texel_directions(n)[..., 1] > 0.15
    down = texel_directions(n)[..., 1] < -0.15
    inverse, light = (
        inverse_distances(scene, point, n)[0],
        radiance_maps(Surroundings(scene, None, 2), point, n, 1, 0)[0][0],
    )
    assert (inverse[up] == 0).all() and (inverse[down] > 1000).all()
    np.testing.assert_allclose(light[up], np.broadcast_to(sky.radiance, light[up].shape), rtol=1e-5)
    assert (light[down] == 0).all()


def test_a_bake_writes_what_the_contract_says(store: Store) -> None:
    points, normals, blocks, distances, sample_map = (read(store, part) for part in PARTS)
    assert points.shape == normals.shape == (24, 3) and points.dtype == np.float32
    assert blocks.shape == (24, 4, 4, 4) and distances.shape == (24, 6, 4, 2)
    field = read_light_field(store, "ball")
    radiance, inverse = np.asarray(field.radiance), np.asarray(field.inverse_distance)
    assert radiance.shape == (24, 14, 14, 3) and inverse.shape == (24, 14, 14)
    meta = store.artefact(light_field_name("ball", "sample_map")).meta
    heights = np.linalg.norm(points, axis=1) - 0.3
    assert heights.max() < 1.05 * meta["offset_m"] and heights.min() > 0.25 * meta["offset_m"], (
        "the ball has flat faces"
    )
    assert np.allclose(normalize(points), normals, atol=0.05)
    outwards = texel_directions(14) @ normals[0] > 0.3
    assert (radiance[0][outwards].max(axis=-1) > 0.85).mean() > 0.8
    assert (inverse > 0).all(), "a closed room"
    rows, columns = meta["grid"]
    top, left = meta["corner"]
    faces = store.read("geometry/faces")[-len(coloured_room().objects[-1].mesh.faces) :]
    uv2, p = store.read("geometry/uv2")[faces].mean(axis=1), store.read("geometry/positions")[faces].mean(axis=1)
    entry = sample_map[(uv2[:, 1] * rows).astype(int) - top, (uv2[:, 0] * columns).astype(int) - left]
    known = entry[:, 0] != NO_POINT
    assert known.mean() > 0.9
    p, entry = p[known], entry[known]
    away = np.linalg.norm(points[entry[:, 0]] - p, axis=1)
    assert (away < np.linalg.norm(points[None] - p[:, None], axis=-1).min(axis=1) + 0.1).all()


@pytest.mark.long
def test_an_interrupted_bake_ends_with_the_same_bits(store: Store, tmp_path: Path) -> None:
    scene = with_field(coloured_room())

    def stop(done: float, total: float, what: str) -> None:
        if what == "light field of ball" and done / total > 0.3:
            raise Cancelled

    with pytest.raises(Cancelled):
        baked(scene, tmp_path / "part", progress=stop)
    part = Store.open(tmp_path / "part")
    state, share = part.availability(light_field_name("ball", "blocks"))
    assert state == "partial" and 0 < share < 1 and light_field_name("ball", "sample_map") not in part
    before = part.artefact(light_field_name("ball", "blocks")).done
    again = baked(scene, tmp_path / "part")
    for name in PARTS:
        assert read(again, name).tobytes() == read(store, name).tobytes(), name
    after = again.artefact(light_field_name("ball", "blocks")).done
    assert before.items() <= after.items() and len(after) == 4


@pytest.mark.long
def test_only_what_is_asked_is_baked_and_what_is_no_longer_asked_goes(tmp_path: Path) -> None:
    scene = coloured_room()
    names = {light_field_name("ball", part) for part in PARTS}
    store = baked(with_field(scene, points=5, texels=10, offset_m=0.25), tmp_path / "s")
    assert light(store).shape == (5, 10, 10, 3)
    assert store.artefact(light_field_name("ball", "points")).meta["offset_m"] == 0.25
    assert np.allclose(np.linalg.norm(read(store, "points"), axis=1), 0.55, atol=0.02)
    kept = {a.name: a.key for a in store.artefacts() if a.name not in names}
    store = baked(scene, tmp_path / "s")
    assert {a.name: a.key for a in store.artefacts()} == kept, "nothing else is baked again"


@pytest.mark.long
def test_traced_whole_it_is_the_same_within_noise(tmp_path: Path) -> None:
    scene = replace(room_with_step(), light_fields={"ball": LightFieldWish(points=24, texels=14)})
    quality = TINY.changed(light_field={"strata": 4})
    cached, traced = (light(baked(scene, tmp_path / "s", quality, probes=method)) for method in ("cached", "traced"))
    assert not np.array_equal(cached, traced)
    assert traced.mean() == pytest.approx(cached.mean(), rel=0.03)
    squares = [a.reshape(24, 7, 2, 7, 2, 3).mean(axis=(2, 4, 5)) for a in (cached, traced)]
    assert np.median(np.abs(squares[1] - squares[0]) / (squares[0] + 0.05)) < 0.1


def test_a_matte_object_gets_none_and_is_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    scene = with_field(coloured_room())
    matte = replace(scene, materials={**scene.materials, "mirror": Material(kd=0.5)})
    store = baked(matte, tmp_path / "s")
    assert not store.artefacts("light_field")
    assert "ball" in caplog.text and "light_field" in caplog.text


def test_quarters_of_texels_tell_where_a_square_ends(mi: Any) -> None:
    """A black square before a white sky, which ends within texels: those whose middle meets it show it alone.

    With `covers`, texels with any quarter whose middle is before it, by hand, show it, and its distance.
    """
    square = SceneObject("square", patch((-1.03, -1, 1.07), (2, 0, 0), (0, 0, -2)), "black")
    scene = Scene("s", (square,), {"black": BLACK}, environment=ConstantEnvironment((1.0, 1.0, 1.0)))
    built, point, n = SceneBuilder(scene).build(), np.zeros((1, 3)), 31
    around = Surroundings(built, None, 2)
    met = inverse_distances(built, point, n)[0] > 0
    assert 0.05 < met.mean() < 0.3
    by_middles = radiance_maps(around, point, n, 4, 0)[0][0]
    np.testing.assert_allclose(by_middles, np.where(met[..., None], 0.0, 1.0) * np.ones(3), atol=1e-6)
    inverse, cover = covered_distances(built, point, n)
    w = texel_directions(2 * n)
    x, z = (-w[..., axis] / np.minimum(w[..., 1], -1e-9) for axis in (0, 2))
    before = (w[..., 1] < 0) & (x > -1.03) & (x < 0.97) & (z > -0.93) & (z < 1.07)
    bits = before.reshape(n, 2, n, 2).transpose(0, 2, 1, 3).reshape(n, n, 4)
    np.testing.assert_array_equal(cover[0], (bits * [1, 2, 4, 8]).sum(axis=-1))
    mixed = bits.any(axis=-1) & ~bits.all(axis=-1)
    assert mixed.sum() > 20 and (inverse[0][bits.any(axis=-1)] > 0).all()
    maps, shows = radiance_maps(around, point, n, 2, 0, covers=True)
    light = maps[0, ..., 0]
    np.testing.assert_array_equal(shows[0], bits.any(axis=-1))
    assert (light[bits.all(axis=-1)] == 0).all()
    np.testing.assert_allclose(light[inverse[0] == 0], 1, atol=1e-6)
    assert (light[mixed] == 0).mean() > 0.9, "where no part of two by two meets it, its sky"


def test_lamps_smaller_than_texels_keep_their_light(mi: Any) -> None:
    """A square lamp of .6 texels a side: most places see it through no middle of a texel."""
    n, side_m = 32, 0.055
    lamp = SceneObject(
        "lamp", patch((-side_m / 2, 1, -side_m / 2), (side_m, 0, 0), (0, 0, side_m)), "black", (100.0,) * 3
    )
    ceiling = SceneObject("ceiling", patch((-50, 1.01, -50), (100, 0, 0), (0, 0, 100)), "black")
    scene = Scene("s", (lamp, ceiling), {"black": BLACK})
    points = np.random.default_rng(0).uniform(-0.3, 0.3, (400, 3)) * [1, 0, 1]
    around = Surroundings(SceneBuilder(scene, diffuse=False).build(), lambda si, active: mi.Color3f(0.0), 2)
    distance = np.linalg.norm(points - [0, 1, 0], axis=1)
    expected = (100 * side_m**2 / distance**3).sum()
    omega, w = texel_solid_angles(n), texel_directions(n)
    assert 0.6 < side_m / np.sqrt(omega[w[..., 1] > 0.95].mean()) < 0.7

    def share(covers: bool) -> float:
        light = radiance_maps(around, points, n, 4, 0, covers=covers)[0][..., 0]
        return float((light * omega).sum() / expected)

    without, found = share(covers=False), share(covers=True)
    assert without < 0.85 and found == pytest.approx(1, abs=0.06), (without, found)


@pytest.mark.long
def test_the_disc_of_the_sun_is_left_out(mi: Any) -> None:
    """Pixels add it. Seen from an open place, maps with and without it differ by the irradiance that it has."""
    floor = SceneObject("floor", patch((-1, -5, 1), (2, 0, 0), (0, 0, -2)), "black")
    scene = Scene("s", (floor,), {"black": BLACK}, environment=SunSky((0.39, 0.86, -0.32)))
    found, n, strata = sun_of(scene), 16, 128
    assert found is not None
    built, point = SceneBuilder(scene).build(), np.zeros((1, 3))
    whole, rest = (
        radiance_maps(Surroundings(built, None, 2, sun), point, n, strata, 0)[0][0] for sun in (None, Sun(found))
    )
    difference = (whole - rest) * texel_solid_angles(n)[..., None]
    near = texel_directions(n) @ np.array(found.record.direction) > 0.97
    assert not difference[~near].any()
    np.testing.assert_allclose(difference.sum(axis=(0, 1)), found.record.irradiance, rtol=0.1)
    assert rest[near].max() < 0.01 * whole[near].max()


def test_maps_that_are_traced_where_they_are_read_are_those_of_a_bake(mi: Any) -> None:
    room = coloured_room()
    around = Surroundings(SceneBuilder(replace(room, objects=room.objects[:-1])).build(), None, 1)
    points = np.array([[0.0, 0, 0], [1.5, -0.7, 0.3]])
    whole, read = radiance_maps(around, points, 16, 1, 0)[0], TracedMaps(around, points, 16, 0)
    some = np.array([[1, 0], [1, 1]]), np.array([[3, 3], [15, 0]]), np.array([[4, 4], [0, 7]])
    for _ in range(2):
        np.testing.assert_array_equal(read[some], whole[some])
    assert read.shape == whole.shape and read.nbytes == whole.nbytes
    np.testing.assert_array_equal(np.array(read), whole)


def test_an_object_without_its_lobes_shows_the_sun_on_it(tmp_path: Path) -> None:
    """A mirror on top of kd = .5, under a sun straight above of irradiance pi and no sky: radiance kd E/pi."""
    glossy = Material(kd=0.5, lobes=(Lobe(mx=0.01, my=0.01, r0=0.9),))
    scene = replace(plane(), materials={"black": glossy}, lights=(DirectionalLight((0.0, -1.0, 0.0), (np.pi,) * 3),))
    store = bake(scene, tmp_path / "s", quality=TINY, only=("light_map",))
    context = BakeContext(scene, store, kinds(), TINY, chosen({}))
    surroundings = around(context.traced, finished_maps(context), 2, ("floor",))
    light = radiance_maps(surroundings, np.array([[0.0, 0.2, 0.0]]), 16, 1, 0)[0][0]
    up = texel_directions(16)[..., 1]
    np.testing.assert_allclose(light[up < -0.9], 0.5, rtol=0.02)
    assert not light[up > 0.1].any()
