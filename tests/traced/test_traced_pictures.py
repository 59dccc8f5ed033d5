"""Traced pictures of rooms whose light is known: by hand, or by whole paths."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.replacement import Replacement
from lambent.scenes.scene import ConstantEnvironment, PointLight, Scene, SceneObject
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import TracedRoom, room_of_paths, room_of_store
from tests.baking.small_scenes import TINY, furnace, plane, turned_inwards

pytestmark = [pytest.mark.usefixtures("mi"), pytest.mark.slow]
SIZE = (24, 16)
BLACKENED = dict.fromkeys(("wall", "floor", "black", "glossy"), Material())
WIDE = Camera("wide", (0.0, 1.0, 0.9), (0.1, 1.0, -0.5), fov_y_deg=110)
INSIDE = Camera("inside", (0.0, 1.1, 0.9), (0.2, 0.4, -0.6), fov_y_deg=70)


def lit_room() -> Scene:
    """A room of 2 m with a glossy box on its coloured floor, a lamp with a surface and a point light."""
    floor = patch((-1, 0.001, 1), (2, 0, 0), (0, 0, -2))
    objects = (
        SceneObject("room", turned_inwards(placed(box((2, 2, 2)), (0, 1, 0))), "wall"),
        SceneObject("floor", floor, "floor"),
        SceneObject("cube", placed(box((0.5, 0.5, 0.5)), (0.2, 0.251, -0.3)), "glossy"),
        SceneObject("lamp", placed(box((0.4, 0.05, 0.4)), (0, 1.9, 0)), "black", emission=(6.0, 6.0, 6.0)),
    )
    materials = {
        "wall": Material(kd=0.6), "floor": Material(kd=(0.6, 0.2, 0.1), kd_coupled=True), "black": Material(),
        "glossy": Material(kd=0.2, lobes=(Lobe(mx=0.2, my=0.1, r0=0.3),)),
    }  # fmt: skip
    light = PointLight((-0.7, 1.2, 0.5), (0.4, 0.6, 0.9), name="bulb")
    return Scene("lit room", objects, materials, lights=(light,), cameras=(INSIDE,))


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, mi: Any) -> Store:
    folder = tmp_path_factory.mktemp("traced") / "s"
    return bake(lit_room(), folder, quality=TINY, only=("light_map", "answer"), light_groups="scene")


@pytest.fixture(scope="module")
def room(store: Store) -> TracedRoom:
    return room_of_store(store, lit_room())


@pytest.fixture(scope="module")
def paths() -> TracedRoom:
    return room_of_paths(lit_room())


def traced(
    room: TracedRoom, samples: int, seed: int = 0, *, path: bool = False, part: str = "full", camera: Camera = INSIDE
) -> TracedPicture:
    picture = TracedPicture(room.tracer, camera, SIZE, seed=seed, path=path, part=part)
    while picture.samples < samples:
        picture.sample(samples - picture.samples)
    return picture


def brightness(room: TracedRoom, *, path: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Mean radiance (3,) of the picture over seeds, and its standard error."""
    means = np.array([traced(room, 160, seed, path=path).mean().mean(axis=(0, 1)) for seed in range(4)])
    return means.mean(axis=0), means.std(axis=0, ddof=1) / 2


def test_a_furnace_has_radiance_1(tmp_path: Path) -> None:
    scene = furnace()
    baked = bake(scene, tmp_path / "s", quality=TINY, only=("light_map",))
    inside = Camera("inside", (0.3, 0.1, 0.2), (0.0, 0.3, -1.0), fov_y_deg=100)
    for room, path in ((room_of_store(baked, scene), False), (room_of_paths(scene), True)):
        picture = TracedPicture(room.tracer, inside, SIZE, path=path)
        while picture.samples < 80:
            picture.sample()
        assert picture.mean().mean() == pytest.approx(1, abs=0.01)
        assert np.abs(picture.mean() - 1).max() < 0.25


@pytest.mark.long
def test_gathered_light_is_that_of_whole_paths(room: TracedRoom, paths: TracedRoom) -> None:
    (found, one), (true, other) = brightness(room), brightness(paths, path=True)
    assert np.abs(found - true).max() < 0.02 * true.max(), "the map's error, seen by one more bounce"
    assert (one < 0.01 * found).all() and (other < 0.01 * true).all()


@pytest.mark.long
def test_a_mix_is_the_scene_with_other_lamps(store: Store) -> None:
    scene, factors = lit_room(), {"lamp": (0.2, 0.5, 1.0), "bulb": (2.0, 2.0, 2.0)}
    objects = tuple(replace(o, emission=tuple(np.multiply(o.emission, factors["lamp"]))) for o in scene.objects)
    light = replace(scene.lights[0], intensity=tuple(np.multiply(scene.lights[0].intensity, factors["bulb"])))
    expected, error = brightness(room_of_paths(replace(scene, objects=objects, lights=(light,))), path=True)
    for room, path in ((room_of_paths(scene), True), (room_of_store(store, scene), False)):
        room.mix(factors)
        found, noise = brightness(room, path=path)
        assert np.abs(found - expected).max() < 0.02 * expected.max() + 4 * float((noise + error).max())


def test_an_unknown_group_is_an_error(room: TracedRoom, paths: TracedRoom) -> None:
    for one in (room, paths):
        with pytest.raises(
            UserError, match="unknown light group; found lomp; expected bulb, lamp; did you mean 'lamp'"
        ):
            one.mix({"lomp": (0.0, 0.0, 0.0)})


