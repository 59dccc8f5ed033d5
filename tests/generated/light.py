"""Unseen light: leaks, lamps in odd places, almost and wholly dark rooms, the sun where it should not be."""

from __future__ import annotations

from pathlib import Path

from numpy.random import default_rng
from trimesh.creation import annulus, cylinder, icosphere

from tests.generated.lit_rooms import luminaire, photometry, point, shell, spot
from tests.generated.rooms import between
from tests.generated.torchiere import standing
from tests.generated.written import Look, Room, lamp, panel

SUNSKY = '\n[environment]\nkind = "sunsky"\nsun_direction = {}\nturbidity = 3.0\n'


def _beside(folder: Path, name: str, wall_m: float) -> Path:
    """A dark room, with the camera, beside one with 10,000 lm; between them a wall of some thickness."""
    room = Room(Look(name, eye=(-0.4, 1.5, 1.8), target=(-1.2, 0.9, -1.2), more=point((1.2, 2.0, 0), 10000.0)
                     + point((-1.2, 2.3, -0.6), 2.0)))  # fmt: skip
    shell(room.add, 2.0, 2.2, 2.6)
    room.add(between((-wall_m / 2, 0, -2.2), (wall_m / 2, 2.6, 2.2)), "wall_middle")
    room.add(between((-0.2, 0, -0.2), (0.2, 0.7, 0.2)), "red_box", (-1.2, 0, -1.0), 20)
    room.add(icosphere(4, 0.2), "steel_ball", (-0.6, 0.201, -1.2))
    return room.written(folder)


def leak_1mm(folder: Path) -> Path:
    """Light of a bright room must not pass a wall of 1 mm."""
    return _beside(folder, "leak_1mm", 0.001)


def leak_0mm(folder: Path) -> Path:
    """Nor a wall without thickness."""
    return _beside(folder, "leak_0mm", 0.0)


def keyhole(folder: Path) -> Path:
    """Two rooms joined by a hole of 6 cm; the lamp is in the other one."""
    room = Room(Look("keyhole", eye=(-0.5, 1.5, 1.8), target=(-1.6, 0.9, -0.6), more=point((1.0, 1.6, 0.2), 30000.0)))
    shell(room.add, 2.0, 2.2, 2.6)
    hole = 0.03
    room.add(between((-0.05, 0, -2.2), (0.05, 2.6, -hole)), "wall_a")
    room.add(between((-0.05, 0, hole), (0.05, 2.6, 2.2)), "wall_b")
    room.add(between((-0.05, 0, -hole), (0.05, 1.2, hole)), "wall_c")
    room.add(between((-0.05, 1.2 + 2 * hole, -hole), (0.05, 2.6, hole)), "wall_d")
    room.add(between((-0.2, 0, -0.2), (0.2, 0.7, 0.2)), "red_box", (-1.2, 0, -0.3), 20)
    return room.written(folder)


def shaded_lamp(folder: Path) -> Path:
    """A bulb within a shade that is open above and below, its neck passing through the bulb."""
    room = Room(Look("shaded_lamp", more=lamp(60000.0))).furnish()
    room.add(icosphere(3, 0.04), "lamp", (0.4, 1.25, -1.2))
    room.add(standing(annulus(0.14, 0.145, 0.22, sections=48)), "red_shade", (0.4, 1.27, -1.2))
    room.add(standing(cylinder(0.01, 1.26, sections=24)), "steel_neck", (0.4, 0.63, -1.2))
    return room.written(folder)


def ceiling_lamp(folder: Path) -> Path:
    """A lamp whose top lies in the ceiling, and one that is a hole of it."""
    room = Room(Look("ceiling_lamp", more=lamp())).furnish()
    room.add(between((-0.3, 2.55, -0.3), (0.3, 2.6, 0.3)), "lamp_box", (-0.6, 0, -0.4))
    room.add(between((-0.2, 2.6, -0.2), (0.2, 2.6, 0.2)), "lamp_flat", (0.9, 0, 0.6))
    return room.written(folder)


