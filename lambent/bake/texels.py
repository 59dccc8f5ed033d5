"""Which surface point a texel of the light map stands for.

Texel (row, column) has its centre at ((column + 1/2)/W, (row + 1/2)/H). Every texel that a bilinear look-up on a
triangle can touch gets points: up to four where the quarters' centres lie on a triangle, else the nearest point of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.frames import normalize

Array = NDArray[np.floating]
Indices = NDArray[np.integer]
POINTS = 4  # per texel
PULL = 0.25  # texels
BEYOND = 1 << 40  # added to the label of a chart, for texels that no viewer sees (see viewers.py)
CANDIDATES_AT_ONCE = 1 << 21  # (triangle, texel) pairs tested in one go: some 200 MB


@dataclass(frozen=True)
class Texels:
    """Surface points of the covered texels, in row-major order of the texels.

    index (K,) int64 is row * width + column; face (K, POINTS) int64 counts through the merged geometry; positions,
    normals (shading) and flat (of the triangle) are (K, POINTS, 3) float32. Points repeat where there are fewer.
    spacing (K,) is the size of a texel in metres.
    """

    width: int
    height: int
    index: Indices
    face: Indices
    positions: Array
    normals: Array
    flat: Array
    spacing: Array


def texels_of(geometry: dict[str, Array], width: int, height: int) -> Texels:
    """Surface points of all texels of a light map; `geometry` as in `atlas.merged`."""
    corners = geometry["uv2"][geometry["faces"]].astype(np.float64)  # (T, 3, 2)
    whole = _nearest(corners, width, height, reach=1.0)
    _pull_inwards(whole, corners * (width, height))
    quarters = _nearest(corners, 2 * width, 2 * height, reach=0.0)
    index = np.flatnonzero(whole.face >= 0)
    row, column = index // width, index % width
    quarter = [(2 * row + r) * 2 * width + 2 * column + c for r in (0, 1) for c in (0, 1)]
    face = np.stack([quarters.face[q] for q in quarter], axis=1)
    weights = np.stack([quarters.weights[q] for q in quarter], axis=1)
    bare = (face < 0).all(axis=1)
    face[bare], weights[bare] = whole.face[index[bare], None], whole.weights[index[bare], None]
    found = np.argmax(face >= 0, axis=1)
    rows = np.arange(len(index))
    missing = face < 0
    face = np.where(missing, face[rows, found][:, None], face)
    weights = np.where(missing[..., None], weights[rows, found][:, None], weights)
    return Texels(
        width,
        height,
        index,
        face,
        *_surface(geometry, face, weights),
        _spacing(geometry, corners * (width, height), face),
    )


def _spacing(geometry: dict[str, Array], corners: Array, face: Indices) -> Array:
    """Metres per texel (K,): root of a triangle's area in the scene over that in the map, 0 where that has none."""
    p = geometry["positions"][geometry["faces"]].astype(float)
    world = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1)
    texels = np.abs(_cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    ratio = np.divide(world, texels, out=np.zeros(len(world)), where=texels > 0)
    return np.asarray(np.sqrt(ratio[face[:, 0]]))


def _pull_inwards(best: _Nearest, corners: Array) -> None:
    """Move points that were clamped to an edge towards the triangle's middle, by PULL texels at most.

    On the edge itself a ray would start in the plane of the neighbouring wall, and might miss it.
    """
    clamped = np.flatnonzero((best.face >= 0) & (best.distance > 0))
    triangle, weights = corners[best.face[clamped]], best.weights[clamped]
    to_middle = triangle.mean(axis=1) - np.einsum("ncx,nc->nx", triangle, weights)
    share = np.minimum(PULL / np.maximum(np.linalg.norm(to_middle, axis=1), 1e-12), 1.0)[:, None]
    best.weights[clamped] = weights * (1 - share) + share / 3


def _surface(geometry: dict[str, Array], face: Indices, weights: Array) -> tuple[Array, Array, Array]:
    """Positions, shading normals and triangle normals at barycentric weights on faces."""
    corner = geometry["faces"][face]  # (K, POINTS, 3)
    p = geometry["positions"][corner]
    position = np.einsum("kpcx,kpc->kpx", p, weights)
    flat = normalize(np.cross(p[..., 1, :] - p[..., 0, :], p[..., 2, :] - p[..., 0, :]).astype(np.float64))
    normal = normalize(np.einsum("kpcx,kpc->kpx", geometry["normals"][corner], weights))
    normal = np.where((normal == 0).all(axis=-1, keepdims=True), flat, normal)
    return position.astype(np.float32), normal.astype(np.float32), flat.astype(np.float32)


@dataclass
class _Nearest:
    """Per cell of a grid: the nearest triangle within reach (-1: none), and barycentric weights of the point."""

    face: Indices
    weights: Array
    distance: Array


def _nearest(corners_uv: Array, width: int, height: int, reach: float) -> _Nearest:
    cells = width * height
    best = _Nearest(np.full(cells, -1), np.zeros((cells, 3)), np.full(cells, np.inf))
    corners = corners_uv * (width, height) - 0.5  # cell centres at whole numbers
    low = np.ceil(corners.min(axis=1) - reach).astype(int).clip(0, (width - 1, height - 1))
    high = np.floor(corners.max(axis=1) + reach).astype(int).clip(-1, (width - 1, height - 1))
    counts = (high - low + 1).clip(0)
    pairs = counts[:, 0] * counts[:, 1]
    start = 0
    while start < len(corners):
        total = np.cumsum(pairs[start:])
        stop = start + max(1, int(np.searchsorted(total, CANDIDATES_AT_ONCE, side="right")))
        _closer(best, corners, np.arange(start, stop), low, counts, width, reach)
        start = stop
    return best


def _closer(best: _Nearest, corners: Array, faces: Indices, low: Indices, counts: Indices, width: int, reach: float):
    """Take into `best` what the given faces offer; the first of equals wins, so the result is deterministic."""
    pairs = counts[faces, 0] * counts[faces, 1]
    face = np.repeat(faces, pairs)
    number = np.arange(len(face)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    x, y = low[face, 0] + number % counts[face, 0], low[face, 1] + number // counts[face, 0]
    cells = np.stack([x, y], axis=-1).astype(float)
    weights, within = _barycentric(corners[face], cells)
    distance = np.zeros(len(face))
    near = within
    if reach > 0:
        outside = np.flatnonzero(~within)
        weights[outside], offset = _closest_on_edges(corners[face[outside]], cells[outside])
        distance[outside] = (offset**2).sum(axis=-1)
        near[outside] = np.abs(offset).max(axis=-1) <= reach
    cell, face, weights, distance = (y * width + x)[near], face[near], weights[near], distance[near]
    order = np.lexsort((face, distance, cell))
    cell, first = np.unique(cell[order], return_index=True)
    chosen = order[first]
    closer = distance[chosen] < best.distance[cell]
    cell, chosen = cell[closer], chosen[closer]
    best.face[cell], best.weights[cell], best.distance[cell] = face[chosen], weights[chosen], distance[chosen]


def _barycentric(triangles: Array, points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Barycentric weights (n, 3) of points (n, 2) in triangles (n, 3, 2), and whether they lie within."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    area = _cross(b - a, c - a)
    solid = np.abs(area) > 1e-12
    weights = np.stack([_cross(c - b, points - b), _cross(a - c, points - c), _cross(b - a, points - a)], -1)
    weights /= np.where(solid, area, 1.0)[:, None]
    return weights, (weights >= 0).all(axis=1) & solid


def _closest_on_edges(triangles: Array, points: Array) -> tuple[Array, Array]:
    """Barycentric weights (n, 3) of the points on the triangles' edges nearest to points (n, 2), and the offsets."""
    best = np.full(len(points), np.inf)
    weights, offset = np.zeros((len(points), 3)), np.zeros((len(points), 2))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, edge = triangles[:, i], triangles[:, j] - triangles[:, i]
        length = (edge**2).sum(axis=1)
        t = np.divide(((points - start) * edge).sum(axis=1), length, out=np.zeros(len(points)), where=length > 0)
        t = t.clip(0, 1)
        away = points - start - t[:, None] * edge
        closer = (away**2).sum(axis=1) < best
        best[closer] = (away[closer] ** 2).sum(axis=1)
        offset[closer], weights[closer] = away[closer], 0
        weights[closer, i], weights[closer, j] = 1 - t[closer], t[closer]
    return weights, offset


def _cross(a: Array, b: Array) -> Array:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def chart_labels(geometry: dict[str, Array], texels: Texels) -> Indices:
    """(H, W) number of the chart each texel belongs to, -1 in the gutters."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    faces, vertices = geometry["faces"].astype(np.int64), len(geometry["positions"])
    edges = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_matrix((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=(vertices, vertices))
    label = connected_components(graph, directed=False)[1]
    labels = np.full(texels.width * texels.height, -1)
    labels[texels.index] = label[faces[texels.face[:, 0], 0]]
    return labels.reshape(texels.height, texels.width)
