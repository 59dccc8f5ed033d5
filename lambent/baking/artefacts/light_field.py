"""Offset surface light fields: what is seen from many points just above the surface of an object."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baked.light_fields.stored import BLOCKS, DISTANCES, EXITS
from lambent.baking.artefacts.light_map import finished_maps
from lambent.baking.artefacts.probe import cached
from lambent.baking.context import BakeContext
from lambent.baking.engine import engine
from lambent.baking.light_fields import request
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import key_of
from lambent.baking.running.tiles import run_tiles, seed_of
from lambent.core.arrays import Floats, Indices
from lambent.core.errors import UserError
from lambent.core.geometry.triangles import triangle_areas
from lambent.core.light.colour import halves
from lambent.core.progress import Progress, part_of
from lambent.scenes.scene import LightFieldWish
from lambent.store.contract import LIGHT_FIELD_CHOICE, light_field_name, needs_probe
from lambent.store.store import Array

if TYPE_CHECKING:
    from lambent.baking.light_fields.acquisition import Surroundings
    from lambent.baking.light_fields.choosing import Chooser
    from lambent.baking.light_fields.placing import Placed, Placing
    from lambent.baking.light_fields.sample_map import FindExits

KIND = "light_field"
NEEDS = ("geometry", "light_map", "probe")
REVISION = 8
MATTE = "%s: light_field is ignored: its material is purely diffuse"
PATHS_OF_A_CHUNK = 1 << 21
MIRROR_DEPTH = 6  # glossy surfaces in a row on a path
BYTES_PER_TEXEL = 1.76  # of light and distances
log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Settings:
    """`points` on each object, with maps of `texels` a side, best 4 k - 2; `strata` x `strata` rays go through each.

    `onward` paths go on from each glossy surface that a ray meets: only there is there noise to speak of.
    """

    points: int
    texels: int
    strata: int = 2
    onward: int = 1


SETTINGS = {
    QualityName.preview: Settings(196, 94),
    QualityName.normal: Settings(576, 158, onward=2),
    QualityName.final: Settings(1156, 310, onward=4),
}


@dataclass(frozen=True)
class Traced:
    """The scene that points are placed in, what they see, and the unit of its light in half floats.

    Points whose maps are without their object see `without` of its name.
    """

    placing: Placing
    around: Surroundings
    unit: float
    without: Callable[[str], Surroundings]

    def seen(self, name: str, wish: LightFieldWish) -> Surroundings:
        """What points of an object see."""
        return self.without(name) if wish.without_object else self.around


def keys(context: BakeContext) -> dict[str, str]:
    found = dict[str, str]()
    for name, wish in wished(context).items():
        how = settings_of(context, wish)
        inputs: list[Any] = [context.keys("light_map")["light_map/irradiance"], name, _said(how)]
        inputs += [wish.offset_m, wish.error, context.seed, context.methods["probes"]]
        if not cached(context):
            inputs.append(context.settings("light_map").max_depth)
        if wish.error is not None:
            inputs.append("texels traced where they are read")  # decides the number of points
        if wish.without_object:  # keys of other light fields stay as they were
            inputs.append("volume" if wish.volume else "refracts")
        found |= dict.fromkeys(
            (light_field_name(name, part) for part in parts_of(wish)), key_of(KIND, REVISION, *inputs)
        )
    return found


def bake(context: BakeContext) -> None:
    stale, traced, wishes = context.stale(KIND), _traced(context), wished(context)
    left = {
        name: how.points * how.texels**2
        for name, how in ((name, settings_of(context, wish)) for name, wish in wishes.items())
        if stale & {light_field_name(name, part) for part in parts_of(wishes[name])}
    }
    done, total = 0, sum(left.values())
    for name, work in left.items():
        mine = part_of(context.progress, done / total, (done + work) / total, f"light field of {name}")
        _light_field(context, name, wishes[name], traced, mine)
        done += work


def describe(context: BakeContext) -> None:
    """Drop the light fields of objects that are to have none any more; tell of objects that need none."""
    kept = context.keys(KIND)
    context.store.forget([a.name for a in context.store.artefacts(KIND) if a.name not in kept])
    for name in sorted(context.scene.light_fields.keys() - wished(context).keys()):
        log.warning(MATTE, name)


def wished(context: BakeContext) -> dict[str, LightFieldWish]:
    """By object that is to have a light field, what is asked of it."""
    scene = context.scene
    asked = {name: scene.light_fields[name] for name in _shiny(context) if name in scene.light_fields}
    if context.methods.get(request.FIELDS) != request.AUTO:
        return asked
    return {
        one["object"]: LightFieldWish(points=one["points"], texels=one["texels"]) for one in _choice(context)
    } | asked


def parts_of(wish: LightFieldWish) -> tuple[str, ...]:
    """The arrays of an object's light field, in the order in which they are written."""
    return "points", "normals", BLOCKS, DISTANCES, *((EXITS,) if wish.refracts else ()), "sample_map"


def _said(how: Settings) -> dict[str, Any]:
    """Settings as inputs of a key; depth and storage of the maps were settings once."""
    return {**asdict(how), "levels": MIRROR_DEPTH, "blocks": True}


