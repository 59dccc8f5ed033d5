"""Points all over an object: blue noise by sample elimination, denser where reflections change within less distance.

Candidates, several to a point, are drawn by area. Those whose neighbours are closest are taken away until as many are
left as are wanted (Yuksel 2015, "Sample elimination for generating Poisson disk sample sets"), distances measured by
the spacing that the density gives at each.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.scenes.scene import Mesh

CANDIDATES = 8  # for each point
NEIGHBOURS = 40  # of a candidate that weigh: within two spacings there are about 30
SHARPNESS = 8  # exponent of a neighbour's weight (Yuksel 2015, section 3)
AROUND = 9  # nearest candidates that curvature is found from, the candidate itself included
DENSER_CURVED, DENSER_NEAR = 2.0, 2.0  # more points where the surface turns, or other things are, within the spacing
OPPOSED = 0.2  # cosine to the triangle's normal below which a shading normal is not believed


@dataclass(frozen=True)
class SurfacePoints:
    """Points of a surface and its unit normals there, (n, 3) float64 each."""

    positions: Floats
    normals: Floats

    def __getitem__(self, chosen: Indices | Flags | slice) -> SurfacePoints:
        return SurfacePoints(self.positions[chosen], self.normals[chosen])

    def __len__(self) -> int:
        return len(self.positions)


def spread_evenly(mesh: Mesh, count: int, rng: np.random.Generator) -> SurfacePoints:
    """Points in equal shares of a surface's area, with its shading normals; none where it has no area."""
    areas = triangle_areas(mesh.corners)
    if not areas.sum() > 0:
        return SurfacePoints(np.zeros((0, 3)), np.zeros((0, 3)))
    up_to = np.cumsum(areas)
    face = np.searchsorted(up_to, (np.arange(count) + rng.random(count)) / count * up_to[-1], side="right")
    face = np.minimum(face, np.flatnonzero(areas)[-1])
    weights = rng.dirichlet((1, 1, 1), size=count)
    corners = mesh.corners_of(face)
    positions = np.einsum("kc,kcx->kx", weights, corners)
    flat = triangle_normals(corners)
    leaning = normalize(np.einsum("kc,kcx->kx", weights, mesh.normals[mesh.faces[face]].astype(float)))
    opposed = (leaning * flat).sum(axis=1, keepdims=True) < OPPOSED
    return SurfacePoints(positions, np.where(opposed, flat, leaning))


def densities(points: SurfacePoints, area_m2: float, count: int, free_m: Floats) -> Floats:
    """Points per m^2 (n,) at points drawn by `spread_evenly`, for `count` points in all.

    Curvature and nearness are both shares from 0 to 1, by the spacing s of evenly spread points: k s/(1 + k s) of the
    curvature k, and the mean of s/(s + d) over the distances d that rays travel in `free_m` (n, rays). `area_m2` is
    that of the surface. The densest places have 1 + DENSER_CURVED + DENSER_NEAR times as many to an area as flat and
    free ones.
    """
    spacing = np.sqrt(area_m2 / count)
    curved = curvatures(points) * spacing
    near = (spacing / (spacing + free_m)).mean(axis=1)
    relative = 1 + DENSER_CURVED * curved / (1 + curved) + DENSER_NEAR * near
    return np.asarray(relative * count / (area_m2 * relative.mean()))


def curvatures(points: SurfacePoints) -> Floats:
    """How fast the normal turns (n,), 1/m, from each point to those nearest to it."""
    if len(points) < AROUND:
        return np.zeros(len(points))
    from scipy.spatial import cKDTree

    distance, other = cKDTree(points.positions).query(points.positions, AROUND)
    turned = np.linalg.norm(points.normals[other] - points.normals[:, None], axis=-1)
    same_side = turned < np.sqrt(2)
    return np.asarray((turned * same_side).sum(axis=1) / np.maximum((distance * same_side).sum(axis=1), 1e-12))


def thinned(points: SurfacePoints, density: Floats, count: int, rng: np.random.Generator) -> Indices:
    """Which points of `spread_evenly` to keep, `count` or all: blue noise of a `density` (n,), points per m^2."""
    kept = np.flatnonzero(rng.random(len(points)) * density.max(initial=0) <= density)
    if len(kept) < 2 * count:  # too few to choose from
        kept = np.arange(len(points))
    radius = np.sqrt(1 / (2 * np.sqrt(3) * density[kept]))  # of the densest packing of discs (Yuksel 2015, eq. 1)
    return np.asarray(kept[eliminated(points[kept], radius, count)])


def eliminated(points: SurfacePoints, radius: Floats, count: int) -> Indices:
    """The `count` of n points, in rising order, that are left when those nearest to others are taken away one by one.

    Neighbours are within the sum of both radii (n,), on the same side: the sides of a thin sheet do not see each other.
    """
    if len(points) <= count:
        return np.arange(len(points))
    weights = _weights(points, radius)
    total = np.asarray(weights.sum(axis=1)).ravel()
    heap = [(-weight, i) for i, weight in enumerate(total.tolist())]
    heapq.heapify(heap)
    there = np.ones(len(points), bool)
    left = len(points)
    while left > count:
        weight, i = heap[0]
        if -weight > total[i]:  # weights only fall: what the heap knows is never too small
            heapq.heapreplace(heap, (-float(total[i]), i))
            continue
        heapq.heappop(heap)
        there[i] = False
        left -= 1
        mine = slice(weights.indptr[i], weights.indptr[i + 1])
        total[weights.indices[mine]] -= weights.data[mine]
    return np.flatnonzero(there)


def _weights(points: SurfacePoints, radius: Floats):  # type: ignore[no-untyped-def]
    """Symmetric sparse (n, n) array: how much each neighbour weighs."""
    from scipy.sparse import csr_array
    from scipy.spatial import cKDTree

    n, k = len(points), min(NEIGHBOURS + 1, len(points))
    distance, other = cKDTree(points.positions).query(points.positions, k)
    one = np.repeat(np.arange(n), k)
    other = other.ravel()
    reach = distance.ravel() / (radius[one] + radius[other])
    beside = (reach < 1) & (one != other)
    beside &= (points.normals[one] * points.normals[other]).sum(axis=1) > 0
    found = csr_array(((1 - reach[beside]) ** SHARPNESS, (one[beside], other[beside])), shape=(n, n))
    return found.maximum(found.T).tocsr()
