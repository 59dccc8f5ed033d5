"""Panes and lenses that refract what a light field sees behind them, in a room whose light is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_EXIT, Glass, LightField
from lambent.baked.light_fields.lookup import March, Place, marched
from lambent.baked.light_fields.thin_glass import exits_beside, mirrored_back, sideways, through_glass
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.octahedral import texel_directions
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Lobe, Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.renderer import Renderer
from tests.realtime.lit_ball import HALF
from tests.realtime.lit_plate import CAMERA, GRID, mirrored, plate_field, plate_scene
from tests.realtime.lit_wall import cube_of, smooth_light

SIZE = 96
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular", integrator="rings")
CLEAR = Material(
    name="clear", lobes=(Lobe(side="transmission", mx=0.001, my=0.001, k=(1, 0.9, 0.8), r0=0.04, alpha=0.5),)
)
ETA, TINT = 1.5, (0.96, 0.9 * 0.96, 0.8 * 0.96)
DEPTH = 0.06


def pane(tilt_deg: float = 0.0) -> Glass:
    """With a second face that is tilted, of a prism."""
    tilt = np.radians(tilt_deg)
    exits = np.broadcast_to(np.array([0, -np.cos(tilt), -np.sin(tilt), DEPTH], np.float16), (*GRID, 4))
    return Glass(exits.copy(), ETA, TINT, 0.0)


def lens() -> Glass:
    """Normals that lean outwards, as of a face that is curved, and a share of light for what lies beyond."""
    column, row = np.meshgrid((np.arange(GRID[1]) + 0.5) / GRID[1] - 0.5, (np.arange(GRID[0]) + 0.5) / GRID[0] - 0.5)
    normal = np.stack([column, np.full(GRID, -1.0), -row], axis=-1)
    normal *= 0.9 / np.linalg.norm(normal, axis=-1, keepdims=True)
    return Glass(np.concatenate([normal, np.full((*GRID, 1), DEPTH)], axis=-1).astype(np.float16), ETA, TINT, 0.0)


def with_opacity(field: LightField, glass: Glass, w: np.ndarray, place: Place, uv2: np.ndarray) -> tuple[Any, ...]:
    """Places behind the glass, directions there, and shares (k, 3) of light that faces let pass, and mirror back."""
    exits = between(glass.exits.astype(float), uv2)
    step = sideways(through_glass(w, place.n, exits, glass.eta)[0], place.n)
    beside = between(glass.exits.astype(float), uv2 + step[:, [0, 2]] * [1, -1])
    exits = exits_beside(exits, beside, step, place.n)
    offset, leaving, cosine, share = through_glass(w, place.n, exits, glass.eta)
    first = np.array(CLEAR.lobes[0].k) * 0.96 * under_fresnel(-np.sum(w * place.n, axis=1))[:, None]
    second = share[:, None] * np.array(glass.tint) * under_fresnel(cosine)[:, None]
    back = mirrored_back(cosine, share, glass.eta, glass.tint)[:, None] * np.array(glass.tint)
    return place.x + offset, leaving, first * np.where(exits[:, 3:] < 0, 1, second), first * back


def between(texels: np.ndarray, uv2: np.ndarray) -> np.ndarray:
    at = uv2 * [GRID[1], GRID[0]] - 0.5
    low = np.floor(at).astype(int)
    share = at - low
    total = np.zeros((len(uv2), 4))
    for i in (0, 1):
        for j in (0, 1):
            row, column = (low[:, 1] + i).clip(0, GRID[0] - 1), (low[:, 0] + j).clip(0, GRID[1] - 1)
            total += (np.abs(1 - j - share[:, 0]) * np.abs(1 - i - share[:, 1]))[:, None] * texels[row, column]
    return total


@pytest.fixture(scope="module")
def field() -> LightField:
    """What is below the plate is striped."""
    plain, w = plate_field(8, 158), texel_directions(158)
    points = plain.points[:, None, None].astype(float)
    return replace(plain, radiance=room_light(points, w).astype(np.float16))


def views(field: LightField) -> tuple[Place, np.ndarray, np.ndarray, np.ndarray]:
    """Places, the rays that go on through them, which are well on the plate, and their uv2."""
    place, mirror, inside = mirrored(field, SIZE)
    uv2 = np.stack([place.x[:, 0] + 0.5, 0.5 - place.x[:, 2]], axis=-1)
    return place, mirror * [1, -1, 1], inside, uv2


@pytest.mark.long
def test_a_prism_shows_the_room_behind_it(device: Any, field: LightField) -> None:
    """By Snell's law and both faces' transmittance, from the room's own light; without glass it is elsewhere."""
    place, w, inside, uv2 = views(field)
    x, leaving, passed, back = with_opacity(field, pane(25), w, place, uv2)
    mirror = back * room_light(place.x, w * [1, -1, 1])
    truth = passed * room_light(x, leaving) + mirror
    image = Renderer(device, plate_scene(replace(field, glass=pane(25)), CLEAR)).image(STATE).reshape(-1, 3)
    error = np.abs(image - truth)[inside]
    straight = np.abs(passed * room_light(place.x, w) + mirror - truth)[inside]
    assert error.mean() < 0.15 * straight.mean() and error.mean() < 0.02, (error.mean(), straight.mean())


def room_light(x: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Light (..., 3) of the walls along w from x, by hand: stripes along all axes."""
    t = ((np.sign(w) * HALF - x) / np.where(w == 0, 1e-30, w)).min(axis=-1)
    return np.asarray(1.5 + np.sin(12 * (x + t[..., None] * w)))


@pytest.mark.long
def test_shader_and_numpy_agree(device: Any, field: LightField) -> None:
    glass = lens()
    place, w, inside, uv2 = views(field)
    x, leaving, passed, back = with_opacity(field, glass, w, place, uv2)
    up = w * [1, -1, 1]
    beyond, sky = Place(x, place.n, place.points), cube_of(smooth_light)
    light = marched(field, beyond, leaving, March(), lambda w: sample(sky, w)).radiance
    mirror = marched(field, place, up, March(), lambda w: sample(sky, w)).radiance
    scene = plate_scene(replace(field, glass=glass), CLEAR)
    got = Renderer(device, scene).image(STATE).reshape(-1, 3)
    error = np.abs(got - passed * light - back * mirror)[inside].max(axis=1)
    assert inside.sum() > 2000
    assert np.quantile(error, 0.5) < 4e-3 and np.quantile(error, 0.97) < 0.04, np.quantile(error, [0.5, 0.9, 0.97])


@pytest.mark.long
def test_a_sheet_lets_light_pass_straight(device: Any, field: LightField) -> None:
    """It has no second face to refract at."""
    sheet = pane()
    sheet.exits[..., 3] = NO_EXIT
    place, w, inside, _ = views(field)
    share = np.array(CLEAR.lobes[0].k) * 0.96 * under_fresnel(-np.sum(w * place.n, axis=1))[:, None]
    light = marched(field, place, w, March(), lambda w: sample(cube_of(smooth_light), w)).radiance
    got = Renderer(device, plate_scene(replace(field, glass=sheet), CLEAR)).image(STATE).reshape(-1, 3)
    error = np.abs(got - share * light)[inside].max(axis=1)
    assert np.quantile(error, 0.5) < 4e-3 and np.quantile(error, 0.97) < 0.04, np.quantile(error, [0.5, 0.9, 0.97])
