"""What a probe sees and where: lamps of known texels, and sheets lit from either side."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.baking.light.cache import LightMapCache
from lambent.baking.probes.hidden import Seen, hidden_share, parallax_deg
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.materials.document import Material
from lambent.scenes.geometry import patch, placed, sphere
from lambent.scenes.geometry.grid import turn
from lambent.scenes.scene import DirectionalLight, Mesh, Scene, SceneObject
from tests.baking.small_scenes import BLACK, MIRROR, TINY, coloured_room

N = 16  # TINY's texels along a face
# A lamp before each wall, and the texel (row, column) of the wall's face whose middle it covers, by WebGPU's table of
# cube faces: +x (-z, -y), -x (z, -y), +y (x, z), -y (x, -z), +z (x, -y), -z (-x, -y) to the right and downwards.
LAMPS = (
    ((1, 0.4375, -0.6875), (4, 13)),
    ((-1, 0.4375, -0.6875), (4, 2)),
    ((0.4375, 1, -0.6875), (2, 11)),
    ((0.4375, -1, -0.6875), (13, 11)),
    ((0.4375, -0.6875, 1), (13, 11)),
    ((0.4375, -0.6875, -1), (13, 4)),
)


def lamp(at: tuple[float, float, float]) -> Mesh:
    """A square of .1 m, less than a texel at 1 m, that faces the origin."""
    axis = int(np.argmax(np.abs(at)))
    across, up = 0.1 * np.eye(3)[(axis + 1) % 3], 0.1 * np.eye(3)[(axis + 2) % 3]
    if at[axis] > 0:
        across = -across
    return patch(np.array(at) - across / 2 - up / 2, across, up)


@pytest.mark.long
@pytest.mark.parametrize("method", ["traced", "cached"])
def test_every_face_has_its_lamp_in_its_texel(tmp_path: Path, method: str) -> None:
    """Off the axes, so that a face that is mirrored or turned shows it elsewhere; distances likewise."""
    room = coloured_room()
    walls = tuple(replace(o, emission=(0.0, 0.0, 0.0)) for o in room.objects)
    lamps = tuple(SceneObject(f"lamp {i}", lamp(at), "black", emission=(9, 9, 9)) for i, (at, _) in enumerate(LAMPS))
    scene = replace(room, objects=(*walls, *lamps))
    store = bake(scene, tmp_path / "s", quality=TINY, probes=method, only=("probe",))
    radiance, distance = (store.read(f"probe/ball/{part}").astype(float) for part in ("radiance", "distance"))
    for face, (at, (row, column)) in enumerate(LAMPS):
        seen = radiance[face, ..., 1]
        assert seen[row, column] == pytest.approx(0.8**2 * 9, rel=0.15), f"face {face}: the texel's mean"
        assert seen.sum() == pytest.approx(seen[row, column]), f"face {face}: one texel alone"
        assert distance[face, row, column] == pytest.approx(np.linalg.norm(at), rel=1e-3)
        assert np.sum(distance[face] < 1.9) == 1, f"face {face}"


@pytest.fixture(scope="module")
def sheet_of_light(mi: Any) -> Any:
    """A sheet whose light map is 1 on the normal's side and 3 on the other, seen from (0, 0, z) at its middle."""

    def seen(material: Material, z: float) -> np.ndarray:
        sheet = SceneObject("sheet", patch((-1, -1, 0), (2, 0, 0), (0, 2, 0)), "m")  # its normal is +z
        builder = SceneBuilder(Scene("s", (sheet,), {"m": material}), {"sheet": np.full((4, 2), 0.5)})
        maps = (np.full((4, 4, 3), e) for e in (1.0, 3.0))
        cache = LightMapCache(builder, *maps)
        si = builder.build().ray_intersect(mi.Ray3f(mi.Point3f(0, 0, z), mi.Vector3f(0, 0, -z)))
        return np.array(cache(si, si.is_valid())).ravel()

    return seen


@pytest.mark.parametrize(("z", "here", "beyond"), [(1.0, 1.0, 3.0), (-1.0, 3.0, 1.0)])
def test_each_side_shows_its_own_light_and_what_passes(
    sheet_of_light: Any, z: float, here: float, beyond: float
) -> None:
    """kd/pi E of the side that is seen, kt_d/pi E of the other (4.1)."""
    material = Material(kd=(0.2, 0.4, 0.6), kt_d=(0.3, 0.1, 0.05))
    expected = (np.array(material.kd) * here + np.array(material.kt_d) * beyond) / np.pi
    np.testing.assert_allclose(sheet_of_light(material, z), expected, rtol=1e-5)


