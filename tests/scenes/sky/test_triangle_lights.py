"""Environments and lamps as triangles: no light lost, small triangles where the light is, orientation."""

from __future__ import annotations

import numpy as np
import pytest

from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.scenes.sky.triangle_lights import (
    TriangleLights,
    environment_triangles,
    icosahedron,
    solid_angles,
    surface_triangles,
)

HEIGHT = 256
W = lat_long_directions(HEIGHT, 2 * HEIGHT).reshape(-1, 3)
WEIGHT_SR = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, HEIGHT + 1))), 2 * HEIGHT) * np.pi / HEIGHT
SUN = normalize(np.array([0.4, 0.6, -0.7]))


def sunny() -> np.ndarray:
    sky = np.clip(W[:, 1:2], 0, 1) * np.array([0.3, 0.5, 1.0]) + 0.1
    return np.where((np.cos(0.03) < W @ SUN)[:, None], 5000.0, sky)


def lights(count: int, radiance: np.ndarray | None = None) -> TriangleLights:
    return environment_triangles(W, WEIGHT_SR, sunny() if radiance is None else radiance, count)


def test_icosahedron_covers_the_sphere() -> None:
    faces = icosahedron()
    assert faces.shape == (20, 3, 3)
    assert np.allclose(solid_angles(faces), np.pi / 5)
    assert (np.einsum("fx,fx->f", np.cross(faces[:, 0], faces[:, 1]), faces[:, 2]) > 0).all()


@pytest.mark.parametrize("count", [20, 50, 400, 4000])
def test_no_light_is_lost(count: int) -> None:
    found = lights(count)
    assert count - 3 < len(found) <= count
    assert np.allclose(found.light.sum(axis=0), (sunny() * WEIGHT_SR[:, None]).sum(axis=0))
    assert solid_angles(found.corners).sum() == pytest.approx(4 * np.pi)
    assert not found.near.any()


def test_the_sun_is_cut_out() -> None:
    """Its light lies in small triangles at its place, and their centres are where it is."""
    found = lights(400)
    bright = found.light.sum(axis=1) > 1e-3 * found.light.sum()
    close = found.centres @ SUN > np.cos(0.04)
    share = found.light[close].sum() / found.light.sum()
    sun_share = (sunny() * WEIGHT_SR[:, None])[np.cos(0.03) < W @ SUN].sum() / found.light.sum() * 1.0
    assert share == pytest.approx(sun_share, abs=0.01)
    assert solid_angles(found.corners)[bright & close].max() < 0.003
    mean = normalize((found.light.sum(axis=1)[:, None] * found.centres)[close].sum(axis=0))
    assert mean @ SUN > np.cos(0.003)


def test_irradiance_of_the_triangles_is_the_environments() -> None:
    found, n = lights(2000), normalize(np.array([0.2, 0.9, 0.3]))
    exact = (sunny() * (WEIGHT_SR * np.maximum(W @ n, 0))[:, None]).sum(axis=0)
    assert np.allclose((found.light * np.maximum(found.centres @ n, 0)[:, None]).sum(axis=0), exact, rtol=2e-3)


def test_lamps_are_cut_into_equal_parts() -> None:
    corners = np.array([[[0, 2, 0], [0, 2, 1], [0.5, 2, 0]], [[0, 0, 0], [1, 0, 0], [0, 1, 0]]], float)
    found = surface_triangles(corners, np.array([[5.0, 4, 3], [1, 2, 3]]), largest_m=0.3)
    areas = triangle_areas(found.corners)
    assert areas.sum() == pytest.approx(triangle_areas(corners).sum())
    edges = np.linalg.norm(found.corners - np.roll(found.corners, 1, axis=1), axis=-1)
    assert edges.max() <= 0.3 + 1e-12
    assert found.near.all()
    first = found.light[:, 0] == 5
    assert np.allclose(triangle_normals(found.corners)[first], triangle_normals(corners)[0])
    assert np.ptp(areas[first]) < 1e-12
