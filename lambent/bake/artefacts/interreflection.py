"""Interreflections of a view: light that met other surfaces first, by bands of the curves and by tails (`store.tails`).

Passes over all points add samples, each as many as there are, so that a picture is soon there and its noise falls. A
tile of points is one array, written whole: work that ends early loses at most one tile's pass.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.bake.artefacts.view_points import points_key
from lambent.bake.context import BakeContext
from lambent.bake.engine import engine
from lambent.bake.keys import geometry_inputs, key_of, light_inputs, texture_inputs
from lambent.bake.tiles import seed_of, slices
from lambent.bake.view import View
from lambent.core.shared_exponent import LARGEST, packed_rgb, unpacked_rgb
from lambent.materials.factored.roughness import varies
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.store.source import environment_note
from lambent.store.tails import FIXED, SecondBands, Tails

if TYPE_CHECKING:
    from lambent.bake.interreflection.binning import SecondTerm
    from lambent.bake.interreflection.sums import Sums
    from lambent.bake.transport.bands import Bands

KIND = "interreflection"
NEEDS = ("view_points",)
OF_VIEWS = True
ON_REQUEST = True
REVISION = 1
SMOOTH, SMOOTH_OF_TWO = 4, 8  # bands of curves over angles without narrow peaks
SMOOTH_ANGLES = ("theta_i", "theta_o", "theta_d")
POINTS = 1 << 12  # of a tile
PATHS = 1 << 20  # at once
FIRST_PASS = 16  # samples


@dataclass(frozen=True)
class Part:
    """The points of a view that show one material.

    `terms` are the terms that the light of its first surface is sorted by, with the bands of their curves; none where
    the material is not edited.
    """

    view: View
    material: str
    editable: Editable
    terms: tuple[tuple[Term, tuple[tuple[Factor, int], ...]], ...]
    key: str

    @property
    def bands(self) -> list[int]:
        """Of each term; of a material that is not edited, one."""
        return [int(np.prod([n for _, n in factors], dtype=int)) for _, factors in self.terms] or [1]

    def name(self, term: int, tile: int) -> str:
        return self.view.name(KIND, f"{self.material}/{term}/{tile}")


def tails_of(context: BakeContext) -> Tails:
    """The tails of a scene: a slot for each side of its edited materials, and one for all others."""
    bounces = context.bounces
    worn = _worn(context)
    slots = []
    for material in worn:
        if material not in bounces.fixed:
            sides = {
                "transmission" if t.side == "transmission" else "reflection" for t in context.editable(material).terms
            }
            slots += [(material, side) for side in sorted(sides)]
    if any(material in bounces.fixed for material in worn):
        slots.append(("", FIXED))
    second: list[SecondBands] = []
    if bounces.series[1] > 1:
        for material in worn:
            if material not in bounces.fixed:
                for number, term in enumerate(context.editable(material).terms):
                    counts = tuple(n for _, n in _factors(term, bounces.series[1]))
                    second.append(SecondBands(material, number, counts))
        if any(material in bounces.fixed for material in worn):
            second.append(SecondBands("", 0, ()))
    return Tails(tuple(slots), len(bounces.series), tuple(second))


def keys(context: BakeContext) -> dict[str, str]:
    """Of the tails and the samples; tiles have keys of their own (`Part.key`), and are not counted before the bake."""
    found: dict[str, str] = {}
    for view in context.views:
        found[view.name(KIND, "tails")] = key_of(KIND, REVISION, _series_key(context, view), context.bounces.series)
        of_parts = [part.key for part in parts(context, view)]
        found[view.name(KIND, "samples")] = key_of(KIND, REVISION, of_parts, context.bounces.samples)
    return found


def bake(context: BakeContext) -> None:
    engine()  # before Mitsuba is imported
    bounces = context.bounces
    for view in context.views:
        _put_tails(context, view)
    samples = FIRST_PASS
    while True:
        samples = min(samples, bounces.samples)
        for view in context.views:
            _Pass(context, view, samples).run()
        if samples == bounces.samples:
            break
        samples *= 2
    for view in context.views:
        context.put(KIND, view.name(KIND, "samples"), np.array([samples], np.uint32), view.meta)


class _Pass:
    """Brings every tile of a view to so many samples."""

    def __init__(self, context: BakeContext, view: View, samples: int) -> None:
        from lambent.bake.interreflection.paths import Surfaces

        self.context, self.view, self.samples = context, view, samples
        self.tails = tails_of(context)
        self.points = context.view_tracer.points(view)
        objects = context.in_views.objects
        self.worn = np.array([o.material for o in objects])[self.points.object]
        tracer = context.view_tracer
        worn = [o.material for o in objects]
        self.surfaces = Surfaces.of(tracer.scene, tracer.object_numbers, worn, self.tails)

        self.seconds = [self._second(one) for one in self.tails.second]

    def _second(self, one: SecondBands) -> SecondTerm:
        from lambent.bake.interreflection.binning import SecondTerm
        from lambent.bake.interreflection.paths import NONE

        if not one.material:
            return SecondTerm(NONE, None, ())
        term = self.context.editable(one.material).terms[one.term]
        factors = tuple(zip(term.factors, one.counts, strict=True))
        return SecondTerm(self.surfaces.worn.index(one.material), term, tuple(_bands(factors)))

    def run(self) -> None:
        jobs = [
            (part, tile, place)
            for part in parts(self.context, self.view)
            for tile, place in enumerate(self._tiles(part))
        ]
        what = f"interreflections, {self.samples} samples"
        for done, (part, tile, place) in enumerate(jobs):
            self.context.progress(done, len(jobs), what)
            self._tile(part, tile, place)
        self.context.progress(len(jobs), len(jobs), what)

    def _tiles(self, part: Part) -> list[slice]:
        return slices(int(np.count_nonzero(self.worn == part.material)), POINTS)

    def _tile(self, part: Part, tile: int, place: slice) -> None:
        from lambent.bake.interreflection.binning import Sorting
        from lambent.bake.interreflection.directions import shares_of
        from lambent.bake.interreflection.paths import trace
        from lambent.bake.interreflection.sums import Sums

        store, names = self.context.store, [part.name(k, tile) for k in range(len(part.bands))]
        before = min(_samples(store, name, part.key) for name in names)
        if before >= self.samples:
            return
        points = self.points.where(self.worn == part.material).where(place)
        sums = [self._begun(name, len(points), before) if before else Sums.none(len(points)) for name in names]
        at_once = max(1, (PATHS >> 2 if self.seconds else PATHS) // len(points))
        for first in range(before, self.samples, at_once):
            count = min(at_once, self.samples - first)
            seed = seed_of(self.context.seed, names[0], first)
            paths = trace(self.surfaces, points, shares_of(part.editable), self.tails, count, seed)
            sorting = Sorting(paths, points, self.tails, self.seconds)
            found = (sorting.by_term(term, _bands(factors)) for term, factors in part.terms)
            new = found if part.terms else [sorting.whole(part.editable)]
            zipped = zip(sums, new, part.bands, strict=True)
            sums = [total.and_of(more, bands, len(self.tails)) for total, more, bands in zipped]
        for k, (name, total) in enumerate(zip(names, sums, strict=True)):
            self._write(part, name, k, total)

    def _begun(self, name: str, points: int, before: int) -> Sums:
        """The sums of the samples that the store has."""
        from lambent.bake.interreflection.sums import Sums

        counts, codes, light = unpacked(self.context.store.read(name), points)
        unit = self.context.store.artefact(name).meta["unit"]
        return Sums(np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]), codes, light * np.float32(unit * before))

    def _write(self, part: Part, name: str, term: int, total: Sums) -> None:
        light = total.light / np.float32(self.samples)
        unit = 2.0 ** np.ceil(np.log2(max(float(light.max(initial=0.0)), 1e-30) / (LARGEST / 4)))
        counts = np.diff(total.ends).astype(np.uint32)
        array = np.concatenate([counts, total.codes, packed_rgb(light / np.float32(unit))])
        meta = {**self.view.meta, **said(part, term), "unit": unit, "points": len(counts)}
        writer = self.context.store.begin(name, KIND, array.shape, array.shape, "uint32", key=part.key, meta=meta)
        writer.write((0,), array)
        writer.finish(**meta, samples=self.samples)


def unpacked(array: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Entries of each point (P,), numbers tail * bands + band (N,) and light (N, 3) of a stored tile."""
    counts, rest = array[:points], array[points:]
    half = len(rest) // 2
    return counts, rest[:half], unpacked_rgb(rest[half:])