def test_an_edited_material_shows_with_its_light(store: Store, room: TracedRoom) -> None:
    scene, blue = lit_room(), Material(name="wall", kd=(0.05, 0.1, 0.7))
    edited, true = room_of_store(store, scene), room_of_paths(scene)
    for one in (edited, true):
        one.set_materials({}, {"wall": blue})
    (found, _), (expected, _) = brightness(edited), brightness(true, path=True)
    before, _ = brightness(room)
    assert np.abs(found - expected).max() < 0.04 * expected.max()
    assert np.abs(before - expected).max() > 0.2 * expected.max(), "the edit is seen"
    edited.set_materials({}, {})
    assert traced(edited, 16).mean().mean() == pytest.approx(traced(room, 16).mean().mean(), rel=1e-5)


def test_parts_of_the_light_add_up(room: TracedRoom) -> None:
    """A lamp's own light is in the diffuse part, of gathered samples as well."""
    parts = {part: traced(room, 16, part=part, camera=WIDE).mean() for part in ("full", "diffuse", "specular")}
    assert parts["diffuse"].mean() > 0.1 * parts["full"].mean() and parts["specular"].max() > 1e-3
    np.testing.assert_allclose(parts["diffuse"] + parts["specular"], parts["full"], atol=1e-4)
    lamp = traced(room_of_paths(replace(lit_room(), materials=BLACKENED)), 16, path=True, camera=WIDE).mean()
    shows_lamp = lamp.max(axis=-1) == lamp.max()
    assert 0 < shows_lamp.mean() < 0.5
    gathered = traced(room, 24, part="diffuse", camera=WIDE).mean()
    np.testing.assert_allclose(gathered[shows_lamp], lamp.max(), rtol=1e-4)


@pytest.mark.long
def test_the_sky_is_in_neither_part(tmp_path: Path) -> None:
    scene = replace(plane(), environment=ConstantEnvironment((1.0, 1.0, 1.0)))
    baked = bake(scene, tmp_path / "s", quality=TINY, only=("light_map",))
    room, up = room_of_store(baked, scene), Camera("up", (0.0, 1.0, 0.0), (0.0, 2.0, 0.1))
    means = [traced(room, 24, part=part, camera=up).mean().mean() for part in ("full", "diffuse", "specular")]
    assert means == [pytest.approx(1), 0, 0]


@pytest.mark.long
def test_a_replacing_mesh_is_lit_although_it_has_no_texels(store: Store) -> None:
    scene, ball = lit_room(), Replacement("cube", sphere(1.0, 32, 16), "wall")
    expected, _ = brightness(room_of_paths(scene, replacements=[ball]), path=True)
    found, _ = brightness(room_of_store(store, scene, replacements=[ball]))
    assert np.abs(found - expected).max() < 0.03 * expected.max()


@pytest.mark.long
def test_the_stated_noise_is_the_error(room: TracedRoom) -> None:
    """Both are relative to a pixel's own light; the truth is the mean of many pictures with the same samples."""
    pictures = [traced(room, 48, seed) for seed in range(12)]
    images = np.array([picture.mean().mean(axis=-1) for picture in pictures])
    true = images.mean(axis=0)
    error = np.abs(images - true).mean(axis=0) * np.sqrt(np.pi / 2 * 12 / 11) / np.maximum(true, 0.1 * true.mean())
    stated = np.mean([picture.noise(denoised=False) for picture in pictures])
    assert stated == pytest.approx(float(error.mean()), rel=0.35)
    assert pictures[0].noise(denoised=True) < pictures[0].noise(denoised=False)


def test_more_samples_have_less_noise_and_seeds_differ(room: TracedRoom) -> None:
    few, many = traced(room, 16, 1), traced(room, 16, 2)
    assert not np.array_equal(few.mean(), many.mean())
    np.testing.assert_array_equal(few.mean(), traced(room, 16, 1).mean())
    few_paths, many_paths = (traced(room_of_paths(lit_room()), n, path=True) for n in (8, 128))
    assert many_paths.noise(denoised=False) < 0.6 * few_paths.noise(denoised=False)


def test_bands_of_a_large_picture_are_the_picture(room: TracedRoom, monkeypatch: pytest.MonkeyPatch) -> None:
    from lambent.baking.pictures import tracer

    whole = traced(room, 4)
    monkeypatch.setattr(tracer, "RAYS_AT_ONCE", 100)
    bands = traced(room, 4)
    np.testing.assert_allclose(bands.mean(), whole.mean(), rtol=1e-5)
    for one, other in zip(bands.guides(), whole.guides(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-5)


@pytest.mark.long
def test_edits_sizes_and_counts_compile_nothing(store: Store) -> None:
    """Every number that changes from picture to picture is read from memory; a material's structure is compiled."""
    import drjit as dr

    room, glossy = room_of_store(store, lit_room()), lit_room().materials["glossy"]

    def edited(mx: float) -> Material:
        return glossy.model_copy(update={"lobes": (Lobe(mx=mx, my=0.1, r0=0.2),)})

    def kernels(size: tuple[int, int], samples: int, camera: Camera = INSIDE) -> list[dict[str, Any]]:
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            picture = TracedPicture(room.tracer, camera, size)
            while picture.samples < samples:
                picture.sample()
            picture.guides()
            return [one for one in dr.kernel_history([dr.KernelType.JIT]) if one["type"] == dr.KernelType.JIT]

    states: list[dict[str, Material]] = [{}, {"glossy": edited(0.3)}, {}, {"wall": Material(kd=(0.1, 0.5, 0.2))}]
    first = set[str]()
    for state in states[:2]:
        room.set_materials({}, state)
        first |= {one["hash"] for one in kernels(SIZE, 24)}
    for state in [*states, {"glossy": edited(0.5)}]:
        room.set_materials({}, state)
        for size, samples, camera in ((SIZE, 24, WIDE), ((40, 30), 40, INSIDE)):
            later = {one["hash"] for one in kernels(size, samples, camera)}
            assert later <= first, (state, size)
