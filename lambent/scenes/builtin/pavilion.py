"""A pavilion in a park: a polished teapot and cups on a table with a patterned cloth, under an open roof.

After the test scene of offset surface light fields (thesis R, figure 1.1): near and far surroundings, and the teapot
itself, show in the teapot. The lights, materials and cameras are in pavilion.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.materials.document import Lobe, Material
from lambent.scenes.builtin import furnishings
from lambent.scenes.builtin.things import at, block, painted, thing, wood
from lambent.scenes.geometry import cylinder, extrusion, fan, lathe, placed, sphere, teapot, tube, turn
from lambent.scenes.geometry.drape import Drape
from lambent.scenes.geometry.teapot import lid_seat
from lambent.scenes.scene import MaterialTextures, Mesh, SceneObject

SIDES = 8
POSTS, EAVES, RIDGE = (2.15, 2.3), (2.75, 2.3), (0.1, 3.3)  # distance from the axis and height, metres
DECK, LAWN = (2.55, 0.16), (14.0, -0.16)  # radius and thickness; radius and height
OPEN_BAYS = (0, 3)  # between these posts and the next there is no railing
TABLE_HIGH, GAP = 0.74, 0.002  # gap between table and cloth
CLOTH, CLOTH_RADIUS = Drape(flat_radius=0.56, bend=0.02, crest_bend=0.05, flare_deg=14.0, folds=13), 0.84
CHECK_M, BOARDS_M = 0.16, (2.4, 1.2)  # what one repetition of the patterns covers
TEAPOT_LENGTH = 0.3
Profiles = list[list[tuple[float, float]]]  # (radius, height), metres


@cache
def objects() -> tuple[SceneObject, ...]:
    """The deck's top is y = 0, the table in its middle."""
    return (*_building(), *_ground(), *_table(), *_tea())


@cache
def textured() -> dict[str, tuple[Material, MaterialTextures]]:
    """The boards of the deck and the pattern of the cloth."""
    boards = ((1 / BOARDS_M[0], 0.0, 0.0), (0.0, 1 / BOARDS_M[1], 0.0))
    checks = ((1 / CHECK_M, 0.0, 0.5), (0.0, 1 / CHECK_M, 0.5))
    varnish = Lobe(mx=0.16, my=0.16, r0=(0.04,) * 3, alpha=0.5)
    return {
        "deck": painted("deck", wood(), varnish, uv_transform=boards),
        "cloth": painted("cloth", _checks(), uv_transform=checks),
    }


def _checks() -> Floats:
    """Reflectance (256, 256, 3) of a cloth: woven checks in two blues, a red flower on every light square."""
    at_texel = (np.arange(256) + 0.5) / 256
    u, v = np.meshgrid(at_texel, at_texel)
    dark = (np.floor(2 * u) % 2 + np.floor(2 * v) % 2)[..., None] / 2  # 0 on light squares, 1 where bands cross
    colour = (1 - dark) * [0.78, 0.74, 0.64] + dark * [0.05, 0.13, 0.36]
    x, y = u - 0.25, v - 0.25
    radius, petal = np.hypot(x, y), np.cos(5 * np.arctan2(y, x))
    colour = np.where((radius < 0.085 + 0.035 * petal)[..., None], [0.62, 0.05, 0.05], colour)
    colour = np.where((radius < 0.034)[..., None], [0.8, 0.52, 0.06], colour)
    stitch = (np.abs(u - 0.75) < 0.012) | (np.abs(v - 0.75) < 0.012)
    weave = 1 + 0.07 * np.sin(2 * np.pi * 32 * u) * np.sin(2 * np.pi * 32 * v)
    return np.asarray(np.where(stitch[..., None], [0.74, 0.6, 0.2], colour) * weave[..., None])


def _around(k: float, radius: float, height: float) -> Triple:
    """A point at so many eighths of a turn."""
    phi = 2 * np.pi * (k + 0.5) / SIDES
    return (radius * float(np.cos(phi)), height, -radius * float(np.sin(phi)))


