"""The share of points seen by a surface that is hidden from its probe.

A probe shows the view from its centre; a surface mirrors its own view. Rays from points all over an object, which is
left out as in its probe, find what its surface sees; other things hide a share of these hits from the centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.baked.probes.lookups import planes_lookup
from lambent.baking.tracing.rays import array_of, cosine_directions, distances, leaving, rays_from
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals
from lambent.scenes.scene import Mesh

RAYS = 4096  # per object
OFTEN = 0.9
SHORT = 1e-3  # metres, and share of the distance: rays that end this close to a hit are unoccluded


@dataclass(frozen=True)
class Seen:
    """Rays from a surface: origins, unit directions, hits (n, 3), and hit flags (n,)."""

    origins: Floats
    directions: Floats
    hits: Floats
    valid: Flags

    def among(self, mine: Flags) -> Seen:
        """The subset `mine` (n,)."""
        return Seen(self.origins[mine], self.directions[mine], self.hits[mine], self.valid[mine])


def seen_from(points: Floats, normals: Floats, without: Any) -> Seen:
    """Cosine-distributed rays from points (n, 3), of unit normals (n, 3), of a surface that `without` leaves out."""
    directions = cosine_directions(normals)
    return seen_along(array_of(leaving(without, points, normals, directions).o).astype(float), directions, without)


def seen_along(origins: Floats, directions: Floats, without: Any) -> Seen:
    """First hits of rays (n, 3) in a Mitsuba scene."""
    distance = distances(without, rays_from(origins, directions))
    valid = np.isfinite(distance)
    return Seen(origins, directions, origins + directions * np.where(valid, distance, 0.0)[:, None], valid)


def hidden_share(seen: Seen, centre: Floats, without: Any) -> float:
    """Share of the hits that are occluded from the centre; 0 without hits."""
    if not seen.valid.any():
        return 0.0
    offset = seen.hits[seen.valid] - centre
    distance = np.linalg.norm(offset, axis=1)
    t = distances(without, rays_from(centre, offset / np.maximum(distance, 1e-9)[:, None]))
    return float((t < distance * (1 - SHORT) - SHORT).mean())


def parallax_deg(seen: Seen, centre: Floats, planes: Floats) -> float:
    """Angle in degrees from the hit, as seen from the centre, to the look-up; the OFTEN quantile over the rays.

    `planes` (P, 4) are relative to the centre.
    """
    if not seen.valid.any():
        return 0.0
    origins, w, hits = (a[seen.valid] for a in (seen.origins, seen.directions, seen.hits))
    cosine = (normalize(planes_lookup(origins - centre, w, planes)) * normalize(hits - centre)).sum(axis=1)
    return float(np.degrees(np.quantile(np.arccos(cosine.clip(-1, 1)), OFTEN)))


def spread(mesh: Mesh, count: int) -> tuple[Floats, Floats]:
    """Points and normals (count, 3), uniform over the area."""
    corners = mesh.corners
    up_to = np.cumsum(triangle_areas(corners))
    rng = np.random.default_rng(0)
    face = np.searchsorted(up_to, (np.arange(count) + 0.5) / count * up_to[-1]).clip(0, len(corners) - 1)
    points = points_on_triangles(corners, face, rng)
    order = rng.permutation(count)  # decorrelates a point's place on the object from its ray's direction
    return points[order], triangle_normals(corners)[face][order]
