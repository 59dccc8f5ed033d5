"""Two rooms that no choice of the renderer was made on, as a CAD program would write them: one .glb and a scene.toml.

    python -m tests.generated.rooms gallery FOLDER

`gallery` is lit at night by spots, a luminaire with an IES file and a strip; `workshop` has low sun through clerestory
windows and a few hundred small things. Their placing is drawn from `seed`.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import trimesh
from numpy.random import Generator, default_rng
from trimesh.creation import box, capsule, cylinder, icosphere, torus

IES = """IESNA:LM-63-2002
[TEST] generated
TILT=NONE
1 -1 1 7 1 1 2 0.1 0.1 0
1 1 18
0 10 20 30 40 60 90
0
2400 2200 1500 600 180 40 0
"""
GALLERY = """format = "lambent-scene"
version = 1
name = "gallery"
geometry = "gallery.glb"
exposure_ev100 = 6.5
crease_angle = 30.0

[materials]
walls = { kd = [0.78, 0.77, 0.74] }
concrete = { kd = [0.24, 0.24, 0.23], lobes = [{ mx = 0.11, my = 0.11, r0 = 0.045 }] }
bronze = { lobes = [{ mx = 0.17, my = 0.17, r0 = [0.71, 0.5, 0.29], k = 0.9 }] }
lacquer = { kd = [0.45, 0.025, 0.02], lobes = [{ mx = 0.03, my = 0.03, r0 = 0.05 }] }
satin = { lobes = [{ mx = 0.22, my = 0.22, r0 = [0.9, 0.9, 0.91], k = 0.85 }] }
cloth = { kd = [0.07, 0.11, 0.19] }
canvas = { kd = [0.5, 0.33, 0.12], lobes = [{ mx = 0.35, my = 0.35, r0 = 0.04 }] }
panel = { kd = 0.6 }

[assign]
"wall*" = "walls"
"floor*" = "concrete"
"bronze*" = "bronze"
"lacquer*" = "lacquer"
"satin*" = "satin"
"bench*" = "cloth"
"picture*" = "canvas"
"strip*" = "panel"
"plinth*" = "walls"

[objects."strip*"]
luminance = 3000.0
colour = [1.0, 0.85, 0.65]

[[cameras]]
name = "door"
position = [-3.6, 1.6, 4.9]
target = [0.8, 1.0, -1.2]
fov_y_deg = 52.0
"""
WORKSHOP = """format = "lambent-scene"
version = 1
name = "workshop"
geometry = "workshop.glb"
crease_angle = 30.0

[environment]
kind = "sunsky"
sun_direction = [0.62, 0.34, 0.71]
turbidity = 4.5

[materials]
brick = { kd = [0.42, 0.2, 0.13] }
screed = { kd = [0.3, 0.29, 0.27], lobes = [{ mx = 0.3, my = 0.3, r0 = 0.04 }] }
timber = { kd = [0.36, 0.22, 0.1], lobes = [{ mx = 0.16, my = 0.16, r0 = 0.04 }] }
steel = { lobes = [{ mx = 0.09, my = 0.09, r0 = [0.56, 0.57, 0.58], k = 0.95 }] }
chrome = { lobes = [{ mx = 0.025, my = 0.025, r0 = [0.55, 0.56, 0.56] }] }
zinc = { kd = [0.1, 0.1, 0.11], lobes = [{ mx = 0.28, my = 0.28, r0 = [0.6, 0.61, 0.63], k = 0.7 }] }
yellow = { kd = [0.62, 0.4, 0.02], lobes = [{ mx = 0.08, my = 0.08, r0 = 0.045 }] }
green = { kd = [0.03, 0.2, 0.1], lobes = [{ mx = 0.08, my = 0.08, r0 = 0.045 }] }
rubber = { kd = 0.03, lobes = [{ mx = 0.4, my = 0.4, r0 = 0.04 }] }

[assign]
"shell*" = "brick"
"floor*" = "screed"
"bench*" = "timber"
"plank*" = "timber"
"tool*" = "steel"
"lathe*" = "chrome"
"duct*" = "zinc"
"bin_a*" = "yellow"
"bin_b*" = "green"
"tyre*" = "rubber"

