"""Look-ups in a light field: the points near a place on the surface, and the values of their octahedral maps.

These are numpy versions of the renderer's shaders, tested for parity. Points are given by index, (...) integers;
directions (..., 3) need not be unit.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import SKY_SHARE, LightField, Sky
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.octahedral import texel_directions, to_square

FOCUS = 8.0  # exponent of weights by the place between texels
WHOLE = 15  # `LightField.cover` of a texel without sky


def nearest_points(field: LightField, uv2: Floats) -> Indices:
    """(..., 4) points named by the sample map at uv2 (..., 2) of the light map, nearest first, or NO_POINT.

    Reads the nearest texel, clamped to the map's rectangle.
    """
    rows, columns = field.grid
    column = np.floor(uv2[..., 0] * columns).astype(np.int64) - field.corner[1]
    row = np.floor(uv2[..., 1] * rows).astype(np.int64) - field.corner[0]
    height, width = field.sample_map.shape[:2]
    found = field.sample_map[row.clip(0, height - 1), column.clip(0, width - 1)]
    return np.asarray(found, np.int64)


def radiance_along(field: LightField, point: Indices, w: Floats, sky: Sky | None = None) -> Floats:
    """(..., 3) radiance that points see along directions: bilinear between the four nearest texels.

    Texels that show both surfaces and sky hold the light of the surfaces; a given `sky` is mixed in by its share.
    """
    total, open_sky = np.zeros(w.shape), np.zeros(w.shape[:-1])
    mixes = sky is not None and field.cover is not None
    for weight, texel in _between(point, w, field.radiance.shape[1]):
        if mixes and field.cover is not None:
            part = SKY_SHARE[field.cover[texel]] * weight
            open_sky, weight = open_sky + part, weight - part
        total += weight[..., None] * field.radiance[texel]
    if sky is not None and (edge := open_sky > 0).any():
        total[edge] += open_sky[edge][:, None] * sky(w[edge])
    return total


def focus_along(field: LightField, w: Floats) -> Floats:
    """(...) weights of light between the four nearest texels: 1 at a texel's centre, least in the middle of four.

    The sum of the squared bilinear weights, to the power of FOCUS: of several points that see the same surface, the one
    with a texel's centre near the wanted place blurs it least.
    """
    at = to_square(w) * field.radiance.shape[1] - 0.5
    share = at - np.floor(at)
    return np.asarray((share**2 + (1 - share) ** 2).prod(axis=-1) ** FOCUS)


def surface_along(field: LightField, point: Indices, w: Floats) -> tuple[Floats, Floats, Floats]:
    """Surfaces before the sky between the four nearest texels, in light fields with `cover`.

    Returns the radiance (..., 3) of texels that show surfaces, times their share (...) of the interpolation, and the
    share (...) of the sky that surfaces cover, between the four nearest quarters of texels.
    """
    assert field.cover is not None, "only quarters of texels tell edges"
    n = field.radiance.shape[1]
    light, shows, share = np.zeros(w.shape), np.zeros(w.shape[:-1]), np.zeros(w.shape[:-1])
    for weight, texel in _between(point, w, n):
        weight = np.where(field.cover[texel] != 0, weight, 0.0)
        light, shows = light + weight[..., None] * field.radiance[texel], shows + weight
    for weight, (_, row, column) in _between(point, w, 2 * n):
        bit = field.cover[point, row // 2, column // 2] >> (2 * (row % 2) + column % 2).astype(np.uint8)
        share += weight * (bit & 1)
    return light, shows, share


def whole_texels(radiance: Floats, cover: NDArray[np.uint8], sky: Sky) -> Floats:
    """Maps (P, E, E, 3) with the sky mixed in by its share of the texels that hold the light of a surface."""
    n = cover.shape[1]
    behind = sky(texel_directions(n).reshape(-1, 3)).reshape(n, n, 3)
    found, share = np.array(radiance, np.float32), SKY_SHARE[cover]
    point, row, column = np.nonzero(share)
    part = share[point, row, column, None].astype(np.float32)
    found[point, row, column] += part * (behind[row, column] - found[point, row, column])
    return found


def nearness_along(field: LightField, point: Indices, w: Floats) -> Floats:
    """(...) inverse distance, 1/m, of the nearest texel along directions; 0 for the sky.

    In texels that show both, the quarter decides.
    """
    place, at = _texel_along(field, w)
    found = np.asarray(field.inverse_distance[point, at[..., 1], at[..., 0]], np.float64)
    if field.cover is None:
        return found
    half = place - at >= 0.5
    bit = field.cover[point, at[..., 1], at[..., 0]] >> (2 * half[..., 1] + half[..., 0]).astype(np.uint8)
    return np.where(bit & 1, found, 0.0)


def cover_along(field: LightField, point: Indices, w: Floats) -> NDArray[np.uint8]:
    """(...) bits of `LightField.cover` of the nearest texel along directions."""
    assert field.cover is not None, "this light field has whole texels"
    _, at = _texel_along(field, w)
    return np.asarray(field.cover[point, at[..., 1], at[..., 0]])


def _between(point: Indices, w: Floats, n: int) -> Iterator[tuple[Floats, tuple[Indices, Indices, Indices]]]:
    """The four nearest texels of maps of n x n: weights (...) and indices of points, rows and columns."""
    at = to_square(w) * n - 0.5
    low = np.floor(at)
    share = at - low
    column, row = low[..., 0].astype(np.int64), low[..., 1].astype(np.int64)
    for i in (0, 1):
        for j in (0, 1):
            weight = np.abs(1 - j - share[..., 0]) * np.abs(1 - i - share[..., 1])
            yield weight, (point, *_on_map(row + i, column + j, n))


def _texel_along(field: LightField, w: Floats) -> tuple[Floats, Indices]:
    """Place (..., 2) on a map along directions, in texels, and the texel's column and row."""
    n = field.inverse_distance.shape[1]
    place = to_square(w) * n
    return place, np.minimum(place.astype(np.int64), n - 1)


def _on_map(row: Indices, column: Indices, n: int) -> tuple[Indices, Indices]:
    """Map texels at most one beyond an edge back into the map, mirrored as in `octahedral.bordered`."""
    row_beyond, column_beyond = (row < 0) | (row >= n), (column < 0) | (column >= n)
    row, column = row.clip(0, n - 1), column.clip(0, n - 1)
    return np.where(column_beyond, n - 1 - row, row), np.where(row_beyond, n - 1 - column, column)
