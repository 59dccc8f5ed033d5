"""Light sorted by group while it is traced: each group is the light of a scene with its emitters alone."""

from __future__ import annotations

import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.views.camera import Camera
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import ConstantEnvironment, LightGroup, PointLight, Scene, SceneObject, SunSky
from lambent.store.light_groups import light_groups
from lambent.store.store import Store
from tests.baking.small_scenes import BLACK, GREY, MIRROR, TINY, plane, room_with_step
from tests.tools.z_test import assert_same_image, mean_and_variance

GATHERING = TINY.changed("gathering", light_map={"gather_samples": 64})
KINDS = ("light_map", "probe")
SUN = SunSky((0.6, 0.8, 0.0), ground="black")  # a ground that the sun lights is the sky's
BULBS = (PointLight((1, 1.5, 1), (1, 0.5, 0.2), name="bulb_1"), PointLight((-1, 1.5, 1), (0.2, 0.5, 1), name="bulb_2"))


def corner() -> Scene:
    """A floor, a wall that shades it, a mirror ball, a panel that shines, a bulb, sun and sky."""
    objects = (
        SceneObject("floor", patch((-1, 0, 1), (2, 0, 0), (0, 0, -2)), "grey"),
        SceneObject("wall", patch((-0.9, 0, 1), (0, 0, -2), (0, 1.5, 0)), "grey"),
        SceneObject("panel", patch((-0.5, 1.2, -0.5), (1, 0, 0), (0, 0, 1)), "black", emission=(5e3, 4e3, 1e3)),
        SceneObject("ball", placed(sphere(0.25, 16, 8), (0.4, 0.3, 0.3)), "mirror"),
    )
    bulb = PointLight((0.6, 0.9, -0.6), (2e3, 3e3, 4e3), name="bulb")
    return Scene("corner", objects, {"grey": GREY, "black": BLACK, "mirror": MIRROR}, SUN, (bulb,))


def sums_at_points(scene: Scene, *, whole: bool = False) -> tuple[Any, Any, list[str]]:
    """Mean and variance of sums of irradiance (k, 32, 3) on the floor, by group, or of all light."""
    from lambent.baking.engine import engine

    engine()
    import mitsuba as mi

    from lambent.baking.sky.sun import sun_of
    from lambent.baking.tracing import path_tracer
    from lambent.baking.tracing.first_light import FirstLight, sky_without
    from lambent.baking.tracing.group_tally import Direct, GroupTally, Sorting
    from lambent.baking.tracing.lights.sun import Sun
    from lambent.baking.tracing.rays import block_sums, independent, vectors
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from lambent.scenes.light_groups import sorted_lights

    builder = SceneBuilder(scene)
    built, found = builder.build(), sun_of(scene)
    lights = sorted_lights(scene, sun_in_sky=found is not None)
    unseen = None
    if found is not None:
        unseen = Sun(found, FirstLight(builder, built, found, sky_without(found, builder, built)))
    tally = (
        path_tracer.AllLight() if whole else GroupTally(Sorting(lights, builder, found and Sun(found)), Direct.straight)
    )
    count, samples, passes = 32, 128, 8
    rng = np.random.default_rng(3)
    places = np.stack([rng.uniform(-0.8, 0.9, count), np.zeros(count), rng.uniform(-0.9, 0.9, count)], -1)
    p = np.repeat(places, samples, axis=0).astype(np.float32)
    up = np.broadcast_to(np.float32([0, 1, 0]), p.shape)
    points = path_tracer.Points(*(vectors(mi.Vector3f, v) for v in (p, up, up)))
    estimates = []
    for seed in range(passes):
        sampler = independent(seed + 100 * whole, len(p))
        u = sampler.next_2d(), sampler.next_2d()
        sums = path_tracer.irradiance_sums(built, sampler, points, *u, 5, None, tally, unseen)
        estimates.append(np.stack([block_sums(one, samples) / samples for one in sums]))
    return *mean_and_variance(np.array(estimates, float)), [group.name for group in lights.groups]


def pooled(mean: np.ndarray, variance: np.ndarray) -> np.ndarray:
    """Variances, at least as large relative to the light as they are on average: each is from eight passes alone."""
    relative = (variance / np.maximum(mean, 1e-9) ** 2).mean()
    return np.asarray(np.maximum(variance, relative * mean**2))


@pytest.fixture(scope="module")
def by_group() -> tuple[np.ndarray, np.ndarray, list[str]]:
    return sums_at_points(corner())


