"""Preview of a fit: a ball with the measured table as BSDF, and the same ball with the fitted material.

The ball is brushed along its circles of latitude, its axis tilted towards the viewer and to the side, so that brushed
highlights show. For a table that transmits, only the front half of the ball is rendered, with a lamp behind it whose
light passes through the sheet. Figures cover the ball's pixels alone: a shared background would flatter them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.material_plugin import material_dict, register_material_plugin
from lambent.baking.bsdfs.table_plugin import table_dict
from lambent.baking.tracing.scene_builder import environment_dict
from lambent.baking.tracing.shapes import mesh_of
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize
from lambent.core.pictures.metrics import display_pair, flip, psnr, tile_means
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.half_vector_grid import ISOTROPIC, GridShape
from lambent.scenes.geometry import sphere, transformed, turn
from lambent.scenes.scene import Environment, Mesh, SceneObject, SunSky

DAYLIGHT = SunSky(sun_direction=tuple(normalize(np.array([-0.55, 0.62, 0.56])).tolist()))
SIZE_PX, SPP = 320, 49
GRIDS = {True: ISOTROPIC, False: GridShape(32, 24, 64, 64)}  # by isotropy; finer grids look the same
MAX_DEPTH = {False: 2, True: 3}  # without a lamp, light hits the ball once, because it is convex
DISTANCE, FOV_DEG = 6.0, 19.4  # of the camera; the ball has radius 1 and nearly fills the image
LAMP_AT, LAMP_RADIUS = (0.25, -0.2, 0.1), 0.12
LAMP_RADIANCE = (300.0, 230.0, 150.0)  # multiples of the environment's mean
OPEN_BEHIND = -0.15  # z in the camera's direction up to which the half ball reaches, slightly behind its silhouette
MEAN_SHOWN = 0.3  # displayed mean of the ball with the table


@dataclass(frozen=True)
class Preview:
    """Two images and their difference.

    Attributes
    ----------
    measured, model : (H, W, 3) float64
        Displayed values, encoded, black outside the ball: clip(e L)^(1/2.2), one e for both.
    difference : (H, W, 3)
        FLIP error in false colour, encoded.
    ball : (H, W) bool
        Pixels that show nothing but the ball.
    figures : dict
        Over the ball: `psnr_db`, `flip_mean`, `flip_worst_tile` (16x16 tiles within it).
    spp : int
    lamp : bool
        Whether a lamp hangs behind the front half.
    """

    measured: Floats
    model: Floats
    difference: Floats
    ball: Flags
    figures: dict[str, float]
    spp: int
    lamp: bool


def preview(
    table: MeasuredTable,
    material: Material,
    environment: Environment = DAYLIGHT,
    *,
    size_px: int = SIZE_PX,
    spp: int = SPP,
    seed: int = 0,
    progress: Progress = silent,
) -> Preview:
    """Render a ball with a measurement and one with the material fitted to it, with the same seed, and compare them.

    Images have `size_px` pixels along each side, and `spp` samples per pixel.

    Raises
    ------
    UserError
        If no path tracing engine works, or the environment's image cannot be read.
    """
    register_material_plugin()
    lamp = table.info.transmits or material.transmits
    shape = GRIDS[table.info.isotropic]
    bsdfs = {"measured": table_dict(table, shape=shape, progress=progress), "model": material_dict(material)}
    images = {}
    for i, (name, bsdf) in enumerate(bsdfs.items()):
        progress(i, 2, "rendering the previews")
        images[name] = _render(bsdf, environment, lamp, size_px, spp, seed)
    progress(2, 2, "rendering the previews")
    return _compared(images["measured"], images["model"], _ball_pixels(size_px), spp, lamp)


def _compared(measured: Floats, model: Floats, ball: Flags, spp: int, lamp: bool) -> Preview:
    seen = display_pair(measured[ball], model[ball], MEAN_SHOWN)
    shown = [np.zeros(measured.shape), np.zeros(model.shape)]
    for image, pixels in zip(shown, seen, strict=True):
        image[ball] = pixels
    difference = flip(shown[0], shown[1])
    whole = tile_means(ball.astype(float)) == 1
    tiles = tile_means(difference.error)[whole] if whole.any() else difference.error[ball]
    figures = {
        "psnr_db": psnr(*seen),
        "flip_mean": float(difference.error[ball].mean()),
        "flip_worst_tile": float(tiles.max()),
    }
    return Preview(shown[0], shown[1], difference.picture, ball, figures, spp, lamp)


def _render(bsdf: Mapping[str, Any], environment: Environment, lamp: bool, size_px: int, spp: int, seed: int) -> Floats:
    """Radiance (H, W, 3)."""
    light = environment_dict(environment)
    film = {"type": "hdrfilm", "pixel_format": "rgb", "component_format": "float32", "rfilter": {"type": "box"}}
    camera = {
        "type": "perspective",
        "fov": FOV_DEG,
        "to_world": mi.ScalarTransform4f().look_at([0, 0, DISTANCE], [0, 0, 0], [0, 1, 0]),
        "sampler": {"type": "multijitter", "sample_count": spp},
        "film": {**film, "width": size_px, "height": size_px},
    }
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": MAX_DEPTH[lamp], "hide_emitters": True},
        "sensor": camera,
        "environment": light,
        "ball": mesh_of(SceneObject("ball", ball_mesh(half=lamp), "material"), mi.load_dict(dict(bsdf))),
    }
    if lamp:
        mean = float(np.mean(np.array(light["bitmap"]))) * light["scale"]
        scene["lamp"] = {
            "type": "sphere",
            "center": list(LAMP_AT),
            "radius": LAMP_RADIUS,
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [mean * c for c in LAMP_RADIANCE]}},
            "bsdf": {"type": "diffuse", "reflectance": 0.0},
        }
    return np.array(mi.render(mi.load_dict(scene), spp=spp, seed=seed), dtype=float)


def _ball_pixels(size_px: int) -> Flags:
    """(H, W) pixels that show nothing but the ball: all four corners hit it; its facets lie a hair within radius 1."""
    edge = (np.arange(size_px + 1) / size_px * 2 - 1) * np.tan(np.radians(FOV_DEG / 2))
    x, y = np.meshgrid(edge, edge)
    slope2 = x * x + y * y
    met = DISTANCE**2 * slope2 / (1 + slope2) < 0.999**2
    return np.asarray(met[1:, 1:] & met[1:, :-1] & met[:-1, 1:] & met[:-1, :-1])


def ball_mesh(half: bool = False) -> Mesh:
    """The ball, radius 1, or the half that faces the camera."""
    tilt = np.eye(4)
    tilt[:3, :3] = turn("z", -28.0) @ turn("x", 32.0)
    ball = transformed(sphere(1.0, around=192, rows=96), tilt)
    if not half:
        return ball
    front = ball.positions[ball.faces, 2].mean(axis=1) > OPEN_BEHIND
    return replace(ball, faces=ball.faces[front])