def _beam(start: ArrayLike, end: ArrayLike, wide: float, high: float) -> Mesh:
    """Square timber between two points, `wide` along the level, its edges rounded."""
    a, b = np.asarray(start, float), np.asarray(end, float)
    length, along = float(np.linalg.norm(b - a)), (b - a) / np.linalg.norm(b - a)
    level = np.cross([0.0, 1.0, 0.0], along) if abs(along[1]) < 0.999 else np.array([0.0, 0.0, 1.0])
    level = level / np.linalg.norm(level)
    frame = np.stack([along, np.cross(level, along), level], axis=-1)
    timber = block((0.0, -high / 2, -wide / 2), (length, high / 2, wide / 2), 0.006)
    return placed(timber, a, frame)


def _building() -> list[SceneObject]:
    """Deck, posts with braces, beams, an open roof of rafters and battens, and railings."""
    corners = [(DECK[0] * np.cos(a), DECK[0] * np.sin(a)) for a in (np.arange(SIDES) + 0.5) * 2 * np.pi / SIDES]
    deck = placed(extrusion(corners, DECK[1]), (0, -DECK[1], 0), turn("x", -90))
    radius, high = POSTS
    posts: list[Mesh] = []
    rafters: list[Mesh] = []
    rails: list[Mesh] = []
    for k in range(SIDES):
        foot, top, beside = _around(k, radius, -0.01), _around(k, radius, high), _around(k + 1, radius, high)
        posts.append(_beam(foot, top, 0.1, 0.1))
        posts.append(_beam(top, beside, 0.09, 0.14))
        for start, end in ((top, beside), (beside, top)):  # braces from the posts up to the beam
            towards = np.subtract(end, start) / np.linalg.norm(np.subtract(end, start))
            low, up = start + 0.02 * towards - (0, 0.45, 0), start + 0.43 * towards - (0, 0.04, 0)
            posts.append(_beam(low, up, 0.05, 0.06))
        for half in (0.0, 0.5):
            short = 1.0 if half == 0 else float(np.cos(np.pi / SIDES))  # those between the corners
            low, ridge = _around(k + half, EAVES[0] * short, EAVES[1]), _around(k + half, *RIDGE)
            rafters.append(_beam(low, ridge, 0.06, 0.1))
        for share in (0.25, 0.5, 0.75):
            r, y = (1 - share) * np.array(EAVES) + share * np.array(RIDGE)
            rafters.append(_beam(_around(k, r, y + 0.068), _around(k + 1, r, y + 0.068), 0.045, 0.04))
        if k not in OPEN_BAYS:
            rails += _railing(k, radius)
    return [
        thing("deck", "deck", deck),
        thing("posts", "timber", *posts),
        thing("roof", "timber_light", *rafters, placed(cylinder(0.14, 0.42, 24, 0.01), (0, RIDGE[1] - 0.24, 0))),
        thing("railings", "paint", *rails),
        *at(_lantern(RIDGE[1] - 0.3), (0.0, 2.08, 0.0)),
    ]


def _railing(k: int, radius: float) -> list[Mesh]:
    """Hand rail, foot rail and balusters between a post and the next."""
    rails = [
        _beam(_around(k, radius, y), _around(k + 1, radius, y), wide, 0.04) for y, wide in ((0.9, 0.07), (0.12, 0.05))
    ]
    ends = np.array(_around(k, radius, 0.0)), np.array(_around(k + 1, radius, 0.0))
    for share in np.linspace(0, 1, 13)[1:-1]:
        x, _, z = (1 - share) * ends[0] + share * ends[1]
        rails.append(_beam((x, 0.11, z), (x, 0.89, z), 0.026, 0.026))
    return rails


def _lantern(ceiling: float) -> list[SceneObject]:
    """A paper globe on a cord from the ridge, its centre the origin."""
    hang = ceiling - 2.08
    return [
        thing("lantern_globe", "lamp_glass", sphere(0.13, 40, 20)),
        thing("lantern_cord", "black_steel", tube([(0, 0.12, 0), (0, hang, 0)], 0.004, 8)),
    ]