def parts(context: BakeContext, view: View) -> Iterator[Part]:
    """The materials of a scene's objects."""
    bounces, key = context.bounces, _series_key(context, view)
    textures: Any = texture_inputs(context.in_views, "diffuse", "specular")
    rough: Any = texture_inputs(context.in_views, "roughness")
    for material in _worn(context):
        editable, terms = context.editable(material), []
        if material not in bounces.fixed:
            terms = [(term, _factors(term, bounces.series[0])) for term in editable.terms]
        angles = [(term.fixed, [n for _, n in factors]) for term, factors in terms] or repr(editable)
        inputs = [textures.get(material), rough.get(material) if any(map(varies, editable.terms)) else None]
        yield Part(view, material, editable, tuple(terms), key_of(KIND, REVISION, key, angles, inputs))


def said(part: Part, term: int) -> dict[str, Any]:
    """What a tile says of its bands."""
    if not part.terms:
        return {"material": part.material, "term": -1, "fixed": None, "curves": []}
    one, factors = part.terms[term]
    curves = [[factor.curve, n] for factor, n in factors]
    return {"material": part.material, "term": term, "fixed": one.fixed, "curves": curves}


def _put_tails(context: BakeContext, view: View) -> None:
    """The document of the tails: an array without numbers, whose notes say what they are."""
    tails = tails_of(context)
    environment = environment_note(context.environment)
    meta = {**view.meta, "tails": tails.said(), "series": list(context.bounces.series), "environment": environment}
    context.put(KIND, view.name(KIND, "tails"), tails.hits.astype(np.uint32), meta)


