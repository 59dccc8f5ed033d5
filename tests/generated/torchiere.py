"""A living room lit by a torchiere, a bright disc in a bowl, and by a spot in a can: one .glb and a scene.toml.

    python -m tests.generated.torchiere FOLDER

Polished are the table's top, the torchiere's foot and a bowl on the table. The places are drawn from `seed`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import trimesh
from numpy.random import default_rng
from trimesh.creation import annulus, cylinder, icosphere, revolve

from tests.generated.lit_rooms import shell, spot
from tests.generated.rooms import adding_to, between, saved

TOML = """format = "lambent-scene"
version = 1
name = "torchiere"
geometry = "torchiere.glb"
exposure_ev100 = 5.5
crease_angle = 30.0

[materials]
walls = {{ kd = [0.8, 0.78, 0.74] }}
oak = {{ kd = [0.3, 0.19, 0.1], lobes = [{{ mx = 0.25, my = 0.25, r0 = 0.04 }}] }}
polish = {{ kd = [0.05, 0.02, 0.01], lobes = [{{ mx = {m}, my = {m}, r0 = 0.05 }}] }}
brass = {{ lobes = [{{ mx = 0.08, my = 0.08, r0 = [0.87, 0.7, 0.36] }}] }}
enamel = {{ kd = 0.7, lobes = [{{ mx = 0.15, my = 0.15, r0 = 0.04 }}] }}
cloth = {{ kd = [0.1, 0.14, 0.2] }}
panel = {{ kd = 0.5 }}

[assign]
"wall*" = "walls"
"floor*" = "oak"
"polish*" = "polish"
"brass*" = "brass"
"enamel*" = "enamel"
"cloth*" = "cloth"
"disc*" = "panel"

[objects."disc*"]
luminance = 30000.0
colour = [1.0, 0.82, 0.6]

[[cameras]]
name = "sofa"
position = [1.2, 1.25, 1.9]
target = [{x}, 0.6, {z}]
fov_y_deg = 55.0
"""
FLAT = trimesh.transformations.rotation_matrix(-np.pi / 2, (1, 0, 0))  # from an axis along z to one along y


def standing(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh.apply_transform(FLAT)
    return mesh


def written(folder: Path, seed: int = 1) -> Path:
    """Write the room into a folder; the path of its scene file."""
    rng = default_rng(seed)
    scene = trimesh.Scene()
    add = adding_to(scene)

    shell(add, 2.2, 2.6, 2.7)
    x, z, turn = rng.uniform(-0.4, 0.1), rng.uniform(-0.4, 0.1), rng.uniform(-30, 30)
    top = rng.uniform(0.4, 0.75)
    add(between((-0.8, top - 0.04, -0.4), (0.8, top, 0.4)), "polish_top", (x, 0, z), turn)
    for number, px in enumerate((-0.5, 0.5)):
        add(between((px - 0.03, 0, -0.3), (px + 0.03, top - 0.04, 0.3)), f"cloth_leg_{number}", (x, 0, z), turn)
    dish = [(0, 0), (0.06, 0.005), (0.11, 0.04), (0.14, 0.08), (0.13, 0.08), (0.1, 0.045), (0.05, 0.02), (0, 0.015)]
    add(standing(revolve(dish, sections=64)), "brass_dish", (x + 0.2, top + 0.001, z))
    add(icosphere(4, 0.07), "enamel_ball", (x - 0.25, top + 0.071, z + rng.uniform(-0.1, 0.1)))
    add(between((-0.5, 0, -0.45), (0.5, 0.42, 0.45)), "cloth_seat", (1.5, 0, -1.7), rng.uniform(-20, 20))
    lx, lz, high = x - rng.uniform(1.1, 1.3), z - rng.uniform(-0.1, 0.3), rng.uniform(1.2, 1.6)
    foot = [(0, 0), (0.16, 0), (0.16, 0.015), (0.13, 0.03), (0.05, 0.05), (0.02, 0.09), (0.0, 0.09)]
    add(standing(revolve(foot, sections=64)), "brass_foot", (lx, 0.001, lz))
    add(standing(cylinder(0.014, high - 0.18, sections=32)), "brass_pole", (lx, 0.08 + (high - 0.18) / 2, lz))
    bowl = [(0, 0), (0.1, 0.01), (0.18, 0.05), (0.22, 0.11), (0.215, 0.11), (0.175, 0.055), (0.1, 0.017), (0, 0.007)]
    add(standing(revolve(bowl, sections=64)), "enamel_bowl", (lx, high - 0.11, lz))
    add(standing(cylinder(0.09, 0.01, sections=48)), "disc", (lx, high - 0.05, lz))
    cx, cz = x + rng.uniform(0.1, 0.5), z + rng.uniform(-0.2, 0.3)
    add(standing(annulus(0.05, 0.055, 0.18, sections=48)), "enamel_can", (cx, 2.6, cz))
    light = spot((cx, 2.6, cz), (cx, 0, cz), 600.0, 40.0)
    roughness = round(float(rng.uniform(0.02, 0.12)), 3)
    toml = TOML.format(x=round(float(x), 3) - 0.3, z=round(float(z), 3) - 0.3, m=roughness)
    return saved(scene, "torchiere", folder, toml + light)


if __name__ == "__main__":
    written(Path(sys.argv[1]))
