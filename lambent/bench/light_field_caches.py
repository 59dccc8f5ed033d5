"""Miss rates of caches of a light field's maps, as in tables 6.3 to 6.6 of thesis R."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bench.light_field_view import LightFieldView
from lambent.core.arrays import Floats
from lambent.core.cubemap import face_places
from lambent.core.light_field import NO_POINT, LightField
from lambent.core.light_field_lookup import Place
from lambent.core.map_cache import POLICIES, KnownFuture, MapCache, fewest_misses, misses

SCATTERED = 100  # samples of a BRDF
TILE = 16  # pixels: a renderer's order of shading
FACE_TEXELS = 128  # along a face of the thesis's cube maps


def caches(
    field: LightField, place: Place, view: LightFieldView, capacities: tuple[int, ...]
) -> Iterator[dict[str, Any]]:
    """Misses in percent of reads, pixel by pixel: in rows, as the thesis's renderer shades, or in tiles.

    Maps are read whole: for the surface (the first point), for reflections (all four), and for SCATTERED samples of a
    BRDF with the points in the outer loop, which reads each map that often in a row. The sample map is read by rows.
    """
    pixel, first = np.unique(view.shown.pixel, return_index=True)
    row, column = np.divmod(pixel, view.size[0])
    across = column // TILE
    orders = {"rows": np.lexsort((column, row)), "tiles": np.lexsort((column, row, across, row // TILE))}
    sample_rows = np.floor(view.shown.uv2[first, 1:] * field.grid[0]).astype(np.int64)
    points = place.points[first]
    for what, of, again in (
        ("sample map", sample_rows, 1), ("surface", points[:, :1], 1), ("reflection", points, 1),
        ("BRDF", points, SCATTERED),
    ):  # fmt: skip
        for order, pixels in orders.items():
            wanted = of[pixels]
            reads = wanted[wanted != NO_POINT].tolist()
            for capacity in capacities:
                missed = {name: misses(reads, make(capacity)) for name, make in POLICIES.items()}
                missed["known future"] = fewest_misses(reads, capacity)
                percent = {name: round(100 * found / (len(reads) * again), 4) for name, found in missed.items()}
                count = len(reads) * again
                yield {
                    "reads": what, "order": order, "maps": capacity, "count": count, "first": len(set(reads)),
                    "miss_percent": percent,
                }  # fmt: skip
    yield from thesis_reads(Place(place.x[first], place.n[first], points), view.shown.w[first], orders, capacities)


def thesis_reads(
    place: Place, w: Floats, orders: dict[str, NDArray[np.int64]], capacities: tuple[int, ...]
) -> Iterator[dict[str, Any]]:
    """Misses of reflections by the thesis's count: of each texel of bilinear look-ups in cube maps.

    An item is a face of a cube map, read on demand from its first row to that of the texel (section 4.3; rows are
    consecutive in compressed TIFF files).
    """
    for order, pixels in orders.items():
        face, _, row = face_places(np.repeat(w[pixels, None], place.points.shape[1], axis=1), FACE_TEXELS)
        known = place.points[pixels] != NO_POINT
        item = (6 * place.points[pixels] + face)[known].repeat(4).tolist()
        rows = (row[known][:, None] + [0, 0, 1, 1]).ravel().tolist()
        reads = list(zip(item, rows, strict=True))
        for capacity in capacities:
            kept = {name: make(capacity) for name, make in POLICIES.items()}
            kept["known future"] = KnownFuture(item, capacity)
            missed = {name: round(100 * partial_misses(reads, of) / len(reads), 4) for name, of in kept.items()}
            said = {"reads": "reflection, texels of faces", "order": order, "maps": capacity}
            yield {**said, "count": len(reads), "first": len(set(item)), "miss_percent": missed}


def partial_misses(reads: list[tuple[int, int]], cache: MapCache) -> int:
    """Reads (item, row) that find their item missing from `cache`, or read only to an earlier row."""
    ends, missed = dict[int, int](), 0
    for item, row in reads:
        end = ends.get(item, -1) if cache.read(item) else -1
        missed += row > end
        ends[item] = max(end, row)
    return missed
