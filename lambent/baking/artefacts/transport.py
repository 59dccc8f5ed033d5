"""Transport of the terms of a view's materials: direct light by bands of their curves, starting with few lights."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from lambent.baking.artefacts.visibility import lights_key, trace
from lambent.baking.context import BakeContext
from lambent.baking.interreflection.series import SMOOTH_ANGLES
from lambent.baking.quality import QualityName
from lambent.baking.running.in_background import background
from lambent.baking.running.keys import key_of, texture_inputs
from lambent.baking.transport.view import View
from lambent.core.progress import Progress
from lambent.materials.factored.terms import Factor, Term, varies
from lambent.store.contract import TRANSPORT_BASIS
from lambent.store.source import environment_note
from lambent.store.store import Store, Writer

if TYPE_CHECKING:
    from lambent.baking.transport.view_points import ViewPoints
    from lambent.scenes.sky.triangle_lights import TriangleLights

KIND = "transport"
NEEDS = ("view_points", "visibility")
OF_VIEWS = True
REVISION = 4
POINTS = 1 << 15  # per chunk
LEAST = 2.0**-10  # of the light of a band of the first curve: less is moved to a neighbour along a smooth second curve
ENTRIES = 1 << 20  # of pairs, per chunk: each chunk costs milliseconds to write
MANY_LIGHTS = 1000  # below this, two sharp curves have half the bands each


@dataclass(frozen=True)
class Settings:
    """Numbers of bands, powers of two, for curves with narrow peaks and smooth ones, alone or as one of two."""

    sharp: int
    smooth: int
    sharp_of_two: int
    smooth_of_two: int


SETTINGS = {
    QualityName.preview: Settings(256, 64, 128, 16),
    QualityName.normal: Settings(256, 64, 128, 16),
    QualityName.final: Settings(256, 128, 256, 32),
}


@dataclass(frozen=True)
class _Part:
    """One term of one material in one view with a number of lights."""

    view: View
    lights: int
    material: str
    number: int
    term: Term
    bands: tuple[tuple[Factor, int], ...]
    key: str

    def name(self, array: str) -> str:
        return self.view.name(KIND, f"{self.lights}/{self.material}/{self.number}/{array}")

    @property
    def arrays(self) -> tuple[str, ...]:
        return ("spans", "steps", "values") if len(self.bands) == 2 else ("rows",)

    def said(self, scale: float) -> dict[str, Any]:
        curves = [[factor.curve, count] for factor, count in self.bands]
        fixed = self.term.fixed
        said = {"material": self.material, "term": self.number, "fixed": fixed, "curves": curves, "scale": scale}
        return {**said, "basis": TRANSPORT_BASIS}


def keys(context: BakeContext) -> dict[str, str]:
    found: dict[str, str] = {}
    for view in context.views:
        for count in context.settings("visibility").lights:
            parts = list(_parts(context, view, count))
            found |= {part.name(array): part.key for part in parts for array in part.arrays}
            curves = [(p.material, p.number, p.key, p.term.curves) for p in parts]
            found[_terms_name(view, count)] = key_of(
                KIND, REVISION, curves, *filter(None, [environment_note(context.environment)])
            )
    return found


def bake(context: BakeContext) -> None:
    counts = context.settings("visibility").lights
    for count in counts:
        for view in context.views:
            trace(context, view, count)
            _bake_view(context, view, count)


def _bake_view(context: BakeContext, view: View, count: int) -> None:
    from lambent.baking.transport.device_lights import brightest
    from lambent.baking.transport.stored import scale_of

    lights, points = context.view_tracer.lights(count), context.view_tracer.points(view)
    scale, sizes = scale_of(brightest(points.p, lights)), []
    seen = context.store.read(view.name("visibility", str(count)))
    materials = np.array([o.material for o in context.in_views.objects])[points.object]
    parts = list(_parts(context, view, count))
    for material, terms in groupby(parts, lambda part: part.material):
        mine = materials == material
        own = points.where(mine), lights, seen[:, mine], scale
        for part in terms:
            sizes.append(np.count_nonzero(mine))
            if context.stale(KIND) & {part.name(array) for array in part.arrays}:
                what = f"{part.material}: {part.term.name}, {len(lights)} lights"
                baking = _Baking(part, *own, what, context.progress)
                (baking.pairs if len(part.bands) == 2 else baking.rows)(context.store)
    said = {
        **view.meta,
        "terms": [part.said(scale) for part in parts],
        "environment": environment_note(context.environment),
    }
    context.put(KIND, _terms_name(view, count), np.array(sizes, np.uint32), said)


@dataclass(frozen=True)
class _Baking:
    """The points of a part and their visibility."""

    part: _Part
    points: ViewPoints
    lights: TriangleLights
    seen: np.ndarray
    scale: float
    what: str
    progress: Progress

    def rows(self, store: Store) -> None:
        """Write transport by wavelets of one curve; without a curve, as one row."""
        from lambent.baking.transport.bands import transport
        from lambent.baking.transport.stored import wavelet_rows

        bands, many = self._bands(), len(self.points)
        writer = self._begin(store, "rows", (bands[0].count, 3, many), (bands[0].count, 3, POINTS), "float16")
        with background() as after:
            for chunk in self._missing(writer):
                some = writer.artefact.region(chunk)[2]
                found = transport(self.points.where(some), self.lights, self.seen[:, some], self.part.term, bands[0])
                texture = self._texture(some).T
                after.do(lambda c, light: writer.write(c, wavelet_rows(light, self.scale)), chunk, found * texture)
        writer.finish()

    def pairs(self, store: Store) -> None:
        """Write transport by pairs of bands, the entries of a block of points before its spans."""
        from lambent.baking.transport.bands import pair_transport

        bands, many, term = self._bands(), len(self.points), self.part.term
        least = LEAST if bands[1].factor.over in SMOOTH_ANGLES else 0.0
        spans = self._begin(store, "spans", (many, 2), (POINTS, 2), "uint32")
        steps = self._begin(store, "steps", (0,), (ENTRIES,), "uint8", growing=True)
        values = self._begin(store, "values", (0,), (ENTRIES,), "uint32", growing=True)
        begin = None
        with background() as after:
            for chunk in self._missing(spans):
                if begin is None:
                    begin = int(spans.read_chunk((chunk[0] - 1, 0)).max(initial=0)) if chunk[0] else 0
                begin = -(-begin // ENTRIES) * ENTRIES
                some = spans.artefact.region(chunk)[0]
                points, seen, texture = self.points.where(some), self.seen[:, some], self._texture(some)
                streams, counts = [EntryStream(writer, begin, after.do) for writer in (steps, values)], []
                for found in pair_transport(points, self.lights, seen, term, bands, self.scale, texture, least):
                    counts.append(found.counts)
                    streams[0].add(found.steps)
                    streams[1].add(found.light)
                for stream in streams:
                    stream.end()
                many_each = np.concatenate(counts)
                ends = begin + np.cumsum(many_each)
                after.do(spans.write, chunk, np.stack([ends - many_each, ends], axis=1).astype(np.uint32))
                begin = int(ends[-1])
        for writer in (steps, values, spans):
            writer.finish()

    def _bands(self) -> list[Any]:
        from lambent.baking.transport.bands import Bands

        return [Bands(*pair) for pair in self.part.bands or ((Factor("", "theta_i"), 1),)]

    def _texture(self, some: slice) -> np.ndarray:
        """(points, 3) factors of textures."""
        return (self.points.diffuse if self.part.term.is_diffuse else self.points.specular)[some]

    def _begin(
        self, store: Store, array: str, shape: tuple[int, ...], chunks: tuple[int, ...], dtype: str,
        growing: bool = False,
    ) -> Writer:  # fmt: skip
        meta = {**self.part.view.meta, **self.part.said(self.scale)}
        name = self.part.name(array)
        return store.begin(name, KIND, shape, chunks, dtype, key=self.part.key, meta=meta, growing=growing)

    def _missing(self, writer: Writer) -> Iterator[tuple[int, ...]]:
        """Yield the missing chunks, and report each when it is taken."""
        total = len(writer.artefact.chunk_grid)
        for chunk in writer.missing:
            self.progress(total - len(writer.missing), total, self.what)
            yield chunk
        self.progress(total, total, self.what)


class EntryStream:
    """Writes entries (n, ...) into whole chunks from `begin`, the last one padded with zeros.

    Holds one chunk, however many entries come. `do` writes a full one, at once or in the background, which may queue.
    """

    def __init__(self, writer: Writer, begin: int, do: Callable[..., None]) -> None:
        self._writer, self._next, self._do = writer, begin // ENTRIES, do
        self._chunk, self._filled = self._empty(), 0

    def add(self, entries: np.ndarray) -> None:
        while len(entries):
            here, entries = np.split(entries, [ENTRIES - self._filled])
            self._chunk[self._filled : self._filled + len(here)] = here
            self._filled += len(here)
            if self._filled == ENTRIES:
                self.end()

    def end(self) -> None:
        """Write what is held."""
        if self._filled:
            self._do(self._write, self._next, self._chunk)
            self._chunk, self._filled = self._empty(), 0
            self._next += 1

    def _empty(self) -> np.ndarray:
        return np.zeros((ENTRIES, *self._writer.artefact.shape[1:]), self._writer.artefact.dtype)

    def _write(self, number: int, chunk: np.ndarray) -> None:
        missing = (number + 1) * ENTRIES - self._writer.artefact.shape[0]
        if missing > 0:
            self._writer.extend(missing)
        self._writer.write((number, *[0] * (chunk.ndim - 1)), chunk)


def append(writer: Writer, begin: int, entries: np.ndarray) -> None:
    """Write entries as `EntryStream`, at once."""
    stream = EntryStream(writer, begin, lambda work, *arguments: work(*arguments))
    stream.add(entries)
    stream.end()


def _parts(context: BakeContext, view: View, count: int) -> Iterator[_Part]:
    """Yield the terms of every material used by an object of the scene."""
    scene = context.in_views
    light = lights_key(context, view, count)
    textures: Any = texture_inputs(scene, "diffuse", "specular")
    rough: Any = texture_inputs(scene, "roughness")
    for material in dict.fromkeys(o.material for o in scene.objects):
        for number, term in enumerate(context.editable(material).terms):
            bands = _bands(context.settings(KIND), term, count)
            angles = [(factor.over, factor.stretch, count) for factor, count in bands]
            said = [rough[material]] if material in rough and varies(term) else []
            key = key_of(KIND, REVISION, light, repr(term.quotient), term.side, angles, textures.get(material), *said)
            yield _Part(view, count, material, number, term, bands, key)


def _bands(how: Settings, term: Term, lights: int) -> tuple[tuple[Factor, int], ...]:
    """The curves of a term, and their bands for this many lights.

    The cost of pairs of two sharp curves is the product of their bands. Few lights are too wide for so many bands: one
    of 400 turns the half vector by 5 degrees.
    """
    of_two = len(term.factors) == 2
    smooth, sharp = (how.smooth_of_two, how.sharp_of_two) if of_two else (how.smooth, how.sharp)
    if of_two and lights < MANY_LIGHTS and not any(factor.over in SMOOTH_ANGLES for factor in term.factors):
        sharp //= 2
    return tuple((factor, smooth if factor.over in SMOOTH_ANGLES else sharp) for factor in term.factors)


def _terms_name(view: View, count: int) -> str:
    return view.name(KIND, f"{count}/terms")
