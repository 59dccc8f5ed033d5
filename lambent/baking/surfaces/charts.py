"""Charts: parts of objects laid flat in the light map.

xatlas parametrises. Its time is quadratic in the size of a smooth chart, and it overruns its memory on a chart of
80,000 triangles, so large meshes are first cut into pieces. A cut costs nothing but a seam.

Charts of a few texels are mostly border. Flat ones of one object are merged by the six directions that faces point to
and projected along them; faces of a merged chart share texels if one lies behind another.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.baking.surfaces.clusters import clusters_of
from lambent.baking.surfaces.copies import Copies
from lambent.baking.surfaces.layers import in_first_layer, layers_of, lie_flat
from lambent.baking.surfaces.parametrization import Laid, laid_flat
from lambent.core.arrays import Flags, Floats, Indices, components
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import area_vectors, cross_2d, triangle_areas, triangle_normals
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Mesh, SceneObject

PIECE_FACES = 1500  # larger pieces are slower, smaller ones cost seams
SMALL = 12.0  # texels: smaller charts may be merged with others
FLAT_DEG = 25.0  # largest angle between a chart's normals and their mean for merging
SLIM = 0.35  # covered share of its texels below which a chart may be merged too
ANGLES = np.arange(8) * np.pi / 16  # rotations tried for charts, to take fewer texels
STRETCH = 2.5  # texels of surface along one texel of a chart by xatlas, at most


@dataclass(frozen=True)
class Piece:
    """Some faces (K,), near each other, of the object with this number."""

    owner: int
    faces: Indices


@dataclass(frozen=True)
class Chart:
    """Faces (K,) of an object, their corners on the chart (K, 3, 2) in texels, and the vertex of each corner (K, 3).

    Vertices are numbered within the object's charts of one kind; no two charts share one.
    """

    faces: Indices
    corners: Floats
    vertices: Indices


def pieces_of(objects: tuple[SceneObject, ...], copies: Copies, longest_m: float = np.inf) -> list[Piece]:
    """All faces in spatially compact pieces of at most PIECE_FACES (halved at the median of the longest side).

    The centres of a piece's faces are at most `longest_m` apart. Copies share the pieces of their original, as the same
    arrays, if none of them is longer than that.
    """
    pieces: list[Piece] = []
    of_first: dict[int, list[Indices]] = {}
    for owner, o in enumerate(objects):
        first = int(copies.first[owner])
        parts = of_first.get(first)
        if parts is None or (longest_m < np.inf and max(_diagonal(o.mesh, part) for part in parts) > longest_m):
            parts = _parts(o.mesh, longest_m)
            of_first.setdefault(first, parts)
        pieces += [Piece(owner, part) for part in parts]
    return pieces


def _diagonal(mesh: Mesh, faces: Indices) -> float:
    return float(np.linalg.norm(np.ptp(mesh.positions[mesh.faces[faces]].reshape(-1, 3), axis=0)))


def _parts(mesh: Mesh, longest_m: float) -> list[Indices]:
    centres = mesh.positions[mesh.faces].mean(axis=1)
    left, parts = [np.arange(len(mesh.faces))], []
    while left:
        part = left.pop()
        extent = np.ptp(centres[part], axis=0)
        if len(part) <= PIECE_FACES and extent.max() <= longest_m:
            parts.append(np.sort(part))
            continue
        axis = np.argmax(extent)
        order = part[np.argsort(centres[part, axis], kind="stable")]
        left += [order[len(order) // 2 :], order[: len(order) // 2]]
    return parts


def charts_of(
    objects: tuple[SceneObject, ...],
    pieces: list[Piece],
    sizes_m: Floats,
    copies: Copies,
    progress: Progress = silent,
) -> list[list[Chart]]:
    """Charts of all faces, by object; `sizes_m` (N,) is the texel size on each piece, in metres.

    Copies with the same pieces, and texels of equal relative size, share the same list.
    """
    unwrapped = _unwrapped(objects, pieces, copies)
    of_object: list[list[int]] = [[] for _ in objects]
    for i, piece in enumerate(pieces):
        of_object[piece.owner].append(i)
    known: dict[tuple[object, ...], list[Chart]] = {}
    charts = []
    for owner, (o, mine) in enumerate(zip(objects, of_object, strict=True)):
        progress(owner, len(objects), "unwrapping")
        first, scale = int(copies.first[owner]), copies.scale[owner]
        key = (first, *((id(pieces[i].faces), round(float(np.log(sizes_m[i] / scale)), 6)) for i in mine))
        if key not in known:
            size = np.zeros(len(o.mesh.faces))
            for i in mine:
                size[pieces[i].faces] = sizes_m[i]
            faces = np.concatenate([np.zeros(0, np.int64), *(pieces[i].faces for i in mine)])
            known[key] = _merged(o.mesh, _charts(o.mesh, faces, [unwrapped[i] for i in mine], size[faces]), size)
        charts.append(known[key])
    return charts


def _unwrapped(objects: tuple[SceneObject, ...], pieces: list[Piece], copies: Copies) -> list[Laid]:
    """What xatlas makes of each piece. Copies share it.

    Pieces are scaled to one size: xatlas ignores triangles below 1.2e-7 of its units squared.
    """
    keys = [(int(copies.first[piece.owner]), id(piece.faces)) for piece in pieces]
    number: dict[tuple[int, int], int] = {}
    meshes = []
    for piece, key in zip(pieces, keys, strict=True):
        if key in number:
            continue
        number[key] = len(number)
        mesh = objects[piece.owner].mesh
        vertices, faces = np.unique(mesh.faces[piece.faces], return_inverse=True)
        at = mesh.positions[vertices].astype(np.float64)
        at = (at - at.mean(axis=0)) / max(float(np.ptp(at, axis=0).max()), 1e-30)
        faces = np.ascontiguousarray(faces.reshape(-1, 3), dtype=np.uint32)
        meshes.append((at.astype(np.float32), faces, mesh.normals[vertices]))
    found = laid_flat(meshes)
    return [found[number[key]] for key in keys]


def _charts(mesh: Mesh, faces: Indices, pieces: list[Laid], size_m: Floats) -> list[Chart]:
    """The charts of an object from xatlas's `pieces`, of faces (K,) with texels of `size_m` (K,).

    Faces without area in the map, stretched ones, and those that pass others of their chart within a texel have no
    corners (K, 0, 2).
    """
    first = np.cumsum([0, *(len(vertices) for vertices, _, _ in pieces)])
    uv = np.concatenate([np.zeros((0, 2), np.float32), *(own for _, _, own in pieces)])
    each = (own.astype(np.int64) + start for (_, own, _), start in zip(pieces, first, strict=False))
    indices = np.concatenate([np.zeros((0, 3), np.int64), *each])
    label = components(np.concatenate([indices[:, :2], indices[:, 1:]]), len(uv))[indices[:, 0]]
    world = mesh.corners_of(faces) / size_m[:, None, None]
    corners = _in_texels(world, uv[indices].astype(float), label)
    lost = ~np.isfinite(corners).all(axis=(1, 2)) | _is_stretched(world, corners)
    charts = []
    flat = np.zeros(label.max(initial=-1) + 1, bool)
    sound = lie_flat(corners[~lost], world[~lost], label[~lost])
    flat[: len(sound)] = sound
    for mine in _groups(np.where(lost, -1, label)):
        if not lost[mine[0]]:
            kept = mine
            while not flat[label[mine[0]]] and not (inside := in_first_layer(corners[kept], world[kept])).all():
                kept = kept[inside]  # a smaller chart is laid out again
            lost[np.setdiff1d(mine, kept, assume_unique=True) if len(kept) < len(mine) else []] = True
            charts.append(Chart(faces[kept], corners[kept], indices[kept]))
    charts.append(Chart(faces[lost], np.zeros((lost.sum(), 0, 2)), indices[lost]))
    return charts


def _groups(label: Indices) -> list[Indices]:
    """Face numbers by label (F,)."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)