@pytest.mark.long
def test_groups_add_up_to_all_light(by_group: Any) -> None:
    mean, variance, names = by_group
    expected, its_variance, _ = sums_at_points(corner(), whole=True)
    count = len(names)
    # groups of one path are not independent: the deviation of a sum is at most the sum of theirs
    bound = np.sqrt(variance[:count]).sum(axis=0) ** 2
    total = mean[:count].sum(axis=0)
    assert_same_image(total, pooled(total, bound), expected[0], pooled(expected[0], its_variance[0]))


@pytest.mark.long
@pytest.mark.parametrize("name", ["sky", "panel"])
def test_a_group_is_the_light_of_its_emitters_alone(by_group: Any, name: str) -> None:
    mean, variance, names = by_group
    scene = corner()
    dark = tuple(replace(o, emission=(0.0, 0.0, 0.0)) if name != "panel" else o for o in scene.objects)
    alone = replace(
        scene, objects=dark, environment=replace(SUN, sun_scale=0.0) if name == "sky" else None,
        lights=(),
    )  # fmt: skip
    expected, its_variance, _ = sums_at_points(alone, whole=True)
    found, its = mean[names.index(name)], variance[names.index(name)]
    assert_same_image(found, pooled(found, its), expected[0], pooled(expected[0], its_variance[0]))


@pytest.mark.long
def test_direct_light_of_the_sun_is_left_out_and_its_bounces_are_not(by_group: Any) -> None:
    mean, _, names = by_group
    sun, count = names.index("sun"), len(names)
    assert not mean[count + sun].any(), "its direct light is drawn by pixel"
    assert mean[sun].mean() > 1, "the wall throws it onto the floor"


@pytest.mark.long
def test_light_of_a_bulb_comes_straight_or_by_others(by_group: Any) -> None:
    """The part that is direct against the inverse square law."""
    mean, variance, names = by_group
    number, count = names.index("bulb"), len(names)
    rng = np.random.default_rng(3)
    places = np.stack([rng.uniform(-0.8, 0.9, 32), np.zeros(32), rng.uniform(-0.9, 0.9, 32)], -1)
    bulb = corner().lights[0]
    offset = np.array(bulb.position) - places
    distance = np.linalg.norm(offset, axis=1)
    expected = np.array(bulb.intensity) * (offset[:, 1] / distance**3)[:, None]
    shaded = mean[count + number][:, 0] == 0  # by the ball
    assert shaded.sum() < 8
    direct = mean[count + number][~shaded]
    its = pooled(direct, variance[count + number][~shaded])
    assert_same_image(direct, its, expected[~shaded], np.zeros_like(direct))
    assert (mean[number] >= mean[count + number] * (1 - 1e-6)).all()


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Store:
    path = tmp_path_factory.mktemp("groups") / "s"
    return bake(replace(room_with_step(), lights=BULBS), path, quality=GATHERING, light_groups="scene", only=KINDS)


def test_a_store_has_groups_that_add_up_to_what_it_shows(baked: Store) -> None:
    found = light_groups(baked)
    assert [group.name for group in found] == ["bulb", "lamp"] and sum(g.share for g in found) == pytest.approx(1)
    whole, light, direct = (
        baked.read(f"light_map/{name}").astype(float) for name in ("irradiance", "groups", "direct")
    )
    assert light.sum(axis=0) == pytest.approx(whole, rel=2e-3, abs=1e-4)
    assert (direct <= light).all() and direct.mean() > 0.2 * light.mean()
    radiance, by_group = (baked.read(f"probe/ball/{name}").astype(float) for name in ("radiance", "groups"))
    assert by_group.sum(axis=0) == pytest.approx(radiance, rel=3e-3, abs=1e-4)
    raw, parts = baked.read("light_map/gathered"), baked.read("light_map/gathered_by_group")[0]
    count = raw[..., 3].sum(axis=0)
    known = count > 0
    means = raw[..., :3].sum(axis=0)[known] / count[known][:, None]
    assert parts[known].reshape(-1, 4, 3)[:, :2].sum(axis=1) == pytest.approx(means, rel=2**-12, abs=1e-5)


@pytest.mark.long
def test_a_bake_with_groups_goes_on_where_it_was_interrupted(baked: Store, tmp_path: Path) -> None:
    scene, calls = replace(room_with_step(), lights=BULBS), []

    def stop(done: float, total: float, what: str) -> None:
        calls.append(what)
        if what == "light map, gathered" and done == total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bake(scene, tmp_path / "s", quality=GATHERING, light_groups="scene", only=KINDS, progress=stop)
    assert "light_map/groups" not in Store.open(tmp_path / "s")
    again = bake(scene, tmp_path / "s", quality=GATHERING, only=KINDS)  # the store remembers that it has groups
    names = {a.name for a in baked.artefacts()}
    assert {a.name for a in again.artefacts()} == names
    for name in names:
        np.testing.assert_array_equal(again.read(name), baked.read(name), err_msg=name)


