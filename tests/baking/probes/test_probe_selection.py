"""Probes of hollow and of round things, and how their error is measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lambent.baked.probes.lookups import distance_lookup, inverse_depth
from lambent.baking.bake import bake
from lambent.baking.probes.probe import Probe
from lambent.baking.probes.selection import (
    UNSCALED,
    Mirrored,
    Scaling,
    by_distance,
    by_planes,
    error,
    judged,
    specular_occlusion,
)
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import merge, patch, sphere
from lambent.scenes.scene import ImageEnvironment, Scene, SceneObject
from lambent.store.contract import FAR
from tests.baking.small_scenes import TINY, constant_picture

PAINT = Material(kd=0.5, lobes=(Lobe(distribution="ggx", mx=0.2, my=0.2, r0=0.04),))


def rays(**given: object) -> Mirrored:
    one = np.array([[0.0, 0.0, 1.0]])
    values = {"origins": 0 * one, "directions": one, "normals": one, "radiance": one * 0 + 1.0}
    return Mirrored(**{**values, "irradiance": np.ones(1), "fresnel": np.ones(1), "own": np.zeros(1, bool), **given})


def under_a_white_sky(shown: np.ndarray, share: np.ndarray) -> tuple[Mirrored, Probe]:
    """Rays upwards that show so much of the sky, from places of so large a share of its irradiance."""
    up = np.tile([0.0, 0.0, 1.0], (100, 1))
    light = np.repeat(shown[:, None], 3, axis=1)
    sky = np.ones((6, 8, 8, 3), np.float32)
    probe = Probe(sky, np.full((6, 8, 8), FAR, np.float32), sky)
    return Mirrored(0 * up, up, up, light, np.pi * share, np.ones(100), np.zeros(100, bool)), probe


def test_error_and_share_by_hand() -> None:
    assert error(rays(), np.ones(1)) == pytest.approx(0, abs=1e-4)
    assert error(rays(), np.full(1, 3.0)) == pytest.approx(np.log(2), abs=1e-3)  # log((1 + 3)/(1 + 1))
    whole = np.array([4.0, *[0] * 8])
    lit, up = np.ones(1), rays().normals
    assert specular_occlusion(lit, up, whole) == pytest.approx(0.25)
    assert specular_occlusion(lit, up, whole / 100) == pytest.approx(1)


@pytest.mark.parametrize(("niches", "open_share", "gain"), [(20, 0.6, 2.0), (90, 1.0, 1.0), (0, 0.9, 0.0)])
def test_gain_leaves_what_is_no_niche_its_light(niches: int, open_share: float, gain: float) -> None:
    """Niches show as much of the sky as their irradiance has, and open places show all."""
    is_niche = np.arange(100) < niches
    share = np.where(is_niche, 0.2 / max(gain, 1.0), open_share)
    seen, probe = under_a_white_sky(np.where(is_niche, 0.2, 1.0), share)
    found = judged(seen, probe, np.zeros(3), np.zeros((0, 4)))
    assert found.scaling == Scaling(gain) and found.best == pytest.approx(0, abs=1e-3)
    assert judged(seen, probe, np.zeros(3), np.zeros((0, 4)), through=True).scaling == UNSCALED


def test_walls_of_a_niche_shine_where_they_hide_the_sky() -> None:
    """Shelves with .4 of the sky's irradiance, which show it in .36 of their directions."""
    ratio = np.repeat([0.4, 1.0], 50)
    share = np.minimum(1.5 * ratio, 1)
    seen, probe = under_a_white_sky(share**2 + (1 - share) * ratio, ratio)
    found = judged(seen, probe, np.zeros(3), np.zeros((0, 4)))
    assert found.scaling == Scaling(1.5, even=True) and found.best == pytest.approx(0, abs=1e-3)


def test_planes_turn_the_look_up_as_the_renderer_does() -> None:
    cube = np.zeros((6, 64, 64, 3))
    cube[0] = 1.0  # +x
    slanted = normalize(np.array([[1.0, 0.0, 1.2]]))
    wall = np.array([[-1.0, 0.0, 0.0, 2.0]])  # x = 2
    beside = rays(origins=np.array([[0.0, 0.0, -2.0]]), directions=slanted)
    assert by_planes(beside, cube, np.zeros(3), wall[:0])[0] == 0, "without planes it looks to +z"
    assert by_planes(beside, cube, np.zeros(3), wall)[0] == pytest.approx(1, abs=1e-4), "the wall at (2, 0, .4)"


