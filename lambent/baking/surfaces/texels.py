"""Surface points of the light map's texels.

Texel (row, column) is the square from (column/W, row/H) to ((column + 1)/W, (row + 1)/H), and holds the mean over the
surface in it. Its points are spread over that by area, each at random in its own stratum, so that irradiance that
varies within a texel is unbiased. A texel that bilinear look-ups touch although it has hardly any surface gets points
from the whole footprint of those look-ups: its own square and half a texel around.

Points are stored, not drawn again for each sample, because each is tested for lying within a solid and for visibility:
one side of a texel across a wall may be a thousand times as bright as the other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.baking.surfaces.coverage import Pieces, corners_of, density_of, in_cell, pieces_of, placed
from lambent.core.arrays import Flags, Floats, Indices, components
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import area_vectors, cross_2d, triangle_areas

POINTS = 4  # per texel, an even number
SLIVER = 0.02  # covered share of a texel below which its points also come from around it
FOOTPRINT = 0.5  # texels around a texel from which bilinear look-ups touch it
MARGIN = 2e-6  # metres, and share of the largest coordinate, from the border of a triangle
MOST = 0.2  # largest share of a triangle's height that is margin
BEYOND = 1 << 40  # added to a texel's chart label if no viewer sees it (tracing/visibility.py)


@dataclass(frozen=True)
class Texels:
    """Surface points of the covered texels, in row-major order of the texels.

    index (K,) int64 is row * width + column; face (K, POINTS) int64 indexes the merged geometry; positions, normals
    (shading) and flat (of the triangle) are (K, POINTS, 3) float32. Each point represents an equal share of area.
    spacing (K,) is the texel size in metres, area_m2 (K,) the surface in the texel's square: less than spacing^2 at
    borders of charts, 0 for a texel only touched by look-ups.
    """

    width: int
    height: int
    index: Indices
    face: Indices
    positions: Floats
    normals: Floats
    flat: Floats
    spacing: Floats
    area_m2: Floats


@dataclass(frozen=True)
class Sides:
    """The points of a map that light can reach, on one side of the surfaces.

    `sign` is +1 for the normal's side, -1 for the other; valid (K, POINTS) bool is false for points within a solid,
    and, on the back, for objects that light does not cross.
    """

    texels: Texels
    sign: float
    valid: Flags


def texels_of(geometry: dict[str, Floats], width: int, height: int) -> Texels:
    """Surface points of all texels of a light map; `geometry` as in `atlas.merged`. Deterministic."""
    corners = corners_of(geometry, width, height)
    own = pieces_of(geometry, width, height)
    around = pieces_of(geometry, width, height, reach=FOOTPRINT)
    size = density_of(geometry, corners)
    in_map = np.divide(own.area, size[own.face], out=np.zeros(len(own.area)), where=size[own.face] > 0)
    slight = np.bincount(own.cell, in_map, minlength=width * height) < SLIVER
    parts = [_points(own, corners, width, 0.0, ~slight), _points(around, corners, width, FOOTPRINT, slight)]
    index, face, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
    order = np.argsort(index)
    index, face, weights = index[order], face[order], weights[order]
    weights = _off_borders(geometry, face, weights)
    area_m2 = np.bincount(own.cell, own.area, minlength=width * height)[index]
    return Texels(width, height, index, face, *_surface(geometry, face, weights), np.sqrt(size[face[:, 0]]), area_m2)


def area_of_texels(texels: Texels) -> Floats:
    """(H, W) surface area in m^2 in each texel's square."""
    found = np.zeros(texels.width * texels.height)
    found[texels.index] = texels.area_m2
    return found.reshape(texels.height, texels.width)


def covered_share(texels: Texels) -> Floats:
    """(H, W) share, 0 to 1, of each texel's square that is covered by surface."""
    found = np.zeros(texels.width * texels.height)
    found[texels.index] = np.minimum(texels.area_m2 / np.maximum(texels.spacing, 1e-12) ** 2, 1)
    return found.reshape(texels.height, texels.width)


