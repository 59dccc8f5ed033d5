"""Daylight for the path tracer: Mitsuba's `sunsky`, drawn once into a picture.

Evaluating the sky model at every path vertex costs several times the ray itself; a picture costs next to nothing and is
sampled as well. The sky is smooth and is drawn coarsely; the sun's surroundings are averaged over each pixel, so that
the disc keeps its power. Interpolation between pixels widens it from .53 to about .7 degrees.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.vectors import array_of, vectors
from lambent.core.directions import normalize
from lambent.core.latlong import lat_long_direction
from lambent.scenes.scene import SunSky

Array = NDArray[np.floating]
WIDTH, HEIGHT, COARSE = 2048, 1024, 4
SUN_RADIUS_RAD = np.radians(0.27)
SUPERSAMPLES = 16  # per pixel and axis, near the sun


def sunsky_dict(sky: SunSky, sun: bool = True) -> dict[str, Any]:
    """Mitsuba's dictionary of the model itself; its sky has z up and is turned by -90 degrees about x."""
    return {
        "type": "sunsky",
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90),
        "sun_direction": list(sky.sun_direction),
        "turbidity": sky.turbidity,
        "albedo": sky.albedo,
        "sun_scale": sky.sun_scale if sun else 0.0,
        "sky_scale": sky.sky_scale,
    }


def sunsky_radiance(sky: SunSky, w: Array, *, sun: bool = True) -> Array:
    """Radiance (n, 3) that arrives from unit world directions w (n, 3), W/(sr m^2)."""
    emitter = mi.load_dict(sunsky_dict(sky, sun))
    emitter.set_scene(mi.load_dict({"type": "scene", "environment": emitter}))
    si = dr.zeros(mi.SurfaceInteraction3f, len(w))
    si.wi = vectors(mi.Vector3f, -w)
    return array_of(emitter.eval(si))


@lru_cache(maxsize=1)
def sky_picture(sky: SunSky) -> NDArray[np.float32]:
    """(HEIGHT, WIDTH, 3) lat-long picture, oriented as an `ImageEnvironment`.

    The model is black below the horizon; there the picture shows a diffuse ground of the sky's own albedo, lit by it.
    """
    rows, columns = np.arange(HEIGHT, step=COARSE), np.arange(WIDTH, step=COARSE)
    r, c = np.meshgrid(rows + (COARSE - 1) / 2, columns + (COARSE - 1) / 2, indexing="ij")
    coarse = sunsky_radiance(sky, _directions(r, c).reshape(-1, 3), sun=False)
    picture = coarse.reshape(len(rows), len(columns), 3).repeat(COARSE, axis=0).repeat(COARSE, axis=1)
    sun = normalize(np.asarray(sky.sun_direction, float))
    pixels = np.stack(np.meshgrid(np.arange(HEIGHT), np.arange(WIDTH), indexing="ij"), axis=-1).reshape(-1, 2)
    near = pixels[(_directions(*pixels.T) @ sun) > np.cos(SUN_RADIUS_RAD + 2 * np.pi / HEIGHT)]
    offset = (np.arange(SUPERSAMPLES) + 0.5) / SUPERSAMPLES - 0.5
    r, c = near[:, 0, None, None] + offset[:, None], near[:, 1, None, None] + offset
    fine = sunsky_radiance(sky, _directions(*np.broadcast_arrays(r, c)).reshape(-1, 3))
    picture[near[:, 0], near[:, 1]] = fine.reshape(len(near), -1, 3).mean(axis=1)
    height = np.cos(np.arange(HEIGHT) * (np.pi / (HEIGHT - 1)))  # y of the directions in each row
    rows_sr = np.sqrt(1 - height**2) * (np.pi / (HEIGHT - 1)) * (2 * np.pi / WIDTH)
    irradiance = np.einsum("rcx,r->x", picture, np.maximum(height, 0) * rows_sr)
    picture[height < 0] = sky.albedo / np.pi * irradiance
    return np.ascontiguousarray(picture, dtype=np.float32)


def _directions(row: Array, column: Array) -> Array:
    """World directions of pixel positions: Mitsuba puts the first and the last row onto the poles."""
    theta = np.clip(row * (np.pi / (HEIGHT - 1)), 0, np.pi)
    phi = (column + 0.5) * (2 * np.pi / WIDTH)
    return lat_long_direction(theta, phi) * (-1.0, 1.0, -1.0)  # half a turn: phi counts from the left edge
