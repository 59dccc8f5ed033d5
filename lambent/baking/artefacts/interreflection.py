"""Interreflections of a view: indirect light, by bands of the curves and by tails (`baked.transport.tails`).

Each pass over all points doubles the samples, so that a picture is available early and its noise falls. A tile of
points is one array, written whole: an interruption loses at most one tile's pass. Jobs for other processes go through
several passes, because a tile's samples travel back and forth with each job.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baking.artefacts.view_points import points_key
from lambent.baking.context import BakeContext
from lambent.baking.interreflection.as_baked import SCATTERING_TEXTURES, shapes_of, state_of
from lambent.baking.interreflection.series import Bins, bins_of, tails_of, used_materials
from lambent.baking.interreflection.tiles import Job, Tile, TileTracer
from lambent.baking.running.keys import key_of, light_inputs, texture_inputs
from lambent.baking.running.tiles import slices
from lambent.baking.transport.view import View
from lambent.materials.factored.terms import Editable, varies
from lambent.store.source import environment_note

if TYPE_CHECKING:
    from lambent.baking.transport.view_points import ViewPoints

KIND = "interreflection"
NEEDS = ("view_points",)
OF_VIEWS = True
ON_REQUEST = True
REVISION = 2
POINTS = 1 << 12  # per tile
FIRST_PASS, LONGEST_PASS = 16, 1 << 16  # samples
TOGETHER = 1 << 10  # samples that jobs of other processes may end with, after passes in between


@dataclass(frozen=True)
class Part:
    """The points of a view that show one material."""

    view: View
    material: str
    bins: Bins
    key: str

    def names(self, tile: int) -> list[str]:
        """Names of a tile's arrays, one per term."""
        terms = range(len(self.bins.bands))
        return [self.view.name(KIND, f"{self.material}/{term}/{tile}") for term in terms]


def keys(context: BakeContext) -> dict[str, str]:
    """Keys of tails and samples; tiles have their own keys (`Part.key`) and are not counted before the bake."""
    found: dict[str, str] = {}
    for view in context.views:
        found[view.name(KIND, "tails")] = key_of(KIND, REVISION, _series_key(context, view), context.bounces.series)
        of_parts = [part.key for part in parts(context, view)]
        found[view.name(KIND, "samples")] = key_of(KIND, REVISION, of_parts, context.bounces.samples)
    return found


def bake(context: BakeContext) -> None:
    bounces, editables, scene = context.bounces, _editables(context), context.in_views
    tails, bins = tails_of(editables, bounces), bins_of(editables, bounces)
    work = TileTracer(scene, tails, bins, context.seed, context.view_tracer, bounces.diffuse_seen)
    for view in context.views:
        _put_tails(context, view)
    shown = [(view, list(parts(context, view))) for view in context.views]
    for stops in stages(bounces.samples, together=context.workers.apart):
        for view, found in shown:
            _bring(context, work, view, found, stops)
    for view in context.views:
        context.put(KIND, view.name(KIND, "samples"), np.array([bounces.samples], np.uint32), view.meta)


def passes(samples: int) -> list[int]:
    """Samples per point after each pass of a bake."""
    found = [min(FIRST_PASS, samples)]
    while found[-1] < samples:
        found.append(min(found[-1] + min(found[-1], LONGEST_PASS), samples))
    return found


def stages(samples: int, *, together: bool) -> list[list[int]]:
    """The passes of a bake by jobs: one each, or `together` those after the first up to TOGETHER samples."""
    first, *more = passes(samples)
    joined = [one for one in more if together and one <= TOGETHER]
    return [[first], *([joined] if joined else []), *([one] for one in more[len(joined) :])]


def _bring(context: BakeContext, work: TileTracer, view: View, found: list[Part], stops: list[int]) -> None:
    """Bring every tile of a view to the last of some numbers of samples, through the others; `found` are its parts."""
    samples = stops[-1]
    points = context.view_tracer.points(view)
    materials = np.array([o.material for o in context.in_views.objects])[points.object]
    mine = {part.material: np.flatnonzero(materials == part.material) for part in found}
    shown = {material: [numbers[some] for some in slices(len(numbers), POINTS)] for material, numbers in mine.items()}
    tiles = [(part, tile) for part in found for tile in range(len(shown[part.material]))]
    behind = [one for one in tiles if _samples(context, *one) < samples]
    # Small ones last: no worker waits for a large one.
    behind.sort(key=lambda one: -len(shown[one[0].material][one[1]]))
    place = {part.names(tile)[0]: (part, tile) for part, tile in behind}
    what = f"interreflections, {samples} samples"
    context.progress(len(tiles) - len(behind), len(tiles), what)
    jobs = (_job(context, part, tile, points.where(shown[part.material][tile]), stops) for part, tile in behind)
    for done, (job, traced) in enumerate(context.workers.each(work, jobs), len(tiles) - len(behind) + 1):
        _write(context, *place[job.name], traced, samples)
        context.progress(done, len(tiles), what)


