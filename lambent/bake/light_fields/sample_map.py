"""The sample map: by texel of an object's charts, the nearest points above its horizon.

Thesis R, section 3: of texel t the nearest points p with n_t . normalize(p - t) > cos 85 deg, nearest first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.bake.surfaces.texels import texels_of
from lambent.bake.tiles import slices
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.directions import normalize
from lambent.core.geometry import cross_2d, triangle_areas
from lambent.core.light_field import CANDIDATES, NO_POINT

HORIZON_DEG = 85.0
FINER = 8  # texels to the spacing of the points, about
MOST_TEXELS, LONGEST = 1 << 18, 8192  # of a sample map, and along its sides
GUTTER = 2  # texels around charts that have the entries of the nearest one
FIRST_ASKED = 12  # points by distance, of which most texels find their four
AT_ONCE = 1 << 16


@dataclass(frozen=True)
class SampleMap:
    """`entries` (h, w, 4) uint16, and where they are: see `core.light_field.LightField`."""

    entries: NDArray[np.uint16]
    corner: tuple[int, int]
    grid: tuple[int, int]


def sample_map(
    geometry: dict[str, Floats], faces: Indices, size: tuple[int, int], points: Floats, spacing_m: float
) -> SampleMap:
    """The sample map of an object.

    Parameters
    ----------
    geometry : the arrays geometry/* of a store.
    faces : (F,) the object's.
    size : width and height of the light map.
    points : (P, 3), P at most 65535.
    spacing_m : of the points; texels are finer, as far as the map has room.
    """
    corners = geometry["uv2"][geometry["faces"][faces]].astype(float) * size
    scale = finer_by(geometry["positions"][geometry["faces"][faces]].astype(float), corners, spacing_m)
    grid = np.array(size) * scale
    low = np.maximum(np.floor(corners.min(axis=(0, 1)) * scale).astype(int) - GUTTER, 0)
    high = np.minimum(np.ceil(corners.max(axis=(0, 1)) * scale).astype(int) + GUTTER, grid)
    width, height = (int(side) for side in high - low)
    cropped = (geometry["uv2"].astype(float) * grid - low) / (width, height)
    texels = texels_of({**geometry, "faces": geometry["faces"][faces], "uv2": cropped}, width, height)
    middle, normal = texels.positions.mean(axis=1, dtype=float), normalize(texels.normals.sum(axis=1, dtype=float))
    entries = np.full((height * width, CANDIDATES), NO_POINT, np.uint16)
    entries[texels.index] = nearest_points(middle, normal, points)
    covered = np.zeros(height * width, bool)
    covered[texels.index] = True
    filled = with_gutters(entries.reshape(height, width, CANDIDATES), covered.reshape(height, width))
    (left, top), (columns, rows) = map(int, low), map(int, grid)
    return SampleMap(filled, (top, left), (rows, columns))


def finer_by(positions: Floats, corners: Floats, spacing_m: float) -> int:
    """How many times as fine as the light map the sample map is; triangles (F, 3, 3) and (F, 3, 2), in its texels."""
    in_map = np.abs(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum() / 2
    texel_m = np.sqrt(triangle_areas(positions).sum() / max(in_map, 1e-9))
    sides = np.maximum(np.ptp(corners.reshape(-1, 2), axis=0), 1)
    room = min(np.sqrt(MOST_TEXELS / sides.prod()), (LONGEST / sides).min())
    return int(max(1, min(np.ceil(FINER * texel_m / spacing_m), np.floor(room))))


def nearest_points(places: Floats, normals: Floats, points: Floats) -> NDArray[np.uint16]:
    """(n, 4) the nearest points (P, 3) above the horizon of places (n, 3) of unit normals (n, 3), then NO_POINT."""
    from scipy.spatial import cKDTree

    found = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    tree = cKDTree(points) if len(points) else None
    for mine in slices(len(places), AT_ONCE):
        left, asked = np.arange(mine.start, mine.stop), FIRST_ASKED
        while tree is not None and len(left):
            asked = min(asked, len(points))
            distance, index = tree.query(places[left], asked)
            distance, index = distance.reshape(-1, asked), index.reshape(-1, asked)
            chosen, known = _chosen(places[left], normals[left], points, distance, index)
            found[left[known]] = chosen[known]
            left, asked = left[~known], 4 * asked
    return found


def _chosen(
    places: Floats, normals: Floats, points: Floats, distance: Floats, index: Indices
) -> tuple[NDArray[np.uint16], Flags]:
    """The nearest CANDIDATES of the points asked for that are above the horizon, and where no other can be nearer."""
    offset = points[index] - places[:, None]
    length = np.linalg.norm(offset, axis=-1)
    above = (offset * normals[:, None]).sum(axis=-1) > np.cos(np.radians(HORIZON_DEG)) * length
    key = np.where(above, length, np.inf)
    order = np.lexsort((index, key))[:, :CANDIDATES]
    best, at = np.take_along_axis(key, order, axis=1), np.take_along_axis(index, order, axis=1)
    chosen = np.full((len(places), CANDIDATES), NO_POINT, np.uint16)
    chosen[:, : at.shape[1]] = np.where(np.isfinite(best), at, NO_POINT)
    everything = index.shape[1] == len(points)
    return chosen, np.full(len(places), True) if everything else best[:, -1] < distance[:, -1]


def with_gutters(entries: NDArray[np.uint16], covered: Flags) -> NDArray[np.uint16]:
    """Entries (h, w, 4) with those of the nearest `covered` texel (h, w) in others, up to GUTTER texels away."""
    from scipy.ndimage import distance_transform_edt

    distance, (row, column) = distance_transform_edt(~covered, return_indices=True)
    near = distance < GUTTER + 1
    return np.where(near[..., None], entries[row, column], NO_POINT).astype(np.uint16)
