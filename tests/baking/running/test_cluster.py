"""Tiles on other processes: the same arrays, whoever dies."""

from __future__ import annotations

import itertools
import os
import pickle
import signal
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lambent.baking.artefacts.interreflection import stages
from lambent.baking.bake import bake
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.running.cluster import DaskWorkers, opened
from lambent.baking.running.workers import Workers
from lambent.baking.transport.view import View
from lambent.core.errors import UserError
from lambent.core.pictures.images import read_image
from lambent.core.progress import Progress, silent
from lambent.materials.document import Lobe, Material
from lambent.store.store import Store
from tests.baking.interreflection.test_interreflection import FIRST, FROM_ABOVE, corner
from tests.baking.running.lit_room import bake_lit, lit_room

BOUNCES = Bounces((16, 1, 1), samples=64, fixed=frozenset({"side"}))
VIEW = View(FROM_ABOVE, 16, 16)
GLOSSY = Material(kd=0.3, lobes=(Lobe(mx=0.3, my=0.3, r0=0.5),))
SCENE = corner({**FIRST, "floor": GLOSSY})
TILES = 5  # of a pass: two terms of the floor are one job


def baked(folder: Path, workers: Workers | None = None, progress: Progress = silent) -> Store:
    return bake(
        SCENE, folder, only={"interreflection"}, views=[VIEW], bounces=BOUNCES, workers=workers, progress=progress
    )


def assert_same(ours: Store, theirs: Store) -> None:
    names = {a.name for a in theirs.artefacts()}
    assert {a.name for a in ours.artefacts()} == names
    for name in names:
        assert ours.artefact(name).meta == theirs.artefact(name).meta
        assert np.array_equal(ours.read(name), theirs.read(name)), name


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> Store:
    return baked(tmp_path_factory.mktemp("alone") / "s")


@pytest.fixture(scope="module")
def two() -> Iterator[DaskWorkers]:
    pytest.importorskip("distributed", reason="Dask is not installed")
    with opened(2) as workers:
        yield workers


def pids(workers: DaskWorkers) -> set[int]:
    return set(workers.client.run(os.getpid).values())


def kill_one_of(found: set[int]) -> None:
    os.kill(min(found), signal.SIGKILL)


class Elsewhere:
    """All that is done went through bytes, as to another process, and in another order."""

    apart = True

    def each(self, work: Any, jobs: Any) -> Any:
        there = pickle.loads(pickle.dumps(work))
        return [(job, there(pickle.loads(pickle.dumps(job)))) for job in reversed(list(jobs))]


def test_tiles_depend_on_their_jobs_alone(alone: Store, tmp_path: Path) -> None:
    assert_same(baked(tmp_path / "s", Elsewhere()), alone)


@pytest.mark.long
@pytest.mark.parametrize("options", [{}, {"light_groups": "scene"}, {"probes": "traced"}], ids=str)
def test_light_maps_and_probes_depend_on_their_jobs_alone(tmp_path: Path, options: dict[str, Any]) -> None:
    scene = lit_room(tmp_path)
    assert_same(bake_lit(scene, tmp_path / "s", Elsewhere(), **options), bake_lit(scene, tmp_path / "alone", **options))


def test_jobs_of_other_processes_go_through_several_passes() -> None:
    assert stages(3000, together=True) == [[16], [32, 64, 128, 256, 512, 1024], [2048], [3000]]
    assert stages(64, together=False) == [[16], [32], [64]]
    assert stages(5, together=True) == [[5]] and stages(20, together=True) == [[16], [20]]


@pytest.mark.long
def test_what_is_interrupted_keeps_its_tiles(alone: Store, tmp_path: Path) -> None:
    def stop(done: float, total: float, what: str) -> None:
        if "32 samples" in what and done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        baked(tmp_path / "s", progress=stop)
    kept = [a.meta["samples"] for a in Store.open(tmp_path / "s").artefacts("interreflection") if "samples" in a.meta]
    assert sorted(set(kept)) == [16, 32]
    assert_same(baked(tmp_path / "s"), alone)


@pytest.mark.long
def test_terms_of_different_samples_begin_anew(alone: Store, tmp_path: Path) -> None:
    """A bake that died between the terms of a tile does not count samples twice."""
    store = baked(tmp_path / "s")
    name = next(a.name for a in store.artefacts("interreflection") if "/floor/1/0" in a.name)
    whole = store.artefact(name)
    with Store.create(tmp_path / "s", store.inputs) as again:
        writer = again.begin(name, "interreflection", whole.shape, whole.shape, "uint32", key=whole.key)
        writer.write((0,), store.read(name) * 0)
        writer.finish(**{**whole.meta, "samples": 32})
        again.forget([VIEW.name("interreflection", "samples")])
    after = baked(tmp_path / "s")
    counts, before = after.read(name)[: whole.meta["points"]], alone.read(name)[: whole.meta["points"]]
    assert np.array_equal(counts, before)  # the same paths, added up in one go


@pytest.mark.long
def test_a_worker_that_is_killed_is_survived(alone: Store, two: DaskWorkers, tmp_path: Path) -> None:
    calls = iter(range(1000))

    def progress(done: float, total: float, what: str) -> None:
        if next(calls) in (3, 9):
            kill_one_of(pids(two))

    assert_same(baked(tmp_path / "s", two, progress), alone)


@pytest.mark.long
def test_a_bake_that_is_interrupted_leaves_workers_that_go_on(alone: Store, two: DaskWorkers, tmp_path: Path) -> None:
    def stop(done: float, total: float, what: str) -> None:
        if "64 samples" in what and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        baked(tmp_path / "s", two, stop)
    assert_same(baked(tmp_path / "s", two), alone)


