"""More samples for a tile of points: a function of its job alone, so that any process can run it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.shared_exponent import LARGEST, packed_rgb, unpacked_rgb
from lambent.baked.transport.tails import SecondBands, Tails
from lambent.baking.engine import engine
from lambent.baking.interreflection.as_baked import shapes_of
from lambent.baking.interreflection.series import Bins
from lambent.baking.running.tiles import seed_of, slices
from lambent.scenes.scene import Scene

if TYPE_CHECKING:
    from lambent.baking.interreflection.binning import SecondTerm
    from lambent.baking.interreflection.paths import Surfaces
    from lambent.baking.interreflection.sums import Sorted, Sums
    from lambent.baking.transport.bands import Bands
    from lambent.baking.transport.view_points import ViewPoints
    from lambent.baking.transport.view_tracer import ViewTracer

PATHS = 1 << 20  # traced at a time


@dataclass(frozen=True)
class Tile:
    """The stored mean light of a term at P points.

    Attributes
    ----------
    array : (P + 2 N,) uint32
        Number of entries of each point; their numbers tail * bands + band, ascending within a point; their light
        (`packed_rgb`).
    unit : float
        Factor on the packed light, in W/(sr m^2).
    points : int
    """

    array: NDArray[np.uint32]
    unit: float
    points: int

    @classmethod
    def of(cls, parts: Sequence[Sums], samples: int) -> Tile:
        """Concatenate parts of the points."""
        largest = max(float(part.light.max(initial=0.0)) for part in parts) / samples
        unit = 2.0 ** np.ceil(np.log2(max(largest, 1e-30) / (LARGEST / 4)))
        counts = np.concatenate([np.diff(part.ends).astype(np.uint32) for part in parts])
        packed = [packed_rgb(part.light / np.float32(samples) / np.float32(unit)) for part in parts]
        return cls(np.concatenate([counts, *(part.codes for part in parts), *packed]), float(unit), len(counts))

    def sums(self, samples: int, some: slice = slice(None)) -> Sums:
        """The sums of its samples, at some points."""
        from lambent.baking.interreflection.sums import Sums

        ends = np.concatenate([[0], np.cumsum(self.array[: self.points], dtype=np.int64)])
        first, last, _ = some.indices(self.points)
        codes, packed = (half[ends[first] : ends[last]] for half in np.split(self.array[self.points :], 2))
        return Sums(ends[first : last + 1] - ends[first], codes, unpacked_rgb(packed) * np.float32(self.unit * samples))


def unpacked(
    array: NDArray[np.uint32], points: int
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]:
    """Number of entries per point (P,), numbers tail * bands + band (N,) and light (N, 3) of a stored tile."""
    counts, rest = array[:points], array[points:]
    half = len(rest) // 2
    return counts, rest[:half], unpacked_rgb(rest[half:])


def paths_at_once(by_second: bool) -> int:
    """Paths traced at a time; fewer if second surfaces contribute by bands, which needs additional arrays."""
    return PATHS >> 2 if by_second else PATHS


@dataclass(frozen=True)
class Job:
    """Points of a material to bring to a number of samples.

    `name` distinguishes their seeds from those of other points; `held` has the existing tiles of the material's terms
    with their samples, `before`, or is empty. `via` are numbers of samples on the way, as of jobs one after the other.
    """

    material: str
    points: ViewPoints
    name: str
    samples: int
    before: int = 0
    held: tuple[Tile, ...] = ()
    via: tuple[int, ...] = ()


class TileTracer:
    """Traces jobs in this process or, pickled, in another, which builds Mitsuba's scene at the first call.

    A given `tracer` must have the materials of `bins`; `diffuse_seen` is that of `Bounces`.
    """

    def __init__(
        self,
        scene: Scene,
        tails: Tails,
        bins: Mapping[str, Bins],
        seed: int,
        tracer: ViewTracer | None = None,
        diffuse_seen: bool = False,
    ) -> None:
        self.scene, self.tails, self.bins, self.seed, self._tracer = scene, tails, bins, seed, tracer
        self._diffuse_seen = diffuse_seen

    def __reduce__(self) -> tuple[Any, ...]:
        return TileTracer, (self.scene, self.tails, self.bins, self.seed, None, self._diffuse_seen)

    def __call__(self, job: Job) -> tuple[Tile, ...]:
        """The tiles of the terms of the job's material."""
        for samples in job.via:
            job = replace(job, before=samples, held=self._brought(replace(job, samples=samples)))
        return self._brought(job)

    def _brought(self, job: Job) -> tuple[Tile, ...]:
        """Likewise, in one go."""
        engine()  # before Mitsuba is imported
        # Before the thread starts: imports and numba's compiler parse Python, which CPython 3.11 cannot do in two
        # threads.
        from lambent.baking.interreflection import binning, paths  # noqa: F401
        from lambent.baking.interreflection.sums import compile_sums

        adding: list[Future[list[Sums]]] = []
        with ThreadPoolExecutor(1) as adder:  # sums while the next paths are traced and compiled
            adder.submit(compile_sums, bool(self.tails.second))
            for some in self._at_once(len(job.points), job.samples - job.before):
                new = self._traced(job, some)
                if adding:
                    adding[-1].result()  # limits memory to the paths of two blocks
                adding.append(adder.submit(self._added, job, some, new))
        return tuple(Tile.of(term, job.samples) for term in zip(*(block.result() for block in adding), strict=True))

    def _at_once(self, points: int, samples: int) -> list[slice]:
        """Points whose new samples are traced together; a point's sums are written once, however many there are."""
        most = max(1, paths_at_once(by_second=bool(self._seconds)) // samples)
        return slices(points, -(-points // -(-points // most)))

    def _traced(self, job: Job, some: slice) -> list[Sorted]:
        """All new samples of some of a job's points, by term."""
        from lambent.baking.interreflection.binning import Sorting
        from lambent.baking.interreflection.directions import shares_of
        from lambent.baking.interreflection.paths import trace

        bins, points, count = self.bins[job.material], job.points.where(some), job.samples - job.before
        seed = seed_of(self.seed, job.name, job.before, some.start)
        paths = trace(self._surfaces, points, shares_of(bins.editable), self.tails, count, seed)
        sorting = Sorting(paths, points, self.tails, self._seconds)
        if not bins.terms:
            return [sorting.whole(bins.editable)]
        return [sorting.by_term(term, _bands(factors)) for term, factors in bins.terms]

    def _added(self, job: Job, some: slice, new: list[Sorted]) -> list[Sums]:
        """All samples of some of a job's points, by term."""
        from lambent.baking.interreflection.sums import Sums

        none = Sums.none(some.stop - some.start)
        held = [tile.sums(job.before, some) for tile in job.held] or [none] * len(new)
        zipped = zip(held, new, self.bins[job.material].bands, strict=True)
        return [sums.and_of(more, bands, len(self.tails)) for sums, more, bands in zipped]

    @cached_property
    def _surfaces(self) -> Surfaces:
        from lambent.baking.interreflection.paths import Surfaces
        from lambent.baking.transport.view_tracer import ViewTracer

        editables = {name: bins.editable for name, bins in self.bins.items()}
        tracer = self._tracer = self._tracer or ViewTracer(self.scene, editables)  # created on demand, for its scene
        materials = [o.material for o in self.scene.objects]
        shapes = {} if self._diffuse_seen else shapes_of(self.scene, editables)
        return Surfaces.of(tracer.scene, tracer.numbers, materials, self.tails, shapes)

    @cached_property
    def _seconds(self) -> list[SecondTerm]:
        return [self._second(one) for one in self.tails.second]

    def _second(self, one: SecondBands) -> SecondTerm:
        from lambent.baking.interreflection.binning import SecondTerm
        from lambent.baking.interreflection.paths import NONE

        if not one.material:
            return SecondTerm(NONE, None, ())
        term = self.bins[one.material].editable.terms[one.term]
        factors = tuple(zip(term.factors, one.counts, strict=True))
        return SecondTerm(self._surfaces.names.index(one.material), term, tuple(_bands(factors)))


def _bands(factors: Any) -> list[Bands]:
    from lambent.baking.transport.bands import Bands

    return [Bands(*one) for one in factors]
