"""Another mesh in the volume of a light field, against a room whose light is known."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.probes.irradiance import IrradianceVolume
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.octahedral import texel_directions
from lambent.core.geometry.sequences import cosine_hemisphere, hammersley
from lambent.materials.document import Material
from lambent.realtime.frame_state import FrameState
from lambent.realtime.objects.replaced import with_replacements
from lambent.realtime.renderer import Renderer
from lambent.scenes.geometry import box, merge, placed, sphere, subdivided
from lambent.scenes.replacement import Replacement, fitted
from lambent.scenes.scene import Mesh
from tests.realtime.lit_ball import CAMERA, MIRROR, RADIUS, ball_scene, light_field, mirrored, seen

SIZE = 96
STATE = FrameState(CAMERA, SIZE, SIZE, n=1, antialias=False, show="specular")
MATTE = Material(name="matte", kd=(0.5, 0.5, 0.5))


def volume_field(count: int = 5, side: int = 94) -> LightField:
    """Maps at count^3 points in the box of the ball and around it, without the ball."""
    at = (np.arange(count) + 0.5) / count * 2.5 * RADIUS - 1.25 * RADIUS
    points = np.stack(np.meshgrid(at, at, at), axis=-1).reshape(-1, 3)
    radiance, distance = seen(points[:, None, None], texel_directions(side), ball=False)
    nothing = np.full((2, 2, 4), NO_POINT, np.uint16)
    return LightField(
        points.astype(np.float32), normalize(points).astype(np.float32), radiance.astype(np.float16),
        (1 / distance).astype(np.float16), nothing, (0, 0), (2, 2), 0.1, volume=True,
    )  # fmt: skip


@pytest.fixture(scope="module")
def field() -> LightField:
    return volume_field()


def irradiance(x: np.ndarray, n: np.ndarray) -> np.ndarray:
    """(k, 3) at places and normals (k, 3), by 4096 cosine distributed rays."""
    t = normalize(np.cross(n, np.where(np.abs(n[:, :1]) < 0.9, [1.0, 0, 0], [0, 1.0, 0])))
    frame = np.stack([t, np.cross(n, t), n], axis=1)
    w = np.einsum("sa,kac->ksc", cosine_hemisphere(hammersley(4096)), frame)
    return np.asarray(np.pi * seen(np.broadcast_to(x[:, None], w.shape), w, ball=False)[0].mean(axis=1))


@pytest.mark.long
def test_a_sphere_in_the_volume_mirrors_the_room(device: Any, field: LightField) -> None:
    """The bake's sphere, of other size and place in its file: as near to the truth as maps on its surface."""
    other = placed(sphere(7.0, 96, 48), (3.0, 1.0, -20.0))
    scene = with_replacements(ball_scene(field=field), [Replacement("ball", other)])
    image = Renderer(device, scene).image(STATE)
    on_surface = Renderer(device, ball_scene(field=light_field())).image(STATE)
    truth, ball = mirrored(SIZE, SIZE)
    inner = ball & np.roll(ball, 4, 0) & np.roll(ball, -4, 0) & np.roll(ball, 4, 1) & np.roll(ball, -4, 1)
    error, usual, plain = (
        float(np.sqrt(np.mean((found - truth)[inner] ** 2)))
        for found in (image, on_surface, Renderer(device, ball_scene()).image(STATE))
    )
    assert error < 1.5 * usual and error < 0.4 * plain, (error, usual, plain)