def _points(
    pieces: Pieces, corners: Floats, width: int, reach: float, chosen: Flags
) -> tuple[Indices, Indices, Floats]:
    """Chosen cells (K,) with pieces, and POINTS in each: faces (K, POINTS), weights (K, POINTS, 3)."""
    mine = chosen[pieces.cell]
    cell, face, area = pieces.cell[mine], pieces.face[mine], pieces.area[mine]
    index, first, count = np.unique(cell, return_index=True, return_counts=True)
    if not len(index):
        return index, np.zeros((0, POINTS), int), np.zeros((0, POINTS, 3))
    u = _strata(len(index))
    after = np.cumsum(area)
    before = after - area
    low, high = before[first], after[first + count - 1]
    target = low[:, None] + u[..., 0] * (high - low)[:, None]
    piece = np.searchsorted(after, target, side="right").clip(first[:, None], (first + count - 1)[:, None])
    u[..., 0] = ((target - before[piece]) / area[piece]).clip(0, 1)
    at, shape = piece.reshape(-1), (len(index), POINTS)
    x, y = cell[at] % width, cell[at] // width
    local = in_cell(corners[face[at]], x, y, reach)
    weights = _barycentric(local, placed(local, u.reshape(-1, 2)))
    return index, face[at].reshape(shape), weights.reshape(*shape, 3)


def _strata(count: int) -> Floats:
    """(count, POINTS, 2) points of the unit square, each at random in its own row and column.

    Rows and columns are paired at random, so that every place can occur. Opposite points are mirror images, which
    cancels the noise of linear variation (antithetic variates).
    """
    rng, half = np.random.default_rng(0), POINTS // 2
    pair = np.argsort(rng.random((count, half)), axis=1)
    row = np.where(rng.random((count, half)) < 0.5, pair, POINTS - 1 - pair)
    place = np.stack([np.broadcast_to(np.arange(half), row.shape), row], axis=-1)
    u = (place + rng.random((count, half, 2))) / POINTS
    return np.concatenate([u, 1 - u[:, ::-1]], axis=1)


def _off_borders(geometry: dict[str, Floats], face: Indices, weights: Floats) -> Floats:
    """Weights that move points MARGIN off the borders of their triangles, as far as the triangle's width allows.

    On the border itself a ray would start in the plane of the neighbouring wall, and might miss it.
    """
    p = geometry["positions"][geometry["faces"]].astype(float)
    edges = np.linalg.norm(p[:, [1, 2, 0]] - p[:, [2, 0, 1]], axis=2)  # opposite the corners
    twice = 2 * triangle_areas(p)[:, None]
    heights = np.divide(twice, edges, out=np.zeros_like(edges), where=edges > 0)
    margin = MARGIN * (1 + np.abs(p).max(axis=(1, 2)))[:, None]
    least = np.divide(margin, heights, out=np.full_like(heights, MOST), where=heights > 0).clip(0, MOST)
    moved = np.maximum(weights, least[face])
    return np.asarray(moved / moved.sum(axis=-1, keepdims=True))


def _barycentric(triangles: Floats, points: Floats) -> Floats:
    """Barycentric weights (n, 3), none below 0, of points (n, 2) in triangles (n, 3, 2)."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    weights = np.stack([cross_2d(c - b, points - b), cross_2d(a - c, points - c), cross_2d(b - a, points - a)], -1)
    weights = np.maximum(weights * np.sign(cross_2d(b - a, c - a))[:, None], 0)
    total = weights.sum(axis=1, keepdims=True)
    return np.asarray(np.divide(weights, total, out=np.full(weights.shape, 1 / 3), where=total > 0))


def _surface(geometry: dict[str, Floats], face: Indices, weights: Floats) -> tuple[Floats, Floats, Floats]:
    """Positions, shading normals and triangle normals at barycentric weights on faces."""
    corner = geometry["faces"][face]  # (K, POINTS, 3)
    p = geometry["positions"][corner]
    position = np.einsum("kpcx,kpc->kpx", p, weights)
    flat = normalize(area_vectors(p).astype(np.float64))
    normal = normalize(np.einsum("kpcx,kpc->kpx", geometry["normals"][corner], weights))
    normal = np.where((normal == 0).all(axis=-1, keepdims=True), flat, normal)
    return position.astype(np.float32), normal.astype(np.float32), flat.astype(np.float32)


def chart_labels(geometry: dict[str, Floats], texels: Texels) -> Indices:
    """(H, W) number of each texel's chart, -1 in gutters."""
    faces = geometry["faces"].astype(np.int64)
    label = components(np.concatenate([faces[:, :2], faces[:, 1:]]), len(geometry["positions"]))
    labels = np.full(texels.width * texels.height, -1)
    labels[texels.index] = label[faces[texels.face[:, 0], 0]]
    return labels.reshape(texels.height, texels.width)
