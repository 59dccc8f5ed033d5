"""Newell's teapot on a wooden tray with metal handles, after figure 4.4 of Ben-Artzi 2007 ("Teatray").

Nothing else is there: a tray in the light of an interior. The lights, materials and cameras are in teatray.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.materials.document import Lobe, Material
from lambent.scenes.builtin.things import POLISHED_SCALE, at, painted, thing, wood
from lambent.scenes.geometry import fan, grid, merge, placed, smooth_curve, sphere, teapot_parts, tube, turn
from lambent.scenes.geometry.teapot import lid_seat
from lambent.scenes.scene import MaterialTextures, Mesh, SceneObject

HALF_X, HALF_Z, CORNER = 0.187, 0.13, 0.047  # of the tray's outline, metres
FLOOR = 0.012
# (offset from the outline, height) of the tray's side, from its foot up, over the rim and down to its floor
SIDE = ((-0.006, 0.0), (-0.002, 0.0008), (0.001, 0.004), (0.006, 0.018), (0.011, 0.036), (0.0112, 0.0405),
        (0.008, 0.043), (0.0045, 0.0405), (0.0015, 0.031), (-0.003, 0.019), (-0.009, 0.0135), (-0.016, FLOOR),
        (-0.022, FLOOR))  # fmt: skip
BOARDS_M = (0.56, 0.28)  # what one repetition of the grain covers, along and across
TEAPOT_LENGTH = 0.26


@cache
def objects() -> tuple[SceneObject, ...]:
    """The tray on y = 0, its long side along x, and the teapot in its middle."""
    things = [thing("tray", "wood", _tray())]
    for name, side in (("tray_handle_left", -1), ("tray_handle_right", 1)):
        things.append(thing(name, "nickel", _handle(side), light_map_scale=POLISHED_SCALE))
    return (*things, *at(_teapot(), (0.0, FLOOR, 0.0), turn("y", 30)))


@cache
def textured() -> dict[str, tuple[Material, MaterialTextures]]:
    """The wood with its grain."""
    varnish = Lobe(mx=0.13, my=0.13, r0=(0.045,) * 3, k=(0.9,) * 3, alpha=0.5)
    place = ((1 / BOARDS_M[0], 0.0, 0.5), (0.0, 1 / BOARDS_M[1], 0.5))
    return {"wood": painted("wood", wood(), varnish, uv_transform=place)}


def _teapot() -> list[SceneObject]:
    parts = teapot_parts(TEAPOT_LENGTH, 18)
    seat = lid_seat(TEAPOT_LENGTH)
    return [
        thing("teapot", "glaze", *(parts[name] for name in ("rim", "body", "lid", "bottom")), seat),
        thing("teapot_spout", "glaze", parts["spout"]),
        thing("teapot_handle", "nickel", parts["handle"], light_map_scale=POLISHED_SCALE),
        thing("teapot_knob", "nickel", parts["knob"], light_map_scale=POLISHED_SCALE),
    ]


def _outline(arc: int = 14) -> tuple[Floats, Floats]:
    """Points and outward normals (K, 2) in x, z of the tray's rounded outline, the first repeated at the end."""
    angle = (np.linspace(0, np.pi / 2, arc + 1) + np.arange(4)[:, None] * np.pi / 2).ravel()
    corner = np.repeat([(1, 1), (-1, 1), (-1, -1), (1, -1)], arc + 1, axis=0)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    points = corner * (HALF_X - CORNER, HALF_Z - CORNER) + CORNER * normals
    return np.concatenate([points, points[:1]]), np.concatenate([normals, normals[:1]])


def _tray() -> Mesh:
    """Tray with flat floor and a rounded side, its grain along x on the floor and round it on the side."""
    base, out = _outline()
    (offset, height), (d_offset, d_height) = (c.T for c in smooth_curve(np.array(SIDE), 4))

    def lift(xz: Floats, y: Floats) -> Floats:
        return np.stack(np.broadcast_arrays(xz[..., 0], y, xz[..., 1]), axis=-1)

    positions = lift(base + offset[:, None, None] * out, height[:, None])
    normals = lift(d_height[:, None, None] * out, -d_offset[:, None])
    along = lift(np.stack([-out[:, 1], out[:, 0]], axis=-1)[None].repeat(len(offset), 0), np.zeros((1, 1)))
    round_m = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(base, axis=0), axis=-1))])
    up_m = np.concatenate([[0], np.cumsum(np.hypot(np.diff(offset), np.diff(height)))])
    uv = np.stack(np.broadcast_arrays(round_m[None, :], up_m[:, None]), axis=-1)
    return merge([
        grid(positions, normals, along, uv),
        fan(positions[0, :-1], (0, -1, 0)),
        fan(positions[-1, :-1], (0, 1, 0)),
    ])  # fmt: skip


def _handle(side: int) -> Mesh:
    """Bow over the tray's short side, its feet in the rim, a ball on each."""
    bow = [(0.007, 0.03, 0.064), (0.009, 0.055, 0.065), (0.016, 0.084, 0.057), (0.021, 0.1, 0.032)]
    half = [(side * (HALF_X + x), y, z) for x, y, z in bow]
    points = [*half, (side * (HALF_X + 0.0225), 0.104, 0.0), *((x, y, -z) for x, y, z in reversed(half))]
    feet = [placed(sphere(0.0125, 32, 16), (side * (HALF_X + 0.008), 0.0435, z)) for z in (-0.0645, 0.0645)]
    return merge([tube(points, 0.0094, 24, 8), *feet])
