"""Daylight for the path tracer: sky and sun in W/(sr m^2), as one image.

Mitsuba's `sunsky` (Hosek & Wilkie 2012, 2013) gives colours and the sky's distribution of light. Its RGB is in
W/(sr m^2 nm), which 683 lm/W x 106.856 nm, the integral of V(lambda), converts to cd/m^2. With that scale its sun dims
too little with turbidity: 81 klx at 45 degrees and turbidity 6, where published models have 57 to 59. Sky and sun are
therefore scaled to the illuminances of `scenes.sky.clear_sky`.

Evaluating the sky model at every path vertex costs several times the ray itself; an image costs almost nothing and can
be importance sampled. The smooth sky is evaluated coarsely; around the sun, radiance is averaged over each pixel, so
that the disc keeps its power. Interpolation between pixels widens the disc from .53 to about .7 degrees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.running.tiles import slices
from lambent.baking.tracing.rays import array_of, vectors
from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_direction
from lambent.core.light.colour import luminance
from lambent.core.light.photometry import radiometric
from lambent.scenes.scene import SunSky
from lambent.scenes.sky.clear_sky import sky_illuminance, sun_illuminance

WIDTH, HEIGHT, COARSE = 2048, 1024, 4
LIMB_DARKENING = 0.6  # of the sun's edge relative to its centre, at 550 nm
DIRECTIONS = 1 << 14
SUPERSAMPLES = 16  # per pixel and axis, near the sun
PIXELS_AT_ONCE = 1 << 12
LOWEST_SINE = 0.005  # of the sun's elevation: Mitsuba's sky is black with the sun on the horizon


@dataclass(frozen=True)
class SunDisc:
    """The sun: unit direction towards it, irradiance (3,) in W/m^2 on a surface that faces it, angular radius.

    Its irradiance does not depend on its radius. If the horizon cuts the disc, the part above is visible.
    """

    direction: Floats
    irradiance: Floats
    radius_rad: float

    def radiance(self, w: Floats) -> Floats:
        """Radiance (n, 3), W/(sr m^2), from unit world directions w (n, 3): limb darkening is linear in cos."""
        chord = np.linalg.norm(w - self.direction, axis=-1)  # accurate for small angles, unlike the cosine
        share = np.sin(np.minimum(2 * np.arcsin(np.minimum(chord / 2, 1)), np.pi / 2)) / np.sin(self.radius_rad)
        edge = 1 - LIMB_DARKENING * (1 - np.sqrt(np.maximum(1 - share**2, 0)))
        inside = (share <= 1) & (w @ self.direction > 0)
        middle = self.irradiance / (np.pi * np.sin(self.radius_rad) ** 2 * (1 - LIMB_DARKENING / 3))
        return np.asarray(np.where(inside, edge, 0.0)[:, None] * middle)


def sun_disc(sky: SunSky) -> SunDisc:
    """The sun of daylight: the colour of Mitsuba's model, and the illuminance of `scenes.sky.clear_sky`."""
    direction = normalize(np.asarray(sky.sun_direction, float))
    there = _raised(direction)[None]
    colour = np.maximum(_model(sky, there, sun=True) - _model(sky, there, sun=False), 0)[0].astype(float)
    height_deg = float(np.degrees(np.arcsin(np.clip(direction[1], 0, 1))))
    wanted = sky.sun_scale * radiometric(np.array(sun_illuminance(height_deg, sky.turbidity)))
    irradiance = colour * (wanted / luminance(colour)) if wanted > 0 and colour.any() else np.zeros(3)
    return SunDisc(direction, irradiance, np.radians(sky.sun_radius_deg))


def sunsky_radiance(sky: SunSky, w: Floats, *, sun: bool = True) -> Floats:
    """Radiance (n, 3) that arrives from unit world directions w (n, 3), W/(sr m^2); black below the horizon."""
    light = _sky_scale(sky) * _model(sky, w, sun=False)
    return light + np.where(w[:, 1:2] >= 0, sun_disc(sky).radiance(w), 0.0) if sun else light


@lru_cache(maxsize=4)
def _sky_scale(sky: SunSky) -> float:
    """Factor that gives Mitsuba's sky the illuminance of `scenes.sky.clear_sky`."""
    y = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS  # a spiral of equal solid angles
    around, across = np.pi * (1 + 5**0.5) * np.arange(DIRECTIONS), np.sqrt(1 - y**2)
    w = np.stack([across * np.cos(around), y, across * np.sin(around)], axis=-1)
    has = 2 * np.pi * np.mean(luminance(_model(sky, w, sun=False)) * y)
    height_deg = float(np.degrees(np.arcsin(np.clip(sky.sun_direction[1], 0, 1))))
    wanted = sky.sky_scale * radiometric(np.array(sky_illuminance(height_deg, sky.turbidity)))
    return float(wanted / has)


