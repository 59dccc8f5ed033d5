"""No two places of a surface that are far apart share a texel of the light map, or of the finer sample map."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lambent.baking.surfaces.atlas import Atlas, merged, unwrap
from lambent.baking.surfaces.layers import APART, BEHIND, in_first_layer, layers_of, lie_flat
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.triangles import cross_2d, triangle_areas
from lambent.scenes.geometry import lathe, merge, placed, sphere, teapot
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Mesh, Scene, SceneObject

TEXELS = 192
FINER = 8  # the sample map's texels to one of the light map, about
IN_TEXEL = 5.0  # texels of surface, across all three axes, that one texel may hold: 2.5 long where a chart is stretched
IN_FINE = BEHIND + 1.5  # and an eighth of one: the depth of projected faces, and their slopes


def of_mesh(mesh: Mesh) -> Scene:
    return Scene("one", (SceneObject("one", mesh, "grey"),), {})


def triangles(corners: Floats) -> Mesh:
    """Loose triangles (F, 3, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.repeat(
        np.divide(normal, length, out=np.tile([0.0, 1.0, 0.0], (len(normal), 1)), where=length > 0), 3, 0
    )
    positions = corners.reshape(-1, 3).astype(np.float32)
    faces = np.arange(len(positions)).reshape(-1, 3).astype(np.uint32)
    uv = np.zeros((len(positions), 2), np.float32)
    return Mesh(
        positions, normal.astype(np.float32), np.tile(np.array([1, 0, 0], np.float32), (len(positions), 1)), uv, faces
    )


def torus() -> Mesh:
    angle = np.linspace(0, 2 * np.pi, 25)
    return lathe([np.stack([1 + 0.03 * np.cos(angle), 0.03 * np.sin(angle)], axis=1)], around=96, rows=2)


def balls(count: int = 2000) -> Mesh:
    at = np.random.default_rng(3).uniform(-1, 1, (count, 3))
    return merge([placed(sphere(0.01, 4, 3), p) for p in at])


def slivers(count: int = 600) -> Mesh:
    """Needles, specks and faces without area, anywhere, most of them narrower than a texel."""
    rng = np.random.default_rng(5)
    at = rng.uniform(-1, 1, (count, 1, 3))
    long, short = rng.normal(size=(2, count, 3)) * 0.3
    short *= np.repeat([0.01, 1e-5, 0.0], count // 3)[:, None]
    wall = [[[-2.0, -3, -2], [2, -3, -2], [0, -3, 2]]]
    return triangles(np.concatenate([at + np.stack([np.zeros_like(long), long, short], axis=1), wall]))


def crossing() -> Mesh:
    """Slanted slips through one middle, which no cut between their middles tells apart."""
    tilts = np.radians(np.linspace(-40, 40, 9))
    slips = []
    for t in tilts:
        x, z = np.cos(t) * 0.5, np.sin(t) * 0.5
        slips.append([[-x, -z, 0.0], [x, z, 0.0], [0.0, 0.0, 1e-3]])
    wall = [[-2.0, -3, -2], [2, -3, -2], [0, -3, 2]]
    return triangles(np.array([*slips, wall]))


def extents(atlas: Atlas, finer: int = 1) -> Floats:
    """How far apart, in texels, places are in each texel that holds some; texels are `finer` than the light map's."""
    arrays, rng = merged(atlas), np.random.default_rng(0)
    world = arrays["positions"][arrays["faces"]].astype(float)
    on_map = arrays["uv2"][arrays["faces"]].astype(float) * (atlas.width, atlas.height)
    area = np.abs(cross_2d(on_map[:, 1] - on_map[:, 0], on_map[:, 2] - on_map[:, 0])) / 2
    owner = np.repeat(np.arange(len(atlas.scene.objects)), [len(o.mesh.faces) for o in atlas.scene.objects])
    size_m = np.sqrt(np.bincount(owner, triangle_areas(world)) / np.bincount(owner, area))[owner]
    length = np.linalg.norm(np.roll(on_map, -1, axis=1) - on_map, axis=2).max(axis=1)
    face: Indices = np.repeat(np.arange(len(on_map)), np.ceil(4 + 6 * length + 6 * area).astype(int))
    weights = rng.dirichlet((0.6, 0.6, 0.6), size=len(face))
    place = np.einsum("kc,kcx->kx", weights, world[face]) / size_m[face, None]
    cell = np.floor(np.einsum("kc,kcx->kx", weights, on_map[face]) * finer).astype(int)
    number = cell[:, 1] * (atlas.width * finer + 1) + cell[:, 0]
    order = np.argsort(number)
    first = np.flatnonzero(np.diff(number[order], prepend=-1))
    low, high = np.minimum.reduceat(place[order], first), np.maximum.reduceat(place[order], first)
    return np.asarray(np.linalg.norm(high - low, axis=1))


@pytest.mark.long
@pytest.mark.parametrize("name", ["teapot", "torus", "balls", "slivers", "crossing", "builtin:pavilion"])
def test_places_far_apart_share_no_texel(name: str) -> None:
    shapes = {"teapot": teapot, "torus": torus, "balls": balls, "slivers": slivers, "crossing": crossing}
    scene = of_mesh(shapes[name]()) if name in shapes else load_scene(name)
    atlas = unwrap(scene, TEXELS)
    assert extents(atlas).max() < IN_TEXEL
    assert extents(atlas, FINER).max() < IN_FINE
    assert not name.startswith("builtin") or atlas.width * atlas.height < 2.5 * TEXELS**2


def test_vertices_belong_to_one_chart() -> None:
    """Charts that are projected, for being small or lost, count their vertices apart."""
    scene = of_mesh(merge([slivers(300), balls(50)]))
    atlas = unwrap(replace(scene), TEXELS)
    corners = atlas.scene.objects[0].mesh.corners
    assert np.array_equal(corners, scene.objects[0].mesh.corners)
    used = np.unique(atlas.scene.objects[0].mesh.faces)
    assert len(used) == len(atlas.uv2["one"])


def square(depth: float, at: tuple[float, float] = (0.0, 0.0)) -> tuple[Floats, Floats]:
    flat = np.array([[[0, 0], [4, 0], [4, 4]], [[0, 0], [4, 4], [0, 4]]], float) + at
    return flat, np.full((2, 3), depth)


def test_sheets_behind_each_other_are_peeled_by_depth() -> None:
    parts = [square(z) for z in (9.0, 0.0, 1.0, 5.0)] + [square(50.0, (20.0, 0.0))]
    flat, depth = (np.concatenate(a) for a in zip(*parts, strict=True))
    found = [list(layer) for layer in layers_of(flat, depth)]
    assert found == [[2, 3, 4, 5, 8, 9], [6, 7], [0, 1]]


def test_parts_of_a_chart_that_pass_within_a_texel_are_parted() -> None:
    """Two strips half a texel apart on the chart, and 10 texels in the world."""
    strip = np.array([[[0, 0], [9, 0], [9, 2]], [[0, 0], [9, 2], [0, 2]]], float)
    flat = np.concatenate([strip, strip + np.array([0, 2.5])])
    world = np.concatenate([flat, np.zeros((4, 3, 1))], axis=2)
    assert in_first_layer(flat, world).all()
    world[2:, :, 2] = 2.5 * APART
    assert list(in_first_layer(flat, world)) == [True, True, False, False]


def test_charts_that_lie_flat_are_one_layer() -> None:
    """Turned and sheared parts of planes are flat; a fold, a stretch and a spiral are not."""
    rng = np.random.default_rng(0)
    flat, _ = square(0.0)
    turned = np.concatenate([flat, np.zeros((2, 3, 1))], axis=2) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    bent = np.concatenate([flat, np.zeros((2, 3, 1))], axis=2)
    bent[1, 2, 2] = 9.0
    corners = np.concatenate([flat, flat, flat + 9, 0 * flat])
    places = np.concatenate([turned, bent, 2 * turned, turned])
    assert lie_flat(corners, places, np.repeat(np.arange(4), 2)).tolist() == [True, False, False, False]
    assert lie_flat(corners[:0], places[:0], np.zeros(0, int)).size == 0
    for _ in range(50):
        corners = 6 * rng.random((5, 3, 2))
        places = corners @ rng.normal(scale=0.6, size=(2, 3)) + rng.normal(scale=0.3, size=(5, 3, 3))
        if lie_flat(corners, places, np.zeros(5, int))[0]:
            assert in_first_layer(corners, places).all()
