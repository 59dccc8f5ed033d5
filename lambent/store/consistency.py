"""Checks that a store obeys `store.contract`: its arrays, and the names and numbers of its scene record.

Bakes write consistent stores; a damaged or foreign manifest may contain anything. Everything is checked here once, so
that renderers and tracers need no checks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lambent.core.views.camera import FARTHEST_M, Camera
from lambent.store.artefact import Array
from lambent.store.store import Store

SceneRecord = Any  # of `store.contract`, which imports this module
ANY = None
CUBE = (6, ANY, ANY)
_ARRAYS: tuple[tuple[str, tuple[int | None, ...], str], ...] = (  # name, shape, kinds of dtype
    ("geometry/positions", (ANY, 3), "f"), ("geometry/normals", (ANY, 3), "f"), ("geometry/tangents", (ANY, 3), "f"),
    ("geometry/uv", (ANY, 2), "f"), ("geometry/uv2", (ANY, 2), "f"), ("geometry/faces", (ANY, 3), "iu"),
    ("light_map/irradiance", (ANY, ANY, 3), "f"), ("light_map/irradiance_back", (ANY, ANY, 3), "f"),
    ("light_map/noise", (ANY, ANY), "f"), ("light_map/noise_back", (ANY, ANY), "f"),
    ("light_map/groups", (ANY, ANY, ANY, 3), "f"), ("light_map/groups_back", (ANY, ANY, ANY, 3), "f"),
    ("light_map/direct", (ANY, ANY, ANY, 3), "f"), ("light_map/direct_back", (ANY, ANY, ANY, 3), "f"),
    ("probe/*/groups", (ANY, *CUBE, 3), "f"),
    ("light_map/lean", (ANY, ANY, 3), "f"), ("light_map/probe_share", (ANY, ANY, 4), "f"),
    ("light_map/sunlit", (ANY, ANY), "u"), ("light_map/lamps_reach", (ANY, ANY, 4), "u"),
    ("light_map/lamps", (ANY, ANY, ANY, 3), "f"), ("light_map/lamps_back", (ANY, ANY, ANY, 3), "f"),
    ("lamps/*", (ANY, ANY, ANY), "f"),
    ("environment/radiance", (*CUBE, 3), "f"),
    ("probe/*/radiance", (*CUBE, 3), "f"), ("probe/*/distance", CUBE, "f"), ("probe/*/planes", (ANY, 4), "f"),
    ("light_field/*/points", (ANY, 3), "f"), ("light_field/*/normals", (ANY, 3), "f"),
    ("light_field/*/blocks", (ANY, ANY, ANY, 4), "u"), ("light_field/*/distances", (ANY, ANY, ANY, 2), "u"),
    ("light_field/*/sample_map", (ANY, ANY, 4), "u"),
    ("texture/*", (ANY, ANY, ANY), "f"),
)  # fmt: skip
_PER_VERTEX = ("positions", "normals", "tangents", "uv", "uv2")


def check_record(store: Store, record: SceneRecord) -> None:
    """Raise `UserError` if an array's shape does not fit its name, or the record contradicts itself."""
    for artefact in store.artefacts():
        for pattern, wanted, kinds in _ARRAYS:
            if fnmatchcase(artefact.name, pattern):
                shape = artefact.shape
                fits = len(shape) == len(wanted) and all(w in (ANY, n) for w, n in zip(wanted, shape, strict=True))
                cube = wanted[:3] != CUBE or (len(shape) > 2 and shape[1] == shape[2] > 0)
                if not (fits and cube and np.dtype(artefact.dtype).kind in kinds):
                    got, expected = f"{shape} {artefact.dtype}", " x ".join("n" if w is ANY else str(w) for w in wanted)
                    raise store.broken(artefact.name, "array has the wrong shape or type", got, expected)
    _check_names(store, record)
    for field, camera in _cameras(record):
        if not is_usable(camera):
            raise store.broken(field, "a camera is beyond 1e9 m or has an impossible field of view")
    numbers = [record.exposure_ev or 0.0, *_flat(record.bounds)]
    numbers += [x for o in record.objects for x in (*o.emission, *_flat(o.bounds), *_flat(o.borders))]
    numbers += [path.seconds for path in record.paths] + [s for path in record.paths for s in path.times_s or ()]
    numbers += [x for r in record.reflectors for x in (*r.plane, *_flat(r.outline), *(p.area_m2 for p in r.parts))]
    numbers += [x for t in record.textures.values() for x in (t.cutoff, *_flat(_flat(t.parts.values())))]
    if not all(map(math.isfinite, numbers)):
        raise store.broken("scene", "the scene record has a number that is not finite")