def _job(context: BakeContext, part: Part, tile: int, points: ViewPoints, stops: list[int]) -> Job:
    names, before = part.names(tile), _samples(context, part, tile)
    held = tuple(_held(context, name, len(points)) for name in names) if before else ()
    *via, samples = (one for one in stops if one > before)
    return Job(part.material, points, names[0], samples, before, held, tuple(via))


def _held(context: BakeContext, name: str, points: int) -> Tile:
    return Tile(context.store.read(name), context.store.artefact(name).meta["unit"], points)


def _write(context: BakeContext, part: Part, tile: int, found: tuple[Tile, ...], samples: int) -> None:
    for term, (name, one) in enumerate(zip(part.names(tile), found, strict=True)):
        meta = {**part.view.meta, **said(part, term), "unit": one.unit, "points": one.points}
        shape = one.array.shape
        writer = context.store.begin(name, KIND, shape, shape, "uint32", key=part.key, meta=meta)
        writer.write((0,), one.array)
        writer.finish(**meta, samples=samples)


def parts(context: BakeContext, view: View) -> Iterator[Part]:
    """One part per material used by the scene's objects."""
    key = _series_key(context, view)
    textures: Any = texture_inputs(context.in_views, "diffuse", "specular")
    rough: Any = texture_inputs(context.in_views, "roughness")
    for material, bins in bins_of(_editables(context), context.bounces).items():
        angles = [(term.fixed, [n for _, n in factors]) for term, factors in bins.terms] or state_of(bins.editable)
        inputs = [textures.get(material), rough.get(material) if any(map(varies, bins.editable.terms)) else None]
        yield Part(view, material, bins, key_of(KIND, REVISION, key, angles, inputs))


def said(part: Part, term: int) -> dict[str, Any]:
    """A tile's meta for its bands."""
    if not part.bins.terms:
        return {"material": part.material, "term": -1, "fixed": None, "curves": []}
    one, factors = part.bins.terms[term]
    curves = [[factor.curve, n] for factor, n in factors]
    return {"material": part.material, "term": term, "fixed": one.fixed, "curves": curves}


def _samples(context: BakeContext, part: Part, tile: int) -> int:
    """Samples of a tile: 0 if its terms differ, because a bake was interrupted between them."""
    store, names = context.store, part.names(tile)
    if not all(name in store and store.artefact(name).key == part.key for name in names):
        return 0
    found = {int(store.artefact(name).meta["samples"]) for name in names}
    return found.pop() if len(found) == 1 else 0


def _put_tails(context: BakeContext, view: View) -> None:
    """Write the document of the tails, as the meta of an array without numbers."""
    tails = tails_of(_editables(context), context.bounces)
    environment = environment_note(context.environment)
    meta = {
        **view.meta, "tails": tails.said(), "series": list(context.bounces.series), "environment": environment,
        "points": points_key(context, view),
    }  # fmt: skip
    context.put(KIND, view.name(KIND, "tails"), tails.hits.astype(np.uint32), meta)


def _series_key(context: BakeContext, view: View) -> str:
    """Key of all inputs of tiles except the material of their points."""
    scene, bounces, editables = context.in_views, context.bounces, _editables(context)
    lights, tails = light_inputs(scene), tails_of(editables, bounces).said()
    return key_of(KIND, REVISION, points_key(context, view), lights, _as_baked(context), tails, context.seed)


def _as_baked(context: BakeContext) -> list[Any]:
    """States of the materials whose BRDFs enter the paths, that is, without those scattered by the cosine."""
    scene, editables, bounces = context.in_views, _editables(context), context.bounces
    known = bounces.fixed | (set() if bounces.diffuse_seen else shapes_of(scene, editables).keys())
    textures: Any = texture_inputs(scene, *SCATTERING_TEXTURES)
    return [[name, state_of(one), textures.get(name)] for name, one in editables.items() if name in known]


def _editables(context: BakeContext) -> dict[str, Editable]:
    return {name: context.editable(name) for name in used_materials(context.in_views)}