def test_lights_of_single_colours_stay_apart(tmp_path: Path) -> None:
    red = PointLight((0.3, 1, 0), (1, 0, 0), name="red")
    blue = PointLight((-0.3, 1, 0), (0, 0, 2), name="blue")
    scene = replace(plane(), lights=(red, blue))
    store = bake(scene, tmp_path / "s", quality=TINY, light_groups="scene", only=["light_map"])
    names = [group.name for group in light_groups(store)]
    light = store.read("light_map/groups").astype(float)
    parts = store.read("light_map/traced_by_group")[0]
    traced = parts.reshape(*parts.shape[:2], -1, 3)[:, :, :2]
    assert not traced[:, :, names.index("red"), 1:].any() and not traced[:, :, names.index("blue"), :2].any()
    assert light[names.index("blue")][..., 2].mean() == pytest.approx(
        2 * light[names.index("red")][..., 0].mean(), rel=0.05
    )
    assert light_groups(store)[names.index("red")].share == pytest.approx(0.2126 / (0.2126 + 2 * 0.0722), rel=0.02)


@pytest.mark.long
def test_groups_are_named_by_the_scene_and_change_with_it(tmp_path: Path) -> None:
    scene = replace(room_with_step(), lights=BULBS)
    quality = TINY.changed("rough", light_map={"samples": (4, 4)})
    bake(scene, tmp_path / "s", quality=quality, light_groups="scene", only=["light_map"])
    named = replace(scene, light_groups=(LightGroup("left", ("bulb_2",)),))
    store = bake(named, tmp_path / "s", quality=quality, only=["light_map"])
    assert [(g.name, g.members) for g in light_groups(store)] == [
        ("left", ("bulb_2",)), ("bulb", ("bulb_1",)), ("lamp", ("lamp",))
    ]  # fmt: skip


def test_photons_have_no_groups(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="photons cannot be stored by light group"):
        bake(room_with_step(), tmp_path / "s", quality=TINY, light_map="photons", light_groups="scene")


def test_samples_by_group_are_rounded_evenly(mi: Any) -> None:
    from lambent.baking.light.groups import rounded

    means = np.random.default_rng(0).lognormal(0, 6, 100_000).astype(np.float32)
    means[:3] = 0, -3.3, np.inf
    found = rounded(means)
    assert np.allclose(found, means, rtol=2**-13, atol=0)
    assert np.mean(found[3:] / means[3:]) == pytest.approx(1, abs=2e-6)
    assert len(zlib.compress(found.tobytes())) < 0.8 * len(zlib.compress(means.tobytes()))


@pytest.mark.long
def test_light_that_no_viewer_sees_has_no_share(tmp_path: Path) -> None:
    """A crate reaches through the floor of a closed room: its underside lies in the sky, which nobody inside sees."""
    room = (
        SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "grey"),
        SceneObject("ceiling", patch((-2, 2, -2), (4, 0, 0), (0, 0, 4)), "grey"),
        *(
            SceneObject(f"wall {n}", patch(corner, along, (0, 2, 0)), "grey")
            for n, (corner, along) in enumerate((
                ((-2, 0, -2), (4, 0, 0)), ((2, 0, -2), (0, 0, 4)), ((2, 0, 2), (-4, 0, 0)), ((-2, 0, 2), (0, 0, -4)),
            ))
        ),
        SceneObject("crate", placed(box((1.5, 1, 1.5)), (0, 0.499, 0)), "grey"),
        SceneObject("lamp", patch((-0.5, 1.9, -0.5), (1, 0, 0), (0, 0, 1)), "black", emission=(5, 5, 5)),
    )  # fmt: skip
    materials, sky = {"grey": GREY, "black": BLACK}, ConstantEnvironment((20.0, 20.0, 20.0))
    inside = Camera("inside", (1.4, 1.4, 1.4), (0.0, 0.5, 0.0))
    scene = Scene("crate", room, materials, environment=sky, cameras=(inside,))
    store = bake(scene, tmp_path / "s", quality=TINY, light_groups="scene", only=["light_map"])
    share = {group.name: group.share for group in light_groups(store)}
    light = store.read("light_map/groups").astype(float)
    names = [group.name for group in light_groups(store)]
    assert light[names.index("sky")].max() > 10, "the underside is lit"
    assert share["sky"] < 0.02 and share["lamp"] > 0.98
