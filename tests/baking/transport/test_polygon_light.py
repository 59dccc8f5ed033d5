"""Light of wide triangles: known form factors, quadrature, the horizon, and furnaces whose walls touch."""

from __future__ import annotations

from typing import Any

import drjit as dr
import numpy as np
import pytest

from lambent.baking.transport.polygon_light import cosine_integral, highest_part
from lambent.core.geometry.sequences import r2
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.lobes import NUMPY
from lambent.scenes.geometry import box, patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.scenes.sky.triangle_lights import surface_triangles
from tests.baking.small_scenes import turned_inwards
from tests.baking.transport.test_transport import view

CEILING = np.array([[[0, 0, 1], [200, 0, 1], [200, 100, 1]], [[0, 0, 1], [200, 100, 1], [0, 100, 1]]], float)


def overhead(a: float, b: float) -> float:
    """Form factor of a rectangle a x b parallel to a surface, one corner at a distance of 1 over the point."""
    p, q = np.hypot(1, a), np.hypot(1, b)
    return float((a / p * np.arctan(b / p) + b / q * np.arctan(a / q)) / (2 * np.pi))


def beside(width: float, height: float) -> float:
    """Form factor of a wall that stands on the surface at a distance of 1, to one side of the point."""
    far = np.hypot(1, height)
    return float((np.arctan(width) - np.arctan(width / far) / far) / (2 * np.pi))


def integral(corners: np.ndarray) -> np.ndarray:
    """`cosine_integral` of triangles (..., 3, 3)."""
    return np.asarray(cosine_integral(*(tuple(np.moveaxis(corners[..., c, :], -1, 0)) for c in range(3)), NUMPY))


def test_a_point_a_centimetre_from_a_ceiling_of_two_metres() -> None:
    assert integral(CEILING).sum() / np.pi == pytest.approx(overhead(200, 100), rel=1e-9)


@pytest.mark.parametrize("below", [0.0, 0.5, 1e3])
def test_what_is_below_the_horizon_is_nothing(below: float) -> None:
    a, b, c, d = (0, 1, -below), (2, 1, -below), (2, 1, 1.5), (0, 1, 1.5)
    assert integral(np.array([[a, b, c], [a, c, d]], float)).sum() / np.pi == pytest.approx(beside(2, 1.5), rel=1e-9)
    under = np.array([[a, b, (1, 1, -below - 0.1)]], float)
    assert integral(under) == pytest.approx(0, abs=1e-12)


def test_triangles_anywhere_by_quadrature() -> None:
    """Through the horizon and around the nadir, too; twice the same by halves of them."""
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(200, 3, 3))
    corners[:20] = np.array([[2, -1, -0.1], [-2, -1, -0.1], [0, 2, 0.1]]) + rng.normal(scale=0.05, size=(20, 3, 3))
    found = integral(corners)
    first, second = corners.copy(), corners.copy()
    first[:, 1] = second[:, 0] = (corners[:, 0] + corners[:, 1]) / 2
    assert np.allclose(integral(first) + integral(second), found, atol=1e-9)
    u = r2(20_000)
    z, phi = 1 - 2 * u[:, 0], 2 * np.pi * u[:, 1]
    w = np.stack([np.sqrt(1 - z * z) * np.cos(phi), np.sqrt(1 - z * z) * np.sin(phi), z], axis=1)
    sides = np.stack([np.cross(corners[:, k], corners[:, (k + 1) % 3]) for k in range(3)])
    for k in range(30):
        side = w @ sides[:, k].T * np.sign(np.linalg.det(corners[k]))
        inside = (side > 0).all(axis=1) & (w[:, 2] > 0)
        assert found[k] == pytest.approx(4 * np.pi * (w[:, 2] * inside).mean(), abs=0.02)


def test_the_place_that_is_looked_at_is_above_the_horizon(mi: Any) -> None:
    corners = [mi.Vector3f(*c) for c in ((0, 1, -3), (1, 1, -3), (0.5, 1, 0.2))]
    up, centre = mi.Vector3f(0, 0, 1), mi.Vector3f(0.5, 1, -5.8 / 3)
    assert np.allclose(np.array(highest_part(centre, corners, up, dr)).ravel(), (0.5, 1, 0.2))
    assert np.allclose(np.array(highest_part(centre, corners, -up, dr)).ravel(), np.array(centre).ravel())


