"""Charts: parts of objects that lie flat in the light map.

xatlas parametrises. Its time is quadratic in the size of a smooth chart, and it overruns its memory on a chart of
80,000 triangles: large meshes are cut into pieces first. A cut costs a seam, nothing else.

Charts of a few texels are mostly border. Those of one object are taken together by the six directions that faces look
to, and projected along them: faces of one merged chart share texels where one lies behind another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xatlas

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.errors import UserError
from lambent.core.geometry import cross_2d, triangle_areas, triangle_normals
from lambent.scenes.scene import Mesh, SceneObject

PIECE_FACES = 1500  # more per piece is slower, fewer cost seams
SMALL = 12.0  # texels: a smaller chart may be merged with others
SLIM = 0.35  # share of the texels it takes that a chart lies on, below which it may be merged, too
LONGEST = 24.0  # texels: side of a merged chart
MIXED = 0.1  # texels that one texel is worth whose faces are mixed over a depth of one texel


@dataclass(frozen=True)
class Piece:
    """Some faces (K,) of the object with this number, near each other."""

    owner: int
    faces: Indices


@dataclass(frozen=True)
class Chart:
    """Faces (K,) of an object, their corners on the chart (K, 3, 2) in texels, and which corners are one vertex (K, 3).

    Vertices are counted within the object's charts of one kind; no two charts share one.
    """

    owner: int
    faces: Indices
    corners: Floats
    vertices: Indices


def pieces_of(objects: tuple[SceneObject, ...]) -> list[Piece]:
    """All faces in spatially compact pieces of at most PIECE_FACES (halved at the median of the longest side)."""
    pieces = []
    for owner, o in enumerate(objects):
        centres = o.mesh.positions[o.mesh.faces].mean(axis=1)
        left: list[Indices] = [np.arange(len(o.mesh.faces))]
        while left:
            part = left.pop()
            if len(part) <= PIECE_FACES:
                pieces.append(Piece(owner, np.sort(part)))
                continue
            axis = np.argmax(np.ptp(centres[part], axis=0))
            order = part[np.argsort(centres[part, axis], kind="stable")]
            left += [order[len(order) // 2 :], order[: len(order) // 2]]
    return pieces


def charts_of(objects: tuple[SceneObject, ...], pieces: list[Piece], sizes_m: Floats) -> list[Chart]:
    """Charts of all faces; `sizes_m` (N,) is the size of a texel on each piece, in metres."""
    unwrapped = _unwrapped(objects, pieces)
    charts = []
    for owner, o in enumerate(objects):
        mine = [i for i, piece in enumerate(pieces) if piece.owner == owner]
        size = np.zeros(len(o.mesh.faces))
        for i in mine:
            size[pieces[i].faces] = sizes_m[i]
        first = np.cumsum([0] + [len(unwrapped[i][0]) for i in mine])
        own = [
            c
            for i, n in zip(mine, first, strict=False)
            for c in _charts(o.mesh, pieces[i], unwrapped[i], sizes_m[i], n)
        ]
        charts += _merged(o.mesh, owner, own, size)
    return charts


def _unwrapped(objects: tuple[SceneObject, ...], pieces: list[Piece]) -> list[tuple[Floats, Indices, Floats]]:
    """By piece as xatlas has it: the vertex of each of its vertices, faces, and coordinates.

    Pieces are scaled to one size: xatlas ignores triangles below 1.2e-7 of its units squared.
    """
    atlas = xatlas.Atlas()
    for piece in pieces:
        o = objects[piece.owner]
        vertices, faces = np.unique(o.mesh.faces[piece.faces], return_inverse=True)
        at = o.mesh.positions[vertices].astype(np.float64)
        at = (at - at.mean(axis=0)) / max(float(np.ptp(at, axis=0).max()), 1e-30)
        faces = np.ascontiguousarray(faces.reshape(-1, 3), dtype=np.uint32)
        try:
            atlas.add_mesh(at.astype(np.float32), faces, o.mesh.normals[vertices])
        except (RuntimeError, ValueError) as error:
            raise UserError(f"object cannot be unwrapped ({error})", field=o.name) from error
    packing = xatlas.PackOptions()
    packing.resolution, packing.padding, packing.bilinear = 16 * int(np.ceil(np.sqrt(len(pieces)))), 0, False
    atlas.generate(xatlas.ChartOptions(), packing, False)
    return [atlas[i] for i in range(len(pieces))]


def _charts(mesh: Mesh, piece: Piece, found: tuple[Floats, Indices, Floats], size_m: float, first: int) -> list[Chart]:
    """The charts of a piece, its vertices counted from `first`. Charts without area have no corners (K, 0, 2)."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    vertex_of, indices, uv = found
    indices = indices.astype(np.int64)
    edges = np.concatenate([indices[:, :2], indices[:, 1:]])
    shape = (len(vertex_of), len(vertex_of))
    graph = coo_matrix((np.ones(len(edges), bool), (edges[:, 0], edges[:, 1])), shape=shape)
    label = connected_components(graph, directed=False)[1][indices[:, 0]]
    corners = _in_metres(mesh.positions[mesh.faces[piece.faces]].astype(float), uv[indices].astype(float), label)
    order = np.argsort(label, kind="stable")
    charts = []
    for mine in np.split(order, np.flatnonzero(np.diff(label[order])) + 1):
        here = corners[mine] / size_m if np.isfinite(corners[mine]).all() else np.zeros((len(mine), 0, 2))
        charts.append(Chart(piece.owner, piece.faces[mine], here, first + indices[mine]))
    return charts


