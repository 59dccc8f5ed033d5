"""Where the points of a light map's texels lie: spread by area, off borders, and rays that leave them hit nothing."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from lambent.baking.engine import engine
from lambent.baking.surfaces.coverage import placed, texel_areas
from lambent.baking.surfaces.texels import POINTS, Texels, texels_of
from lambent.baking.tracing import rays
from lambent.scenes.geometry import box, patch, sphere
from lambent.scenes.geometry import placed as moved
from lambent.scenes.scene import Mesh

engine()
SIDE = 96  # texels
LONG, STRIP = 80, 0.3  # texels


def strip_at(angle: float) -> dict[str, np.ndarray]:
    """A strip of LONG x STRIP texels, a texel a metre, turned on the map; in the scene x is along it and y across."""
    along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    corners = np.array([(0, 0), (LONG, 0), (LONG, STRIP), (0, STRIP)])
    positions = np.c_[corners, np.zeros(4)]
    uv2 = ((8.37, 8.21) + corners[:, :1] * along + corners[:, 1:] * across) / SIDE
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    return {"positions": positions, "normals": np.tile((0.0, 0, 1), (4, 1)), "uv2": uv2, "faces": faces}


def share_by_area(texels: Texels, area: np.ndarray) -> np.ndarray:
    """(K, POINTS) m^2 that each point stands for."""
    return np.repeat(area.reshape(-1)[texels.index, None], POINTS, axis=1) / POINTS


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.79, np.pi / 2])
def test_points_of_a_strip_narrower_than_a_texel_are_spread_over_its_width(angle: float) -> None:
    geometry = strip_at(angle)
    texels = texels_of(geometry, SIDE, SIDE)
    share = share_by_area(texels, texel_areas(geometry, SIDE, SIDE))
    assert share.sum() == pytest.approx(LONG * STRIP)
    across = texels.positions[..., 1] / STRIP
    found = np.histogram(across, bins=4, range=(0, 1), weights=share)[0] / share.sum()
    assert np.abs(found - 0.25).max() < 0.06
    assert np.average(across**2, weights=share) == pytest.approx(1 / 3, abs=0.03), "1/4 in the middle"
    assert across.min() > 0 and across.max() < 1, "never on the border"
    assert np.median(np.ptp(across, axis=1)) > 0.5, "each texel by itself, most of those beside the strip too"


def test_what_varies_linearly_has_no_noise() -> None:
    corners = np.array([(2, 2), (SIDE - 2, 2), (SIDE - 2, SIDE - 2), (2, SIDE - 2)], float)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    up = np.tile((0.0, 0, 1), (4, 1))
    geometry = {"positions": np.c_[corners, np.zeros(4)], "normals": up, "uv2": corners / SIDE, "faces": faces}
    texels = texels_of(geometry, SIDE, SIDE)
    row, column = np.divmod(texels.index, SIDE)
    inner = (np.minimum(row, column) > 1) & (np.maximum(row, column) < SIDE - 2) & (row != column)
    mean = texels.positions[inner].mean(axis=1)[:, :2]
    assert inner.sum() == (SIDE - 4) * (SIDE - 5) and np.allclose(mean, np.c_[column, row][inner] + 0.5, atol=1e-4)
    place = texels.positions[inner][..., :2] - np.c_[column, row][inner][:, None]
    assert place.std(axis=0).min() > 0.05, "and yet they differ"
    cell = np.round(4 * place - 0.5)
    near = (np.abs(4 * place - np.round(4 * place)) < 1e-4).any(axis=(1, 2))  # rounding may have moved those
    cell = cell[~near]
    assert len(cell) > 700 and (np.sort(cell, axis=1) == np.arange(4)[:, None]).all(), (
        "one in each row and column of four"
    )


def test_placing_is_uniform_in_any_triangle() -> None:
    rng = np.random.default_rng(1)
    for number in range(24):
        triangle = rng.uniform(-0.6, 1.6, (3, 2))
        if number % 3 == 0:
            triangle[1, 0] = triangle[0, 0]  # an upright edge
        if number % 4 == 0:
            triangle[:, 1] = np.round(2 * triangle[:, 1]) / 2  # level ones
        candidates = rng.random((100_000, 2))
        sides = [np.roll(triangle, -1, axis=0)[i] - triangle[i] for i in range(3)]
        turn = [
            s[0] * (candidates - t)[:, 1] - s[1] * (candidates - t)[:, 0] for s, t in zip(sides, triangle, strict=True)
        ]
        within = candidates[(np.sign(turn) == np.sign(turn[0])).all(axis=0)]
        if len(within) < 2000:
            continue
        points = placed(np.repeat(triangle[None], 10_000, axis=0), rng.random((10_000, 2)))
        for moment in (lambda p: p, lambda p: p**2, lambda p: p[:, :1] * p[:, 1:]):
            a, b = moment(points), moment(within)
            z = (a.mean(axis=0) - b.mean(axis=0)) / np.sqrt(a.var(axis=0) / len(a) + b.var(axis=0) / len(b))
            assert np.abs(z).max() < 4.5


def mitsuba_mesh(mesh: Mesh) -> mi.Mesh:
    found = mi.Mesh("mesh", len(mesh.positions), len(mesh.faces))
    parameters = mi.traverse(found)
    parameters["vertex_positions"] = mesh.positions.astype(np.float32).ravel()
    parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
    parameters.update()
    return found


FLOOR = patch((-500, 0, 500), (1000, 0, 300), (0, 20, -1000))
CONVEX = {
    "coarse ball": moved(sphere(0.3, 8, 4), (1, 2, 3)),
    "fine ball far off": moved(sphere(0.5, 200, 100), (60, 1, -40)),
    "tilted box": box((0.001, 3, 7)),
    "floor of a kilometre": FLOOR,
}


@pytest.mark.parametrize("name", CONVEX)
def test_rays_leave_their_surface(name: str) -> None:
    mesh, n, rng = CONVEX[name], 1 << 16, np.random.default_rng(2)
    scene = mi.load_dict({"type": "scene", "mesh": mitsuba_mesh(mesh)})
    corners = mesh.positions[mesh.faces].astype(np.float32).astype(float)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    face = rng.choice(np.flatnonzero(np.linalg.norm(normal, axis=1) > 0), n)
    point = np.einsum("nc,ncx->nx", rng.dirichlet((0.5, 0.5, 0.5), n), corners[face])
    normal = normal[face] / np.linalg.norm(normal[face], axis=1, keepdims=True)
    p, up = (mi.Vector3f(*np.ascontiguousarray(a.T, dtype=np.float32)) for a in (point, normal))
    local = mi.warp.square_to_cosine_hemisphere(mi.Point2f(*rng.random((2, n)).astype(np.float32)))
    hit = scene.ray_test(rays.leaving(scene, p, up, mi.Frame3f(up).to_world(local)))
    assert not np.array(hit).any()
    onto = scene.ray_test(rays.leaving(scene, p + 0.01 * up, up, -up))
    assert np.array(onto).mean() > 0.999 and dr.width(onto) == n
