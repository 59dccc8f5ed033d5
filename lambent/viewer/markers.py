"""What the light comes from, drawn over the picture: probes as mirror balls in their places, reflectors in outline."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.camera import Camera, camera_axes, image_plane
from lambent.core.colour import shown
from lambent.core.cubemap import sample
from lambent.core.directions import normalize
from lambent.core.images import to_bytes
from lambent.realtime.baked import Probe
from lambent.realtime.cube_mips import finite, halved

Floats = NDArray[np.floating[Any]]
BALL_M = 0.12  # radius of a ball in the scene
SMALLEST_PX, LARGEST_PX = 9.0, 72.0  # radius on the screen, logical
CUBE_TEXELS = 64  # per face: a ball is small
NEAR_M = 0.05
Point = tuple[float, float]


@dataclass(frozen=True)
class Ball:
    """One probe on the screen: the middle as shares of the picture, the radius as a share of its height."""

    name: str
    x: float
    y: float
    radius: float
    depth_m: float


@dataclass(frozen=True)
class Line:
    """A closed outline on the screen, in shares of the picture."""

    name: str
    points: tuple[Point, ...]


class Markers:
    """Makes balls and their pictures; the cubes are made small once."""

    def __init__(self, probes: Mapping[str, Probe]) -> None:
        self._probes = probes
        self._cubes: dict[str, Floats] = {}
        self._made_for: tuple[Any, ...] = ()
        self.images: dict[str, NDArray[np.uint8]] = {}
        self.balls: tuple[Ball, ...] = ()

    def update(self, camera: Camera, aspect: float, height_px: float, view: str, exposure_ev: float) -> None:
        """Balls as this camera sees them, farthest first."""
        key = (camera, aspect, height_px, view, exposure_ev)
        if key == self._made_for:
            return
        self._made_for = key
        found = [self._ball(name, probe, camera, aspect, height_px) for name, probe in self._probes.items()]
        self.balls = tuple(sorted((ball for ball in found if ball), key=lambda ball: -ball.depth_m))
        self.images = {
            f"probe {ball.name}": mirror_ball(
                self._cube(ball.name), camera, self._probes[ball.name].centre,
                round(2 * ball.radius * height_px), view, exposure_ev,
            )
            for ball in self.balls
        }  # fmt: skip

    def clear(self) -> None:
        """Show none."""
        self._made_for, self.images, self.balls = (), {}, ()

    def _ball(self, name: str, probe: Probe, camera: Camera, aspect: float, height_px: float) -> Ball | None:
        (place,), (depth,) = projected(camera, np.array([probe.centre]), aspect)
        half = np.tan(np.radians(camera.fov_y_deg) / 2)
        if depth < NEAR_M or not (-0.1 < place[0] < 1.1 and -0.1 < place[1] < 1.1):
            return None
        radius_px = float(np.clip(BALL_M / depth / (2 * half) * height_px, SMALLEST_PX, LARGEST_PX))
        return Ball(name, float(place[0]), float(place[1]), radius_px / height_px, float(depth))

    def _cube(self, name: str) -> Floats:
        if name not in self._cubes:
            cube = finite(self._probes[name].radiance)[0]
            while cube.shape[1] > CUBE_TEXELS:
                cube = halved(cube)
            self._cubes[name] = cube
        return self._cubes[name]


def projected(camera: Camera, points: Floats, aspect: float) -> tuple[Floats, Floats]:
    """Places (P, 2) in shares of the picture from its upper left, and depths (P,) in metres, of points (P, 3)."""
    right, up, forward = camera_axes(camera)
    across, above, _ = image_plane(camera, round(1000 * aspect), 1000)
    v = points - np.asarray(camera.position)
    depth = v @ forward
    safe = np.where(np.abs(depth) < 1e-9, 1e-9, depth)
    x = (v @ right) / safe / np.linalg.norm(across)
    y = (v @ up) / safe / np.linalg.norm(above)
    return np.stack([(x + 1) / 2, (1 - y) / 2], axis=-1), depth


def outline(name: str, corners: Floats, camera: Camera, aspect: float) -> Line | None:
    """A polygon (P, 3) on the screen, cut at the eye; None where all of it is behind."""
    _, _, forward = camera_axes(camera)
    depth = (corners - np.asarray(camera.position)) @ forward
    kept = []
    for i, (a, b) in enumerate(zip(corners, np.roll(corners, -1, axis=0), strict=True)):
        da, db = depth[i], depth[(i + 1) % len(corners)]
        if da >= NEAR_M:
            kept.append(a)
        if (da < NEAR_M) != (db < NEAR_M):
            kept.append(a + (b - a) * (NEAR_M - da) / (db - da))
    if len(kept) < 2:
        return None
    places, _ = projected(camera, np.array(kept), aspect)
    return Line(name, tuple((float(x), float(y)) for x, y in places))


def mirror_ball(
    cube: Floats, camera: Camera, centre: tuple[float, float, float], size: int, view: str, exposure_ev: float
) -> NDArray[np.uint8]:
    """RGBA (size, size, 4) of a perfect mirror ball at `centre` that shows what the probe sees."""
    _, up, ahead = camera_axes(camera)
    sight = np.subtract(centre, camera.position)
    sight = normalize(sight) if np.linalg.norm(sight) > 1e-6 else ahead
    across = normalize(np.cross(sight, up))
    above = np.cross(across, sight)
    at = (np.arange(size) + 0.5) / size * 2 - 1
    u, v = np.meshgrid(at, -at)
    r = np.hypot(u, v)
    inside = np.minimum(r, 0.999)
    towards = np.sqrt(1 - inside**2)
    shrink = inside / np.maximum(r, 1e-9)
    normal = (u * shrink)[..., None] * across + (v * shrink)[..., None] * above - towards[..., None] * sight
    out = sight - 2 * (normal @ sight)[..., None] * normal
    rgba = np.empty((size, size, 4), np.uint8)
    rgba[..., :3] = to_bytes(shown(np.asarray(sample(cube, out), np.float32), view, exposure_ev))
    rgba[..., 3] = to_bytes(np.clip((1 - r) * size / 2 + 0.5, 0, 1))
    return rgba