def _in_metres(world: Floats, uv: Floats, label: Indices) -> Floats:
    """Corners (F, 3, 2) of charts as long as the triangles (F, 3, 3) are, by least squares; NaN where that fails.

    xatlas fits small charts into whole texels of its own, each axis by itself: lengths^2 = a du^2 + b dv^2.
    """
    edge = np.roll(world, -1, axis=1) - world
    run = (np.roll(uv, -1, axis=1) - uv) ** 2
    length = (edge**2).sum(axis=2)
    total = np.bincount(label, length.sum(axis=1))[label][:, None]

    def summed(values: Floats) -> Floats:
        return np.bincount(label, (values / np.maximum(total, 1e-300)).sum(axis=1))

    uu, uv_, vv = summed(run[..., 0] ** 2), summed(run[..., 0] * run[..., 1]), summed(run[..., 1] ** 2)
    ul, vl = summed(run[..., 0] * length), summed(run[..., 1] * length)
    twice = np.abs(cross_2d(uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]))
    in_map, in_world = np.bincount(label, twice), np.bincount(label, 2 * triangle_areas(world))
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = uu * vv - uv_**2
        a, b = (ul * vv - vl * uv_) / determinant, (vl * uu - ul * uv_) / determinant
        even = in_world / in_map
        found = (a > 0) & (b > 0) & (determinant > 1e-9 * uu * vv)
        scale = np.sqrt(np.stack([np.where(found, a, even), np.where(found, b, even)], axis=1))
        scale *= np.sqrt(in_world / (in_map * scale.prod(axis=1)))[:, None]
    scale[(in_map <= 0) | (in_world <= 0)] = np.nan
    return np.asarray(uv * scale[label][:, None])


def texels_taken(corners: Floats) -> float:
    """Texels of a rectangle around a chart (K, 3, 2), as it is packed."""
    return float((np.maximum(np.ptp(corners.reshape(-1, 2), axis=0), 1) + 1).prod())


def _merged(mesh: Mesh, owner: int, charts: list[Chart], size_m: Floats) -> list[Chart]:
    """Charts of an object, small ones merged where that takes fewer texels."""
    small, kept = [], []
    for chart in charts:
        if not chart.corners.size:
            small.append((chart, np.inf))
            continue
        edge = chart.corners - chart.corners[:, :1]
        area, taken = float(np.abs(cross_2d(edge[:, 1], edge[:, 2])).sum() / 2), texels_taken(chart.corners)
        if area < SMALL or area < SLIM * taken:
            small.append((chart, taken))
        else:
            kept.append(chart)
    if not small:
        return kept
    faces = np.concatenate([chart.faces for chart, _ in small])
    merged = _by_direction(mesh, owner, faces, size_m[faces])
    if sum(texels_taken(chart.corners) for chart in merged) < sum(taken for _, taken in small):
        return kept + merged
    return kept + [chart for chart, _ in small]


def _by_direction(mesh: Mesh, owner: int, faces: Indices, size_m: Floats) -> list[Chart]:
    corners = mesh.positions[mesh.faces[faces]].astype(float)
    normals, areas = triangle_normals(corners), triangle_areas(corners)
    axis = np.abs(normals).argmax(axis=1)
    towards = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0)
    charts, count = [], len(mesh.positions)
    for direction in np.unique(towards):
        for mine in _clusters(corners, areas, size_m, np.flatnonzero(towards == direction), direction // 2):
            flat = np.delete(corners[mine], direction // 2, axis=2) / _mean_size(areas[mine], size_m[mine])
            number = mesh.faces[faces[mine]].astype(np.int64) + count * (1 + len(charts))
            charts.append(Chart(owner, faces[mine], flat, -number))  # negative: none of a chart by xatlas
    return charts


def _mean_size(areas: Floats, size_m: Floats) -> float:
    return float(np.average(size_m, weights=areas)) if areas.sum() > 0 else float(size_m.mean())


def _clusters(corners: Floats, areas: Floats, size_m: Floats, faces: Indices, depth: int) -> list[Indices]:
    """Faces in groups that lie close together, each halved as long as that costs less."""
    centres = corners.mean(axis=1)

    def cost(mine: Indices) -> tuple[float, float]:
        size = _mean_size(areas[mine], size_m[mine])
        extent = np.ptp(corners[mine].reshape(-1, 3), axis=0) / size
        sides = np.maximum(np.delete(extent, depth), 1)
        return float((sides + 1).prod() + MIXED * areas[mine].sum() / size**2 * extent[depth]), float(sides.max())

    left, found = [(faces, *cost(faces))], []
    while left:
        mine, price, side = left.pop()
        best: tuple[float, list[tuple[Indices, float, float]]] = (np.inf, [])
        for axis in range(3):
            along = centres[mine, axis]
            lower: Flags = along < (along.min() + along.max()) / 2
            if lower.any() and not lower.all():
                halves = [(half, *cost(half)) for half in (mine[lower], mine[~lower])]
                best = min(best, (halves[0][1] + halves[1][1], halves), key=lambda one: one[0])
        if best[1] and (best[0] < price or side > LONGEST):
            left += best[1]
        else:
            found.append(mine)
    return found
