"""The sample map: by texel of an object's charts, the nearest points above its horizon."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import CANDIDATES, NO_EXIT, NO_POINT
from lambent.baked.light_fields.nearest_points import Sees, nearest_points
from lambent.baking.surfaces.texels import texels_of
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import cross_2d, triangle_areas

FINER = 8  # texels to the spacing of the points, about
MOST_TEXELS, LONGEST = 1 << 18, 8192  # of a sample map, and along its sides
GUTTER = 2  # texels around charts that have the entries of the nearest one


@dataclass(frozen=True)
class SampleMap:
    """`entries` (h, w, 4) uint16, and where they are: see `LightField`; `exits` as in its `Glass`."""

    entries: NDArray[np.uint16]
    corner: tuple[int, int]
    grid: tuple[int, int]
    exits: NDArray[np.float16] | None = None


FindExits = Callable[[Floats, Floats], Floats]  # of places and normals (n, 3): their exits (n, 4), as in `Glass`


def sample_map(
    geometry: dict[str, Floats], faces: Indices, size: tuple[int, int], points: Floats, spacing_m: float,
    find_exits: FindExits | None = None, sees: Sees | None = None, side: float = 1.0,
) -> SampleMap:  # fmt: skip
    """The sample map of an object.

    Parameters
    ----------
    geometry : the arrays geometry/* of a store.
    faces : (F,) the object's.
    size : width and height of the light map.
    points : (P, 3), P at most 65535.
    spacing_m : of the points; texels are finer, as far as the map has room.
    find_exits : finds the faces behind places, where the object is of glass.
    sees : whether places see points (`baked.light_fields.nearest_points`).
    side : -1 where viewers see the object from the other side of its normals.
    """
    grid, low, high = rectangle(geometry, faces, size, spacing_m)
    width, height = (int(side) for side in high - low)
    cropped = (geometry["uv2"].astype(float) * grid - low) / (width, height)
    texels = texels_of({**geometry, "faces": geometry["faces"][faces], "uv2": cropped}, width, height)
    middle, normal = (
        texels.positions.mean(axis=1, dtype=float),
        side * normalize(texels.normals.sum(axis=1, dtype=float)),
    )
    entries = np.full((height * width, CANDIDATES), NO_POINT, np.uint16)
    entries[texels.index] = nearest_points(middle, normal, points, sees)
    covered = np.zeros(height * width, bool)
    covered[texels.index] = True
    shape = height, width, CANDIDATES
    filled = with_gutters(entries.reshape(shape), covered.reshape(height, width), NO_POINT)
    (left, top), (columns, rows) = map(int, low), map(int, grid)
    if find_exits is None:
        return SampleMap(filled, (top, left), (rows, columns))
    exits = np.zeros((height * width, 4), np.float16)
    exits[texels.index] = find_exits(middle, normal)
    whole = with_gutters(exits.reshape(height, width, 4), covered.reshape(height, width), NO_EXIT)
    return SampleMap(filled, (top, left), (rows, columns), whole)


def rectangle(
    geometry: Mapping[str, Floats], faces: Indices, size: tuple[int, int], spacing_m: float
) -> tuple[Indices, Indices, Indices]:
    """The grid of a sample map over the whole light map, and its first texel and the one after its last: x and y."""
    corners = geometry["uv2"][geometry["faces"][faces]].astype(float) * size
    scale = finer_by(geometry["positions"][geometry["faces"][faces]].astype(float), corners, spacing_m)
    grid = np.array(size) * scale
    low = np.maximum(np.floor(corners.min(axis=(0, 1)) * scale).astype(int) - GUTTER, 0)
    return grid, low, np.minimum(np.ceil(corners.max(axis=(0, 1)) * scale).astype(int) + GUTTER, grid)


def megabytes(geometry: Mapping[str, Floats], faces: Indices, size: tuple[int, int], spacing_m: float) -> float:
    """Memory of a sample map, as `sample_map` makes it."""
    _, low, high = rectangle(geometry, faces, size, spacing_m)
    return float((high - low).prod() * CANDIDATES * np.dtype(np.uint16).itemsize / 1e6)


def finer_by(positions: Floats, corners: Floats, spacing_m: float) -> int:
    """How many times as fine as the light map the sample map is; triangles (F, 3, 3) and (F, 3, 2), in its texels."""
    in_map = np.abs(cross_2d(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).sum() / 2
    texel_m = np.sqrt(triangle_areas(positions).sum() / max(in_map, 1e-9))
    sides = np.maximum(np.ptp(corners.reshape(-1, 2), axis=0), 1)
    room = min(np.sqrt(MOST_TEXELS / sides.prod()), (LONGEST / sides).min())
    return int(max(1, min(np.ceil(FINER * texel_m / spacing_m), np.floor(room))))


def with_gutters(values: NDArray[Any], covered: Flags, nothing: float) -> NDArray[Any]:
    """Values (h, w, 4) with those of the nearest `covered` texel (h, w) in others, up to GUTTER texels away."""
    from scipy.ndimage import distance_transform_edt

    distance, (row, column) = distance_transform_edt(~covered, return_indices=True)
    near = distance < GUTTER + 1
    return np.asarray(np.where(near[..., None], values[row, column], nothing)).astype(values.dtype)
