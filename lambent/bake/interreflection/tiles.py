"""More samples of a tile of points: a function of its job alone, which any process can do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.engine import engine
from lambent.bake.interreflection.as_baked import shapes_of
from lambent.bake.interreflection.series import Bins
from lambent.bake.tiles import seed_of
from lambent.core.shared_exponent import LARGEST, packed_rgb, unpacked_rgb
from lambent.scenes.scene import Scene
from lambent.store.tails import SecondBands, Tails

if TYPE_CHECKING:
    from lambent.bake.interreflection.binning import SecondTerm
    from lambent.bake.interreflection.paths import Surfaces
    from lambent.bake.interreflection.sums import Sums
    from lambent.bake.transport.bands import Bands
    from lambent.bake.transport.view_points import ViewPoints
    from lambent.bake.transport.view_tracer import ViewTracer

PATHS = 1 << 20  # at once


@dataclass(frozen=True)
class Tile:
    """The mean light of a term at P points, as it is stored.

    Attributes
    ----------
    array : (P + 2 N,) uint32
        Entries of each point; their numbers tail * bands + band, rising within a point; their light (`packed_rgb`).
    unit : float
        What the packed light is multiplied by, in W/(sr m^2).
    points : int
    """

    array: NDArray[np.uint32]
    unit: float
    points: int

    @classmethod
    def of(cls, sums: Sums, samples: int) -> Tile:
        light = sums.light / np.float32(samples)
        unit = 2.0 ** np.ceil(np.log2(max(float(light.max(initial=0.0)), 1e-30) / (LARGEST / 4)))
        counts = np.diff(sums.ends).astype(np.uint32)
        array = np.concatenate([counts, sums.codes, packed_rgb(light / np.float32(unit))])
        return cls(array, float(unit), len(counts))

    def sums(self, samples: int) -> Sums:
        """The sums of its samples."""
        from lambent.bake.interreflection.sums import Sums

        counts, codes, light = unpacked(self.array, self.points)
        ends = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        return Sums(ends, codes, light * np.float32(self.unit * samples))


def unpacked(
    array: NDArray[np.uint32], points: int
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], NDArray[np.float32]]:
    """Entries of each point (P,), numbers tail * bands + band (N,) and light (N, 3) of a stored tile."""
    counts, rest = array[:points], array[points:]
    half = len(rest) // 2
    return counts, rest[:half], unpacked_rgb(rest[half:])


@dataclass(frozen=True)
class Job:
    """Points of a material, to be brought to so many samples.

    `name` tells their seeds from those of other points; `held` are the tiles of the material's terms with the samples
    that they have, none where they have none.
    """

    material: str
    points: ViewPoints
    name: str
    samples: int
    before: int = 0
    held: tuple[Tile, ...] = ()


class TileTracer:
    """Traces jobs, in this process or, pickled, in another: Mitsuba's scene is made where it is called first.

    A `tracer` that is given has the materials of `bins`; `diffuse_seen` is that of `Bounces`.
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
        engine()  # before Mitsuba is imported
        from lambent.bake.interreflection.binning import Sorting
        from lambent.bake.interreflection.directions import shares_of
        from lambent.bake.interreflection.paths import trace
        from lambent.bake.interreflection.sums import Sums

        points, bins = job.points, self.bins[job.material]
        sums = [tile.sums(job.before) for tile in job.held] or [Sums.none(len(points)) for _ in bins.bands]
        at_once = max(1, (PATHS >> 2 if self._seconds else PATHS) // len(points))
        for first in range(job.before, job.samples, at_once):
            count = min(at_once, job.samples - first)
            seed = seed_of(self.seed, job.name, first)
            paths = trace(self._surfaces, points, shares_of(bins.editable), self.tails, count, seed)
            sorting = Sorting(paths, points, self.tails, self._seconds)
            found = (sorting.by_term(term, _bands(factors)) for term, factors in bins.terms)
            new = found if bins.terms else [sorting.whole(bins.editable)]
            zipped = zip(sums, new, bins.bands, strict=True)
            sums = [total.and_of(more, bands, len(self.tails)) for total, more, bands in zipped]
        return tuple(Tile.of(total, job.samples) for total in sums)

    @cached_property
    def _surfaces(self) -> Surfaces:
        from lambent.bake.interreflection.paths import Surfaces
        from lambent.bake.transport.view_tracer import ViewTracer

        editables = {name: bins.editable for name, bins in self.bins.items()}
        tracer = self._tracer = self._tracer or ViewTracer(self.scene, editables)  # which its scene needs
        worn = [o.material for o in self.scene.objects]
        shapes = {} if self._diffuse_seen else shapes_of(self.scene, editables)
        return Surfaces.of(tracer.scene, tracer.object_numbers, worn, self.tails, shapes)

    @cached_property
    def _seconds(self) -> list[SecondTerm]:
        return [self._second(one) for one in self.tails.second]

    def _second(self, one: SecondBands) -> SecondTerm:
        from lambent.bake.interreflection.binning import SecondTerm
        from lambent.bake.interreflection.paths import NONE

        if not one.material:
            return SecondTerm(NONE, None, ())
        term = self.bins[one.material].editable.terms[one.term]
        factors = tuple(zip(term.factors, one.counts, strict=True))
        return SecondTerm(self._surfaces.worn.index(one.material), term, tuple(_bands(factors)))


def _bands(factors: Any) -> list[Bands]:
    from lambent.bake.transport.bands import Bands

    return [Bands(*one) for one in factors]