def _check_names(store: Store, record: SceneRecord) -> None:
    """Check that all references resolve and all face ranges lie within the faces."""
    objects = {o.name: o for o in record.objects}
    if len(objects) != len(record.objects):
        raise store.broken("objects", "two objects have the same name")
    faces = store.artefact("geometry/faces").shape[0] if "geometry/faces" in store else math.inf
    for o in record.objects:
        if o.material not in record.materials:
            raise store.broken(f"objects.{o.name}", "unknown material", o.material)
        if o.first_face < 0 or o.face_count < 0 or o.first_face + o.face_count > faces:
            got = f"{o.face_count} from {o.first_face}"
            raise store.broken(f"objects.{o.name}", "face index out of range", got, f"within {faces}")
    for material in record.textures:
        if material not in record.materials:
            raise store.broken("textures", "unknown material", material)
    if len({variant.name for variant in record.variants}) != len(record.variants):
        raise store.broken("variants", "two variants have the same name")
    for variant in record.variants:
        textures = {look.textures for look in variant.looks.values() if isinstance(look.textures, str)}
        used = {*variant.looks, *(textures - {""})}
        if strange := sorted(used - set(record.materials)):
            raise store.broken(f"variants.{variant.name}", "unknown material", strange[0])
    for number, reflector in enumerate(record.reflectors):
        for part in reflector.parts:
            field = f"reflectors.{number}"
            if part.object not in objects:
                raise store.broken(field, "unknown object", part.object)
            if part.faces and not 0 <= min(part.faces) <= max(part.faces) < objects[part.object].face_count:
                raise store.broken(field, "face index out of range", max(part.faces))


def read_geometry(store: Store) -> dict[str, Array]:
    """The arrays geometry/* by the last part of their name; `UserError` if they do not fit together."""
    arrays = {name: store.read(f"geometry/{name}") for name in (*_PER_VERTEX, "faces")}
    count = len(arrays["positions"])
    if any(len(arrays[name]) != count for name in _PER_VERTEX):
        got = ", ".join(f"{len(arrays[name])} {name}" for name in _PER_VERTEX)
        raise store.broken("geometry", "arrays have different lengths", got)
    if arrays["faces"].size and not 0 <= int(arrays["faces"].min()) <= int(arrays["faces"].max()) < count:
        raise store.broken("geometry/faces", "vertex index out of range", arrays["faces"].max(), f"below {count}")
    if not np.isfinite(arrays["positions"]).all():
        raise store.broken("geometry/positions", "values are not finite")
    return arrays


def numbers_of(store: Store, artefact: str, name: str, count: int) -> tuple[float, ...]:
    """`count` finite numbers from an array's meta; raise `UserError` otherwise."""
    found = store.artefact(artefact).meta.get(name)
    listed = found if isinstance(found, list) else []
    numbers = tuple(float(x) for x in listed if isinstance(x, int | float) and math.isfinite(x))
    if not len(numbers) == len(listed) == count:
        raise store.broken(f"{artefact}: {name}", "not a list of numbers", found, f"{count} finite numbers")
    return numbers


def is_usable(camera: Camera) -> bool:
    """Whether a camera is within FARTHEST_M of the origin and has a valid view."""
    numbers = (*camera.position, *camera.target, *camera.up)
    return all(abs(number) <= FARTHEST_M for number in numbers) and 0 < camera.fov_y_deg < 180


def _cameras(record: SceneRecord) -> Iterable[tuple[str, Camera]]:
    yield from ((f"cameras.{c.name}", c) for c in record.cameras)
    yield from ((f"paths.{path.name}", c) for path in record.paths for c in path.keys)


def _flat(rows: Iterable[Iterable[Any]]) -> list[Any]:
    return [value for row in rows for value in row]
