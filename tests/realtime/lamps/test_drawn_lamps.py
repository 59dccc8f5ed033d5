"""Lamps at points drawn by pixel: known irradiance, edges of shadows, highlights, and mixes of light groups."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.bake import bake
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera, pixel_rays
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import patch
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.store import Store
from tests.baking.light.test_point_lamps import BULB, SPOT, WASHER, intensity, is_behind_plate
from tests.baking.small_scenes import TINY

SIZE = 192
GLOSSY = Material(kd=0.5, lobes=(Lobe(mx=0.2, my=0.1, r0=(0.2, 0.1, 0.05)),))
CAMERA = Camera(name="above", position=(0.6, 2.4, 1.4), target=(0.0, 0.0, 0.0), fov_y_deg=60.0)


@pytest.fixture(scope="module")
def store(mi: Any, tmp_path_factory: pytest.TempPathFactory) -> Store:
    floor = SceneObject("floor", patch((-2, 0, 2), (4, 0, 0), (0, 0, -4)), "glossy")
    plate = SceneObject("plate", patch((-0.2, 0.5, 0.2), (0.4, 0, 0), (0, 0, -0.4)), "dark")
    lights = (replace(SPOT, name="spot"), replace(BULB, name="bulb"), replace(WASHER, name="washer"))
    scene = Scene("room", (floor, plate), {"glossy": GLOSSY, "dark": Material(kd=0.0)}, lights=lights)
    folder: Path = tmp_path_factory.mktemp("drawn") / "s"
    return bake(scene, folder, quality=TINY, only=("lamps", "probe"), light_groups="scene")


def floor_seen() -> tuple[Floats, Floats, Floats]:
    """Places (SIZE^2, 3) of pixels on the floor's plane, directions to the eye, and which lie on open floor."""
    w = pixel_rays(CAMERA, SIZE, SIZE).reshape(-1, 3)
    eye = np.array(CAMERA.position)
    p = eye + w * (eye[1] / -w[:, 1])[:, None]
    over = eye + w * ((eye[1] - 0.5) / -w[:, 1])[:, None]
    on_plate = np.abs(over[:, [0, 2]]).max(axis=1) < 0.23
    return p, normalize(-w), (np.abs(p[:, [0, 2]]).max(axis=1) < 1.9) & ~on_plate


def still(device: Any, store: Store, show: str = "full", **state: Any) -> Floats:
    renderer = Renderer(device, read_baked(store))
    made = FrameState(CAMERA, SIZE, SIZE, antialias=False, show=show, **state)
    return np.asarray(renderer.still_radiance(made, 1), float).reshape(-1, 3)


def arriving(p: Floats, factors: dict[str, float] | None = None) -> Floats:
    """(3, n, 3) W/m^2 at normal incidence, by lamp, as seen past the plate; NaN beside edges of shadows."""
    found = []
    for name, lamp in (("spot", SPOT), ("bulb", BULB), ("washer", WASHER)):
        position = np.array(lamp.position)
        away = position - p
        distance = np.linalg.norm(away, axis=1)
        hidden = is_behind_plate(p, position)
        light = intensity(lamp, -away / distance[:, None]) / distance[:, None] ** 2
        found.append((factors or {}).get(name, 1.0) * light * (1 - hidden)[:, None])
    return np.array(found)


@pytest.mark.parametrize("mix", [{}, {"bulb": 0.25, "washer": 0.0}])
def test_the_floor_gets_inverse_squares_and_sharp_shadows(device: Any, store: Store, mix: dict[str, float]) -> None:
    light = {name: (factor,) * 3 for name, factor in mix.items()}
    found = still(device, store, "diffuse", light=light)
    p, _, open_floor = floor_seen()
    direct = arriving(p, mix)
    towards = normalize(np.array([SPOT.position, BULB.position, WASHER.position])[:, None] - p)
    expected = (direct * towards[..., 1:2]).sum(axis=0) * 0.5 / np.pi
    known = open_floor & ~np.isnan(expected).any(axis=1)
    assert known.mean() > 0.4
    np.testing.assert_allclose(found[known], expected[known], rtol=0.02, atol=0.002)


def test_highlights_are_the_closed_form(device: Any, store: Store) -> None:
    found = still(device, store, "specular")
    p, wo, open_floor = floor_seen()
    direct = arriving(p)
    frame = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])  # t, b, n of the floor
    gloss = MaterialBSDF(Material(lobes=GLOSSY.lobes))
    expected = np.zeros_like(p)
    for lamp, of_lamp in zip((SPOT, BULB, WASHER), direct, strict=True):
        wi = normalize(np.array(lamp.position) - p) @ frame.T
        expected += of_lamp * gloss.eval(wi, wo @ frame.T) * wi[:, 2:]
    known = open_floor & ~np.isnan(expected).any(axis=1)
    assert expected[known].max() > 0.05
    np.testing.assert_allclose(found[known], expected[known], rtol=0.03, atol=0.003)


def test_a_store_without_lamps_shows_the_same_light_by_texel(device: Any, store: Store) -> None:
    baked = read_baked(store)
    assert baked.lamps is not None and len(baked.lamps.records) == 3
    renderer = Renderer(device, replace(baked, lamps=None))
    state = FrameState(CAMERA, SIZE, SIZE, antialias=False, show="diffuse")
    by_texel = np.asarray(renderer.still_radiance(state, 1), float).reshape(-1, 3)
    by_pixel = still(device, store, "diffuse")
    open_floor = floor_seen()[2]
    assert by_texel[open_floor].mean() == pytest.approx(by_pixel[open_floor].mean(), rel=0.02)
    assert np.abs(by_texel - by_pixel)[open_floor].max() > 0.02, "texels cannot show the plate's shadow"
