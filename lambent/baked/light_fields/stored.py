"""Read light fields: arrays light_field/OBJECT/* to `baked.light_fields.light_field.LightField`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import CANDIDATES, NO_POINT, Glass, LightField, Maps
from lambent.core.plain import triple
from lambent.store.consistency import numbers_of
from lambent.store.contract import light_field_name
from lambent.store.store import Store

BLOCKS, DISTANCES = "blocks", "distances"  # light, and distances with cover
EXITS = "exits"  # glass only
LAST = "sample_map"  # is written last


def has_light_field(store: Store, object_name: str) -> bool:
    """Whether the store has the complete light field of an object, that is, its last array."""
    name = light_field_name(object_name, LAST)
    return light_field_name(object_name, BLOCKS) in store and name in store and store.artefact(name).complete


def read_light_field(store: Store, object_name: str) -> LightField:
    """The light field of an object; `UserError` if its arrays do not fit together."""
    points, normals, sample_map = (
        store.read(light_field_name(object_name, part)) for part in ("points", "normals", LAST)
    )
    inverse_distance, cover, distances = _distances(store, object_name)
    radiance, blocks = _radiance(store, object_name, inverse_distance.shape[-1])
    name = light_field_name(object_name, LAST)
    corner, grid = (numbers_of(store, name, key, 2) for key in ("corner", "grid"))
    (offset_m,) = [float(x) for x in np.atleast_1d(store.artefact(name).meta.get("offset_m", np.nan))]
    count, side = len(points), radiance.shape[1] if len(radiance.shape) == 4 else 0
    fits = (
        points.shape == normals.shape == (count, 3)
        and 0 < count <= NO_POINT
        and radiance.shape == (count, side, side, 3)
        and inverse_distance.shape == (count, side, side)
        and sample_map.ndim == 3
        and sample_map.shape[2] == CANDIDATES
        and sample_map.dtype == np.uint16
        and min(*grid, *sample_map.shape) >= 1
        and np.isfinite([*corner, *grid, offset_m]).all()
    )
    if not fits:
        shapes = [array.shape for array in (points, normals, radiance)]
        raise store.broken(f"light_field/{object_name}", got=str(shapes))
    named = sample_map[sample_map != NO_POINT]
    if named.size and int(named.max()) >= count:
        raise store.broken(name, got=int(named.max()), expected=f"points below {count}")
    return LightField(
        points, normals, radiance, inverse_distance, sample_map,
        (int(corner[0]), int(corner[1])), (int(grid[0]), int(grid[1])), offset_m, blocks,
        store.artefact(name).meta.get("volume") is True,
        _glass(store, object_name, sample_map.shape), cover, distances,
    )  # fmt: skip


def _distances(store: Store, object_name: str) -> tuple[Maps, Maps | None, NDArray[np.uint32]]:
    """Inverse distances and cover, decoded when they are read, and their blocks."""
    from lambent.baked.light_fields.blocks.blocks import distances_in_blocks  # imports numba

    name = light_field_name(object_name, DISTANCES)
    blocks, (side,) = store.read(name), numbers_of(store, name, "texels", 1)
    volume = store.artefact(light_field_name(object_name, LAST)).meta.get("volume") is True
    try:
        inverse, cover = distances_in_blocks(blocks, int(side))
    except ValueError as error:
        raise store.broken(name, got=error) from error
    return inverse, None if volume else cover, blocks


def _glass(store: Store, object_name: str, shape: tuple[int, ...]) -> Glass | None:
    """The refraction of glass; None if the object has none."""
    name = light_field_name(object_name, EXITS)
    if name not in store:
        return None
    exits = store.read(name)
    if exits.shape != shape or exits.dtype != np.float16 or not np.isfinite(exits).all():
        raise store.broken(name, got=exits.shape, expected=shape)
    eta, *tint, power = numbers_of(store, name, "glass", 5)
    return Glass(exits, float(eta), triple(tint), float(power))


def _radiance(store: Store, object_name: str, side: int) -> tuple[Maps, NDArray[np.uint32]]:
    """Light, decoded when it is read, and its blocks."""
    from lambent.baked.light_fields.blocks.blocks import light_in_blocks  # imports numba

    name = light_field_name(object_name, BLOCKS)
    array = store.read(name)
    if array.ndim != 4 or array.shape[1] != array.shape[2] or array.shape[3] != 4 or array.dtype != np.uint32:
        raise store.broken(name, got=array.shape, expected="n x b x b x 4")
    try:
        return light_in_blocks(array, side), array
    except ValueError as error:
        raise store.broken(name, got=error) from error
