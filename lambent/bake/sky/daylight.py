"""Daylight for the path tracer: Mitsuba's `sunsky`, evaluated once into an image.

Evaluating the sky model at every path vertex costs several times the ray itself; an image costs next to nothing and is
sampled as well. The smooth sky is evaluated coarsely; around the sun radiance is averaged over each pixel, so that the
disc keeps its power. Interpolation between pixels widens it from .53 to about .7 degrees.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.tracing.rays import array_of, vectors
from lambent.core.arrays import Floats
from lambent.core.directions import normalize
from lambent.core.latlong import lat_long_direction
from lambent.scenes.scene import SunSky

WIDTH, HEIGHT, COARSE = 2048, 1024, 4
SUN_RADIUS_RAD = np.radians(0.27)
SUPERSAMPLES = 16  # per pixel and axis, near the sun


def sunsky_dict(sky: SunSky, sun: bool = True) -> dict[str, Any]:
    """Mitsuba's dictionary of the model itself; its sky has z up and is turned by -90 degrees about x."""
    return {
        "type": "sunsky",
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90),
        "sun_direction": list(sky.sun_direction),
        "sun_scale": sky.sun_scale if sun else 0.0,
        **{name: getattr(sky, name) for name in ("turbidity", "albedo", "sky_scale")},
    }


def sunsky_radiance(sky: SunSky, w: Floats, *, sun: bool = True) -> Floats:
    """Radiance (n, 3) that arrives from unit world directions w (n, 3), W/(sr m^2)."""
    return radiance_from(lone_emitter(sunsky_dict(sky, sun)), w)


def lone_emitter(description: Mapping[str, Any]) -> Any:
    """mi.Emitter of a dictionary of Mitsuba's, in an empty scene."""
    emitter = mi.load_dict(dict(description))
    emitter.set_scene(mi.load_dict({"type": "scene", "environment": emitter}))
    return emitter


def radiance_from(environment: Any, w: Floats) -> NDArray[np.float32]:
    """Radiance (n, 3) that arrives from unit directions w (n, 3) of an environment (mi.Emitter), W/(sr m^2)."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(w))
    si.wi = vectors(mi.Vector3f, -w)
    return array_of(environment.eval(si))


@lru_cache(maxsize=1)
def sky_image(sky: SunSky) -> NDArray[np.float32]:
    """(HEIGHT, WIDTH, 3) lat-long image, oriented as an `ImageEnvironment`.

    The model is black below the horizon; the image has a diffuse ground of the sky's own albedo there, lit by it.
    """
    rows, columns = np.arange(HEIGHT, step=COARSE), np.arange(WIDTH, step=COARSE)
    r, c = np.meshgrid(rows + (COARSE - 1) / 2, columns + (COARSE - 1) / 2, indexing="ij")
    coarse = sunsky_radiance(sky, _directions(r, c).reshape(-1, 3), sun=False)
    image = coarse.reshape(len(rows), len(columns), 3).repeat(COARSE, axis=0).repeat(COARSE, axis=1)
    sun = normalize(np.asarray(sky.sun_direction, float))
    pixels = np.stack(np.meshgrid(np.arange(HEIGHT), np.arange(WIDTH), indexing="ij"), axis=-1).reshape(-1, 2)
    near = pixels[(_directions(*pixels.T) @ sun) > np.cos(SUN_RADIUS_RAD + 2 * np.pi / HEIGHT)]
    offset = (np.arange(SUPERSAMPLES) + 0.5) / SUPERSAMPLES - 0.5
    r, c = near[:, 0, None, None] + offset[:, None], near[:, 1, None, None] + offset
    fine = sunsky_radiance(sky, _directions(*np.broadcast_arrays(r, c)).reshape(-1, 3))
    image[near[:, 0], near[:, 1]] = fine.reshape(len(near), -1, 3).mean(axis=1)
    height = np.cos(np.arange(HEIGHT) * (np.pi / (HEIGHT - 1)))  # y of the directions in each row
    rows_sr = np.sqrt(1 - height**2) * (np.pi / (HEIGHT - 1)) * (2 * np.pi / WIDTH)
    irradiance = np.einsum("rcx,r->x", image, np.maximum(height, 0) * rows_sr)
    image[height < 0] = sky.albedo / np.pi * irradiance
    return np.ascontiguousarray(image, dtype=np.float32)


def _directions(row: Floats, column: Floats) -> Floats:
    """World directions of pixel positions; Mitsuba puts the first and the last row onto the poles."""
    theta = np.clip(row * (np.pi / (HEIGHT - 1)), 0, np.pi)
    phi = (column + 0.5) * (2 * np.pi / WIDTH)
    return lat_long_direction(theta, phi) * (-1.0, 1.0, -1.0)  # half a turn: phi counts from the left edge
