"""Errors of reflections from an offset surface light field, by method, and miss rates of caches of its maps.

The march of `baked.light_fields.lookup` and published look-ups are compared with traced mirror rays of the teapot's
pixels in the pavilion, as in tables 6.1 and 6.2 of thesis R; caches as in its tables 6.3 to 6.6. Look-ups count texels
of radiance and distance. Pixels are means over the same places for all methods: the look-up is compared, not its
sampling.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from lambent.baked.light_fields import lookup as look
from lambent.baked.light_fields.blocks.blocks import in_blocks
from lambent.baked.light_fields.light_field import NO_POINT, LightField, Sky
from lambent.baked.light_fields.lookup import March, Place
from lambent.baked.light_fields.map_cache import POLICIES, misses
from lambent.baked.light_fields.maps import radiance_along
from lambent.baking.quality import Quality
from lambent.bench.scenes.light_field_view import Compared, LightFieldView
from lambent.core.arrays import Floats
from lambent.core.progress import Progress, part_of, silent
from lambent.published.distance_impostors import fixed_point
from lambent.published.map_reads import fewest_misses, thesis_reads
from lambent.published.surface_light_fields import Basis, basis_weights, surface
from lambent.scenes.loaders.load import load_scene

NAME = "oslf"
POWERS = (1, 4, 8, 16)
STORED = ("B_n 4", "march 1", "march 1, sky", "march 4", "march 4, sky")  # methods also measured with stored blocks
ONE, FOUR = March(candidates=1), March()
PER_POINT = FOUR.steps + 1 + FOUR.secants + 1  # reads of distances, including the one at infinity, plus the radiance
SCATTERED = 100  # samples of a BRDF, for caches
TILE = 16  # pixels: a renderer's order of shading
PREVIEW = Quality("preview")
SMALL = PREVIEW.changed("small", geometry={"texels": 64}, light_map={"gather_samples": 0}, environment={"texels": 16})


@dataclass(frozen=True)
class Effort:
    """Scene, object, view; light fields by points and texels; strata along a texel's side, places per pixel."""

    scene: str = "builtin:pavilion"
    object: str = "teapot"
    camera: int = 0
    size: tuple[int, int] = (640, 480)
    fields: tuple[tuple[int, int], ...] = ((1156, 112), (1156, 222), (1156, 310), (289, 222))
    strata: int = 2
    paths: int = 4
    capacities: tuple[int, ...] = (2, 4, 8, 16, 32, 64, 128)
    quality: Quality = PREVIEW


FULL = Effort()
QUICK = Effort("builtin:box", "sphere", 0, (96, 96), ((64, 32),), 1, 4, (4, 16), SMALL)


@dataclass(frozen=True)
class Method:
    """A look-up: its texel reads per pixel, and its radiance (k, 3) along the mirror directions."""

    name: str
    look_ups: int
    radiance: Callable[[], Floats]


def run(effort: Effort, progress: Progress = silent) -> dict[str, Any]:
    """Rows method x light field, then rows of caches."""
    count = len(effort.fields) + 1
    rows: list[dict[str, Any]] = []
    with TemporaryDirectory() as folder:
        lighting = part_of(progress, 0, 1 / count, "light")
        view = LightFieldView(
            load_scene(effort.scene), effort.object, effort.camera, effort.size, effort.paths, Path(folder) / "store",
            effort.quality, lighting,
        )  # fmt: skip
        mirror = Compared.of(view.shown.pixel, view.size, view.truth)
        for number, (points, texels) in enumerate(effort.fields):
            progress(number + 1, count, f"{points} points, {texels} texels")
            field = view.field(points, texels, effort.strata)
            place = view.place(field)
            said = {"points": len(field.points), "texels": texels, "raw_mb": raw_mb(field)}
            single = view.single(texels, effort.strata)
            for method in methods(field, single, place, view):
                found = mirror.errors(method.radiance())
                rows.append({**said, "method": method.name, "look_ups": method.look_ups, **found})
            rows += stored_rows(field, single, view, mirror, said)
            rows += surface_rows(field, place, view, said)
            if number == 0:
                rows += list(caches(field, place, view, effort.capacities))
    progress(1, 1, "done")
    return {"rows": rows, "summary": summary(rows)}


