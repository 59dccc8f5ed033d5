"""A lens in a room of glowing tiles: what it shows is known by exact rays through its two spheres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.baked.light_fields.thin_glass import refracted
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize
from lambent.core.views.camera import Camera, image_plane
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Lobe, Material
from lambent.scenes.geometry import lathe, merge, patch, placed, turn
from lambent.scenes.scene import LightFieldWish, Scene, SceneObject

HALF_M, TILES = 1.5, 6  # half the room's side; tiles along a side
COLOURS = np.array([[0.9, 0.2, 0.15], [0.2, 0.7, 0.3], [0.2, 0.35, 0.95], [0.85, 0.8, 0.3], [0.7] * 3, [0.1] * 3])
ETA, R0, APERTURE_M = 1.5, 0.04, 0.25
GLASS = Material(name="glass", lobes=(Lobe(side="transmission", mx=0.002, my=0.002, k=1.0, r0=R0, alpha=0.5),))
ORIGIN = (0.0, 0.0, 0.0)
FRONT = Camera("front", (0.15, 0.1, 0.9), ORIGIN, fov_y_deg=40.0)
OBLIQUE = Camera("oblique", (0.75, 0.25, 0.65), ORIGIN, fov_y_deg=36.0)


@dataclass(frozen=True)
class Lens:
    """Biconvex, about z: faces are spheres of `radius_m`, the rim is `rim_m` thick."""

    radius_m: float
    rim_m: float

    @property
    def centre_m(self) -> float:
        """Distance of the spheres' centres from the middle, each on the other face's side."""
        return float(np.sqrt(self.radius_m**2 - APERTURE_M**2)) - self.rim_m / 2

    def scene(self) -> Scene:
        """The lens wants a light field that refracts."""
        angle = np.linspace(0, np.arcsin(APERTURE_M / self.radius_m), 7)
        radius, height = self.radius_m * np.sin(angle), self.radius_m * np.cos(angle) - self.centre_m
        cap = np.stack([radius, height], axis=1)
        rim = [[APERTURE_M, -self.rim_m / 2], [APERTURE_M, self.rim_m / 2]]
        mesh = placed(lathe([cap * [1, -1], rim, cap[::-1]], around=96, rows=5), rotation=turn("x", 90))
        objects = (*_walls(), SceneObject("lens", mesh, "glass"))
        materials = {"black": Material(), "glass": GLASS}
        return Scene("lens", objects, materials, light_fields={"lens": LightFieldWish(refracts=True)})

    def seen(self, camera: Camera, pixels: int, within: int = 4) -> tuple[Floats, Floats, Flags]:
        """What a square picture shows (pixels, pixels, 3): through the lens, and without it.

        Also where all rays enter by the front face and leave by the back one. Weights of light as in
        `baked.light_fields.thin_glass`; pixels are means of `within` x `within` rays.
        """
        count = pixels * within
        across, up, forward = image_plane(camera, count, count)
        x, y = np.meshgrid((np.arange(count) + 0.5) / count * 2 - 1, 1 - (np.arange(count) + 0.5) / count * 2)
        w = normalize((forward + x[..., None] * across + y[..., None] * up).reshape(-1, 3))
        eye = np.broadcast_to(np.array(camera.position), w.shape)
        first, n, met = self._face(eye, w, 1)
        inside, _ = refracted(w, n, 1 / ETA)
        second, out, left = self._face(first, inside, -1)
        leaving, passes = refracted(inside, -out, ETA)
        cosine, cosine_out = -np.sum(w * n, axis=1), np.sum(leaving * out, axis=1)
        enters, leaves = ((1 - R0) * under_fresnel(of) for of in (cosine, cosine_out))
        mirrored = enters * (1 - leaves) * (1 - R0)
        light = (enters * leaves)[:, None] * tile_light(second, leaving)
        light += mirrored[:, None] * tile_light(first, w + 2 * cosine[:, None] * n)
        straight = tile_light(eye, w)
        through = met & left & passes

        def image(of: Floats) -> Floats:
            return np.asarray(of.reshape(pixels, within, pixels, within, -1).mean(axis=(1, 3)))

        return image(light), image(straight), image(through.astype(float))[..., 0] == 1

    def _face(self, x: Floats, w: Floats, side: int) -> tuple[Floats, Floats, Flags]:
        """Where rays meet the face on one side of z = 0: places and normals out of the glass (k, 3), and whether."""
        centre = np.array([0.0, 0.0, -side * self.centre_m])
        along, away = np.sum(w * (x - centre), axis=1), np.sum((x - centre) ** 2, axis=1)
        root = along**2 - away + self.radius_m**2
        at = x + (-along - side * np.sqrt(np.maximum(root, 0)))[:, None] * w
        on = (root > 0) & (np.hypot(at[:, 0], at[:, 1]) < APERTURE_M) & (side * at[:, 2] > 0)
        return at, (at - centre) / self.radius_m, on


def _walls() -> list[SceneObject]:
    tiles: list[list[object]] = [[] for _ in COLOURS]
    for face in range(6):
        out, across, up = _axes(face)
        size = 2 * HALF_M / TILES
        for i, j in np.ndindex(TILES, TILES):
            corner = HALF_M * (out - across - up) + size * (i * across + j * up)
            tiles[_colour(face, i, j)].append(patch(corner, size * across, size * up))
    return [
        SceneObject(f"tiles_{k}", merge(of), "black", emission=tuple(COLOURS[k]))  # type: ignore[arg-type]
        for k, of in enumerate(tiles)
    ]


def _axes(face: int) -> tuple[Floats, Floats, Floats]:
    """Out of the room, across a wall and up."""
    axis, sign = face // 2, 1 - 2 * (face % 2)
    out, across = np.eye(3)[axis] * sign, np.eye(3)[(axis + 1) % 3]
    return out, across, np.cross(-out, across)


def _colour(face: int, i: int, j: int) -> int:
    return (2 * i + 3 * j + face) % len(COLOURS)


def tile_light(x: Floats, w: Floats) -> Floats:
    """Radiance (k, 3) of the tiles that rays from x along w meet."""
    w = np.where(np.abs(w) < 1e-12, 1e-12, w)
    t = (np.sign(w) * HALF_M - x) / w
    axis = t.argmin(axis=1)
    at = x + t.min(axis=1)[:, None] * w
    face = 2 * axis + (np.take_along_axis(w, axis[:, None], axis=1)[:, 0] < 0)
    table = np.array([[[_colour(f, i, j) for j in range(TILES)] for i in range(TILES)] for f in range(6)])
    across, up = (np.stack(of)[face] for of in list(zip(*map(_axes, range(6)), strict=True))[1:])
    i, j = (
        np.clip((np.sum(at * of, axis=1) / (2 * HALF_M) + 0.5) * TILES, 0, TILES - 1).astype(int) for of in (across, up)
    )
    return np.asarray(COLOURS[table[face, i, j]])