def _in_texels(world: Floats, uv: Floats, label: Indices) -> Floats:
    """Corners (F, 3, 2) of charts scaled to the lengths of the triangles (F, 3, 3), by least squares; NaN on failure.

    xatlas fits small charts to whole texels, each axis separately: lengths^2 = a du^2 + b dv^2.
    """
    edge = np.roll(world, -1, axis=1) - world
    run = (np.roll(uv, -1, axis=1) - uv) ** 2
    length = (edge**2).sum(axis=2)
    total = np.bincount(label, length.sum(axis=1))[label][:, None]

    def summed(values: Floats) -> Floats:
        return np.asarray(np.bincount(label, (values / np.maximum(total, 1e-300)).sum(axis=1)), float)

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


def _is_stretched(world: Floats, corners: Floats) -> Flags:
    """Flags of triangles (F, 3, 3) with an edge much longer than on the chart (F, 3, 2), both in texels."""
    length, on_chart = (np.linalg.norm(np.roll(a, -1, axis=1) - a, axis=2) for a in (world, corners))
    return np.asarray(((length > 1) & (length > STRETCH * on_chart)).any(axis=1))


def texels_taken(extents: Floats) -> Floats:
    """Texels of rectangles (..., 2) when packed: each side is at least one texel."""
    return np.asarray((np.maximum(extents, 1) + 1).prod(axis=-1))