def methods(field: LightField, single: LightField, place: Place, view: LightFieldView) -> Iterator[Method]:
    """All look-ups, from reflection mapping to the one that knows the true hit."""
    w, k = view.shown.w, len(place.x)
    middle = Place(place.x, place.n, np.stack([np.zeros(k, np.int64), *[np.full(k, NO_POINT)] * 3], axis=-1))
    far = March(1, first=0.02, last=4.0)

    def blend(basis: Basis, power: int = look.POWER) -> Floats:
        return look.blended(field, place, w, basis_weights(field, place, w, basis, power), view.sky)

    yield Method("single map", 1, partial(radiance_along, single, middle.named(1)[:, 0], w))
    yield Method("single map, marched", PER_POINT, partial(_marched, single, middle, w, far))
    yield Method("nearest", 1, partial(blend, "nearest"))
    yield Method("angle", 1, partial(blend, "angle"))
    yield Method("average", 4, partial(blend, "average"))
    for power in POWERS:
        yield Method(f"B_r {power}", 4, partial(blend, "reflection", power))
    for power in POWERS:
        yield Method(f"B_n {power}", 4, partial(blend, "normal", power))
    yield Method("fixed point", 28, lambda: fixed_point(field, place, w, edges=view.sky).radiance)
    for name, rule in (("march 1", ONE), ("march 4", FOUR)):
        count = rule.candidates * PER_POINT
        yield Method(name, count, partial(_marched, field, place, w, rule, None, view.sky))
        yield Method(f"{name}, sky", count, partial(_marched, field, place, w, rule, view.sky))
    yield Method("true hit", 4, partial(true_hit, field, place, w, view.distance_m, view.sky))


def _marched(
    field: LightField, place: Place, w: Floats, rule: March, sky: Sky | None = None, edges: Sky | None = None
) -> Floats:
    return look.marched(field, place, w, rule, sky, edges).radiance


def true_hit(field: LightField, place: Place, w: Floats, distance_m: Floats, sky: Sky | None = None) -> Floats:
    """Radiance (k, 3) of the maps towards the traced hits: the remaining error is that of their texels."""
    is_open = ~np.isfinite(distance_m)
    q = place.offsets(field) + np.where(is_open, 1e6, distance_m)[:, None, None] * w[:, None]
    seen = radiance_along(field, place.named(), q)
    seen[is_open] = radiance_along(field, place.named()[is_open], q[is_open], sky)
    return np.asarray(np.einsum("kj,kjc->kc", look.normal_weights(field, place), seen))


def stored_rows(
    field: LightField, single: LightField, view: LightFieldView, mirror: Compared, said: dict[str, Any]
) -> Iterator[dict[str, Any]]:
    """Some methods with the light field in the blocks of a store and a GPU, and their MB uncompressed."""
    stored = in_blocks(field)
    assert stored.blocks is not None and stored.distances is not None, "it is in blocks"
    megabytes = {"light_mb": stored.blocks.nbytes / 1e6, "distances_mb": stored.distances.nbytes / 1e6}
    for method in methods(stored, single, view.place(stored), view):
        if method.name in STORED:
            found = mirror.errors(method.radiance())
            yield {**said, **megabytes, "method": f"{method.name}, in blocks", "look_ups": method.look_ups, **found}


def surface_rows(
    field: LightField, place: Place, view: LightFieldView, said: dict[str, Any]
) -> Iterator[dict[str, Any]]:
    """The object itself from its light field, and the share of pixels that a point sees; no rows for a black object."""
    if view.surface.any():
        light, seen = surface(field, place)
        found = Compared.of(view.shown.pixel, view.size, view.surface).errors(light)
        yield {**said, "method": "surface", "look_ups": 5, **found, "seen": round(float(seen.mean()), 5)}


def raw_mb(field: LightField) -> float:
    """MB of radiance and inverse distance in half floats, and of the sample map, uncompressed."""
    arrays = field.radiance, field.inverse_distance, field.sample_map  # maps in blocks are not decoded for this
    return round(sum(math.prod(array.shape) * array.dtype.itemsize for array in arrays) / 1e6, 1)


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """FLIP and PSNR of every method by light field; misses of least-recently-used caches."""
    found: dict[str, Any] = {}
    for row in rows:
        if "method" in row:
            of = found.setdefault(f"{row['points']} x {row['texels']}", {})
            of[row["method"]] = [row["flip"], row["psnr"]]
    cached = [row for row in rows if "reads" in row]
    found["miss_percent"] = {
        f"{row['reads']}, {row['order']}, {row['maps']}": row["miss_percent"]["least-recent"] for row in cached
    }
    return found


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
