"""Luminaires with an opening: the far field of their photometry, light from all of the opening nearby, flux."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.bake.engine import engine
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_areas
from lambent.materials.document import Material
from lambent.scenes.geometry import patch
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.luminous_surfaces import MATERIAL, with_luminous_surfaces
from lambent.scenes.photometry.opening import Opening
from lambent.scenes.scene import IesLight, Scene, SceneObject

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
    return with_luminous_surfaces(scene, {0})


def irradiance(scene: Scene, points: Floats, count: int = 1 << 15) -> Floats:
    """(n, 3) path traced at points of the floor."""
    import drjit as dr
    import mitsuba as mi

    from lambent.bake.tracing import path_tracer
    from lambent.bake.tracing.rays import block_sums, independent, vectors
    from lambent.bake.tracing.scene_builder import SceneBuilder

    built = SceneBuilder(scene).build()
    place = vectors(mi.Vector3f, np.repeat(points, count, axis=0))
    up = mi.Vector3f(0, 1, 0) + dr.zeros(mi.Vector3f, len(points) * count)
    sampler = independent(1, len(points) * count)
    at = path_tracer.Points(place, up, up)
    found = path_tracer.irradiance(built, sampler, at, sampler.next_2d(), sampler.next_2d(), 1)
    return block_sums(found, count).astype(float) / count


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

    from lambent.bake.tracing.rays import array_of, independent
    from lambent.bake.tracing.scene_builder import SceneBuilder

    light = luminaire(OPENINGS[name], 2.0)
    scene = lit(light)
    (shown,) = (o for o in scene.objects if o.luminaire is not None)
    assert not scene.lights and shown.name == "lamp" and shown.material == MATERIAL
    flux = light.photometry.lumens * np.array(light.scale)
    area = triangle_areas(shown.mesh.corners).sum()
    np.testing.assert_allclose(np.array(shown.emission) * np.pi * area, flux, rtol=1e-6)
    builder = SceneBuilder(scene)  # owns the mesh
    emitter = builder.meshes["lamp"].emitter()
    sampler: Any = independent(2, 1 << 18)
    _, power = emitter.sample_ray(0.0, 0.0, sampler.next_2d(), sampler.next_2d(), mi.Bool(True))
    dr.eval(power)
    np.testing.assert_allclose(array_of(power).astype(float).mean(axis=0), flux, rtol=0.02)


def test_unsized_and_unnamed_luminaires_stay_points() -> None:
    light = luminaire(Opening())
    scene = Scene("s", (), {}, lights=(light, luminaire(OPENINGS["disc"])))
    assert with_luminous_surfaces(scene, {0}) is scene
    both = with_luminous_surfaces(scene, {0, 1})
    assert both.lights == (light,) and [o.name for o in both.objects] == ["lamp"]