def test_the_distance_map_is_stepped_through_to_the_wall() -> None:
    """A cube of 2 m about the centre: from any point within, what is looked up is the wall's colour there."""
    w = normalize(face_directions(64))
    distance = np.linalg.norm(face_directions(64), axis=-1)
    rng = np.random.default_rng(1)
    origins, directions = rng.uniform(-0.8, 0.8, (200, 3)), normalize(rng.normal(size=(200, 3)))
    reach = np.min((np.sign(directions) - origins) / directions, axis=1)
    hits = origins + reach[:, None] * directions
    cube = np.repeat(2 + w[..., :1], 3, axis=-1)  # looked up at p: 2 + p_x/|p|
    many = rays(origins=origins, directions=directions)
    found = by_distance(many, cube, np.zeros(3), distance)
    assert np.quantile(np.abs(found - 2 - normalize(hits)[:, 0]), 0.9) < 0.05  # few steps: a tenth ends beside the wall
    walls = np.array([[*-np.sign(s) * np.eye(3)[i], 1.0] for i in range(3) for s in (1, -1)])
    assert np.allclose(by_planes(many, cube, np.zeros(3), walls), 2 + normalize(hits)[:, 0], atol=5e-3)


@pytest.mark.parametrize("scale", [0.1, 1.0, 1e3])
def test_the_distance_map_finds_the_wall_of_a_cup_before_the_sky(scale: float) -> None:
    """Rays from the tea in a cup of 4.6 cm, seen from 1 cm above its rim, under a sky that is 10 km away."""
    radius, rim, tea = 0.023, -0.01, -0.035
    w = normalize(face_directions(256))
    with np.errstate(divide="ignore"):
        across = radius / np.linalg.norm(w[..., [0, 2]], axis=-1)
        depth = np.where(w[..., 1] < 0, tea / w[..., 1], np.inf)
    to_wall = np.where((across * w[..., 1] < rim) & (across < depth), across, np.inf)
    to_tea = np.where(depth * np.linalg.norm(w[..., [0, 2]], axis=-1) < radius, depth, np.inf)
    distance = np.minimum(np.minimum(to_wall, to_tea), 1e4)
    rng = np.random.default_rng(4)
    phi, up = rng.uniform(0, 2 * np.pi, 500), np.radians(rng.uniform(10, 35, 500))
    r, turn = 0.8 * radius * np.sqrt(rng.uniform(size=500)), rng.uniform(0, 2 * np.pi, 500)
    x = np.stack([r * np.cos(phi), np.full(500, tea + 1e-5), r * np.sin(phi)], axis=-1)
    along = np.stack([np.cos(up) * np.cos(turn), np.sin(up), np.cos(up) * np.sin(turn)], axis=-1)
    level = along[:, [0, 2]]
    a, b = (level**2).sum(axis=1), (x[:, [0, 2]] * level).sum(axis=1)
    t = (np.sqrt(b * b + a * (radius**2 - r * r)) - b) / a
    hits = x + t[:, None] * along
    inside = hits[:, 1] < rim - 1e-3
    assert inside.sum() > 100
    found = distance_lookup(scale * x, along, inverse_depth(np.minimum(scale * distance, 1e4)))
    cosine = (normalize(found) * normalize(hits)).sum(axis=1)[inside]
    assert (np.degrees(np.arccos(cosine.clip(-1, 1))) < 2).mean() > 0.9


def well(folder: Path) -> Scene:
    """A pit of five painted walls, 1 m wide and 2 m deep, under a sky of radiance 1, and a painted ball above it."""
    x, z, up, half = np.array([1, 0, 0]), np.array([0, 0, 1]), np.array([0, 2, 0]), 0.5
    corners = [(-half, -2, half), (-half, -2, -half), (half, -2, half), (-half, -2, half), (half, -2, -half)]
    sides = [(x, -z), (x, up), (-x, up), (-z, up), (z, up)]
    walls = [patch(corner, *edges) for corner, edges in zip(corners, sides, strict=True)]
    objects = SceneObject("well", merge(walls), "paint"), SceneObject("ball", sphere(0.2, 24, 12), "paint")
    camera = Camera("above", (0.0, 2.0, 0.3), (0.0, 0.0, 0.0))
    return Scene("pit", objects, {"paint": PAINT}, environment=ImageEnvironment(constant_picture(folder)),
                 cameras=(camera,))  # fmt: skip


@pytest.mark.long
def test_a_pit_is_shown_no_more_sky_than_it_sees(tmp_path: Path) -> None:
    scene = well(tmp_path)
    scene = replace(scene, objects=scene.objects[:1])
    store = bake(scene, tmp_path / "s", quality=TINY, only=("probe",))
    meta = store.artefact("probe/well/radiance").meta
    if meta["object_left_out"]:  # then the probe sees the sky alone
        assert meta["seen_irradiance"][0] == pytest.approx(np.pi, rel=0.01)
        assert np.abs(meta["seen_irradiance"][1:]).max() < 0.02
    assert "seen_irradiance" in meta or not meta["object_left_out"]
    assert meta["mirror_error"] < 0.3


@pytest.mark.long
def test_a_ball_in_the_open_keeps_all_its_light(tmp_path: Path) -> None:
    scene = well(tmp_path)
    store = bake(replace(scene, objects=scene.objects[1:]), tmp_path / "s", quality=TINY, only=("probe",))
    meta = store.artefact("probe/ball/radiance").meta
    assert meta["object_left_out"] and "seen_irradiance" not in meta
    assert meta["mirror_error"] < 0.01
