"""A light field that is known by hand: points above a ball in a room, whose walls shine by where they are."""

from __future__ import annotations

import numpy as np

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.lookup import Place
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.octahedral import texel_directions

BALL, OFFSET = 0.2, 0.02  # radius of the ball about the origin, and how far off it the points are, metres
OWN = np.array([0.3, 0.2, 0.1])  # radiance of the ball
ROOM = np.array([1.0, 0.8, 1.3])  # half sizes


def wall_light(p: Floats) -> Floats:
    """Radiance (..., 3) of places (..., 3) on the walls: smooth, and different everywhere."""
    return np.asarray(1.5 + np.sin(2.5 * p + np.array([0.3, 1.1, 2.0])))


def sky_light(w: Floats) -> Floats:
    """Radiance (..., 3) of the sky, where there is one."""
    return np.asarray(3 + w)


def seen(x: Floats, w: Floats, *, open_roof: bool = False) -> tuple[Floats, Floats]:
    """Radiance (..., 3) and distance (...), infinite for the sky, along unit w (..., 3) from x (..., 3)."""
    with np.errstate(divide="ignore"):
        t = (np.where(w > 0, ROOM, -ROOM) - x) / np.where(w == 0, 1e-300, w)
    wall = t.min(axis=-1)
    p = x + wall[..., None] * w
    light = wall_light(p)
    if open_roof:
        up = p[..., 1] > ROOM[1] * (1 - 1e-9)
        wall, light = np.where(up, np.inf, wall), np.where(up[..., None], sky_light(w), light)
    along = np.sum(x * w, axis=-1)
    square = along**2 - np.sum(x * x, axis=-1) + BALL**2
    ball = -along - np.sqrt(np.maximum(square, 0))
    own = (square > 0) & (ball > 1e-9)
    return np.where(own[..., None], OWN, light), np.where(own, ball, wall)


def on_ball(count: int) -> Floats:
    """Unit directions (count, 3), evenly spread: Fibonacci's spiral."""
    z = 1 - (2 * np.arange(count) + 1) / count
    phi = np.arange(count) * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1)


def ball_field(count: int = 144, texels: int = 160, *, open_roof: bool = False) -> LightField:
    """The light field of the ball; its sample map is that of `uv2_of`."""
    n = on_ball(count)
    points = n * (BALL + OFFSET)
    light, distance = seen(points[:, None, None], texel_directions(texels), open_roof=open_roof)
    rows, columns = 48, 96
    v, u = np.meshgrid((np.arange(rows) + 0.5) / rows, (np.arange(columns) + 0.5) / columns, indexing="ij")
    normals = direction_of(np.stack([u, v], axis=-1))
    off = points - normals[..., None, :] * BALL
    above = np.sum(off * normals[..., None, :], axis=-1) > np.cos(np.radians(85)) * np.linalg.norm(off, axis=-1)
    far = np.where(above, np.linalg.norm(off, axis=-1), np.inf)
    order = far.argsort(axis=-1)[..., :4]
    nearest = np.where(np.isfinite(np.take_along_axis(far, order, axis=-1)), order, NO_POINT)
    return LightField(
        points=points.astype(np.float32), normals=n.astype(np.float32), radiance=light.astype(np.float32),
        inverse_distance=(1 / distance).astype(np.float16), sample_map=nearest.astype(np.uint16),
        corner=(0, 0), grid=(rows, columns), offset_m=OFFSET,
    )  # fmt: skip


def direction_of(uv2: Floats) -> Floats:
    """The place (..., 3) on the unit ball of its coordinates (..., 2)."""
    theta, phi = np.pi * uv2[..., 1], 2 * np.pi * uv2[..., 0]
    return np.stack([np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi)], axis=-1)


def places(field: LightField, count: int = 2000, seed: int = 3) -> tuple[Place, Floats]:
    """Random places on the ball, and mirrored directions (count, 3) of views from all sides."""
    rng = np.random.default_rng(seed)
    uv2 = rng.random((count, 2))
    n = direction_of(uv2)
    w = normalize(rng.normal(size=(count, 3)))
    w = np.where(np.sum(w * n, axis=-1, keepdims=True) > 0, w, -w)
    return Place.at(field, n * BALL, n, uv2), w


def errors(answer: Floats, place: Place, w: Floats, which: Flags | None = None, *, open_roof: bool = False) -> Floats:
    """Largest error over the channels (k,) of radiance along w."""
    start = place.x + 1e-7 * place.n
    found = np.abs(answer - seen(start, w, open_roof=open_roof)[0]).max(axis=-1)
    return found if which is None else found[which]
