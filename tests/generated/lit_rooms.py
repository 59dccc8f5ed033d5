"""Five rooms under 1 to 60 luminaires, that no choice of the renderer was made on: one .glb and a scene.toml each.

    python -m tests.generated.lit_rooms warehouse FOLDER

`foyer` has one wall washer, `stair` lamps at points behind slats, `office` louvres under 16 luminaires, `shop` 24
spots, `warehouse` racks of 4 m under 60 high bays. Their placing is drawn from `seed`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh
from numpy.random import Generator, default_rng
from trimesh.creation import cylinder, icosphere

from tests.generated.rooms import Add, Vector, adding_to, between, saved

HEAD = """format = "lambent-scene"
version = 1
name = "{name}"
geometry = "{name}.glb"
crease_angle = 30.0

[materials]
walls = {{ kd = [0.74, 0.73, 0.7] }}
stone = {{ kd = [0.3, 0.29, 0.28], lobes = [{{ mx = 0.12, my = 0.12, r0 = 0.045 }}] }}
wood = {{ kd = [0.4, 0.25, 0.12], lobes = [{{ mx = 0.2, my = 0.2, r0 = 0.04 }}] }}
steel = {{ lobes = [{{ mx = 0.18, my = 0.18, r0 = [0.6, 0.61, 0.62], k = 0.9 }}] }}
cards = {{ kd = [0.45, 0.33, 0.2] }}
glaze = {{ kd = [0.05, 0.2, 0.3], lobes = [{{ mx = 0.07, my = 0.07, r0 = 0.05 }}] }}

[assign]
"wall*" = "walls"
"floor*" = "stone"
"wood*" = "wood"
"steel*" = "steel"
"card*" = "cards"
"glaze*" = "glaze"

