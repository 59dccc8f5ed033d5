"""A closed room of 6 x 3 x 4 m as a scene.toml, for grids whose illuminance is known by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np

CORNERS = [(x, y, z) for y in (0, 3) for z in (2, -2) for x in (-3, 3)]
SIDES = {"floor": "1 2 4 3", "ceiling": "5 7 8 6", "front": "2 1 5 6", "back": "3 4 8 7", "left": "1 3 7 5",
         "right": "4 2 6 8"}  # fmt: skip
HEAD = """format = "lambent-scene"
version = 1
name = "hall"
geometry = "hall.obj"
environment = {{ kind = "constant", radiance = [0, 0, 0] }}
[assign]
"*" = "paint"
[materials]
paint = {{ kd = {kd} }}
"""
PLANE = """[[grids]]
name = "plane"
corner = [-2.5, 0.75, 1.5]
edges = [[5, 0, 0], [0, 0, -3]]
"""
VERTICAL_DEG, CANDELA = (0.0, 20.0, 40.0, 60.0, 90.0), (900.0, 700.0, 350.0, 80.0, 0.0)


def write_hall(folder: Path, text: str, kd: float = 0.0) -> Path:
    """The scene.toml of the hall, its OBJ and `lamp.ies`, a luminaire of CANDELA at VERTICAL_DEG from a point."""
    vertices = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    faces = [f"o {name}\nf {corners}" for name, corners in SIDES.items()]
    (folder / "hall.obj").write_text("\n".join([*vertices, *faces]) + "\n")
    numbers = [f"1 -1 1 {len(CANDELA)} 1 1 2 0 0 0", "1 1 0", " ".join(map(str, VERTICAL_DEG)), "0"]
    (folder / "lamp.ies").write_text(
        "\n".join(["IESNA:LM-63-2002", "TILT=NONE", *numbers, " ".join(map(str, CANDELA))])
    )
    path = folder / "scene.toml"
    path.write_text(HEAD.format(kd=kd) + text)
    return path


def lux_from(place: tuple[float, float, float], points: np.ndarray, normal: np.ndarray, candela: object) -> np.ndarray:
    """Lx (n,) at points (n, 3): inverse square and cosine, with `candela` by degrees from straight down."""
    way = np.asarray(place) - points
    distance = np.linalg.norm(way, axis=1)
    angle_deg = np.degrees(np.arccos(way[:, 1] / distance))
    return candela(angle_deg) * np.maximum(way @ normal / distance, 0) / distance**2