@pytest.mark.long
@pytest.mark.parametrize("method", ["traced", "cached"])
def test_a_probe_sees_a_sheet_lit_from_one_side_and_the_other(tmp_path: Path, method: str) -> None:
    """The sheet's normal points to the probe or away; the sun stands on the probe's side or behind the sheet."""
    material = Material(kd=(0.2, 0.4, 0.6), kt_d=(0.3, 0.1, 0.05))
    ball = SceneObject("ball", placed(sphere(0.05, 12, 6), (0, 0, 1)), "mirror")
    forward = patch((-1, -1, 0), (2, 0, 0), (0, 2, 0))
    turned = patch((1, -1, 0), (-2, 0, 0), (0, 2, 0))
    for number, (mesh, z) in enumerate(((forward, -0.8), (turned, -0.8), (turned, 0.8))):
        sun = DirectionalLight((0.6, 0.0, z), (np.pi, np.pi, np.pi))  # irradiance .8 pi
        scene = Scene(
            "sheet", (SceneObject("sheet", mesh, "sheet"), ball), {"sheet": material, "mirror": MIRROR, "black": BLACK},
            lights=(sun,), probe_centres={"ball": (0.0, 0.0, 1.0)},
        )  # fmt: skip
        quality = TINY.changed(probe={"texels": 8})
        store = bake(scene, tmp_path / str(number), quality=quality, probes=method, only=("probe",))
        seen = store.read("probe/ball/radiance").astype(float)[5, 3:5, 3:5].mean(axis=(0, 1))  # towards -z
        expected = 0.8 * np.array(material.kd if z < 0 else material.kt_d)
        np.testing.assert_allclose(seen, expected, rtol=0.03, err_msg=f"case {number}, sun towards {z}")


@pytest.mark.long
def test_planes_are_found_whichever_way_the_walls_face(tmp_path: Path) -> None:
    """The normal that counts is that on the probe's side. The room is turned and moved: no box around it would do."""
    room, about, place = coloured_room(), turn("y", 30), np.array([10.0, 0, 0])
    inside_out = (replace(o.mesh, normals=-o.mesh.normals, faces=o.mesh.faces[:, ::-1].copy()) for o in room.objects)
    meshes = [placed(mesh, place, rotation=about) for mesh in inside_out]
    objects = tuple(replace(o, mesh=mesh) for o, mesh in zip(room.objects[:-1], meshes, strict=False))
    ball = replace(room.objects[-1], mesh=placed(room.objects[-1].mesh, place))
    store = bake(replace(room, objects=(*objects, ball)), tmp_path / "s", quality=TINY, only=("probe",))
    planes = store.read("probe/ball/planes")
    assert planes.shape == (6, 4)
    for axis in (*about.T, *-about.T):
        assert np.abs(planes - [*axis, 2 - axis @ place]).max(axis=1).min() < 2e-3


def test_parallax_is_counted_from_the_centre() -> None:
    """Planes that bound the room exactly leave none, wherever the centre stands; without planes it is known by hand."""
    half = np.array([2.0, 1.5, 2.5])
    rng = np.random.default_rng(3)
    origins = rng.uniform(-0.9, 0.9, (500, 3)) * half
    w = rng.normal(size=(500, 3))
    w /= np.linalg.norm(w, axis=1, keepdims=True)
    t = ((np.sign(w) * half - origins) / w).min(axis=1)
    seen = Seen(origins, w, origins + t[:, None] * w, np.ones(500, bool))
    centre = np.array([1.0, -0.4, 1.2])
    about = np.array([[*(-s * a), a @ half - s * (a @ centre)] for a in np.eye(3) for s in (1, -1)])
    assert parallax_deg(seen, centre, about) < 0.01
    alone = Seen(np.array([[0.0, 0, 1.0]]), np.array([[1.0, 0, 0]]), np.array([[1.0, 0, 1.0]]), np.ones(1, bool))
    assert parallax_deg(alone, np.zeros(3), np.zeros((0, 4))) == pytest.approx(45.0, abs=0.01)


def test_the_hidden_share_is_of_what_is_seen(mi: Any) -> None:
    """Of six rays two meet nothing, and a screen stands before two of the four hits."""
    wall = SceneObject("wall", patch((-4, -4, -2), (8, 0, 0), (0, 8, 0)), "m")
    screen = SceneObject("screen", patch((0.2, -4, -1), (4, 0, 0), (0, 8, 0)), "m")
    scene = SceneBuilder(Scene("s", (wall, screen), {"m": Material(kd=0.5)})).build()
    hits = np.array([[-2, 0, -2], [-1, 1, -2], [2, 0, -2], [2, 1, -2], [0, 0, 0], [0, 0, 0]], float)
    valid = np.array([True] * 4 + [False] * 2)
    seen = Seen(np.zeros((6, 3)), np.tile([0.0, 0, -1], (6, 1)), hits, valid)
    assert hidden_share(seen, np.zeros(3), scene) == pytest.approx(0.5)