def settings_of(context: BakeContext, wish: LightFieldWish) -> Settings:
    """This bake's settings, with what is asked of one object."""
    asked = {name: value for name in ("points", "texels") if (value := getattr(wish, name)) is not None}
    how: Settings = context.settings(KIND)
    return replace(how, **asked)


def _shiny(context: BakeContext) -> list[str]:
    """Names of the objects that mirror what is around them."""
    return [o.name for o in context.scene.objects if needs_probe(context.scene.materials[o.material])]


def _choice(context: BakeContext) -> list[dict[str, Any]]:
    """What the bake has chosen, found again only where light or probes changed; nothing before these are baked."""
    if any(context.stale(need) for need in NEEDS):
        return []
    how, budget_mb = context.settings(KIND), float(context.methods[request.MEGABYTES])
    named = sorted(context.scene.light_fields)
    inputs = [context.keys("light_map"), context.keys("probe"), _said(how), named, budget_mb, context.seed]
    key = key_of(LIGHT_FIELD_CHOICE, 3, *inputs)
    said = context.store.documents.get(LIGHT_FIELD_CHOICE)
    if not isinstance(said, dict) or said.get("key") != key:
        from lambent.baking.light_fields.choosing import chosen

        with context.timed(LIGHT_FIELD_CHOICE):
            others = [name for name in _shiny(context) if name not in named]
            trials = _chooser(context, _traced(context)).trials(others, context.progress)
            found = chosen(trials, budget_mb, BYTES_PER_TEXEL, partial(_sample_map_mb, context))
        said = {"key": key, "chosen": [one.said() for one in found]}
        context.store.set_document(LIGHT_FIELD_CHOICE, said)
    return list(said["chosen"])


def _sample_map_mb(context: BakeContext, name: str, points: int) -> float:
    from lambent.baking.light_fields.sample_map import megabytes

    spacing_m = float(np.sqrt(triangle_areas(context.scene.object(name).mesh.corners).sum() / points))
    return megabytes(context.geometry, _faces_of(context, name), (context.atlas.width, context.atlas.height), spacing_m)


def _faces_of(context: BakeContext, name: str) -> Indices:
    """Numbers of an object's triangles."""
    objects = context.scene.objects
    first = np.cumsum([0, *(len(o.mesh.faces) for o in objects)])
    number = next(i for i, o in enumerate(objects) if o.name == name)
    return np.arange(first[number], first[number + 1])


def _traced(context: BakeContext) -> Traced:
    engine()  # before Mitsuba is imported
    from lambent.baking.light_fields.placing import Placing
    from lambent.baking.light_fields.surroundings import around, unit_of

    traced, maps, by_map = context.traced, finished_maps(context), cached(context)
    depth = MIRROR_DEPTH if by_map else context.settings("light_map").max_depth
    seen, kind = around(traced, maps if by_map else None, depth), {"diffuse": not by_map}

    def without(name: str) -> Surroundings:
        return replace(seen, scene=traced.builder(**kind).build(leave_out=traced.apart | {name}))

    placing = Placing(traced.builder(**kind), traced.whole(**kind))
    return Traced(placing, seen, unit_of(context.scene, maps[0], traced.sun), without)


def _chooser(context: BakeContext, traced: Traced) -> Chooser:
    from lambent.baking.light_fields.choosing import Chooser

    places = context.traced.places
    return Chooser(
        context.scene, context.store, traced.placing, traced.around, places, context.settings(KIND).texels, context.seed
    )