[[cameras]]
name = "corner"
position = [-2.7, 1.65, 2.6]
target = [0.9, 0.95, -1.3]
fov_y_deg = 58.0
"""
Add = Callable[..., None]
Vector = tuple[float, float, float]


def written(name: str, folder: Path, seed: int = 1) -> Path:
    """Write a room, of `ROOMS`, into a folder; the path of its scene file."""
    fill, toml = ROOMS[name]
    scene = trimesh.Scene()
    lights = fill(adding_to(scene), default_rng(seed))
    return saved(scene, name, folder, toml + lights, {"downlight.ies": IES})


def adding_to(scene: trimesh.Scene) -> Add:
    """A function that adds a mesh to a scene, by name, rotated and then moved."""

    def add(
        mesh: trimesh.Trimesh, name: str, at: Vector = (0, 0, 0), turn_deg: float = 0.0, about: Vector = (0, 1, 0)
    ) -> None:
        place = trimesh.transformations.rotation_matrix(np.radians(turn_deg), about)
        place[:3, 3] = at
        scene.add_geometry(mesh, node_name=name, geom_name=name, transform=place)

    return add


def saved(scene: trimesh.Scene, name: str, folder: Path, toml: str, files: Mapping[str, str] | None = None) -> Path:
    """Write a room as NAME.glb, scene.toml and text `files` by name; the path of the scene.toml."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.glb").write_bytes(trimesh.exchange.gltf.export_glb(scene, include_normals=True))
    for file, text in {**(files or {}), "scene.toml": toml}.items():
        (folder / file).write_text(text)
    return folder / "scene.toml"


def between(low: Vector, high: Vector) -> trimesh.Trimesh:
    """Box between two corners."""
    return box(bounds=np.array([low, high], float))


def gallery(add: Add, rng: Generator) -> str:
    """Long room with plinths and pictures; the text of its lights."""
    x, z, high, thick = 4.5, 6.0, 3.6, 0.2
    add(between((-x, -thick, -z), (x, 0, z)), "floor")
    add(between((-x, high, -z), (x, high + thick, z)), "wall_ceiling")
    for side in (-1, 1):
        add(between((min(side * x, side * (x + thick)), -thick, -z), (max(side * x, side * (x + thick)), high, z)),
            f"wall_x{side}")  # fmt: skip
        add(between((-x, -thick, min(side * z, side * (z + thick))), (x, high, max(side * z, side * (z + thick)))),
            f"wall_z{side}")  # fmt: skip
    add(between((-0.1, 0, -3.2), (0.1, 2.8, -0.4)), "wall_middle")
    spots = []
    for number, (px, pz) in enumerate(((-2.2, 1.2), (1.9, 1.5), (2.3, -2.6), (-1.8, -3.1), (0.6, 3.2))):
        tall = rng.uniform(0.7, 1.1)
        add(between((-0.28, 0, -0.28), (0.28, tall, 0.28)), f"plinth_{number}", (px, 0, pz), rng.uniform(-25, 25))
        kind = ("bronze", "lacquer", "satin")[number % 3]
        piece = (torus(0.22, 0.075, 96, 48), icosphere(4, 0.26), capsule(0.3, 0.14, [48, 48]))[int(rng.integers(3))]
        lean = rng.uniform(0, 90)
        piece.apply_transform(trimesh.transformations.rotation_matrix(np.radians(lean), (1, 0, 0)))
        add(piece, f"{kind}_{number}", (px, tall - piece.bounds[0, 1] + 0.001, pz), rng.uniform(0, 180))
        spots.append(_spot((px + 0.7, high - 0.15, pz + 0.9), (px, tall, pz), 900.0))
    for number in range(4):
        pz = -4.4 + 2.7 * number
        wide, tall = rng.uniform(0.8, 1.5), rng.uniform(0.8, 1.3)
        add(between((-0.025, -tall / 2, -wide / 2), (0.025, tall / 2, wide / 2)), f"picture_{number}",
            (x - 0.026, 1.55, pz))  # fmt: skip
        spots.append(_spot((x - 1.4, high - 0.15, pz), (x, 1.4, pz), 700.0))
    add(between((-0.35, 0.36, -0.9), (0.35, 0.45, 0.9)), "bench_seat", (-0.9, 0, 3.1), 14)
    for number, pz in enumerate((-0.7, 0.7)):
        add(between((-0.3, 0, -0.05), (0.3, 0.36, 0.05)), f"satin_leg_{number}", (-0.9, 0, 3.1 + pz), 14)
    add(between((-x + 0.05, high - 0.12, -5.0), (-x + 0.09, high - 0.08, 5.0)), "strip")
    ies = '\n[[lights]]\nkind = "ies"\nfile = "downlight.ies"\nposition = [-2.6, 3.4, -0.6]\nname = "downlight"\n'
    return "".join(spots) + ies