@pytest.mark.long
def test_the_mesh_gets_the_irradiance_of_the_room(device: Any, field: LightField) -> None:
    """Of a box with flat faces: its light map is what rays gather at its place."""
    cube = box((1.0, 1.0, 1.0))
    scene = with_replacements(replace(ball_scene(field=field)), [Replacement("ball", cube)])
    corners = scene.faces.reshape(-1)
    pick = np.random.default_rng(1).choice(corners, 60, replace=False)
    expected = irradiance(scene.positions[pick].astype(float), scene.normals[pick].astype(float))
    assert scene.irradiance is not None
    height, width = scene.irradiance.shape[:2]
    texel = (scene.uv2[pick] * [width, height]).astype(int)
    found = scene.irradiance[texel[:, 1], texel[:, 0]]
    assert np.abs(found / expected - 1).max() < 0.08 and np.abs(found / expected - 1).mean() < 0.03
    matte = replace(scene, record=scene.record.model_copy(update={"materials": {MIRROR.name: MATTE}}))
    image = Renderer(device, matte).image(replace(STATE, show="diffuse", lookup="plain"))
    lit = image[image.sum(axis=-1) > 0]
    low, high = 0.5 / np.pi * found.min(axis=0), 0.5 / np.pi * found.max(axis=0)
    assert len(lit) > 500 and (lit > 0.8 * low).all() and (lit < 1.2 * high).all()


def test_irradiance_between_points_is_continuous(field: LightField) -> None:
    lit = IrradianceVolume(field)
    x = np.linspace(-0.4, 0.4, 4001)[:, None] * np.array([1.0, 0.3, -0.7])
    light = lit.at(x, np.broadcast_to([0.0, 1.0, 0.0], x.shape))
    assert np.abs(np.diff(light, axis=0)).max() < 0.01 * light.max()
    few = replace(field, points=field.points[:1], radiance=field.radiance[:1])
    assert np.ptp(IrradianceVolume(few).at(x, np.broadcast_to([0.0, 1.0, 0.0], x.shape)), axis=0).max() < 1e-9


def test_a_mesh_stands_on_the_floor_of_its_box() -> None:
    low, high = np.array([1.0, 2.0, 3.0]), np.array([2.0, 2.5, 5.0])
    tall = fitted(placed(box((1.0, 4.0, 1.0)), (9.0, 9.0, 9.0)), low, high)
    np.testing.assert_allclose(tall.bounds, [[1.4375, 2.0, 3.9375], [1.5625, 2.5, 4.0625]], atol=1e-6)
    wide = fitted(box((8.0, 1.0, 1.0)), low, high)
    np.testing.assert_allclose(wide.bounds, [[1.0, 2.0, 3.9375], [2.0, 2.125, 4.0625]], atol=1e-6)
    flat = box((1.0, 1.0, 1.0))
    flat = Mesh(flat.positions * [1, 0, 1], flat.normals, flat.tangents, flat.uv, flat.faces)
    np.testing.assert_allclose(fitted(flat, low, high).bounds, [[1, 2, 3.5], [2, 2, 4.5]], atol=1e-6)


def test_subdivision_keeps_the_surface() -> None:
    mesh = merge([box((1.0, 2.0, 3.0)), sphere(1.0, 8, 4)])
    fine = subdivided(mesh, 0.5, 10**6)
    edges = np.linalg.norm(fine.corners - np.roll(fine.corners, 1, axis=1), axis=2)
    assert edges.max() <= 0.5 and len(subdivided(mesh, 0.01, 4 * len(mesh.faces)).faces) == 4 * len(mesh.faces)

    def area(one: Mesh) -> float:
        a, b, c = np.moveaxis(one.corners, 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)

    assert area(fine) == pytest.approx(area(mesh), rel=1e-6)
    np.testing.assert_allclose(fine.bounds, mesh.bounds)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"object": "bal"}, "unknown object.*did you mean 'ball'"),
        ({"material": "mirrow"}, "unknown material.*did you mean 'mirror'"),
        ({}, "no light field of a volume"),
    ],
)
def test_what_cannot_be_replaced_is_refused(change: dict[str, str], message: str) -> None:
    """The last: the light field is of points on the surface."""
    one = replace(Replacement("ball", box((1.0, 1.0, 1.0))), **change)
    with pytest.raises(UserError, match=f"--replace.*{message}"):
        with_replacements(ball_scene(field=light_field()), [one])