def _ground() -> list[SceneObject]:
    """A lawn, and shrubs beside the pavilion."""
    phi = 2 * np.pi * np.arange(64) / 64
    rim = np.stack([LAWN[0] * np.cos(phi), np.full(64, LAWN[1]), LAWN[0] * np.sin(phi)], axis=-1)
    places = ((3.5, -2.2, 0.75), (2.5, -3.6, 0.6), (-3.6, -1.5, 0.8), (-3.4, 2.4, 0.65), (-0.9, -3.9, 0.7))
    shrubs = [placed(sphere(r, 32, 16), (x, LAWN[1] + 0.6 * r, z)) for x, z, r in places]
    return [
        thing("lawn", "grass", fan(rim, (0, 1, 0)), light_map_scale=0.3),
        thing("shrubs", "leaves", *shrubs, light_map_scale=0.2),
    ]


def _table() -> list[SceneObject]:
    """A round table under a cloth, and two chairs."""
    edge = CLOTH.bend - GAP
    top = placed(cylinder(CLOTH.flat_radius + edge, 0.05, 96, edge), (0, TABLE_HIGH - GAP - 0.05, 0))
    leg = [(0.26, 0.02), (0.2, 0.05), (0.05, 0.12), (0.045, 0.4), (0.07, TABLE_HIGH - 0.05)]
    foot = lathe([[(0, 0), (0.26, 0)], [(0.26, 0), (0.26, 0.02)], leg, [leg[-1], (0, TABLE_HIGH - 0.05)]], 40, 4)
    return [
        thing("table", "timber", top, foot),
        thing("cloth", "cloth", placed(CLOTH.mesh(CLOTH_RADIUS, 260, (6, 10, 14)), (0, TABLE_HIGH, 0))),
        *at(furnishings.chair("chair_1"), (-1.15, 0.0, -0.35), turn("y", 73)),
        *at(furnishings.chair("chair_2"), (0.55, 0.0, -1.1), turn("y", -27)),
    ]


def _tea() -> list[SceneObject]:
    """The teapot in the middle, three cups about it and a bowl of oranges."""
    pot = thing("teapot", "silver", teapot(TEAPOT_LENGTH, 16), lid_seat(TEAPOT_LENGTH), light_map_scale=4.0)
    on_cloth: list[SceneObject] = at([pot], (0, 0, 0), turn("y", 14))
    for name, x, z, yaw_deg in (("white", 0.02, 0.21, 40.0), ("blue", 0.28, -0.1, -35.0), ("red", -0.25, 0.13, 160.0)):
        on_cloth += at(_cup(name), (x, 0, z), turn("y", yaw_deg))
    on_cloth += at(furnishings.bowl(), (-0.06, 0, -0.33))
    return at(on_cloth, (0.0, TABLE_HIGH, 0.0))


def _cup(name: str) -> list[SceneObject]:
    """A cup of tea on its saucer, 95 mm and 150 mm wide."""
    saucer: Profiles = [[(0, 0), (0.042, 0)], [(0.042, 0.0), (0.045, 0.004), (0.062, 0.01), (0.075, 0.017)],
              [(0.075, 0.017), (0.0745, 0.0185), (0.0735, 0.018)],
              [(0.0735, 0.018), (0.06, 0.0125), (0.043, 0.0065), (0.0, 0.0055)]]  # fmt: skip
    cup: Profiles = [[(0, 0), (0.024, 0)],
           [(0.024, 0), (0.026, 0.006), (0.036, 0.022), (0.0445, 0.045), (0.0475, 0.062)],
           [(0.0475, 0.062), (0.0468, 0.0632), (0.046, 0.062)],
           [(0.046, 0.062), (0.043, 0.045), (0.034, 0.023), (0.022, 0.0085), (0.0, 0.0075)]]  # fmt: skip
    ear = [(0.0455, 0.054, 0), (0.063, 0.056, 0), (0.072, 0.043, 0), (0.063, 0.028, 0), (0.04, 0.024, 0)]
    china = [placed(lathe(cup, 64, 3), (0, 0.006, 0)), placed(tube(ear, 0.0035, 12, 6), (0, 0.006, 0))]
    tea = placed(cylinder(0.0427, 0.002, 48), (0, 0.0475, 0))
    return [
        thing(f"saucer_{name}", f"china_{name}", lathe(saucer, 64, 3)),
        thing(f"cup_{name}", f"china_{name}", *china),
        thing(f"tea_{name}", "tea", tea),
    ]
