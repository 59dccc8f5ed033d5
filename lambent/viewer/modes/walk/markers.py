"""Marks over the picture: mirror balls at probes, outlines of planar reflectors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import sample
from lambent.core.geometry.directions import normalize, reflect
from lambent.core.light.colour import shown
from lambent.core.pictures.images import to_bytes
from lambent.core.views.camera import Camera, camera_axes, clip_from_world
from lambent.realtime.gpu.cube_mips import finite, halved
from lambent.realtime.light.baked import Probe
from lambent.store.contract import ReflectorRecord
from lambent.viewer.mode import Image

BALL_M = 0.12  # radius of a ball in the scene
SMALLEST_PX, LARGEST_PX = 9.0, 72.0  # radius on the screen in logical pixels
CUBE_TEXELS = 64  # per side of a face; a ball is small
NEAR_M = 0.05
Line = tuple[tuple[float, float], ...]  # a closed outline, in shares of the picture
Size = tuple[int, int]  # width and height of the picture, logical


@dataclass(frozen=True)
class Ball:
    """One probe on the screen: the middle as shares of the picture, the radius as a share of its height."""

    name: str
    x: float
    y: float
    radius: float
    depth_m: float


class Marks:
    """Wanted marks (`probes`, `reflectors`) for one camera: balls, farthest first, and outlines."""

    def __init__(self, sources: Mapping[str, Probe], reflectors: Sequence[ReflectorRecord]) -> None:
        self.sources, self._reflectors = sources, reflectors
        self._cubes: dict[str, Floats] = {}  # reduced cube maps
        self._made_for: tuple[Any, ...] = ()
        self.probes = self.reflectors = False
        self.images: dict[str, Image] = {}  # "probe NAME"
        self.balls: tuple[Ball, ...] = ()
        self.lines: tuple[Line, ...] = ()

    def update(self, camera: Camera, size: Size, view: str, exposure_ev: float) -> None:
        """Make the wanted marks for a picture of `size`."""
        key = (camera, size, view, exposure_ev, self.probes, self.reflectors)
        if key == self._made_for:
            return
        self._made_for = key
        found = [self._ball(name, probe, camera, size) for name, probe in self.sources.items() if self.probes]
        self.balls = tuple(sorted((ball for ball in found if ball), key=lambda ball: -ball.depth_m))
        self.images = {}
        for ball in self.balls:
            cube, centre, size_px = self._cube(ball.name), self.sources[ball.name].centre, 2 * ball.radius * size[1]
            self.images[f"probe {ball.name}"] = mirror_ball(cube, camera, centre, round(size_px), view, exposure_ev)
        outlines = (np.array(record.outline) for record in self._reflectors if self.reflectors)
        lines = (outline(corners, camera, size) for corners in outlines)
        self.lines = tuple(line for line in lines if line is not None)

    def _ball(self, name: str, probe: Probe, camera: Camera, size: Size) -> Ball | None:
        ((x, y),), (depth_m,) = projected(camera, np.array([probe.centre]), size)
        if depth_m < NEAR_M or not (-0.1 < x < 1.1 and -0.1 < y < 1.1):
            return None
        half = np.tan(np.radians(camera.fov_y_deg) / 2)
        radius_px = float(np.clip(BALL_M / depth_m / (2 * half) * size[1], SMALLEST_PX, LARGEST_PX))
        return Ball(name, float(x), float(y), radius_px / size[1], float(depth_m))

    def _cube(self, name: str) -> Floats:
        if name not in self._cubes:
            cube = finite(self.sources[name].radiance)[0]
            while cube.shape[1] > CUBE_TEXELS:
                cube = halved(cube)
            self._cubes[name] = cube
        return self._cubes[name]


def projected(camera: Camera, points: Floats, size: Size) -> tuple[Floats, Floats]:
    """Positions (P, 2), as shares of the picture from its upper left, and depths (P,), m, of points (P, 3)."""
    clip = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ clip_from_world(camera, *size, NEAR_M).T
    depth_m = clip[:, 3]
    x, y = clip[:, :2].T / np.where(np.abs(depth_m) < 1e-9, 1e-9, depth_m)
    return np.stack([(1 + x) / 2, (1 - y) / 2], axis=-1), depth_m


def outline(corners: Floats, camera: Camera, size: Size) -> Line | None:
    """A polygon (P, 3) projected to the screen and clipped at the eye; None if it is behind the eye."""
    _, depths_m = projected(camera, corners, size)
    kept = []
    for a, b, da, db in zip(corners, np.roll(corners, -1, axis=0), depths_m, np.roll(depths_m, -1), strict=True):
        if da >= NEAR_M:
            kept.append(a)
        if (da < NEAR_M) != (db < NEAR_M):
            kept.append(a + (b - a) * (NEAR_M - da) / (db - da))
    if len(kept) < 2:
        return None
    places, _ = projected(camera, np.array(kept), size)
    return tuple((float(x), float(y)) for x, y in places)


def mirror_ball(
    cube: Floats, camera: Camera, centre: tuple[float, float, float], size: int, view: str, exposure_ev: float
) -> Image:
    """RGBA (size, size, 4) of a perfect mirror ball at `centre` that reflects the probe's cube map."""
    _, up, ahead = camera_axes(camera)
    towards_centre = np.subtract(centre, camera.position, dtype=float)
    towards_centre = normalize(towards_centre) if np.linalg.norm(towards_centre) > 1e-6 else ahead
    across = normalize(np.cross(towards_centre, up))
    above = np.cross(across, towards_centre)
    at = (np.arange(size) + 0.5) / size * 2 - 1
    u, v = np.meshgrid(at, -at)
    r = np.hypot(u, v)
    inside = np.minimum(r, 0.999)
    towards = np.sqrt(1 - inside**2)
    shrink = inside / np.maximum(r, 1e-9)
    normal = (u * shrink)[..., None] * across + (v * shrink)[..., None] * above - towards[..., None] * towards_centre
    out = -reflect(towards_centre, normal)
    rgba = np.empty((size, size, 4), np.uint8)
    rgba[..., :3] = to_bytes(shown(np.asarray(sample(cube, out), np.float32), view, exposure_ev))
    rgba[..., 3] = to_bytes(np.clip((1 - r) * size / 2 + 0.5, 0, 1))
    return rgba
