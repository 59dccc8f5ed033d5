"""The sky turned under a baked scene: what light fields, probes and the sun show of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields import lookup as numpy_twin
from lambent.baked.light_fields.shading import turned, under_sky
from lambent.baking.bake import bake
from lambent.core.errors import UserError
from lambent.core.geometry.cubemap import face_directions, sample
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import Probe, read_baked
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun.turned_sky import under_turned_sky
from lambent.render import Settings
from lambent.scenes.geometry import turn
from lambent.scenes.scene import ComputedEnvironment, ConstantEnvironment, ImageEnvironment, Scene, SunSky
from lambent.scenes.sky.turned_sky import under_turned_sky as scene_under_turned_sky
from lambent.store.contract import FAR, SunRecord
from tests.baking.small_scenes import TINY, plane
from tests.realtime.lit_plate import CAMERA, mirrored, plate_field, plate_scene
from tests.realtime.lit_wall import smooth_light

SIZE, DEGREES = 128, 70.0
QUALITY = TINY.changed("tiny, clear sky", environment={"texels": 64})
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular", integrator="rings")


@pytest.mark.long
def test_what_mirrors_the_sky_mirrors_the_turned_one(device: Any) -> None:
    """As numpy's look-up in maps under the sky turned by hand; walls stay, and another turn is another picture."""
    field = plate_field()
    scene = under_turned_sky(plate_scene(field), DEGREES)
    sky = turned(smooth_light, turn("y", DEGREES))
    place, w, inside = mirrored(field, SIZE)
    relit = under_sky(field, sky)
    march = numpy_twin.marched(relit, place, w, None, sky)
    open_sky = march.sky & inside
    assert open_sky.sum() > 100
    got = Renderer(device, scene).image(replace(STATE, lookup="light_field")).reshape(-1, 3)
    error = np.abs(got - march.radiance).max(axis=1)
    assert np.quantile(error[inside], 0.5) < 5e-3 and np.quantile(error[inside], 0.98) < 0.06
    assert np.quantile(error[open_sky], 0.95) < 0.06
    other = under_turned_sky(plate_scene(field), -DEGREES)
    wrong = Renderer(device, other).image(replace(STATE, lookup="light_field")).reshape(-1, 3)
    assert np.quantile(np.abs(wrong - march.radiance).max(axis=1)[open_sky], 0.8) > 0.1


def test_probes_that_know_distances_turn_and_the_sun_turns_too() -> None:
    sky = np.random.default_rng(1).random((6, 32, 32, 3), np.float32)
    distance = np.full((6, 16, 16), 2.0, np.float32)
    distance[2] = FAR  # what is above is the sky
    probe = Probe((0.0, 0.0, 0.0), np.full((6, 32, 32, 3), 7.0, np.float32), distance)
    sun = SunRecord(direction=(0.0, 0.6, -0.8), irradiance=(1.0, 1.0, 1.0), radius_rad=0.004)
    blind = replace(probe, distance=None)
    scene = replace(plate_scene(plate_field()), environment=sky, probes={"a": probe, "b": blind}, sun=sun)
    under = under_turned_sky(scene, 90.0)
    assert under.sun is not None
    np.testing.assert_allclose(under.sun.direction, (-0.8, 0.6, 0.0), atol=1e-6)  # from -z towards -x
    expected = sample(sky, face_directions(32) @ turn("y", 90.0))  # texels turn onto texels
    np.testing.assert_allclose(under.environment, expected, atol=1e-5)
    np.testing.assert_allclose(under.probes["a"].radiance[2], expected[2], atol=1e-5)
    assert (under.probes["a"].radiance[[0, 1, 3, 4, 5]] == 7.0).all()
    assert under.probes["b"] is blind and under_turned_sky(scene, 360.0) is scene


@pytest.mark.long
def test_a_scene_turns_as_its_bake_does(mi: Any, tmp_path: Path) -> None:
    """The environment that a turned scene bakes is that of the scene, turned; all kinds of environment."""
    low_sun = SunSky(sun_direction=(0.0, 0.6, -0.8), sun_scale=0.0)
    for number, environment in enumerate((ComputedEnvironment("park"), low_sun)):
        scene = replace(plane(), environment=environment)
        cubes = []
        for name, one in (("as it is", scene), ("turned", scene_under_turned_sky(scene, DEGREES, tmp_path))):
            with bake(one, tmp_path / f"{name}{number}", quality=QUALITY, only={"geometry", "environment"}) as store:
                cubes.append(read_baked(store))
        got, expected = under_turned_sky(cubes[0], DEGREES).environment, cubes[1].environment
        assert got is not None and expected is not None
        back = under_turned_sky(cubes[0], -DEGREES).environment
        most = 5 * np.median(expected)  # a sun's disc is no larger than a texel
        share, other = (np.abs(np.minimum(one, most) - np.minimum(expected, most)).mean() for one in (got, back))
        assert share < 0.06 * expected.mean() and other > 3 * share, (share, other, expected.mean())


def test_what_cannot_be_turned_is_a_line(tmp_path: Path) -> None:
    lying = Scene("lying", (), {}, environment=ImageEnvironment(tmp_path / "a.hdr", up="+z"))
    with pytest.raises(UserError, match="--sky-turn"):
        scene_under_turned_sky(lying, 10.0, tmp_path)
    even = Scene("even", (), {}, environment=ConstantEnvironment((1.0, 1.0, 1.0)))
    assert scene_under_turned_sky(even, 10.0, tmp_path).environment == even.environment
    with pytest.raises(UserError, match="--sky-turn"):
        Settings(8, 8, sky_turn_deg=float("nan")).check()
