"""Read light fields: arrays light_field/OBJECT/* to `core.light_field.LightField`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.light_field import CANDIDATES, NO_POINT, Glass, LightField, Maps
from lambent.core.plain import triple
from lambent.store.consistency import numbers_of
from lambent.store.contract import light_field_name
from lambent.store.store import Store

PARTS = ("points", "normals", "radiance", "inverse_distance", "sample_map")
BLOCKS = "blocks"  # replaces radiance
DISTANCES = "distances"  # blocks that replace inverse_distance and cover
EXITS = "exits"  # glass only
COVER = "cover"  # of texels' quarters; absent from earlier versions' stores


def has_light_field(store: Store, object_name: str) -> bool:
    """Whether the store has the complete light field of an object, that is, its last array."""
    name = light_field_name(object_name, PARTS[-1])
    return name in store and store.artefact(name).complete


def read_light_field(store: Store, object_name: str) -> LightField:
    """The light field of an object; `UserError` if its arrays do not fit together."""
    points, normals, sample_map = (
        store.read(light_field_name(object_name, part))
        for part in PARTS
        if part not in ("radiance", "inverse_distance")
    )
    inverse_distance, cover, distances = _distances(store, object_name)
    radiance, blocks = _radiance(store, object_name, inverse_distance.shape[-1])
    name = light_field_name(object_name, PARTS[-1])
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
        shapes = {part: array.shape for part, array in zip(PARTS, (points, normals, radiance), strict=False)}
        raise UserError("broken store", file=store.folder, field=f"light_field/{object_name}", got=str(shapes))
    named = sample_map[sample_map != NO_POINT]
    if named.size and int(named.max()) >= count:
        raise UserError(
            "broken store", file=store.folder, field=name, got=int(named.max()), expected=f"points below {count}"
        )
    return LightField(
        points, normals, radiance, inverse_distance, sample_map,
        (int(corner[0]), int(corner[1])), (int(grid[0]), int(grid[1])), offset_m, blocks,
        store.artefact(name).meta.get("levels") == 1, store.artefact(name).meta.get("volume") is True,
        _glass(store, object_name, sample_map.shape), cover, distances,
    )  # fmt: skip


def _distances(store: Store, object_name: str) -> tuple[Maps, Maps | None, NDArray[np.uint32] | None]:
    """Inverse distances and cover, and their blocks if stored; they are decoded when read."""
    name = light_field_name(object_name, DISTANCES)
    if name not in store:
        whole = store.read(light_field_name(object_name, "inverse_distance"))
        return whole, _cover(store, object_name, whole.shape), None
    from lambent.core.light_field_blocks import distances_in_blocks  # imports numba

    blocks, (side,) = store.read(name), numbers_of(store, name, "texels", 1)
    volume = store.artefact(light_field_name(object_name, PARTS[-1])).meta.get("volume") is True
    try:
        inverse, cover = distances_in_blocks(blocks, int(side))
    except ValueError as error:
        raise UserError("broken store", file=store.folder, field=name, got=str(error)) from error
    return inverse, None if volume else cover, blocks


def _cover(store: Store, object_name: str, shape: tuple[int, ...]) -> NDArray[np.uint8] | None:
    """Flags of the texels' quarters that show surfaces; None if not stored."""
    name = light_field_name(object_name, COVER)
    if name not in store:
        return None
    cover = store.read(name)
    if cover.shape != shape or cover.dtype != np.uint8:
        raise UserError("broken store", file=store.folder, field=name, got=str(cover.shape), expected=str(shape))
    return cover


def _glass(store: Store, object_name: str, shape: tuple[int, ...]) -> Glass | None:
    """The refraction of glass; None if the object has none."""
    name = light_field_name(object_name, EXITS)
    if name not in store:
        return None
    exits = store.read(name)
    if exits.shape != shape or exits.dtype != np.float16 or not np.isfinite(exits).all():
        raise UserError("broken store", file=store.folder, field=name, got=str(exits.shape), expected=str(shape))
    eta, *tint, power = numbers_of(store, name, "glass", 5)
    return Glass(exits, float(eta), triple(tint), float(power))


def light_name(store: Store, object_name: str) -> str:
    """Name of the array of a light field's radiance, blocks or maps."""
    blocks = light_field_name(object_name, BLOCKS)
    return blocks if blocks in store else light_field_name(object_name, "radiance")


def _radiance(store: Store, object_name: str, side: int) -> tuple[Maps, NDArray[np.uint32] | None]:
    """Maps, and their blocks if stored."""
    name = light_name(store, object_name)
    array = store.read(name)
    if not name.endswith(BLOCKS):
        return array, None
    from lambent.core.light_field_blocks import light_in_blocks  # imports numba

    if array.ndim != 4 or array.shape[1] != array.shape[2] or array.shape[3] != 4 or array.dtype != np.uint32:
        raise UserError("broken store", file=store.folder, field=name, got=str(array.shape), expected="n x b x b x 4")
    try:
        return light_in_blocks(array, side), array
    except ValueError as error:
        raise UserError("broken store", file=store.folder, field=name, got=str(error)) from error
