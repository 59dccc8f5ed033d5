"""Miss rates of caches of a light field's maps, as in tables 6.3 to 6.6 of thesis R."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from lambent.baked.light_fields.light_field import NO_POINT, LightField
from lambent.baked.light_fields.lookup import Place
from lambent.baked.light_fields.map_cache import POLICIES, misses
from lambent.bench.scenes.light_field_view import LightFieldView
from lambent.published.map_reads import fewest_misses, thesis_reads

SCATTERED = 100  # samples of a BRDF
TILE = 16  # pixels: a renderer's order of shading


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
