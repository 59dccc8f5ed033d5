"""Rows of traced pictures: whole paths, and the picture of the window at rest."""

from __future__ import annotations

import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from lambent.bench.card_rows.baking import baked
from lambent.bench.card_rows.effort import Effort
from lambent.bench.card_rows.row import CUDA, PROCESSOR, Figure, Published, Row, cuda_name, engine_name
from lambent.bench.measuring.reference import compile_kernels, path_traced
from lambent.scenes.loaders.load import load_scene
from lambent.store.source import scene_of
from lambent.traced.picture import TracedPicture
from lambent.traced.room import room_of_paths, room_of_store


def paths(effort: Effort, work: Path, variant: str) -> Iterator[Figure]:
    """Whole paths of a scene's first camera, and those paths denoised."""
    if variant == CUDA:
        cuda_name()
    device, scene, (width, height) = engine_name(), load_scene(effort.scene), effort.sizes[0]
    tracer, camera = room_of_paths(scene).tracer, scene.cameras[0]
    compile_kernels(tracer, camera, path=True)
    began = time.perf_counter()
    picture = path_traced(tracer, camera, (width, height), effort.path_samples, seed=1)
    picture.mean()
    seconds = time.perf_counter() - began
    yield Figure("paths", width * height * effort.path_samples / seconds / 1e6, "million/s", device)
    began = time.perf_counter()
    picture.denoised()
    yield Figure(f"denoising {width}x{height}", time.perf_counter() - began, "s", device)


def at_rest(effort: Effort, work: Path) -> Iterator[Figure]:
    """The first picture, denoised, and the samples of each pixel after some seconds."""
    store = baked(effort, work)
    scene, device = scene_of(store), engine_name()
    tracer, camera = room_of_store(store, scene).tracer, scene.cameras[0]
    compile_kernels(tracer, camera, path=False)
    for size in effort.rest_sizes:
        began, words = time.perf_counter(), "x".join(map(str, size))
        picture = TracedPicture(tracer, camera, size)
        picture.sample()
        picture.denoised(fast=True)
        yield Figure(f"{words}, first picture", time.perf_counter() - began, "s", device)
        while time.perf_counter() - began < effort.rest_s:
            picture.sample()
        rate = picture.samples / (time.perf_counter() - began)
        yield Figure(f"{words}, samples of a pixel", rate, "1/s", device)


# The first picture of the built-in room, whole (docs/performance.md).
FIRST = {"960x540, first picture": Published("1.45 to 1.84", "two cores of an EPYC")}
ROWS = {
    "path tracing, CUDA": Row(partial(paths, variant=CUDA), 40, 5, variant=CUDA),
    "picture at rest": Row(at_rest, 40, 6, FIRST),
    "path tracing, processor": Row(partial(paths, variant=PROCESSOR), 30, 11, variant=PROCESSOR),
}
