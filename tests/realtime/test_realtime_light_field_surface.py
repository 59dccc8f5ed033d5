"""The object itself from its light field: as numpy's `surface`, as its light is known by hand, else its light map."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.core import light_field_lookup as numpy_twin
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light_field import LightField
from lambent.core.octahedral import texel_directions
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from lambent.render import Settings, still
from tests.realtime.lit_ball import light_field, put_ball
from tests.realtime.lit_plate import CAMERA, EDGE, HEIGHT, mirrored, plate_field, plate_scene
from tests.viewer.small_store import write_small_store

SIZE = 128
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="diffuse", integrator="rings")
GREY = Material(name="grey", kd=0.5, lobes=(Lobe(mx=0.1, my=0.1, r0=0.04),))
IRRADIANCE = 0.6


def pattern(x: Floats) -> Floats:
    """Radiance (..., 3) of places (..., 3) on the plate: smooth."""
    return 1 + 0.5 * np.sin(4 * x + np.array([0.0, 1.0, 2.0]))


def field_with_plate(blind: int = 0) -> LightField:
    """Points see the plate below them in its pattern; every so many (`blind`) something nearer instead."""
    field = plate_field(across=10, side=94)
    w = texel_directions(94)
    down = w[..., 1] < -1e-3
    t = (HEIGHT - field.points[:, 1])[:, None, None] / np.where(down, w[..., 1], -1.0)
    x = field.points[:, None, None].astype(float) + t[..., None] * w
    on = down & (np.abs(x[..., [0, 2]]) < EDGE).all(axis=-1)
    radiance = np.where(on[..., None], pattern(x), field.radiance).astype(np.float16)
    nearness = np.where(on, 1 / t, field.inverse_distance).astype(np.float16)
    if blind:
        nearness[::blind] *= np.float16(1.5)
    return replace(field, radiance=radiance, inverse_distance=nearness, own_diffuse=True)


def drawn(device: Any, field: LightField, look_up: str) -> Floats:
    scene = replace(plate_scene(field, GREY), irradiance=np.full((4, 4, 3), IRRADIANCE, np.float32))
    return Renderer(device, scene).image(replace(STATE, lookup=look_up)).reshape(-1, 3)


@pytest.mark.parametrize("blind", [0, 2])
def test_the_surface_is_what_its_points_see(device: Any, blind: int) -> None:
    """As numpy where a point sees it, near the known light; where none does, what the light map says."""
    field = field_with_plate(blind)
    if blind:
        field.inverse_distance[:40] *= np.float16(1.5)
    place, _, inside = mirrored(field, SIZE)
    expected, found = numpy_twin.surface(field, place)
    got = drawn(device, field, "light_field-surface")
    seen = found & inside
    error = np.abs(got - expected).max(axis=1)
    assert seen.sum() > 2000 and np.quantile(error[seen], 0.97) < 4e-3, np.quantile(error[seen], [0.5, 0.97, 1])
    off = np.abs(got - pattern(place.x)).max(axis=1)[seen]
    assert np.median(off) < 0.03
    if blind:
        unseen = ~found & inside
        assert unseen.sum() > 300
        np.testing.assert_allclose(np.median(got[unseen], axis=0), GREY.kd[0] * IRRADIANCE / np.pi, rtol=0.01)


def test_other_look_ups_show_the_light_map(device: Any) -> None:
    field = field_with_plate()
    inside = mirrored(field, SIZE)[2]
    got = drawn(device, field, "light_field")[inside]
    np.testing.assert_allclose(got, GREY.kd[0] * IRRADIANCE / np.pi, rtol=0.01)


def test_reflections_are_those_of_the_march(device: Any) -> None:
    field = field_with_plate()
    scene = Renderer(device, plate_scene(field))
    pictures = [
        scene.image(replace(STATE, show="specular", lookup=name)) for name in ("light_field-surface", "light_field")
    ]
    np.testing.assert_array_equal(*pictures)


def test_a_store_that_cannot_serve_is_a_line(tmp_path: Path) -> None:
    """No light field at all, or maps that show the object with its reflections."""
    from lambent.store.light_fields import read_light_field

    ball = put_ball(tmp_path / "ball.store", light_field(count=12, side=14))
    assert not read_light_field(ball, "ball").own_diffuse
    for folder, look_up, said in (
        (write_small_store(tmp_path / "small"), "light_field-bn", "no light field"),
        (ball.folder, "light_field-surface", "levels = 1"),
    ):
        with pytest.raises(UserError, match="--lookup") as fault:
            still(folder, tmp_path / "a.png", settings=Settings(8, 8, "lamps", lookup=look_up))
        assert said in str(fault.value) and "\n" not in str(fault.value)