def _spot(position: Vector, target: Vector, lumens: float) -> str:
    direction = np.subtract(target, position)
    direction = direction / np.linalg.norm(direction)
    place, aim = ([round(float(v), 4) for v in vector] for vector in (position, direction))
    return (
        f'\n[[lights]]\nkind = "spot"\nposition = {place}\ndirection = {aim}\nlumens = {lumens}\n'
        f'outer_deg = 24.0\ninner_deg = 12.0\ncolour = [1.0, 0.88, 0.72]\nname = "track"\n'
    )


def workshop(add: Add, rng: Generator) -> str:
    """Brick room with benches, shelves and clutter; no lights but the sky."""
    x, z, high, thick = 3.4, 3.2, 3.3, 0.25
    add(between((-x, -thick, -z), (x, 0, z)), "floor")
    add(between((-x, high, -z), (x, high + thick, z)), "shell_roof")
    add(between((-x - thick, -thick, -z), (-x, high, z)), "shell_left")
    add(between((-x, -thick, -z - thick), (x, high, -z)), "shell_back")
    add(between((x, -thick, -z), (x + thick, 2.1, z)), "shell_right")
    add(between((x, 3.0, -z), (x + thick, high, z)), "shell_right_top")
    add(between((-x, -thick, z), (x, 1.9, z + thick)), "shell_front")
    add(between((-x, 2.9, z), (x, high, z + thick)), "shell_front_top")
    for number in range(5):
        at = -z + 2 * z * number / 4
        add(between((x, 2.1, -0.06), (x + thick, 3.0, 0.06)), f"shell_mullion_{number}", (0, 0, at))
    add(between((-1.1, 0.82, -0.4), (1.1, 0.88, 0.4)), "bench_top", (0.9, 0, -1.1), 8)
    for number, (px, pz) in enumerate(((-1, -0.3), (1, -0.3), (-1, 0.3), (1, 0.3))):
        add(between((-0.05, 0, -0.05), (0.05, 0.82, 0.05)), f"bench_leg_{number}", (0.9 + px, 0, -1.1 + pz), 8)
    for shelf in range(4):
        low = 0.35 + 0.55 * shelf
        add(between((-x + 0.01, low, -2.6), (-x + 0.42, low + 0.025, 0.6)), f"plank_{shelf}")
        for number in range(9):
            wide, tall = rng.uniform(0.12, 0.3), rng.uniform(0.1, 0.4)
            kind = ("bin_a", "bin_b", "tool_box")[int(rng.integers(3))]
            add(between((-0.14, 0, -wide / 2), (0.14, tall, wide / 2)), f"{kind}_{shelf}_{number}",
                (-x + 0.22, low + 0.026, -2.4 + 0.35 * number), rng.uniform(-8, 8))  # fmt: skip
    for number in range(70):
        long = rng.uniform(0.06, 0.3)
        piece = cylinder(rng.uniform(0.006, 0.02), long, sections=20) if number % 2 else box((long, 0.02, 0.03))
        piece.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2 * (number % 2), (1, 0, 0)))
        place = (0.9 + rng.uniform(-0.9, 0.9), 0.881 - piece.bounds[0, 1], -1.1 + rng.uniform(-0.2, 0.2))
        add(piece, f"tool_{number}", place, rng.uniform(0, 180))
    for number in range(4):
        tyre = torus(0.24, 0.09, 64, 32)
        tyre.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
        add(tyre, f"tyre_{number}", (-1.7 + 0.03 * number, 0.095 + 0.185 * number, -2.4))
    for number, radius in enumerate((0.11, 0.07, 0.16)):
        shaft = cylinder(radius, 0.9 - 0.2 * number, sections=72)
        add(shaft, f"lathe_{number}", (2.2, 1.05 + 0.34 * number, -2.3), 90)
    add(between((1.5, 0, -2.7), (2.9, 0.85, -1.9)), "bin_b_lathe")
    duct = cylinder(0.17, 2 * x - 0.2, sections=48)
    add(duct, "duct", (0, 2.75, -1.8), 90)
    return ""


ROOMS = {"gallery": (gallery, GALLERY), "workshop": (workshop, WORKSHOP)}

if __name__ == "__main__":
    written(sys.argv[1], Path(sys.argv[2]))