def upright(corners: Floats) -> Floats:
    """A chart (K, 3, 2) rotated to minimise the texels of its bounding rectangle, by ANGLES and its longest edge."""
    edges = (np.roll(corners, -1, axis=1) - corners).reshape(-1, 2)
    longest = edges[(edges**2).sum(axis=1).argmax()]
    turns = _turns(np.append(ANGLES, np.arctan2(longest[1], longest[0])))
    taken = texels_taken(np.ptp(corners.reshape(-1, 2) @ turns, axis=1))
    return np.asarray(corners @ turns[taken.argmin()])


def _turns(angles: Floats) -> Floats:
    """(N, 2, 2) rotations by -angles, applied to rows from the left."""
    c, s = np.cos(angles), np.sin(angles)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def _merged(mesh: Mesh, charts: list[Chart], size_m: Floats) -> list[Chart]:
    """Charts of an object, with small ones merged if that takes fewer texels."""
    lost = np.concatenate([chart.faces for chart in charts if not chart.corners.size])
    kept = [chart for chart in charts if chart.corners.size]
    is_small, taken = _small(mesh, kept)
    small = [chart for chart, one in zip(kept, is_small, strict=True) if one]
    kept = [chart for chart, one in zip(kept, is_small, strict=True) if not one]
    if small:
        merged = _by_direction(mesh, np.concatenate([chart.faces for chart in small]), size_m, 1)
        extents = np.array([np.ptp(chart.corners.reshape(-1, 2), axis=0) for chart in merged])
        kept += merged if texels_taken(extents).sum() < taken else small
    return kept + _by_direction(mesh, lost, size_m, 1 + len(kept))


def _small(mesh: Mesh, charts: list[Chart]) -> tuple[Flags, float]:
    """Flags of charts to merge (N,), and the texels they take.

    All faces of such a chart point almost one way: on round objects, seams along six directions would be visible.
    """
    if not charts:
        return np.zeros(0, bool), 0.0
    counts = [len(chart.faces) for chart in charts]
    starts = np.cumsum([0, *counts[:-1]])
    corners, faces = (np.concatenate(a) for a in zip(*((c.corners, c.faces) for c in charts), strict=True))
    edge = corners - corners[:, :1]
    area = np.add.reduceat(np.abs(cross_2d(edge[:, 1], edge[:, 2])) / 2, starts)
    low, high = np.minimum.reduceat(corners.min(axis=1), starts), np.maximum.reduceat(corners.max(axis=1), starts)
    here = texels_taken(high - low)
    vectors = area_vectors(mesh.corners_of(faces))
    mean = np.repeat(normalize(np.add.reduceat(vectors, starts)), counts, axis=0)
    flat = np.minimum.reduceat((normalize(vectors) * mean).sum(axis=1), starts) > np.cos(np.radians(FLAT_DEG))
    small = ((area < SMALL) | (area < SLIM * here)) & flat
    return small, float(here[small].sum())


def _by_direction(mesh: Mesh, faces: Indices, size_m: Floats, first: int) -> list[Chart]:
    """Merged charts of some faces; corners of different `first` are different vertices. `size_m` (F,): of all faces."""
    corners, size_m = mesh.corners_of(faces).astype(float), size_m[faces]
    normals, areas = triangle_normals(corners), triangle_areas(corners)
    axis = np.where(areas > 0, np.abs(normals).argmax(axis=1), np.ptp(corners, axis=1).argmin(axis=1))
    towards = 2 * axis + (np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0)
    charts: list[Chart] = []
    turns = _turns(ANGLES)
    for direction in np.unique(towards):
        left, depth = [np.flatnonzero(towards == direction)], int(direction // 2)
        while left:
            one = left.pop()
            for mine in (one[group] for group in clusters_of(corners[one], areas[one], size_m[one], depth, turns)):
                local = corners[mine] / _mean_size(areas[mine], size_m[mine])
                flat = upright(np.delete(local, depth, axis=2))
                layers = layers_of(flat, local[:, :, depth])
                if len(layers) > 1:
                    left += [mine[layer] for layer in layers]
                    continue
                number = mesh.faces[faces[mine]].astype(np.int64) + len(mesh.positions) * (first + len(charts))
                charts.append(Chart(faces[mine], flat, -number))  # negative: distinct from charts by xatlas
    return charts


def _mean_size(areas: Floats, size_m: Floats) -> float:
    return float(np.average(size_m, weights=areas)) if areas.sum() > 0 else float(size_m.mean())