def _factors(term: Term, sharp: int) -> tuple[tuple[Factor, int], ...]:
    smooth = SMOOTH if len(term.factors) < 2 else SMOOTH_OF_TWO
    return tuple((f, min(smooth, sharp) if f.over in SMOOTH_ANGLES else sharp) for f in term.factors)


def _bands(factors: tuple[tuple[Factor, int], ...]) -> list[Bands]:
    from lambent.bake.transport.bands import Bands

    return [Bands(*one) for one in factors]


def _samples(store: Any, name: str, key: str) -> int:
    """Samples that a tile has."""
    if name not in store or store.artefact(name).key != key:
        return 0
    return int(store.artefact(name).meta["samples"])


def _series_key(context: BakeContext, view: View) -> str:
    """The key of all that tiles depend on, but the material of their points."""
    scene, bounces = context.in_views, context.bounces
    fixed = [
        [m, repr(context.editable(m)), scene.materials[m].model_dump_json()]
        for m in _worn(context)
        if m in bounces.fixed
    ]
    lights = light_inputs(scene)
    return key_of(
        KIND, REVISION, points_key(context, view), geometry_inputs(scene), lights, fixed, tails_of(context).said(),
        context.seed,
    )  # fmt: skip


def _worn(context: BakeContext) -> list[str]:
    return list(dict.fromkeys(o.material for o in context.in_views.objects))