def _raised(sun_direction: Floats) -> Floats:
    """A direction to the sun, raised until Mitsuba's model is not black."""
    return normalize(np.maximum(sun_direction, (-np.inf, LOWEST_SINE, -np.inf)))


def _model(sky: SunSky, w: Floats, *, sun: bool) -> NDArray[np.float32]:
    """Mitsuba's `sunsky` (n, 3), W/(sr m^2 nm), from world directions; its up is z, turned by -90 degrees about x."""
    description = {
        "type": "sunsky",
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90),
        "sun_direction": _raised(np.asarray(sky.sun_direction, float)).tolist(),
        "sun_scale": float(sun),
        **{name: getattr(sky, name) for name in ("turbidity", "albedo")},
    }
    return np.maximum(radiance_from(lone_emitter(description), w), 0)


def lone_emitter(description: Mapping[str, Any]) -> Any:
    """mi.Emitter from a Mitsuba dictionary, in an empty scene."""
    emitter = mi.load_dict(dict(description))
    emitter.set_scene(mi.load_dict({"type": "scene", "environment": emitter}))
    return emitter


def radiance_from(environment: Any, w: Floats) -> NDArray[np.float32]:
    """Radiance (n, 3), W/(sr m^2), that arrives from an environment (mi.Emitter) along unit directions w (n, 3)."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(w))
    si.wi = vectors(mi.Vector3f, -w)
    return array_of(environment.eval(si))


@lru_cache(maxsize=1)
def sky_image(sky: SunSky) -> NDArray[np.float32]:
    """(HEIGHT, WIDTH, 3) lat-long image, oriented as an `ImageEnvironment`.

    The model is black below the horizon; the image shows a diffuse ground there with the sky's own albedo and lit by
    it, unless `sky.ground` is black.
    """
    rows, columns = np.arange(HEIGHT, step=COARSE), np.arange(WIDTH, step=COARSE)
    r, c = np.meshgrid(rows + (COARSE - 1) / 2, columns + (COARSE - 1) / 2, indexing="ij")
    coarse = sunsky_radiance(sky, _directions(r, c).reshape(-1, 3), sun=False)
    image = coarse.reshape(len(rows), len(columns), 3).repeat(COARSE, axis=0).repeat(COARSE, axis=1)
    sun = sun_disc(sky)
    reach_rad = sun.radius_rad + 2 * np.pi / HEIGHT
    rows_near = (
        np.abs(np.arange(HEIGHT) * (np.pi / (HEIGHT - 1)) - np.arccos(np.clip(sun.direction[1], -1, 1))) < reach_rad
    )
    pixels = np.stack(np.meshgrid(np.flatnonzero(rows_near), np.arange(WIDTH), indexing="ij"), axis=-1).reshape(-1, 2)
    near = pixels[(_directions(*pixels.T) @ sun.direction) > np.cos(reach_rad)]
    offset = (np.arange(SUPERSAMPLES) + 0.5) / SUPERSAMPLES - 0.5
    for mine in slices(len(near), PIXELS_AT_ONCE):
        r, c = near[mine, 0, None, None] + offset[:, None], near[mine, 1, None, None] + offset
        fine = sun.radiance(_directions(*np.broadcast_arrays(r, c)).reshape(-1, 3))
        image[near[mine, 0], near[mine, 1]] += fine.reshape(-1, SUPERSAMPLES**2, 3).mean(axis=1)
    height = np.cos(np.arange(HEIGHT) * (np.pi / (HEIGHT - 1)))  # y of the directions in each row
    rows_sr = np.sqrt(1 - height**2) * (np.pi / (HEIGHT - 1)) * (2 * np.pi / WIDTH)
    irradiance = np.einsum("rcx,r->x", image, np.maximum(height, 0) * rows_sr)
    image[height < 0] = 0 if sky.ground == "black" else sky.albedo / np.pi * irradiance
    return np.ascontiguousarray(image, dtype=np.float32)


def _directions(row: Floats, column: Floats) -> Floats:
    """World directions of pixel positions; Mitsuba puts the first and the last row onto the poles."""
    theta = np.clip(row * (np.pi / (HEIGHT - 1)), 0, np.pi)
    phi = (column + 0.5) * (2 * np.pi / WIDTH)
    return lat_long_direction(theta, phi) * (-1.0, 1.0, -1.0)  # half a turn: phi starts at the left edge
