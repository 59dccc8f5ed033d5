"""Luminaires with an opening: the far field of their photometry, light from all of the opening nearby, flux."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.engine import engine
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_areas
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.luminous_surfaces import MATERIAL, with_luminous_surfaces
from lambent.scenes.photometry.opening import Opening
from lambent.scenes.scene import IesLight, Scene, SceneObject
from tests.baking.small_scenes import TINY

THETA = np.linspace(0, 90, 19)
OPENINGS = {
    "rectangle": Opening("box", (0.6, 0.2, 0.0)),
    "disc": Opening("cylinder", (0.3, 0.3, 0.0)),
    "box": Opening("box", (0.4, 0.2, 0.1)),
    "tube": Opening("cylinder", (1.2, 0.04, 0.04), 0),
    "sphere": Opening("ellipsoid", (0.3, 0.3, 0.3)),
}


@pytest.fixture(autouse=True, scope="module")
def _path_tracer() -> None:
    engine()


def luminaire(opening: Opening, power: float = 1.0, at: tuple[float, float, float] = (0.0, 2.0, 0.0)) -> IesLight:
    """100 cd along the axis, cos^power off it."""
    cd = 100 * np.cos(np.radians(THETA)).clip(0) ** power
    photometry = Photometry.of(THETA, np.array([0.0, 360.0]), np.stack([cd, cd]))
    aim = tuple(normalize(np.array([0.2, -1.0, 0.1])).tolist())
    return IesLight(at, replace(photometry, opening=opening), (0.01, 0.02, 0.005), aim, rotation_deg=20.0, name="lamp")


def lit(light: IesLight, size: float = 4.0) -> Scene:
    floor = SceneObject("floor", patch((-size, 0, size), (2 * size, 0, 0), (0, 0, -2 * size)), "black")
    scene = Scene("lit", (floor,), {"black": Material(name="black")}, lights=(light,))
    return with_luminous_surfaces(scene)


def irradiance(scene: Scene, points: Floats, count: int = 1 << 15) -> Floats:
    """(n, 3) path traced at points of the floor."""
    from lambent.baking.tracing.scene_builder import SceneBuilder
    from tests.baking.tracing import facing_up

    at = facing_up.facing_up(np.repeat(points, count, axis=0))
    found = facing_up.irradiance(SceneBuilder(scene).build(), at, 1, 1)
    return found.reshape(len(points), count, 3).mean(axis=1)


@pytest.mark.parametrize("name", OPENINGS)
def test_far_away_the_light_is_that_of_the_photometry(name: str) -> None:
    light = luminaire(OPENINGS[name], at=(0.0, 30.0, 0.0))
    points = np.array([[0.0, 0, 0], [12.0, 0, -5.0], [-20.0, 0, 10.0]])
    found = irradiance(lit(light, 40.0), points)
    away = np.array(light.position) - points
    distance = np.linalg.norm(away, axis=1)
    local = -(away / distance[:, None]) @ light.axes.T
    cd = light.photometry.at(np.degrees(np.arccos(local[:, 2])), np.zeros(3))
    expected = (cd * away[:, 1] / distance**3)[:, None] * light.scale
    np.testing.assert_allclose(found, expected, rtol=0.02)


def test_a_lambertian_disc_nearby_is_the_known_integral() -> None:
    """A disc of radius r and radiance L, parallel to the floor h below: E = pi L r^2 / (r^2 + h^2) under its centre."""
    light = replace(luminaire(Opening("cylinder", (1.0, 1.0, 0.0)), at=(0.0, 0.4, 0.0)), aim=(0.0, -1.0, 0.0))
    radiance = 100 * np.array(light.scale) / (np.pi * 0.25)
    found = irradiance(lit(light), np.array([[0.0, 0, 0]]))[0]
    np.testing.assert_allclose(found, np.pi * radiance * 0.25 / (0.25 + 0.16), rtol=0.01)


@pytest.mark.parametrize("name", OPENINGS)
def test_emission_is_the_mean_radiance_and_photons_have_the_flux(name: str) -> None:
    import drjit as dr
    import mitsuba as mi

    from lambent.baking.tracing.rays import array_of, independent
    from lambent.baking.tracing.scene_builder import SceneBuilder

    light = luminaire(OPENINGS[name], 2.0)
    scene = lit(light)
    (shown,) = (o for o in scene.objects if o.luminaire is not None)
    assert scene.openings == {0: "lamp"} and shown.name == "lamp" and shown.material == MATERIAL
    flux = light.photometry.lumens * np.array(light.scale)
    area = triangle_areas(shown.mesh.corners).sum()
    np.testing.assert_allclose(np.array(shown.emission) * np.pi * area, flux, rtol=1e-6)
    builder = SceneBuilder(scene)  # owns the mesh
    emitter = builder.meshes["lamp"].emitter()
    sampler: Any = independent(2, 1 << 18)
    _, power = emitter.sample_ray(0.0, 0.0, sampler.next_2d(), sampler.next_2d(), mi.Bool(True))
    dr.eval(power)
    np.testing.assert_allclose(array_of(power).astype(float).mean(axis=0), flux, rtol=0.02)


def test_luminaires_without_a_size_shine_from_points() -> None:
    light = luminaire(Opening())
    scene = Scene("s", (), {}, lights=(light, luminaire(OPENINGS["disc"])))
    assert with_luminous_surfaces(replace(scene, lights=(light,))).objects == ()
    both = with_luminous_surfaces(scene)
    assert both.lights == scene.lights and both.openings == {1: "lamp"}
    assert with_luminous_surfaces(both) is both


def test_the_material_of_openings_replaces_no_other() -> None:
    green = Material(name=MATERIAL, kd=(0.0, 0.5, 0.0))
    scene = with_luminous_surfaces(Scene("s", (), {MATERIAL: green}, lights=(luminaire(OPENINGS["disc"]),)))
    assert scene.materials[MATERIAL] == green and not any(scene.materials[scene.objects[0].material].kd)


@pytest.mark.long
@pytest.mark.parametrize("name", ["disc", "box"])
def test_a_light_map_has_all_the_light_of_an_opening_nearby(tmp_path: Path, name: str) -> None:
    """Rays to the opening and sampled directions add up to the light that paths bring, .4 m below."""
    light = replace(luminaire(OPENINGS[name], at=(0.0, 0.4, 0.0)), aim=(0.0, -1.0, 0.0))
    scene = lit(light, 1.0)
    store = bake(scene, tmp_path / "s", quality=TINY, only=("lamps",))
    positions, of_map = store.read("geometry/positions"), store.read("light_map/irradiance").astype(float)
    uv2 = store.read("geometry/uv2")[:4]
    corners = positions[:4]
    height, width = of_map.shape[:2]
    place = np.linalg.solve(np.column_stack([uv2[1] - uv2[0], uv2[3] - uv2[0]]), np.eye(2))
    row, column = np.mgrid[0:height, 0:width]
    at = (np.stack([column, row], axis=-1) + 0.5) / (width, height) - uv2[0]
    s = at @ place.T
    p = corners[0] + s[..., :1] * (corners[1] - corners[0]) + s[..., 1:] * (corners[3] - corners[0])
    inside = ((s > 0.05) & (s < 0.95)).all(axis=-1)
    chosen = np.flatnonzero(inside & (np.linalg.norm(p, axis=-1) < 0.5))[:: max(1, inside.sum() // 40)]
    found, expected = of_map.reshape(-1, 3)[chosen], irradiance(scene, p.reshape(-1, 3)[chosen])
    assert len(chosen) >= 5
    np.testing.assert_allclose(found.mean(axis=0), expected.mean(axis=0), rtol=0.03)


@pytest.mark.parametrize("count", [4, 400])
def test_edited_views_have_points_of_the_photometry(count: int) -> None:
    from lambent.baking.transport.lights import scene_lights

    scene = lit(luminaire(OPENINGS["disc"]))
    lights = scene_lights(scene, None, count)
    light, centres = luminaire(OPENINGS["disc"]), lights.centres
    assert len(lights) == len(lights.luminaires) == (1 if count == 4 else 16)
    np.testing.assert_allclose(lights.light.sum(axis=0), light.scale, rtol=1e-12)
    local = (centres - light.position) @ light.axes.T
    assert np.abs(local[:, 2]).max() < 1e-9 and np.linalg.norm(local, axis=1).max() <= 0.15
    assert count == 4 or np.allclose((local[:, :2] ** 2).mean(axis=0), 0.15**2 / 4, rtol=0.1)


def test_a_side_without_light_has_shares_too() -> None:
    """A two-sided map whose far side no point can reach: its arrays have the shapes of the near side's."""
    from lambent.baking.light.lamps import LampPoints
    from lambent.baking.surfaces.texels import POINTS, Sides, Texels
    from lambent.baking.tracing.lights.lamps import LampRays
    from lambent.baking.tracing.scene_builder import SceneBuilder

    builder = SceneBuilder(lit(luminaire(OPENINGS["disc"])))
    none = np.zeros((0, POINTS, 3))
    texels = Texels(4, 3, np.zeros(0, int), np.zeros((0, POINTS), int), none, none, none, np.zeros(0), np.zeros(0))
    points = LampPoints(
        LampRays(builder, builder.build(), [0]), Sides(texels, -1.0, np.zeros((0, POINTS), bool)), np.zeros((3, 4), int)
    )
    light = points.light([0], 1, [0])
    assert light.seen.shape == (1, 3, 4) and not light.seen.any() and light.light.shape == (1, 3, 4, 3)