def test_the_path_tracers_numbers_are_numpys(mi: Any) -> None:
    corners = np.random.default_rng(2).normal(size=(3, 3, 1000)).astype(np.float32)
    found = cosine_integral(*(tuple(mi.Float(x.copy()) for x in corner) for corner in corners), dr)
    expected = cosine_integral(*map(tuple, corners.astype(float)), NUMPY)
    assert np.allclose(np.array(found), expected, atol=2e-6)


INSIDE = Camera("inside", (0.3, 0.2, 0.4), (-0.5, -0.3, -1.0), fov_y_deg=100.0)  # to the edges of four walls
POLISHED = Material(kd=0.9, kd_coupled=True, lobes=(Lobe(mx=0.01, my=0.01, r0=0.1, alpha=0.5),))


@pytest.mark.parametrize(
    ("material", "tolerance", "largest_m"),
    [(Material(kd=1.0), 1e-4, 2.0), (POLISHED, 2e-3, 0.6)],
    ids=["white", "glossy"],
)
def test_direct_light_of_walls_that_touch_is_white(material: Material, tolerance: float, largest_m: float) -> None:
    """At every point of the diffuse walls, in the mean of the glossy ones."""
    room = turned_inwards(box((2, 2, 2)))
    lights = surface_triangles(room.corners, np.ones((12, 3)), largest_m)
    scene = Scene("furnace", (SceneObject("room", room, "wall", emission=(1.0, 1.0, 1.0)),), {"wall": material})
    found = view(scene, lights, (14, 14), INSIDE).picture(of_material(material), 128, 16)
    assert abs(found.mean() - 1) < tolerance
    assert np.abs(found - 1).max() < (tolerance if material.kd == (1.0, 1.0, 1.0) else 0.1)


def test_a_lamp_that_a_floor_cuts_lights_with_what_is_above_it() -> None:
    """A wall of a metre, from below the floor to above it, in two triangles; the centre of one is below."""
    floor = SceneObject("floor", patch((-3, 0, 3), (6, 0, 0), (0, 0, -6)), "white")
    at = Camera("at", (0.0, 1.0, 0.01), (0.0, 0.0, 0.0), fov_y_deg=0.1)
    corners = np.array([[-0.5, -0.6, -0.2], [0.5, -0.6, -0.2], [0.5, 0.4, -0.2], [-0.5, 0.4, -0.2]])
    lights = surface_triangles(corners[[[0, 1, 2], [0, 2, 3]]], np.ones((2, 3)), 2.0)
    seen = view(Scene("cut", (floor,), {"white": Material(kd=1.0)}), lights, (2, 2), at)
    found = seen.picture(of_material(Material(kd=1.0)), 64)
    assert found == pytest.approx(2 * beside(0.5 / 0.2, 0.4 / 0.2), rel=2e-3)


@pytest.mark.parametrize(
    ("material", "side"), [(Material(kd=1.0), 1), (Material(kt_d=1.0), -1)], ids=["before", "behind"]
)
def test_a_lamp_a_centimetre_from_a_sheet(material: Material, side: int) -> None:
    """Two metres by one, a corner over the point: nearly a quarter of what a whole sky would be."""
    sheet = SceneObject("sheet", patch((-3, 0, 3), (6, 0, 0), (0, 0, -6)), "sheet")
    at = Camera("at", (0.0, 0.008, 1e-4), (0.0, 0.0, 0.0), fov_y_deg=0.1)
    y = 0.01 * side
    corners = np.array([[0, y, 0], [2, y, 0], [2, y, 1], [0, y, 1]], float)[::side]
    lights = surface_triangles(corners[[[0, 1, 2], [0, 2, 3]]], np.ones((2, 3)), 5.0)
    found = view(Scene("sheet", (sheet,), {"sheet": material}), lights, (2, 2), at).picture(of_material(material), 64)
    assert found == pytest.approx(overhead(200, 100), rel=2e-3)
