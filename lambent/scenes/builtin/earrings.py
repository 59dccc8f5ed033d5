"""Two pearl earrings on a cloth that is draped over a pedestal, after figure 4.5 of Ben-Artzi 2007 ("Earrings").

The lights, materials and cameras are in earrings.toml.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.scenes.builtin.things import POLISHED_SCALE, at, thing
from lambent.scenes.geometry import cylinder, lathe, placed, smooth_curve, sphere, tube, turn
from lambent.scenes.geometry.drape import Drape
from lambent.scenes.scene import SceneObject

PEARL, WIRE, END = 0.007, 0.00074, 0.00095  # radii of pearls, wires and the balls at their ends, metres
GAP = 0.0004  # between pedestal and cloth
TOP = 0.07  # height of the cloth
CLOTH = Drape(flat_radius=0.0185, bend=0.004, crest_bend=0.007, flare_deg=15.0, folds=12)
CLOTH_RADIUS = 0.07
# The wire's middle line in its plane: along the post from the pearl's centre, and across it; millimetres.
HOOK_MM = ((6.6, 0.0), (9.0, 0.0), (11.5, 0.3), (15.0, 0.6), (18.2, 0.1), (20.7, -1.9), (21.2, -5.0), (19.4, -7.6),
           (16.2, -8.5), (13.0, -8.2), (10.4, -8.9))  # fmt: skip


@cache
def objects() -> tuple[SceneObject, ...]:
    """The pedestal stands on y = 0; its axis is that of y."""
    edge = CLOTH.bend - GAP
    pedestal = cylinder(CLOTH.flat_radius + edge, TOP - GAP, 96, edge)
    things = [
        thing("pedestal", "stone", pedestal, light_map_scale=POLISHED_SCALE),
        thing("cloth", "velvet", placed(CLOTH.mesh(CLOTH_RADIUS, 432, (6, 20, 28)), (0, TOP, 0))),
    ]
    for side, x, z, yaw_deg in (("left", -0.0094, -0.004, -98.0), ("right", 0.0066, -0.0088, -78.0)):
        things += at(_earring(side), (x, TOP + PEARL, z), turn("y", yaw_deg))
    return tuple(things)


def _earring(side: str) -> list[SceneObject]:
    """Pearl about the origin with its post along x, tilted until pearl and hook lie on y = -PEARL."""
    line = np.array(HOOK_MM) / 1000
    centres = smooth_curve(line, 10)[0]
    points = np.stack([line[:, 0], np.zeros(len(line)), line[:, 1]], axis=-1)
    tilt = _tilt(centres)
    cap = [(np.sin(a) * (PEARL + 0.00025), np.cos(a) * (PEARL + 0.00025)) for a in np.radians((0, 5, 10, 15))]
    foot = (cap[-1][0], PEARL * 0.95)  # within the pearl
    metal = [
        tube(points, WIRE, 20, 10),
        placed(lathe([[(0, foot[1]), foot], [foot, cap[-1]], cap[::-1]], 40, 4), rotation=turn("z", -90)),
        placed(sphere(0.0011, 32, 16), (0.0092, 0, 0)),
        placed(sphere(END, 20, 10), points[-1]),
    ]
    return [
        thing(f"pearl_{side}", "pearl", placed(sphere(PEARL, 96, 48), rotation=tilt)),
        thing(
            f"post_{side}", "silver", *(placed(mesh, rotation=tilt) for mesh in metal), light_map_scale=POLISHED_SCALE
        ),
    ]


def _tilt(centres: Floats) -> Floats:
    """Rotation (3, 3) about the pearl's centre that brings a wire in the plane y = 0 to rest on the cloth.

    centres (N, 2) are in x, z. For each direction, the wire sinks until its first point touches; the direction in which
    its centre sinks most is used.
    """
    turns = np.radians(np.arange(0, 360, 0.5))
    towards = np.stack([np.cos(turns), np.sin(turns)])
    reach = centres @ towards
    radius = np.full(len(centres), WIRE)
    radius[-1] = END
    sines = np.min((PEARL - radius)[:, None] / np.maximum(reach, 1e-9), axis=0)
    sunk = np.where(sines < 0.9, sines * reach.mean(axis=0), -np.inf)
    best = int(np.argmax(sunk))
    heading = turn("y", -np.degrees(turns[best]))
    return np.asarray(heading @ turn("z", -np.degrees(np.arcsin(sines[best]))) @ heading.T)