def only_emissive(folder: Path) -> Path:
    """Everything shines, as in a scene of light maps baked elsewhere."""
    room = Room(Look("only_emissive", more=lamp(200.0, "*"))).furnish()
    return room.written(folder)


def no_light(folder: Path) -> Path:
    """A closed room without a lamp, in daylight that does not get in."""
    return Room(Look("no_light")).furnish().written(folder)


def candle(folder: Path) -> Path:
    """One flame of 12 lm by night."""
    room = Room(Look("candle", more='\n[objects."lamp*"]\nlumens = 12.0\ncolour = [1.0, 0.6, 0.25]\n')).furnish()
    room.add(icosphere(2, 0.008), "lamp_flame", (0.1, 0.96, -0.5))
    room.add(standing(cylinder(0.012, 0.2, sections=24)), "wood_candle", (0.1, 0.842, -0.5))
    return room.written(folder)


def _outdoors(folder: Path, name: str, environment: str) -> Path:
    room = Room(Look(name, eye=(4.0, 1.7, 5.0), target=(0, 0.8, 0), more=environment))
    room.add(between((-8, -0.1, -8), (8, 0, 8)), "floor")
    room.add(between((-1.5, 0, -0.15), (1.5, 2.2, 0.15)), "wall", (0, 0, -1.5))
    room.add(between((-0.5, 0, -0.5), (0.5, 1, 0.5)), "red_box", (-0.8, 0, 0.4), 25)
    room.add(icosphere(4, 0.4), "steel_ball", (0.9, 0.401, 0.3))
    return room.written(folder)


def horizon_sun(folder: Path) -> Path:
    """The sun on the horizon."""
    return _outdoors(folder, "horizon_sun", SUNSKY.format([0.8, 0.0, 0.6]))


def low_sun(folder: Path) -> Path:
    """The sun one degree above it."""
    return _outdoors(folder, "low_sun", SUNSKY.format([0.8, 0.0175, 0.6]))


def sun_below(folder: Path) -> Path:
    """The sun below it, which no model of daylight covers."""
    return _outdoors(folder, "sun_below", SUNSKY.format([0.8, -0.1, 0.6]))


def overcast(folder: Path) -> Path:
    """The same light from everywhere."""
    return _outdoors(folder, "overcast", '\n[environment]\nkind = "constant"\nradiance = [8.0, 8.2, 8.6]\n')


def sixty(folder: Path) -> Path:
    """A hall with 60 luminaires of an IES file, of which walls between desks hide some."""
    rng = default_rng(5)
    places = [(-8.5 + 1.9 * (n % 10), 3.4, -5.5 + 2.2 * (n // 10)) for n in range(60)]
    lights = "".join(luminaire("bat", at, 90.0 * int(rng.integers(2)), 2000.0) for at in places)
    room = Room(Look("sixty", eye=(8.4, 1.7, 5.6), target=(-1.5, 0.9, -1.5), more=lights))
    shell(room.add, 9.5, 6.6, 3.6)
    for number in range(16):
        at = (-7 + 4.5 * (number % 4) + rng.uniform(-0.4, 0.4), 0, -4.5 + 3 * (number // 4))
        room.add(between((-0.8, 0.7, -0.4), (0.8, 0.74, 0.4)), f"wood_{number}", at, rng.uniform(0, 90))
        room.add(between((-0.02, 0, -1), (0.02, 1.6, 1)), f"wall_screen_{number}", (at[0] + 1.2, 0, at[2]))
    return room.written(folder, {"bat.ies": photometry("bat")})


def narrow_spot(folder: Path) -> Path:
    """A spot of 1 degree, and nothing else."""
    return Room(Look("narrow_spot", more=spot((1.5, 2.4, 1.8), (1.1, 0.6, -1.2), 300.0, 1.0))).furnish().written(folder)


def lit(name: str, more: str = "", **look: object) -> Room:
    """The furnished room under a panel."""
    room = Room(Look(name, more=lamp() + more, **look)).furnish()  # type: ignore[arg-type]
    panel(room.add)
    return room