[[cameras]]
name = "view"
position = {eye}
target = {target}
fov_y_deg = 58.0
"""


def photometry(name: str) -> str:
    """LM-63 text of a luminaire: `washer` shines to one side, `bay` narrowly down, `bat` mostly to the sides."""
    theta = np.arange(0, 91, 5.0)
    cosine = np.cos(np.radians(theta)).clip(0)
    tables = {
        "washer": [cosine * (1 + 4 * np.exp(-(((theta - 35) / 14) ** 2)) * max(np.cos(np.radians(phi)), 0) ** 2)
                   for phi in np.arange(0, 181, 15.0)],
        "bay": [cosine**6],
        "bat": [cosine * (1 + 1.5 * np.exp(-(((theta - 40) / 15) ** 2))) * (1 + 0.3 * np.cos(np.radians(2 * phi)))
                for phi in np.arange(0, 91, 15.0)],
    }  # fmt: skip
    rows = 1000 * np.array(tables[name])
    phi = np.linspace(0, {"washer": 180, "bay": 0, "bat": 90}[name], len(rows))
    numbers = "\n".join(" ".join(f"{value:.1f}" for value in row) for row in (theta, phi, *rows))
    opening_m = {"washer": "0.1 0.3 0", "bay": "-0.35 -0.35 0", "bat": "0.2 1.2 0"}[name]  # a disc and two rectangles
    head = f"1 -1 1 {len(theta)} {len(phi)} 1 2 {opening_m}\n1 1 40\n"
    return f"IESNA:LM-63-2002\n[TEST] generated\nTILT=NONE\n{head}{numbers}\n"


def luminaire(file: str, at: Vector, turn_deg: float = 0.0, lumens: float = 3000.0) -> str:
    place = [round(float(x), 3) for x in at]
    return (
        f'\n[[lights]]\nkind = "ies"\nfile = "{file}.ies"\nposition = {place}\nrotation_deg = {turn_deg}\n'
        f'lumens = {lumens}\nname = "{file}"\n'
    )


def spot(at: Vector, target: Vector, lumens: float, outer_deg: float) -> str:
    aim = np.subtract(target, at)
    place, aim = ([round(float(x), 4) for x in v] for v in (at, aim / np.linalg.norm(aim)))
    return (
        f'\n[[lights]]\nkind = "spot"\nposition = {place}\ndirection = {aim}\nlumens = {lumens}\n'
        f'outer_deg = {outer_deg}\ninner_deg = {outer_deg / 2}\nname = "track"\n'
    )


def point(at: Vector, lumens: float) -> str:
    place = [round(float(x), 3) for x in at]
    return f'\n[[lights]]\nkind = "point"\nposition = {place}\nlumens = {lumens}\nname = "bulb"\n'


def shell(add: Add, x: float, z: float, high: float) -> None:
    """Floor, ceiling and walls of a room of 2x by 2z."""
    t = 0.2
    add(between((-x, -t, -z), (x, 0, z)), "floor")
    add(between((-x, high, -z), (x, high + t, z)), "wall_ceiling")
    add(between((-x - t, -t, -z), (-x, high, z)), "wall_left")
    add(between((x, -t, -z), (x + t, high, z)), "wall_right")
    add(between((-x, -t, -z - t), (x, high, -z)), "wall_back")
    add(between((-x, -t, z), (x, high, z + t)), "wall_front")


def foyer(add: Add, rng: Generator) -> str:
    shell(add, 2.5, 3.0, 3.0)
    for number in range(5):
        ball = icosphere(4, rng.uniform(0.12, 0.3))
        kind = ("steel", "glaze", "card")[number % 3]
        add(ball, f"{kind}_{number}", (rng.uniform(-1.8, 1.8), -ball.bounds[0, 1], rng.uniform(-2.2, 0.5)))
    add(between((-0.6, 0, -2.6), (0.6, 0.9, -2.1)), "wood_desk")
    return luminaire("washer", (-1.9, 2.9, -0.5), 180.0, 5000.0)


def stair(add: Add, rng: Generator) -> str:
    shell(add, 2.2, 3.2, 4.2)
    for step in range(12):
        low = 0.17 * step
        add(between((-2.2, low, 2.2 - 0.3 * step), (-0.8, low + 0.17, 2.5 - 0.3 * step)), f"wood_step_{step}")
    for number in range(22):
        at = 2.3 - 0.2 * number
        add(between((-0.76, 0, at), (-0.72, 3.4, at + 0.05)), f"wood_slat_{number}")
    add(cylinder(0.25, 1.1, sections=64), "glaze_column", (1.2, 0.55, -1.5), 90, (1, 0, 0))
    lamps = [(rng.uniform(0.2, 1.8), rng.uniform(2.2, 3.6), at) for at in (-2.4, 0.0, 2.1)]
    return "".join(point(at, 700.0) for at in lamps)


def office(add: Add, rng: Generator) -> str:
    shell(add, 4.8, 4.8, 3.4)
    for number in range(33):
        at = -4.65 + 0.29 * number
        add(between((at - 0.01, 2.8, -4.8), (at + 0.01, 2.95, 4.8)), f"wall_louvre_{number}")
    for number in range(6):
        x, z = -3.0 + 3.0 * (number % 3), -2.6 + 3.4 * (number // 3)
        add(between((-0.8, 0.7, -0.4), (0.8, 0.74, 0.4)), f"wood_top_{number}", (x, 0, z), rng.uniform(-12, 12))
        add(between((-0.3, 0, -0.25), (0.3, 0.7, 0.25)), f"steel_box_{number}", (x, 0, z))
        add(between((-0.3, 0.9, -0.02), (0.3, 1.25, 0.02)), f"glaze_screen_{number}", (x, 0, z - 0.2))
    places = [(-3.6 + 2.4 * i, 3.25, -3.6 + 2.4 * k) for i in range(4) for k in range(4)]
    return "".join(luminaire("bat", at, 90.0 * int(rng.integers(2))) for at in places)


def shop(add: Add, rng: Generator) -> str:
    shell(add, 4.0, 4.0, 3.2)
    lights = []
    for number in range(24):
        x, z = rng.uniform(-3.4, 3.4), rng.uniform(-3.6, 2.0)
        tall = rng.uniform(0.3, 1.5)
        kind = ("card", "glaze", "steel", "wood")[number % 4]
        add(between((-0.18, 0, -0.18), (0.18, tall, 0.18)), f"{kind}_{number}", (x, 0, z), rng.uniform(0, 90))
        at = (x + rng.uniform(-1, 1), 3.0, z + rng.uniform(-1, 1))
        lights.append(spot(at, (x, tall, z), rng.uniform(300, 900), rng.uniform(12, 30)))
    return "".join(lights)


def warehouse(add: Add, rng: Generator) -> str:
    shell(add, 12.0, 15.0, 8.0)
    for row in range(4):
        x = -8.4 + 5.6 * row
        for number in range(9):
            at = -13.5 + 3.0 * number
            add(between((x - 0.55, 0, at - 0.05), (x + 0.55, 4.0, at + 0.05)), f"steel_frame_{row}_{number}")
            if number == 8:
                continue
            for level in range(3):
                low = 0.15 + 1.35 * level
                add(between((x - 0.5, low, at + 0.1), (x + 0.5, low + 0.05, at + 2.9)), f"wood_{row}_{number}_{level}")
                if rng.random() < 0.7:
                    tall, wide = rng.uniform(0.4, 1.0), rng.uniform(0.6, 2.6)
                    add(between((x - 0.45, low + 0.051, at + 0.2), (x + 0.45, low + tall, at + 0.2 + wide)),
                        f"card_{row}_{number}_{level}")  # fmt: skip
    places = [(-11.2 + 5.6 * i, 7.6, -13.2 + 2.4 * k) for i in range(5) for k in range(12)]
    return "".join(luminaire("bay", at, 0.0, 9000.0) for at in places)


Fill = Callable[[Add, Generator], str]
LIT_ROOMS: dict[str, tuple[Fill, Vector, Vector, tuple[str, ...]]] = {
    "foyer": (foyer, (1.9, 1.6, 2.7), (-0.9, 1.1, -2.0), ("washer",)),
    "stair": (stair, (1.9, 1.7, 2.9), (-0.8, 1.0, -0.9), ()),
    "office": (office, (4.3, 1.6, 4.4), (-1.2, 0.9, -1.6), ("bat",)),
    "shop": (shop, (3.6, 1.7, 3.7), (-0.9, 0.7, -1.2), ()),
    "warehouse": (warehouse, (0.4, 1.7, 14.2), (-0.9, 1.6, 0.0), ("bay",)),
}


def written(name: str, folder: Path, seed: int = 1) -> Path:
    """Write a room, of `LIT_ROOMS`, into a folder; the path of its scene file."""
    fill, eye, target, files = LIT_ROOMS[name]
    scene = trimesh.Scene()
    lights = fill(adding_to(scene), default_rng(seed))
    head = HEAD.format(name=name, eye=list(eye), target=list(target))
    return saved(scene, name, folder, head + lights, {f"{file}.ies": photometry(file) for file in files})


if __name__ == "__main__":
    written(sys.argv[1], Path(sys.argv[2]))
