"""Scenes whose answer is known by hand, small enough to bake in a second."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.baking.quality import quality_named
from lambent.core.pictures.images import write_image
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import box, patch, placed, sphere
from lambent.scenes.scene import Mesh, Scene, SceneObject

TINY = quality_named("preview").changed(
    "tiny",
    geometry={"texels": 48},
    light_map={"samples": (64, 64), "noise": 0.0, "max_depth": 32, "gather_samples": 0},
    environment={"texels": 16},
    probe={"texels": 16, "samples": 16},
    answer={"patches": 48, "gather_rays": 64, "direct_samples": 8},
)
GREY = Material(kd=0.5)
MIRROR = Material(lobes=(Lobe(mx=0.01, my=0.01, r0=0.9),))
BLACK = Material()


def turned_inwards(mesh: Mesh) -> Mesh:
    """A room from a solid."""
    return replace(mesh, normals=-mesh.normals, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))


def furnace(albedo: float = 0.5) -> Scene:
    """A closed diffuse box, emission 1 - albedo: radiance 1 everywhere, irradiance pi."""
    room = SceneObject("room", turned_inwards(box((2, 2, 2))), "grey", emission=(1 - albedo,) * 3)
    return Scene("furnace", (room,), {"grey": Material(kd=albedo)})


def plane() -> Scene:
    """A horizontal square of 2 m, black, so that all light is direct."""
    floor = patch((-1, 0, 1), (2, 0, 0), (0, 0, -2))
    return Scene("plane", (SceneObject("floor", floor, "black"),), {"black": BLACK})


COLOURS = ((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, 0, 1), (0, 1, 1))


def coloured_room() -> Scene:
    """Walls 2 m from the origin that emit COLOURS in the order of cube faces, and a mirror ball in the middle."""
    walls = []
    for face, colour in enumerate(COLOURS):
        axis, sign = face // 2, 1 - 2 * (face % 2)
        out, across = np.eye(3)[axis] * sign, np.eye(3)[(axis + 1) % 3]
        up = np.cross(-out, across)
        mesh = patch(out * 2 - 2 * across - 2 * up, 4 * across, 4 * up)
        walls.append(SceneObject(f"wall_{face}", mesh, "black", emission=colour))
    ball = SceneObject("ball", sphere(0.3, 16, 8), "mirror")
    return Scene("coloured", (*walls, ball), {"black": BLACK, "mirror": MIRROR})


def room_with_step() -> Scene:
    """A room lit by its ceiling, with a block that reaches through the floor, and a ball that wants a probe."""
    objects = (
        SceneObject("shell", placed(turned_inwards(box((4, 2, 4))), (0, 1, 0)), "grey"),
        SceneObject("block", placed(box((1, 1, 1)), (0.8, 0.3, 0.8)), "grey"),
        SceneObject("lamp", patch((-0.5, 1.99, -0.5), (1, 0, 0), (0, 0, 1)), "black", emission=(5, 5, 5)),
        SceneObject("ball", placed(sphere(0.3, 16, 8), (-0.8, 0.5, 0)), "mirror"),
    )
    return Scene("step", objects, {"grey": GREY, "black": BLACK, "mirror": MIRROR})


def constant_picture(folder: Path, radiance: float = 1.0) -> Path:
    """A lat-long picture of one colour."""
    path = folder / "constant.exr"
    write_image(path, np.full((16, 32, 3), radiance, np.float32))
    return path