def product_of_denormals(size: int) -> np.ndarray:
    from lambent.baking.engine import engine

    engine()
    import drjit as dr
    import mitsuba as mi

    return np.array(dr.opaque(mi.Float, 1e-38, size) * dr.opaque(mi.Float, 0.1))


def test_workers_of_few_threads_round_like_this_process(two: DaskWorkers) -> None:
    """Of more than a block of Dr.Jit's: a smaller one may run in the thread that asks, which keeps denormal numbers."""
    for size, found in two.each(product_of_denormals, [1 << 16, 1 << 18]):
        assert np.array_equal(found, product_of_denormals(size)), size


def test_a_cluster_that_runs_already(two: DaskWorkers) -> None:
    with opened(two.client.scheduler.address) as workers:
        assert dict(workers.each(abs, [-1, 2, -3])) == {-1: 1, 2: 2, -3: 3}
    assert dict(two.each(abs, [-4])) == {-4: 4}


class _Slow:
    """A worker's plugin: each job takes some times as long, most with one worker. It changes only that process."""

    def __init__(self, factor: float, slowest: float) -> None:
        self.factor, self.slowest = factor, slowest

    def setup(self, worker: Any) -> None:
        from lambent.baking.running import cluster

        loaded, factor = cluster._loaded, self.slowest if worker.name == 0 else self.factor

        def slow(work: bytes) -> Any:
            def done(job: Any) -> Any:
                began = time.process_time()
                found = loaded(work)(job)
                time.sleep((factor - 1) * (time.process_time() - began))
                return found

            return done

        cluster._loaded = slow


@pytest.mark.long
def test_a_cluster_of_slow_and_dying_workers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight workers of a quarter of the speed, one of a sixteenth; two are killed, one of them with the last tiles."""
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    monkeypatch.setattr("lambent.baking.artefacts.interreflection.POINTS", 16)  # dozens of tiles
    slow = type("Slow", (_Slow, distributed.WorkerPlugin), {})(4.0, 16.0)
    with opened(8) as workers:
        workers.client.wait_for_workers(8)
        workers.client.register_plugin(slow)

        def dying(kills: tuple[int, int], work: Callable[..., Store], folder: Path) -> Store:
            before, calls = pids(workers), itertools.count()

            def progress(done: float, total: float, what: str) -> None:
                if next(calls) in kills:
                    kill_one_of(before & pids(workers))  # new ones may have smaller numbers

            found = work(folder, workers, progress)
            assert next(calls) > max(kills), "both were killed during the bake"
            workers.client.wait_for_workers(8)
            assert len(before - pids(workers)) == 2
            return found

        tiles = dying((5, 32), baked, tmp_path / "tiles")
        light = dying((20, 68), partial(bake_lit, lit_room(tmp_path)), tmp_path / "light")  # traced, gathered
    assert_same(tiles, baked(tmp_path / "alone"))
    assert_same(light, bake_lit(lit_room(tmp_path), tmp_path / "light alone"))


@pytest.mark.long
def test_a_job_that_kills_its_workers_is_given_up() -> None:
    dask = pytest.importorskip("dask", reason="Dask is not installed")
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}), opened(1) as workers,
        pytest.raises(UserError, match="several workers died"),
    ):  # fmt: skip
        list(workers.each(os._exit, [3]))


def test_a_worker_with_other_libraries_is_refused(two: DaskWorkers, monkeypatch: pytest.MonkeyPatch) -> None:
    from lambent.baking.running import cluster

    ours = cluster.made_with()
    monkeypatch.setattr(cluster, "made_with", lambda: {**ours, "mitsuba": "2.0"})
    with pytest.raises(UserError, match=r"different mitsuba.*3"):
        list(two.each(abs, [1]))


@pytest.mark.parametrize("name", ["lambent", "mitsuba"])
def test_a_cluster_with_other_libraries_is_refused(
    two: DaskWorkers, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    from lambent.baking.running import cluster

    ours = cluster.version
    monkeypatch.setattr(cluster, "version", lambda one: "2.0" if one == name else ours(one))
    with pytest.raises(UserError, match=rf"--on: .* has a different {name}; found {ours(name)}; expected 2\.0"):
        opened(two.client.scheduler.address).__enter__()


def test_a_file_that_a_worker_lacks_is_named(two: DaskWorkers) -> None:
    with pytest.raises(UserError, match=r"sky\.exr: on a worker: cannot be read.*same path on every machine"):
        list(two.each(read_image, [Path("absent") / "sky.exr"]))


def test_workers_that_there_are_none_of(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed", reason="Dask is not installed")
    with pytest.raises(UserError, match="--on: no workers; found 0; expected at least 1"), opened(0):
        pass
    monkeypatch.setattr("lambent.baking.running.cluster.SECONDS", 1.0)
    for nowhere in ("tcp://127.0.0.1:1", "nonsense", "smoke://a:1"):
        with pytest.raises(UserError, match=f"--on: no scheduler answered; found {nowhere}; expected a number"):
            opened(nowhere).__enter__()


def test_a_scheduler_without_workers(monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed", reason="Dask is not installed")
    monkeypatch.setattr("lambent.baking.running.cluster.SECONDS", 1.0)
    with (
        distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as empty,
        pytest.raises(UserError, match=r"the scheduler has no workers; found tcp:.*; start some with `dask worker tcp"),
    ):
        opened(empty.scheduler_address).__enter__()


def test_without_dask(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UserError, match=r"pip install 'lambent\[cluster\]'"), opened(2):
        pass
