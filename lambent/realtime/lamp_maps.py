"""Visible solid angle of lamps over a planar reflector: a map over the plane, drawn once.

From each sample point of a lamp, the blockers between it and the plane are drawn in the projection whose image is the
reflector. A texel holds the solid angles, in sr, of at most four lamps, one per channel, penumbras included. A mirrored
view cannot give this visibility: it lacks surfaces hidden from its eye.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from lambent.core.arrays import Floats
from lambent.core.directions import normalize
from lambent.core.sequences import hammersley
from lambent.realtime.layouts import Layouts
from lambent.realtime.plane_lamps import MOST, PlaneLamp
from lambent.realtime.solid_depths import SolidDepths, depth_texture, read_depths

LONGER_PX = 512  # texels along the longer side of a map
STEP_PX = 64  # rows of a multiple of this length can be read back
COARSE = 24  # points along each side where a lamp's solid angle is summed over all its triangles
THIN = 1e-3  # of a lamp's height: surfaces nearer to its sample points than this do not block
AT_ONCE = 4  # sample points drawn before the first is read, each into a layer of one texture


@dataclass(frozen=True, eq=False)
class PlaneFrame:
    """A rectangle around a reflector: corner (3,), axes (2, 3), sides (2,) in metres, and size (columns, rows)."""

    corner: Floats
    axes: Floats
    sides_m: Floats
    size: tuple[int, int]

    @staticmethod
    def about(outline: Floats, normal: Floats) -> PlaneFrame:
        """The rectangle around an outline (P, 3), along its longest edge."""
        edges = np.roll(outline, -1, axis=0) - outline
        across = normalize(edges[np.argmax(np.linalg.norm(edges, axis=1))])
        axes = np.stack([across, np.cross(normal, across)])
        places = outline @ axes.T
        low, sides = places.min(axis=0), np.maximum(np.ptp(places, axis=0), 1e-3)
        corner = outline[0] + (low - outline[0] @ axes.T) @ axes
        px = np.maximum(np.ceil(sides / sides.max() * LONGER_PX / STEP_PX) * STEP_PX, STEP_PX).astype(int)
        return PlaneFrame(corner, axes, sides, (int(px[0]), int(px[1])))

    def points(self, columns: Floats, rows: Floats) -> Floats:
        """World positions (..., 3) of texel coordinates; texel centres are at half-integers."""
        shares = np.stack([columns / self.size[0], rows / self.size[1]], axis=-1)
        return np.asarray(self.corner + (shares * self.sides_m) @ self.axes)

    def texel_rows(self) -> Floats:
        """Matrix (2, 4) from a position (x, y, z, 1) to column and row."""
        scale = self.axes * (np.array(self.size) / self.sides_m)[:, None]
        return np.column_stack([scale, -scale @ self.corner])

    def _offsets(self, place: Floats) -> tuple[NDArray[np.float32], NDArray[np.float32], float]:
        """Offsets, m, from a point (3,): column and row centres along the axes, and the plane along its normal."""
        u, v = (place - self.corner) @ self.axes.T
        lines = (
            ((np.arange(count) + 0.5) * side / count - start).astype(np.float32)
            for count, side, start in zip(self.size, self.sides_m, (u, v), strict=True)
        )
        columns, rows = lines
        return columns, rows, float((self.corner - place) @ np.cross(*self.axes))

    def distances2(self, place: Floats) -> NDArray[np.float32]:
        """(rows, columns) squared distances of texels from a point (3,), m^2."""
        columns, rows, off = self._offsets(place)
        return np.asarray(columns * columns + (rows * rows)[:, None] + np.float32(off * off), np.float32)

    def received(self, place: Floats, area: Floats) -> NDArray[np.float32]:
        """(rows, columns) solid angle, sr, of a small area vector (3,) at a point; 0 seen from behind."""
        columns, rows, off = self._offsets(place)
        along, beside = (self.axes @ area).astype(np.float32)
        facing = columns * along + (rows * beside)[:, None] + np.float32(off * (area @ np.cross(*self.axes)))
        distance2 = self.distances2(place)
        return np.asarray(np.maximum(facing, 0) / (distance2 * np.sqrt(distance2)), np.float32)

    def clip_from_world(self, place: Floats, plane: Floats, least_m: float, jitter_px: Floats) -> Floats:
        """Projection (4, 4) from a point (3,) onto the plane (n, d); depth rises with the height over the plane.

        Surfaces lower than `least_m` over the plane or higher than the point are clipped.
        """
        n, d = plane[:3], float(plane[3])
        high = float(n @ place) + d
        w = np.array([*-n, high - d])
        found = np.zeros((4, 4))
        for row, (axis, side, px, shift) in enumerate(zip(self.axes, self.sides_m, self.size, jitter_px, strict=True)):
            # where the ray meets the plane: u = (place - corner).axis + high (x - place).axis / w
            start = float((place - self.corner) @ axis)
            u = start * w + high * np.array([*axis, -float(place @ axis)])
            found[row] = 2 / side * u + (2 * shift / px - 1) * w
        found[1] *= -1  # rows run down
        found[2] = THIN * np.array([*n, d - least_m])
        found[3] = w
        return found


def lamp_map(
    layouts: Layouts, resources: Any, lamps: list[PlaneLamp], frame: PlaneFrame, plane: Floats, clearance_m: float
) -> NDArray[np.float16]:
    """(rows, columns, MOST) visible solid angle, sr, of each lamp at texel centres; `resources`: `SceneResources`."""
    steps = lamp_map_steps(layouts, resources, lamps, frame, plane, clearance_m)
    while True:
        try:
            next(steps)
        except StopIteration as end:
            return np.asarray(end.value)


def lamp_map_steps(
    layouts: Layouts, resources: Any, lamps: list[PlaneLamp], frame: PlaneFrame, plane: Floats, clearance_m: float
) -> Generator[None, None, NDArray[np.float16]]:
    """`lamp_map` as a generator that yields after every sample point of a lamp and returns the map."""
    width, height = frame.size
    edge = np.linspace(0, 1, COARSE)
    coarse = frame.points(*(side.ravel() for side in np.meshgrid(edge * width, edge * height)))
    found = np.zeros((height, width, MOST), np.float16)
    for channel, lamp in enumerate(lamps):
        places, areas = lamp.light_points(coarse)
        solid = SolidDepths(layouts, resources, names={lamp.object})
        seen, whole = np.zeros((height, width), np.float32), np.full((height, width), 1e-30, np.float32)
        for at, layer in enumerate(_blocked(layouts, solid, places, frame, plane, clearance_m)):
            weight = frame.received(places[at], areas[at])
            whole += weight
            seen += weight * (layer == 0)
            yield
        found[..., channel] = seen / whole * _solid_angles(lamp, frame, coarse)
    return found


def _blocked(
    layouts: Layouts, solid: SolidDepths, places: Floats, frame: PlaneFrame, plane: Floats, clearance_m: float
) -> Iterator[NDArray[np.float32]]:
    """For each point (K, 3): (rows, columns), not 0 where a surface lies between it and the plane."""
    depths = depth_texture(layouts.device, *frame.size, AT_ONCE)
    shifts = hammersley(max(len(places), 1)) - 0.5  # of texels: jitters edges from point to point
    for first in range(0, len(places), AT_ONCE):
        mine = range(first, min(first + AT_ONCE, len(places)))
        encoder = layouts.device.create_command_encoder()
        for k in mine:
            view = depths.create_view(dimension="2d", base_array_layer=k - first, array_layer_count=1)
            solid.draw(encoder, view, frame.clip_from_world(places[k], plane, clearance_m, shifts[k]))
        layouts.device.queue.submit([encoder.finish()])
        for k in mine:
            yield read_depths(layouts.device, depths, k - first)


def _solid_angles(lamp: PlaneLamp, frame: PlaneFrame, coarse: Floats) -> NDArray[np.float32]:
    """(rows, columns) unoccluded solid angle, sr, of a lamp; projected areas are interpolated from `coarse` points."""
    width, height = frame.size
    across = lamp.solid_angles(coarse) * ((coarse - lamp.centre) ** 2).sum(axis=1)
    lines = (np.arange(count) + 0.5 for count in (height, width))
    at = np.meshgrid(*(line * (COARSE - 1) / len(line) for line in lines), indexing="ij")
    shown = map_coordinates(across.reshape(COARSE, COARSE), at, order=1, mode="nearest")
    return np.asarray(shown / frame.distances2(lamp.centre), np.float32)
