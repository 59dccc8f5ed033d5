"""Trials: small parts of a bake with interreflections, traced to estimate the cost of the whole."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from math import log2
from pathlib import Path

import numpy as np

from lambent.baking.artefacts.interreflection import POINTS, passes
from lambent.baking.interreflection.series import bins_of, tails_of
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.interreflection.tiles import Job, Tile, TileTracer, paths_at_once, unpacked
from lambent.baking.transport.view import View
from lambent.baking.transport.view_points import ViewPoints
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.core.arrays import ranges
from lambent.core.files import folder_bytes
from lambent.core.light.colour import luminance
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import Scene
from lambent.store.store import Store

TIMED = 1 << 10  # per batch
FEW, MANY = 8, 256  # numbers of points that get all samples
PER_MATERIAL = 1 << 18  # paths for these points
MOST_OF_VIEW = 0.95  # share of a view traced to find which materials reflect light on
LEAST_SHARE = 0.01  # of a view: uneditable materials with a smaller share are represented by one of them
MOST_SAMPLES = 1 << 14  # for these points; entries of more samples are extrapolated


@dataclass(frozen=True)
class Cost:
    """Cost of a material.

    Attributes
    ----------
    entries, raw_bytes, disk_bytes : float
        Per point with all samples; bytes before and after compression.
    path_s, call_s : float
        Seconds per path, and the overhead of a call that traces many.
    kept_s, tile_s : float
        Seconds to read, pack and write a point in a pass, and the overhead of a tile.
    """

    entries: float = 0.0
    raw_bytes: float = 0.0
    disk_bytes: float = 0.0
    path_s: float = 0.0
    call_s: float = 0.0
    kept_s: float = 0.0
    tile_s: float = 0.0

    def seconds(self, points: int, bounces: Bounces) -> float:
        """Seconds for this number of points, over all passes."""
        done = passes(bounces.samples)
        added = [after - before for before, after in zip((0, *done), done, strict=False)]
        found = points * (bounces.samples * self.path_s + len(done) * self.kept_s)
        for first in range(0, points, POINTS):
            paths = (min(POINTS, points - first) * more for more in added)
            calls = sum(-(-count // paths_at_once(bounces.series[1] > 1)) for count in paths)
            found += calls * self.call_s + len(done) * self.tile_s
        return found


class Trial:
    """Measures a view. `shown` has the points of each material; building the scene and its points takes `begin_s`."""

    def __init__(self, scene: Scene, view: View, editables: Mapping[str, Editable]) -> None:
        start = time.perf_counter()
        self.scene, self.editables, self._tracer = scene, editables, ViewTracer(scene, editables)
        self._points = self._tracer.points(view)
        self.begin_s = time.perf_counter() - start
        by_object = np.array([o.material for o in scene.objects])[self._points.object]
        self._at = {name: np.random.default_rng(0).permutation(np.flatnonzero(by_object == name)) for name in editables}
        self.shown = {name: len(at) for name, at in self._at.items()}

    def passed_on(self) -> dict[str, float]:
        """By material, its share as second surface of the light of paths over two surfaces, with current materials."""
        bounces = Bounces((1, 1), samples=64)
        work, tails = self._work(bounces), tails_of(self.editables, bounces)
        weights = tails.weights(np.array([albedo(self.editables[name], side) for name, side in tails.slots]))
        light = np.zeros((len(tails), 3))
        for name in self._most_of_view():
            at = self._at[name]
            points = self._some(name, max(FEW, 1024 * len(at) // len(self._points)))
            bins = work.bins[name]
            for (term, factors), tile in zip(bins.terms, work(Job(name, points, name, bounces.samples)), strict=True):
                _, codes, values = unpacked(tile.array, tile.points)
                means = [bins.editable.curves[factor.curve].band_means(1)[0] for factor, _ in factors]
                scale = np.prod([term.scale, *means], axis=0) * tile.unit * len(at) / len(points)
                np.add.at(light, codes.astype(int), values * scale)
        found = dict.fromkeys(self.editables, 0.0)
        each = luminance(light * weights)
        for (name, _), share in zip(tails.slots, each / max(float(each.sum()), 1e-30), strict=True):
            found[name] += float(share)
        return found

    def costs(self, bounces: Bounces) -> dict[str, Cost]:
        """Costs by material."""
        work, least = self._work(bounces), LEAST_SHARE * len(self._points)
        alike = [name for name in bounces.fixed if name in self.shown and self.shown[name] < least]
        found = {name: self._cost(work, name, bounces) for name in self.editables if name not in alike}
        one = max(alike, key=lambda name: (self.shown[name], name), default="")
        return {**found, **dict.fromkeys(alike, self._cost(work, one, bounces) if one else Cost())}

    def bake_bytes(self, bounces: Bounces, costs: Mapping[str, Cost]) -> int:
        """Memory of one process: paths on the device and as arrays, sums of the largest tile before and after."""
        ways = 2 * (len(bounces.series) - 1)
        most = max(cost.entries * min(POINTS, self.shown[name]) for name, cost in costs.items())
        return round(paths_at_once(bounces.series[1] > 1) * (3 * 16 * ways + 64) + 3 * 16 * most)

    def _cost(self, work: TileTracer, name: str, bounces: Bounces) -> Cost:
        samples = min(bounces.samples, MOST_SAMPLES)
        points = self._some(name, min(MANY, max(FEW, PER_MATERIAL // samples)))
        if not len(points):
            return Cost()
        half = work(Job(name, points, name, max(1, samples // 2)))
        tiles = work(Job(name, points, name, samples, max(1, samples // 2), half)) if samples > 1 else half
        counts = [(len(tile.array) - tile.points) / 2 for tile in (*half, *tiles)]
        before, after = sum(counts[: len(half)]), sum(counts[len(half) :])
        cells = len(work.tails) * sum(work.bins[name].bands)
        growth = (bounces.samples / samples) ** log2(max(after, 1) / max(before, 1))
        entries = min(after / len(points) * growth, cells)

        # Few points with one sample, and many: separates the overhead of calls and tiles from proportional costs.
        few, many = self._some(name, FEW), self._some(name, TIMED)
        batch = max(2, paths_at_once(bounces.series[1] > 1) // len(many))
        call_s, tile_s, _ = _timed(work, name, few, tiles, samples, 1)
        batch_s, keep_s, smaller = _timed(work, name, many, tiles, samples, batch)
        path_s = max(batch_s - call_s, 0.0) / (len(many) * batch)
        raw, kept_s = 4 * len(tiles) + 8 * entries, max(keep_s - tile_s, 0.0) / len(many)
        return Cost(entries, raw, raw * smaller, path_s, call_s, kept_s, tile_s)

    def _most_of_view(self) -> list[str]:
        """The most visible materials, enough to cover `MOST_OF_VIEW`."""
        names = sorted(self.shown, key=lambda name: -self.shown[name])
        before = np.cumsum([0, *(self.shown[name] for name in names)])[:-1]
        return [name for name, points in zip(names, before, strict=True) if points < MOST_OF_VIEW * len(self._points)]

    def _some(self, name: str, count: int) -> ViewPoints:
        """At most `count` points that show a material."""
        return self._points.where(np.sort(self._at[name][:count]))

    def _work(self, bounces: Bounces) -> TileTracer:
        tails, bins = tails_of(self.editables, bounces), bins_of(self.editables, bounces)
        return TileTracer(self.scene, tails, bins, 0, self._tracer, bounces.diffuse_seen)


def _timed(
    work: TileTracer, name: str, points: ViewPoints, tiles: tuple[Tile, ...], samples: int, batch: int
) -> tuple[float, float, float]:
    """Seconds to trace a batch for points with as many entries, and to store it; compression ratio in bytes."""
    held = tuple(_repeated(tile, len(points)) for tile in tiles)
    start = time.perf_counter()
    more = work(Job(name, points, name, samples + batch, samples, held))
    traced = time.perf_counter()
    for tile in more:  # as in the call
        Tile.of([tile.sums(samples)], samples)
    packed_s = time.perf_counter() - traced
    disk, writing_s = _written(more)
    smaller = disk / max(sum(tile.array.nbytes for tile in more), 1)
    return max(traced - start - packed_s, 0.0), packed_s + writing_s, smaller


def _repeated(tile: Tile, points: int) -> Tile:
    """A tile of more points, which repeat the entries of this one's."""
    counts, codes, _ = unpacked(tile.array, tile.points)
    packed = tile.array[tile.points + len(codes) :]
    turn = np.arange(points) % tile.points
    begin = np.concatenate([[0], np.cumsum(counts[:-1], dtype=np.int64)])
    size = counts[turn].astype(np.int64)
    at = np.repeat(begin[turn], size) + ranges(size)
    return Tile(np.concatenate([counts[turn], codes[at], packed[at]]), tile.unit, points)


def _written(tiles: tuple[Tile, ...]) -> tuple[int, float]:
    """Bytes on disk of tiles, and seconds to write them."""
    with tempfile.TemporaryDirectory(prefix="lambent-") as folder, Store.create(Path(folder) / "s", {}) as store:
        start = time.perf_counter()
        for k, tile in enumerate(tiles):
            store.put(f"trial/{k}", "trial", tile.array, key="")
        seconds = time.perf_counter() - start
        return folder_bytes(Path(folder)), seconds
