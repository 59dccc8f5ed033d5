"""What the renderer takes for the sky of a light field."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from lambent.baked.light_fields import lookup as numpy_twin
from lambent.core.geometry.cubemap import face_directions
from lambent.core.geometry.directions import normalize
from lambent.realtime.frame_state import FrameState
from lambent.realtime.light.baked import DARK
from lambent.realtime.renderer import Renderer
from lambent.realtime.sun.sun_disc import without_sun
from lambent.store.contract import SunRecord
from tests.realtime.lit_plate import CAMERA, mirrored, plate_field, plate_scene

SIZE = 96


def test_without_an_environment_the_maps_answer_for_the_sky(device: Any) -> None:
    """A store may have none; black was shown in its place."""
    field = plate_field()
    place, w, inside = mirrored(field, SIZE)
    march = numpy_twin.marched(field, place, w)
    state = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular", integrator="rings")
    renderer = Renderer(device, replace(plate_scene(field), environment=None))
    got = renderer.image(replace(state, lookup="light_field")).reshape(-1, 3)
    sky = march.sky & inside
    assert sky.sum() > 100
    assert np.quantile(np.abs(got - march.radiance)[sky].max(axis=1), 0.95) < 0.03


def test_the_sky_of_a_light_field_is_without_the_disc() -> None:
    """Pixels add it; else they would show it twice."""
    n, towards = 64, (0.6, 0.8, 0.0)
    disc = normalize(face_directions(n)) @ np.array(towards) > np.cos(0.02)
    cube = np.where(disc[..., None], 5000.0, 0.5).astype(np.float32) * np.ones(3, np.float32)
    sun = SunRecord(direction=towards, irradiance=(6.0, 6.0, 6.0), radius_rad=0.02)
    assert disc.any()
    cleaned = without_sun(replace(DARK, sky=cube), sun)
    assert cleaned.sky is not None
    np.testing.assert_allclose(cleaned.sky, 0.5)
    assert without_sun(replace(DARK, sky=cube), None).sky is cube
