"""Light fields within a budget of memory: which maps are there, what stands in for others, and what a picture loses."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.maps import nearest_points
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import area_vectors
from lambent.core.views.camera import clip_from_world
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.light_fields.needed_points import NeededPoints
from lambent.realtime.light_fields.resident_maps import ResidentMaps, filled
from lambent.realtime.renderer import Renderer
from lambent.render import Settings, still
from tests.realtime.lit_ball import CAMERA, ball_scene, light_field, put_ball

SIZE = 64
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular")
ROUNDED = {"rtol": 1e-3, "atol": 1e-4}  # filters round places in a texture by its size
ELSEWHERE = replace(CAMERA, target=(0.5, 0.6, 1.7))
AROUND, AWAY = (clip_from_world(camera, SIZE, SIZE, 0.01) for camera in (CAMERA, ELSEWHERE))
BEHIND = replace(CAMERA, position=(-0.25, -0.3, -0.65))


@pytest.fixture(scope="module")
def field() -> LightField:
    return light_field(count=64, side=30)


@pytest.fixture(scope="module")
def scene(field: LightField) -> BakedScene:
    return ball_scene(field=field)


def megabytes(device: Any, field: LightField, maps: float) -> float:
    return maps * ResidentMaps(device, field).atlas.map_bytes / 1e6


def budgeted(device: Any, scene: BakedScene, maps: float) -> Renderer:
    return Renderer(device, replace(scene, light_field_mb=megabytes(device, scene.light_fields["ball"], maps)))


@pytest.mark.long
def test_all_maps_within_the_budget_change_nothing(device: Any, scene: BakedScene) -> None:
    exact, roomy = Renderer(device, scene), budgeted(device, scene, 64.5)
    np.testing.assert_array_equal(roomy.image(STATE), exact.image(STATE))
    assert roomy.streaming.statistics == {} and roomy.statistics["light_fields"] == {}


@pytest.mark.long
def test_a_view_gets_the_maps_that_it_needs(device: Any, scene: BakedScene) -> None:
    """Of half of the maps, those of the side that is seen: the picture is that of all maps."""
    exact, half = Renderer(device, scene), budgeted(device, scene, 44.5)
    np.testing.assert_allclose(half.image(STATE), exact.image(STATE), **ROUNDED)
    found = half.streaming.statistics
    assert (found["maps"], found["resident"]) == (64, 44) and found["misses"] > 0
    assert 0 < found["resident_mb"] <= megabytes(device, scene.light_fields["ball"], 44.5)
    half.image(STATE)
    again = half.streaming.statistics
    assert again["misses"] == found["misses"] and again["hits"] > found["hits"], "what was loaded stays"
    turned = replace(STATE, camera=BEHIND)
    np.testing.assert_allclose(half.image(turned), exact.image(turned), **ROUNDED)


@pytest.mark.long
def test_a_frame_that_does_not_wait_is_drawn_from_what_is_there(device: Any, scene: BakedScene) -> None:
    """The window's way: the first frame is of maps that happened to be there, later ones of all that is needed."""
    exact, renderer = Renderer(device, scene).image(STATE), budgeted(device, scene, 44.5)
    renderer.waits = False
    first = renderer.image(STATE)
    assert renderer.streaming.busy and np.abs(first - exact).max() > 0.1
    end, version = time.monotonic() + 30, renderer.streaming.version
    while renderer.streaming.busy and time.monotonic() < end:
        time.sleep(0.01)
        last = renderer.image(STATE)
    np.testing.assert_allclose(last, exact, **ROUNDED)
    assert renderer.streaming.version > version


def test_points_needed_are_those_named_where_the_object_faces_the_eye(scene: BakedScene, field: LightField) -> None:
    """As found at random places of the triangles that the camera sees; on both windings."""
    triangles, uv2 = scene.positions[scene.faces].astype(float), scene.uv2[scene.faces].astype(float)
    eye = np.array(CAMERA.position)
    seen = np.flatnonzero(np.einsum("fd,fd->f", area_vectors(triangles), eye - triangles.mean(axis=1)) > 0)
    shares = np.random.default_rng(1).dirichlet((1, 1, 1), (8, len(seen)))
    named = nearest_points(replace(field, sample_map=filled(field.sample_map)), (shares[..., None] * uv2[seen]).sum(2))
    truth = set(np.unique(named[named != NO_POINT]).tolist())
    for order in ([0, 1, 2], [2, 1, 0]):
        needed = NeededPoints(triangles[:, order], uv2[:, order], field).of_view(eye, AROUND)
        assert truth <= set(needed.tolist()) and len(needed) <= len(truth) + 2 and len(truth) < 50
        facing = (field.normals @ eye) / np.linalg.norm(eye)
        assert facing[needed[:8]].min() > facing[needed[-8:]].max(), "most needed first"
    assert len(NeededPoints(triangles, uv2, field).of_view(eye, AWAY)) == 0
    bare = replace(field, sample_map=np.full_like(field.sample_map, NO_POINT))
    bare.sample_map[0, 0, 0] = 7
    np.testing.assert_array_equal(NeededPoints(triangles, uv2, bare).of_view(eye, AROUND), [7])
    wild = uv2.copy()
    wild[::3] = np.nan
    wild[1::3] = 1e30
    assert set(NeededPoints(triangles, wild, field).of_view(eye, AROUND)) <= set(range(64))


def test_a_budget_below_one_map_is_refused(tmp_path: Path, field: LightField) -> None:
    store = put_ball(tmp_path / "ball.store", field)
    with pytest.raises(UserError, match="--light-field-mb"):
        still(store.folder, tmp_path / "a.png", settings=Settings(8, 8, light_field_mb=0.001))
