"""Transport with 10,000 lights against path traced direct light, within its noise: a test of everything at once."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.baking.reference.path_traced import render_reference
from lambent.baking.transport.view import View as BakedView
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.baking.transport.visibility import visibility
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.scene import (
    DirectionalLight,
    Environment,
    IesLight,
    Light,
    PointLight,
    Scene,
    SceneObject,
    SunSky,
)
from lambent.scenes.sky.triangle_lights import joined, small_lights
from tests.baking.tracing.test_luminaires import LAMP
from tests.baking.transport.test_transport import View
from tests.tools.z_test import assert_same_image

SIZE = 12
CAMERA = Camera("above", (0.0, 2.2, 3.2), (0.0, 0.2, 0.0), fov_y_deg=12.0)  # every pixel well inside of one surface
SATIN = Material(kd=(0.3, 0.2, 0.1), lobes=(Lobe(mx=0.3, my=0.3, r0=0.4, k=(0.8, 0.8, 0.8)),))
SAMPLED = 4  # places in each pixel along x and y
FLOOR = 0.01  # of the pixel: what triangles instead of the light itself, and places instead of areas, may cost


def scene(material: Material, environment: Environment | None, lights: tuple[Light, ...] = ()) -> Scene:
    """A floor, and a block out of view that throws a shadow."""
    floor = SceneObject("floor", patch((-30, 0, 30), (60, 0, 0), (0, 0, -60)), "it")
    ball = SceneObject("ball", placed(sphere(0.5, 48, 24), (1.4, 0.6, 0.0)), "it")
    return Scene("open", (floor, ball), {"it": material}, environment, lights)


def direct_light(of: Scene, count: int = 10_000) -> np.ndarray:
    """(SIZE, SIZE, 3) by transport, means over places in each pixel."""
    engine()
    tracer = ViewTracer(of)
    fine = SIZE * SAMPLED
    points, lights = tracer.points(BakedView(CAMERA, fine, fine)), tracer.lights(count)
    assert len(points) == fine * fine
    view = View(of, lights, points, visibility(tracer.scene, points, lights))
    found = view.picture(of_material(of.materials["it"]), 128, 16)
    return found.reshape(SIZE, SAMPLED, SIZE, SAMPLED, 3).mean(axis=(1, 3))


def assert_converged(of: Scene, spp: int) -> None:
    found = direct_light(of)
    expected, variance = render_reference(of, CAMERA, SIZE, SIZE, spp, max_depth=1)
    assert_same_image(found, (FLOOR * found) ** 2, expected, variance)
    assert np.abs(found.mean() / expected.mean() - 1) < 0.01


SUNNY = SunSky(sun_direction=tuple(normalize(np.array([0.7, 0.6, -0.2]))))  # type: ignore[arg-type]


@pytest.mark.long
def test_many_lights_are_the_light_itself() -> None:
    assert_converged(scene(SATIN, SUNNY), 4096)


@pytest.mark.parametrize(
    "light",
    [
        DirectionalLight((0.3, -1.0, 0.2), (3.0, 2.0, 1.0)),
        PointLight((0.2, 1.0, -0.3), (3.0, 2.0, 1.0)),
        PointLight((0.1, 0.9, 0.2), (3.0, 2.0, 1.0), (0.1, -1.0, 0.0), 10.0, 40.0),
        IesLight((0.1, 0.9, 0.2), LAMP, (0.03, 0.02, 0.01), (0.48, -0.64, 0.6), 25.0),
    ],
    ids=["directional", "point", "spot", "luminaire"],
)
def test_lights_without_extent(light: Light) -> None:
    assert_converged(scene(replace_alpha(SATIN), None, (light,)), 64)


def replace_alpha(material: Material) -> Material:
    """A wider lobe: one direction of light shows the bands of the curve."""
    return material.model_copy(update={"lobes": (material.lobes[0].model_copy(update={"mx": 0.5, "my": 0.5}),)})


def test_sets_of_lights_are_joined() -> None:
    spot = PointLight((0.0, 2.0, 0.0), (1.0, 1.0, 1.0), (0.0, -2.0, 0.0), 50.0, 40.0)
    both = joined([small_lights([DirectionalLight((0.0, -2.0, 0.0), (1.0, 2.0, 3.0))]), small_lights([spot])])
    assert both.near.tolist() == [False, True]
    assert np.allclose(both.centres, [[0, 1, 0], [0, 2, 0]])
    assert np.allclose(both.cones[1], [0, -1, 0, np.radians(40), np.radians(40)])
    assert len(joined([])) == 0
