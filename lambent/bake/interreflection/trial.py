"""Small parts of a bake with interreflections, traced to measure what all of it will take."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Mapping
from dataclasses import dataclass
from math import log2
from pathlib import Path

import numpy as np

from lambent.bake.bounces import Bounces
from lambent.bake.interreflection.series import bins_of, tails_of
from lambent.bake.interreflection.tiles import PATHS, Job, Tile, TileTracer, unpacked
from lambent.bake.transport.view_points import ViewPoints
from lambent.bake.transport.view_tracer import ViewTracer
from lambent.bake.view import View
from lambent.core.colour import luminance
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import Scene
from lambent.store.store import Store

TILE = 1 << 12  # points, as in a bake
TIMED = 1 << 10  # of these, for a batch
FEW, MANY = 8, 256  # points that get all samples
PER_MATERIAL = 1 << 18  # paths of these
MOST_SAMPLES = 1 << 14  # of these; entries of more are extrapolated


@dataclass(frozen=True)
class Cost:
    """Of a point: entries, bytes before and after compression, and seconds for all samples."""

    entries: float
    raw_bytes: float
    disk_bytes: float
    seconds: float


class Trial:
    """Measures a view. `shown` are the points of each material."""

    def __init__(self, scene: Scene, view: View, editables: Mapping[str, Editable]) -> None:
        self.scene, self.editables, self._tracer = scene, editables, ViewTracer(scene, editables)
        self._points = self._tracer.points(view)
        worn = np.array([o.material for o in scene.objects])[self._points.object]
        self._at = {name: np.random.default_rng(0).permutation(np.flatnonzero(worn == name)) for name in editables}
        self.shown = {name: len(at) for name, at in self._at.items()}

    def passed_on(self) -> dict[str, float]:
        """Share of the light of paths over two surfaces, whose second surface is of each material, as it looks now."""
        bounces = Bounces((1, 1), samples=64)
        work, tails = self._work(bounces), tails_of(self.editables, bounces)
        weights = tails.weights(np.array([albedo(self.editables[name], side) for name, side in tails.slots]))
        light = np.zeros((len(tails), 3))
        for name, at in self._at.items():
            points = self._some(name, max(FEW, 1024 * len(at) // len(self._points)))
            if not len(points):
                continue
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
        """By material."""
        work = self._work(bounces)
        return {name: self._cost(work, name, bounces) for name in self.editables}

    def bake_bytes(self, bounces: Bounces, costs: Mapping[str, Cost]) -> int:
        """Memory of one process: paths on the device and as arrays, sums of the largest tile before and after."""
        ways = 2 * (len(bounces.series) - 1)
        most = max(cost.entries * min(TILE, self.shown[name]) for name, cost in costs.items())
        paths = PATHS >> 2 if bounces.series[1] > 1 else PATHS
        return round(paths * (3 * 16 * ways + 64) + 3 * 16 * most)

    def _cost(self, work: TileTracer, name: str, bounces: Bounces) -> Cost:
        samples = min(bounces.samples, MOST_SAMPLES)
        points = self._some(name, min(MANY, max(FEW, PER_MATERIAL // samples)))
        if not len(points):
            return Cost(0.0, 0.0, 0.0, 0.0)
        half = work(Job(name, points, name, max(1, samples // 2)))
        tiles = work(Job(name, points, name, samples, max(1, samples // 2), half)) if samples > 1 else half
        counts = [(len(tile.array) - tile.points) / 2 for tile in (*half, *tiles)]
        before, after = sum(counts[: len(half)]), sum(counts[len(half) :])
        cells = len(work.tails) * sum(work.bins[name].bands)
        growth = (bounces.samples / samples) ** log2(max(after, 1) / max(before, 1))
        entries = min(after / len(points) * growth, cells)

        # One batch for points that hold as many entries; unpacking and packing come once a pass.
        whole = self._some(name, TIMED)
        held = tuple(_repeated(tile, len(whole)) for tile in tiles)
        batch = max(1, (PATHS >> 2 if bounces.series[1] > 1 else PATHS) // TILE)
        start = time.perf_counter()
        more = work(Job(name, whole, name, samples + batch, samples, held))
        traced = time.perf_counter()
        for tile in more:
            Tile.of([tile.sums(samples)], samples)
        packed = time.perf_counter() - traced
        disk, writing = _written(more)
        passes = 1 + max(0.0, log2(bounces.samples / 16))
        seconds = max(traced - start - packed, 0.0) * bounces.samples / batch + (packed + writing) * passes
        raw = 4 * len(tiles) + 8 * entries
        smaller = disk / max(sum(tile.array.nbytes for tile in more), 1)
        return Cost(entries, raw, raw * smaller, seconds / len(whole))

    def _some(self, name: str, count: int) -> ViewPoints:
        """So many points that show a material, or all."""
        return self._points.where(np.sort(self._at[name][:count]))

    def _work(self, bounces: Bounces) -> TileTracer:
        tails, bins = tails_of(self.editables, bounces), bins_of(self.editables, bounces)
        return TileTracer(self.scene, tails, bins, 0, self._tracer, bounces.diffuse_seen)


def _repeated(tile: Tile, points: int) -> Tile:
    """A tile of more points, which have the entries of these in turn."""
    counts, codes, _ = unpacked(tile.array, tile.points)
    packed = tile.array[tile.points + len(codes) :]
    turn = np.arange(points) % tile.points
    begin = np.concatenate([[0], np.cumsum(counts[:-1], dtype=np.int64)])
    size = counts[turn].astype(np.int64)
    at = np.repeat(begin[turn] - (np.cumsum(size) - size), size) + np.arange(size.sum())
    return Tile(np.concatenate([counts[turn], codes[at], packed[at]]), tile.unit, points)


def _written(tiles: tuple[Tile, ...]) -> tuple[int, float]:
    """Bytes on disk of tiles, and seconds to write them."""
    with tempfile.TemporaryDirectory(prefix="lambent-") as folder, Store.create(Path(folder) / "s", {}) as store:
        start = time.perf_counter()
        for k, tile in enumerate(tiles):
            store.put(f"trial/{k}", "trial", tile.array, key="")
        seconds = time.perf_counter() - start
        return sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()), seconds