def _light_field(context: BakeContext, name: str, wish: LightFieldWish, traced: Traced, progress: Progress) -> None:
    from lambent.baked.light_fields.blocks.blocks import (
        blocks_of,
        blocks_shape,
        distance_blocks_of,
        distance_blocks_shape,
    )
    from lambent.baking.light_fields.acquisition import covered_distances, inverse_distances, radiance_maps

    start, how = time.perf_counter(), settings_of(context, wish)
    seen = traced.seen(name, wish)
    progress(0, 1, "points")
    points = _points(context, name, wish, traced)
    normals = context.store.read(light_field_name(name, "normals"))

    def radiance(region: tuple[slice, ...], seed: int) -> Array:
        some = region[0]
        surface = None if wish.without_object else normals[some]  # what is beneath points is seen as well
        # maps of volumes give irradiance, too, and have what texels show altogether
        light, shows = radiance_maps(
            seen, points[some], how.texels, how.strata, seed, how.onward, surface, covers=not wish.volume
        )
        return blocks_of(halves(light, traced.unit), None if wish.volume else shows)

    def distances(region: tuple[slice, ...], seed: int) -> Array:
        some = points[region[0]]
        if wish.volume:
            return distance_blocks_of(inverse_distances(seen.scene, some, how.texels), None)
        return distance_blocks_of(*covered_distances(seen.scene, some, how.texels))

    at_once = max(1, min(PATHS_OF_A_CHUNK // (how.texels * how.strata) ** 2, len(points)))
    arrays: tuple[tuple[str, tuple[int, ...], Callable[[tuple[slice, ...], int], Array], dict[str, Any]], ...] = (
        (BLOCKS, blocks_shape(how.texels), radiance, {"unit": traced.unit}),
        (DISTANCES, distance_blocks_shape(how.texels), distances, {"texels": [how.texels]}),
    )
    for (part, shape, tile, note), share in zip(arrays, ((0.0, 0.9), (0.9, 1.0)), strict=True):
        at = light_field_name(name, part)
        key, meta = context.keys(KIND)[at], context.provenance(**note)
        # an interrupted bake continues with the next points
        writer = context.store.begin(at, KIND, (len(points), *shape), (at_once, *shape), "uint32", key=key, meta=meta)
        run_tiles(writer, tile, seed=context.seed, progress=part_of(progress, *share, at), what=at)
        writer.finish()
    _sample_map(context, name, wish, traced, start)


def _points(context: BakeContext, name: str, wish: LightFieldWish, traced: Traced) -> Floats:
    """Points (P, 3) of an object; those of the store where it has them."""
    names = [light_field_name(name, part) for part in ("points", "normals")]
    if not context.stale(KIND) & set(names):
        return context.store.read(names[0])
    try:
        found = _placed(context, name, wish, traced)
    except UserError as error:
        raise UserError(error.message, field=f"light_field of {name}", hint=error.hint) from error
    for at, array in zip(names, (found.positions, found.normals), strict=True):
        context.put(KIND, at, array.astype(np.float32), context.provenance(offset_m=found.offset_m))
    return context.store.read(names[0])


def _placed(context: BakeContext, name: str, wish: LightFieldWish, traced: Traced) -> Placed:
    """Where the points of an object stand."""
    from lambent.baking.light_fields.facing import turned_to_viewers
    from lambent.baking.light_fields.glass import clearest
    from lambent.baking.light_fields.trial import COUNTS, Option
    from lambent.baking.light_fields.volume import volume_points

    o, seed = context.scene.object(name), seed_of(context.seed, KIND, name)
    mesh = o.mesh
    if wish.refracts:
        clearest(context.scene.materials[o.material])  # an error before anything is traced
    how = settings_of(context, wish)
    count = most = how.points
    if wish.volume:
        return volume_points(context.traced.builder(diffuse=not cached(context)), mesh, name, most)
    if wish.error is not None:
        chooser = _chooser(context, traced)
        if (seen := chooser.watched(name)) is not None:
            options = [Option(points, how.texels) for points in (*(some for some in COUNTS if some < most), most)]
            count = chooser.trial(name, seen, options=options).count_for(wish.error)
    mesh = turned_to_viewers(mesh, context.traced.places, traced.around.scene, seed)
    return traced.placing.points(mesh, count, seed, wish.offset_m)


def _sample_map(context: BakeContext, name: str, wish: LightFieldWish, traced: Traced, start: float) -> None:
    """Written last: a light field that has it is whole."""
    from lambent.baking.light_fields.facing import side_seen, views_in
    from lambent.baking.light_fields.sample_map import sample_map
    from lambent.baking.light_fields.volume import spacing_m

    mesh, points = context.scene.object(name).mesh, context.store.read(light_field_name(name, "points"))
    spacing = np.sqrt(triangle_areas(mesh.corners).sum() / len(points))
    if wish.volume:
        spacing = spacing_m(mesh, len(points))
    size = context.atlas.width, context.atlas.height
    find_exits = _exits(context, name) if wish.refracts else None
    sees = views_in(traced.seen(name, wish).scene)
    side = side_seen(mesh, context.traced.places, traced.around.scene, seed_of(context.seed, KIND, name))
    found = sample_map(context.geometry, _faces_of(context, name), size, points, float(spacing), find_exits, sees, side)
    if found.exits is not None:
        context.put(KIND, light_field_name(name, EXITS), found.exits, context.provenance(glass=_glass(context, name)))
    offset_m = context.store.artefact(light_field_name(name, "points")).meta["offset_m"]
    note = {"corner": list(found.corner), "grid": list(found.grid), "offset_m": offset_m}
    note |= {"volume": True} if wish.volume else {}
    seconds = round(time.perf_counter() - start, 2)
    name_of_map = light_field_name(name, "sample_map")
    context.put(KIND, name_of_map, found.entries, context.provenance(**note, seconds=seconds))


def _exits(context: BakeContext, name: str) -> FindExits:
    """Finds the faces behind the surface of an object of glass."""
    from lambent.baking.light_fields.glass import Exits

    o = context.scene.object(name)
    builder = context.traced.builder(diffuse=not cached(context))
    return Exits(builder, name, context.scene.materials[o.material]).find


def _glass(context: BakeContext, name: str) -> list[float]:
    """Index of refraction, share of light RGB, and power of the cosine of the glass of an object."""
    from lambent.baked.light_fields.thin_glass import normal_transmittance
    from lambent.baking.light_fields.glass import clearest, index_of_refraction

    material = context.scene.materials[context.scene.object(name).material]
    lobe = clearest(material)
    return [index_of_refraction(material), *normal_transmittance(lobe).tolist(), 1 - 2 * lobe.alpha]
