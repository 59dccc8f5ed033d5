"""The sun that leaves the light map: found in pictures, left out by both integrators, and added by shadow rays."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.photons.shooting import shoot
from lambent.baking.sky.daylight import lone_emitter, radiance_from
from lambent.baking.sky.sun import FoundSun, sun_in, sun_of
from lambent.baking.tracing.lights.sun import Sun, SunRays
from lambent.baking.tracing.rays import array_of, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder, environment_dict
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_direction
from lambent.core.pictures.images import write_image
from lambent.scenes.geometry import box, patch, placed
from lambent.scenes.scene import DirectionalLight, ImageEnvironment, Scene, SceneObject, SunSky
from tests.baking.small_scenes import GREY
from tests.baking.tracing.facing_up import facing_up, irradiance

pytestmark = pytest.mark.usefixtures("mi")
H, W = 256, 512
SKY = (0.2, 0.3, 0.5)
TOWARDS = normalize(np.array([0.4, 0.8, -0.3]))
NONE = np.eye(3)


def disc(towards: Floats, radius_deg: float, radiance: float, height: int = H) -> Floats:
    """(height, 2 height, 3) sky with a disc, as Mitsuba reads pictures; pixels at the rim in part."""
    row, column = np.meshgrid(np.arange(height), np.arange(2 * height), indexing="ij")
    w = lat_long_direction(row * np.pi / (height - 1), (column + 0.5) * np.pi / height)
    away = np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(w - towards, axis=-1) / 2, 0, 1)))
    share = np.clip((radius_deg - away) * height / 180 + 0.5, 0, 1)
    return np.asarray(np.array(SKY) + share[..., None] * radiance, np.float32)


def angle_deg(a: Floats, b: Floats) -> float:
    return float(np.degrees(2 * np.arcsin(np.linalg.norm(np.asarray(a) - b) / 2)))


@pytest.mark.parametrize(
    ("towards", "radius_deg"),
    [((0.4, 0.8, -0.3), 1.0), ((0, 1, 0), 3.0), ((0.002, 0.3, -1), 3.0), ((0.001, 0.3, 1), 1.0), ((1, -0.05, 0), 1.0)],
)
def test_disc_in_a_picture_is_found_with_its_light(towards: tuple[float, ...], radius_deg: float) -> None:
    w = normalize(np.array(towards, float))
    found = sun_in(disc(w, radius_deg, 1000.0), NONE)
    assert found is not None
    assert angle_deg(found.record.direction, w) < 0.05
    spread = 0.9 * 180 / H  # by interpolation
    assert np.degrees(found.record.radius_rad) == pytest.approx(np.hypot(radius_deg, spread), rel=0.2)
    sr = 2 * np.pi * (1 - np.cos(np.radians(radius_deg)))
    assert np.allclose(found.record.irradiance, 1000 * sr, rtol=0.1)


def test_only_a_compact_spot_with_much_of_the_light_is_a_sun() -> None:
    even = np.full((H, W, 3), 1.0, np.float32)
    firefly = even.copy()
    firefly[100, 7] = 30.0
    assert sun_in(even, NONE) is None and sun_in(firefly, NONE) is None and sun_in(even * 0, NONE) is None
    assert sun_in(disc(TOWARDS, 12.0, 1000.0), NONE) is None, "a window is no sun"


def test_brightest_of_two_suns_is_taken_and_the_halo_stays() -> None:
    weak = normalize(np.array([-0.5, 0.4, 0.6]))
    two = disc(TOWARDS, 1.0, 1000.0) + disc(weak, 1.0, 400.0)
    found = sun_in(two, NONE)
    assert found is not None and angle_deg(found.record.direction, TOWARDS) < 0.05
    with_halo = sun_in(disc(TOWARDS, 1.0, 1000.0) + disc(TOWARDS, 9.0, 4.0), NONE)
    assert with_halo is not None and np.degrees(with_halo.record.radius_rad) < 1.3


def test_lights_along_one_direction_are_one_sun() -> None:
    strong, along, other = (
        DirectionalLight(d, (e, e, e))
        for d, e in (((0.0, -1.0, 0.0), 2.0), ((0.0, -3.0, 0.0), 1.0), ((0.1, -1, 0), 2.5))
    )
    found = sun_of(Scene("lights", (), {}, lights=(along, other, strong)))
    assert found is not None and found.picture is None and found.record.irradiance == (3.0, 3.0, 3.0)


def environment_file(folder: Path, picture: Floats, name: str = "sky.exr") -> ImageEnvironment:
    write_image(folder / name, picture)
    return ImageEnvironment(folder / name, rotation_deg=30.0, scale=2.0, layout="lat-long")


def test_what_is_left_out_is_what_the_sun_adds_to_the_environment(tmp_path: Path) -> None:
    environment = environment_file(tmp_path, disc(TOWARDS, 2.0, 1000.0))
    found = sun_of(Scene("sky", (), {}, environment))
    assert found is not None
    about = np.array(found.record.direction)
    w = normalize(about + 0.06 * np.random.default_rng(0).normal(size=(20000, 3)))
    whole = radiance_from(lone_emitter(environment_dict(environment)), w)
    added = array_of(Sun(found).radiance(vectors(mi.Vector3f, w)))
    assert (added > 1000).sum() > 1000 and (added == 0).sum() > 1000
    assert np.allclose(whole - added, 2 * np.array(SKY), atol=0.5)  # of 2000
    assert np.median(np.abs(whole - added - 2 * np.array(SKY))) < 1e-3


def wall_with_an_opening() -> tuple[SceneObject, ...]:
    """A floor, a roof with an opening over it, and a block that throws light back."""
    roof = [((-2, 0.4), (-2, 2)), ((1.0, 2), (-2, 2)), ((0.4, 1.0), (-2, -0.5)), ((0.4, 1.0), (0.3, 2))]
    parts = [patch((x[0], 1.5, z[1]), (x[1] - x[0], 0, 0), (0, 0, z[0] - z[1])) for x, z in roof]
    return (
        SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "grey"),
        *(SceneObject(f"roof_{i}", mesh, "grey") for i, mesh in enumerate(parts)),
        SceneObject("block", placed(box((0.4, 0.6, 0.4)), (-0.8, 0.3, 0.2)), "grey"),
    )


def suns(folder: Path) -> list[Scene]:
    materials = {"grey": GREY}
    sky = SunSky((0.39, 0.86, -0.32))
    light = DirectionalLight(tuple(-TOWARDS), (3.0, 2.0, 1.0))
    picture = environment_file(folder, disc(TOWARDS, 3.0, 100.0))
    objects = wall_with_an_opening()
    return [
        Scene("daylight", objects, materials, sky),
        Scene("light", objects, materials, environment_file(folder, disc(TOWARDS, 1.0, 0.0), "even.exr"), (light,)),
        Scene("picture", objects, materials, picture),
    ]


@pytest.mark.parametrize("number", range(2))
def test_light_map_and_sun_add_up_to_all_light_on_the_floor(tmp_path: Path, number: int) -> None:
    scene = suns(tmp_path)[number]
    found = sun_of(scene)
    assert found is not None
    builder = SceneBuilder(scene)
    whole = builder.build()
    rng = np.random.default_rng(number)
    count = 1 << 17
    p = np.column_stack([rng.uniform(-2, 2, count), np.zeros(count), rng.uniform(-2, 2, count)])
    points, sun = facing_up(p), Sun(found)
    on_floor = SunRays(sun, whole).on(points.position, points.normal, points.flat, mi.Bool(True))
    direct = array_of(on_floor).astype(float)
    rest, former = irradiance(whole, points, 1, 6, sun), irradiance(whole, points, 2, 6)
    error = np.sqrt(((rest + direct).var(axis=0) + former.var(axis=0)) / count)
    assert np.all(direct.mean(axis=0) > 8 * error), "the sun is not too small to be missed"
    assert np.all(np.abs((rest + direct).mean(axis=0) - former.mean(axis=0)) < 4 * error)


@pytest.mark.long
def test_photons_leave_out_the_same_light(tmp_path: Path) -> None:
    for scene in suns(tmp_path)[1:]:
        found = sun_of(scene)
        assert found is not None
        uv2 = {o.name: np.full((len(o.mesh.positions), 2), 0.5) for o in scene.objects}
        whole = SceneBuilder(scene, uv2).build()
        flux = np.array([
            [shoot(whole, (1, 1, 1), 1 << 16, 4, 2 * seed + k, None, unseen)[0, 0, 0] for seed in range(6)]
            for k, unseen in enumerate((None, Sun(found)))
        ])  # fmt: skip
        bounced = photon_flux_of_the_sun(scene, found)
        error = np.sqrt(flux.var(axis=1, ddof=1).sum(axis=0) / 6)
        left_out = flux[0].mean(axis=0) - flux[1].mean(axis=0)
        assert np.all(np.abs(left_out - bounced) < 5 * error + 0.01 * bounced), scene.name


def photon_flux_of_the_sun(scene: Scene, found: FoundSun) -> Floats:
    """(3,) W of the sun on the fronts of all surfaces, shadows counted by rays from points on them."""
    from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals

    whole = SceneBuilder(scene).build()
    corners = scene.corners
    area, count = triangle_areas(corners), 1 << 17
    rng = np.random.default_rng(0)
    face = rng.choice(len(area), size=count, p=area / area.sum())
    p, n = points_on_triangles(corners, face, rng), triangle_normals(corners[face])
    points, normals = vectors(mi.Point3f, p), vectors(mi.Vector3f, n)
    direct = array_of(SunRays(Sun(found), whole).on(points, normals, normals, mi.Bool(True)))
    return np.asarray(direct.mean(axis=0) * area.sum())
