"""How much of its lamps each point of a planar reflector sees: a map over the plane, made once.

Sixteen places of a lamp draw what stands between them and the plane, each by the projection that has the reflector for
its picture. A texel holds the solid angles, in sr, of at most four lamps, one per channel, penumbras included. No look-up
in a mirrored view could tell: it does not hold what its eye does not see.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from lambent.core.arrays import Floats
from lambent.core.directions import normalize
from lambent.core.sequences import hammersley
from lambent.realtime.layouts import Layouts
from lambent.realtime.plane_lamps import MOST, POINTS, PlaneLamp
from lambent.realtime.solid_depths import SolidDepths, depth_texture, read_depths

LONGER_PX = 512  # texels along the longer side of a map
STEP_PX = 64  # rows that can be read back are multiples of this
COARSE = 24  # places along each side where the shape of a lamp is summed over all its triangles
THIN = 1e-3  # of a lamp's height: what is nearer to its places than that blocks nothing
LEAST = 1e-9  # sr


@dataclass(frozen=True, eq=False)
class PlaneFrame:
    """A rectangle about a reflector: corner (3,), axes (2, 3), sides (2,) in metres, and size (width, height) in texels."""

    corner: Floats
    axes: Floats
    sides_m: Floats
    size: tuple[int, int]

    @staticmethod
    def about(outline: Floats, normal: Floats) -> PlaneFrame:
        """That of an outline (P, 3), along its longest edge."""
        edges = np.roll(outline, -1, axis=0) - outline
        across = normalize(edges[np.argmax(np.linalg.norm(edges, axis=1))])
        axes = np.stack([across, np.cross(normal, across)])
        places = outline @ axes.T
        low, sides = places.min(axis=0), np.maximum(np.ptp(places, axis=0), 1e-3)
        corner = outline[0] + (low - outline[0] @ axes.T) @ axes
        px = np.maximum(np.ceil(sides / sides.max() * LONGER_PX / STEP_PX) * STEP_PX, STEP_PX).astype(int)
        return PlaneFrame(corner, axes, sides, (int(px[0]), int(px[1])))

    def points(self, columns: Floats, rows: Floats) -> Floats:
        """(..., 3) places of texels; whole numbers and a half are their middles."""
        shares = np.stack([columns / self.size[0], rows / self.size[1]], axis=-1)
        return np.asarray(self.corner + (shares * self.sides_m) @ self.axes)

    def texel_rows(self) -> Floats:
        """(2, 4) that turn a place (x, y, z, 1) into columns and rows."""
        scale = self.axes * (np.array(self.size) / self.sides_m)[:, None]
        return np.column_stack([scale, -scale @ self.corner])

    def clip_from_world(self, place: Floats, plane: Floats, least_m: float, jitter_px: Floats) -> Floats:
        """(4, 4) of the projection from a place (3,) over the plane (n, d); depths rise with the height over it.

        What is lower than `least_m` is cut away, as is what is higher than the place.
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
    """(height, width, MOST) sr of each lamp that the middles of texels see; `resources` is a `SceneResources`."""
    width, height = frame.size
    columns, rows = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    points = frame.points(columns, rows).reshape(-1, 3)
    found = np.zeros((height, width, MOST), np.float16)
    for channel, lamp in enumerate(lamps):
        foot = _nearest(frame, lamp.centre)
        places, areas = lamp.light_points(foot)
        depths = depth_texture(layouts.device, width, height, POINTS)
        encoder, solid = layouts.device.create_command_encoder(), SolidDepths(layouts, resources, names={lamp.object})
        for layer, (place, shift) in enumerate(zip(places, hammersley(len(places)) - 0.5, strict=True)):
            view = depths.create_view(dimension="2d", base_array_layer=layer, array_layer_count=1)
            solid.draw(encoder, view, frame.clip_from_world(place, plane, clearance_m, shift))
        layouts.device.queue.submit([encoder.finish()])
        seen, whole = np.zeros(len(points), np.float32), np.full(len(points), 1e-30, np.float32)
        for layer, (place, area) in enumerate(zip(places, areas, strict=True)):
            to = (points - place).astype(np.float32)
            weight = np.maximum(to @ area.astype(np.float32), 0) / np.einsum("px,px->p", to, to) ** 1.5
            whole += weight
            seen += weight * (read_depths(layouts.device, depths, layer).reshape(-1) == 0)
        share = (seen / whole).reshape(height, width)
        found[..., channel] = np.where(share > 0, share * _solid_angles(lamp, frame, points).reshape(height, width), 0)
    return found


def _nearest(frame: PlaneFrame, place: Floats) -> Floats:
    """The point (3,) of the rectangle that is nearest to a place."""
    shares = np.clip((place - frame.corner) @ frame.axes.T, 0, frame.sides_m)
    return np.asarray(frame.corner + shares @ frame.axes)


def _solid_angles(lamp: PlaneLamp, frame: PlaneFrame, points: Floats) -> NDArray[np.float32]:
    """(P,) of points at the texels of the frame, in order: areas across the view are interpolated, distances are not."""
    width, height = frame.size
    u, v = np.meshgrid(np.linspace(0, width, COARSE), np.linspace(0, height, COARSE))
    coarse = frame.points(u, v).reshape(-1, 3)
    across = lamp.solid_angles(coarse) * ((coarse - lamp.centre) ** 2).sum(axis=1)
    step = (COARSE - 1) / np.array([height, width])
    at = (np.indices((height, width)) + 0.5) * step[:, None, None]
    shown = map_coordinates(across.reshape(COARSE, COARSE), at, order=1, mode="nearest").reshape(-1)
    return np.asarray(np.maximum(shown / ((points - lamp.centre) ** 2).sum(axis=1), LEAST), np.float32)
