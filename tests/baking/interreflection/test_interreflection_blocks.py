"""Points of a tile are traced and added up some at a time: the same light, in bounded memory, by the same kernels."""

from __future__ import annotations

import gc
from typing import Any

import drjit as dr
import numpy as np
import pytest

from lambent.baking.interreflection import paths, tiles
from lambent.baking.interreflection.series import bins_of, tails_of
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.interreflection.sums import Sorted, Sums, _add, compile_sums
from lambent.baking.interreflection.tiles import Job, Tile, TileTracer
from lambent.baking.transport.view import View
from lambent.baking.transport.view_points import ViewPoints
from lambent.baking.transport.view_tracer import ViewTracer
from lambent.materials.document import Lobe, Material
from lambent.scenes.scene import Scene
from tests.baking.interreflection.test_interreflection import FIRST, FROM_ABOVE, INSIDE, corner, furnace, of_scene

GLOSSY = Material(kd=0.3, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5),))


def traced_by(scene: Scene, series: tuple[int, ...], view: View) -> tuple[TileTracer, ViewPoints]:
    editables, bounces, tracer = of_scene(scene), Bounces(series), ViewTracer(scene)
    work = TileTracer(scene, tails_of(editables, bounces), bins_of(editables, bounces), 0, tracer)
    return work, tracer.points(view)


def random_samples(points: int, samples: int, terms: int, rng: np.random.Generator) -> Sorted:
    """Of 3 bands at the first surface, 2 x 5 tails of two lengths, and, where they count, 2 bands at the second."""

    def rows(*shape: int, numbers: int) -> np.ndarray:
        found = rng.random((*shape, 4), np.float32)
        found.view(np.uint32)[..., 3] = rng.integers(0, numbers, shape, np.uint32)
        return found

    n = points * samples
    light = rows(4, n, numbers=5)
    light.view(np.uint32)[2:, :, 3] += 10 if terms else 5
    arrived = rng.integers(0, 16, n, np.uint32)
    return Sorted(rows(n, numbers=3), light, arrived, rows(terms, 2, n, numbers=2), np.full(4, 5, np.int64))


def by_hand(samples: Sorted, points: int, bands: int, tails: int) -> np.ndarray:
    """(points, codes, 3) sums."""
    total = np.zeros((points, bands * tails, 3))
    bits = [array.view(np.uint32)[..., 3] for array in (samples.first, samples.light, samples.second)]
    for i in range(len(samples.first)):
        for e in np.flatnonzero(samples.arrived[i] >> np.arange(4) & 1):
            light = samples.first[i, :3].astype(float) * samples.light[e, i, :3]
            for second, band in (
                zip(samples.second[:, min(e, 1), i], bits[2][:, min(e, 1), i], strict=True)
                if len(samples.second)
                else [(np.ones(4), 0)]
            ):
                code = (bits[1][e, i] + band * 5) * bands + bits[0][i]
                total[i * points // len(samples.first), code] += light * second[:3]
    return total


@pytest.mark.parametrize("terms", [0, 2])
def test_sums_are_those_of_loops(terms: int) -> None:
    rng, points, tails = np.random.default_rng(terms), 6, 20 if terms else 10
    first, then = (random_samples(points, samples, terms, rng) for samples in (7, 40))
    sums = Sums.none(points).and_of(first, 3, tails).and_of(then, 3, tails)
    dense = np.zeros((points, 3 * tails, 3))
    dense[np.repeat(np.arange(points), np.diff(sums.ends)), sums.codes] = sums.light
    assert np.allclose(dense, by_hand(first, points, 3, tails) + by_hand(then, points, 3, tails), rtol=1e-5)
    assert all((np.diff(sums.codes[a:b].astype(int)) > 0).all() for a, b in zip(sums.ends, sums.ends[1:], strict=False))
    tile = Tile.of([sums], 47)
    parts = [tile.sums(47, some) for some in (slice(0, 1), slice(1, 4), slice(4, 6))]
    assert np.allclose(np.concatenate([part.light for part in parts]), sums.light, rtol=0, atol=sums.light.max() / 256)
    again = Tile.of(parts, 47)
    assert again.unit == tile.unit and np.array_equal(again.array, tile.array)


@pytest.mark.long
def test_many_samples_are_traced_for_few_points_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A furnace's light is known whatever the blocks; no block has more paths than may be in memory."""
    widths: list[tuple[int, int]] = []
    trace = paths.trace

    def watched(surfaces: Any, points: Any, sides: Any, tails: Any, samples: int, seed: int) -> Any:
        widths.append((len(points), samples))
        return trace(surfaces, points, sides, tails, samples, seed)

    monkeypatch.setattr(paths, "trace", watched)
    monkeypatch.setattr(tiles, "PATHS", 1 << 12)
    scene = furnace(0.5)
    work, points = traced_by(scene, (4, 1, 1), View(INSIDE, 7, 7))
    (few,) = work(Job("grey", points, "some", 16))
    (many,) = work(Job("grey", points, "some", 1000, 16, (few,)))
    assert widths[0] == (49, 16)
    assert [samples for _, samples in widths[1:]] == [984] * 13
    assert sum(count for count, _ in widths[1:]) == 49
    assert all(count * samples <= 1 << 12 for count, samples in widths[1:])
    (huge,) = work(Job("grey", points.where(slice(0, 2)), "other", 5000))
    assert widths[-2:] == [(1, 5000)] * 2
    for tile in (many, huge):
        sums = tile.sums(1)
        surfaces = work.tails.hits[sums.codes // 4]
        for hits in (2, 3):  # light of 1 from everywhere, times a cosine
            assert sums.light[surfaces == hits].sum() / 3 / tile.points == pytest.approx(np.pi, rel=0.03)


@pytest.mark.long
def test_kernels_do_not_depend_on_the_number_of_paths() -> None:
    gc.collect()  # kernels hold the BSDFs of all scenes that are left, which would go in between
    scene = corner({**FIRST, "floor": GLOSSY, "ball": GLOSSY})
    work, points = traced_by(scene, (16, 8), View(FROM_ABOVE, 12, 12))
    mine = points.where(np.array([o.material == "floor" for o in scene.objects])[points.object])
    work(Job("floor", mine, "first", 8))
    compiled = []
    for few, many in ((24, 101), (40, 77)):  # scenes that other tests left may be freed in between, and change one
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            work(Job("floor", mine, f"{few}", few))
            work(Job("floor", mine.where(slice(0, 9)), f"{few}", many))
            history = dr.kernel_history((dr.KernelType.JIT,))
        assert len(history) > 4
        compiled.append([kernel["size"] for kernel in history if not kernel["cache_hit"]])
    assert [] in compiled, compiled


@pytest.mark.parametrize("terms", [0, 1])
def test_sums_are_compiled_for_the_arrays_of_paths(terms: int) -> None:
    """Beside the first tile's paths; not once more when they are there."""
    compile_sums(by_second=terms > 0)
    before = list(_add.signatures)
    Sums.none(3).and_of(random_samples(3, 4, terms, np.random.default_rng(0)), 3, 20 if terms else 10)
    assert _add.signatures == before
