"""`accumulate`: the window's picture at rest, by error and time.

Rows are scene x time: the denoised picture that the window has after so many seconds, from the first ray to the
denoised picture, as processor time over all cores; a device with memory of its own counts seconds. Kernels are compiled
and the scene is loaded before. `ended` samples take the light of the first diffuse surface from the light map,
`gathered` ones that of the next (`traced.picture`).

The truth is path traced in four independent pictures, or given by finished ones of the first camera (`--reference`),
which set the size of the rows. `reference_flip` is the FLIP between its halves. `bar` is the FLIP of the first two
pictures, each with a quarter of the truth's samples, and `bar_worst_tile` its worst tile: what path tracing without a
denoiser differs by from itself.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lambent.bench.measuring.reference import Truth, compile_kernels, finished, path_traced_parts
from lambent.bench.scenes.views import first_camera, inputs_or_baked
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.store.contract import scene_record
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.traced.picture import ENDED, TracedPicture
from lambent.traced.room import room_of_paths, room_of_store

NAME = "accumulate"


@dataclass(frozen=True)
class Effort:
    """Pixels, samples of the truth, seconds of processor time of the pictures; the scene if no store is given."""

    width: int = 960
    height: int = 540
    truth_spp: int = 2048
    seconds: tuple[float, ...] = (2.0, 5.0, 10.0, 20.0)
    scene: str = "builtin:room"


FULL, QUICK = Effort(), Effort(240, 135, 128, (0.5, 1.0, 2.0), "builtin:box")


def run(
    effort: Effort, inputs: Sequence[Path] = (), reference: Sequence[Path] = (), progress: Progress = silent
) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`.

    `reference`: at least two finished pictures of the only input's first camera, of equal samples, different seeds.
    """
    pictures = finished(reference, inputs)
    if len(pictures) == 1:
        raise UserError("a single reference has no noise", field="--reference", expected="at least two, of other seeds")
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        rows = [row for store in stores for row in rows_of(store, effort, progress, pictures)]
    last = {row["scene"]: row for row in rows}
    summary = {name: {key: row[key] for key in ("flip", "bar", "flip_worst_tile")} for name, row in last.items()}
    return {"rows": rows, "summary": summary}


def rows_of(
    store: Store, effort: Effort, progress: Progress = silent, pictures: Sequence[Floats] = ()
) -> Iterator[dict[str, Any]]:
    """Rows of a store's first camera; `pictures` (H, W, 3) are finished references of it."""
    if pictures:
        effort = replace(effort, width=pictures[0].shape[1], height=pictures[0].shape[0])
    camera, size = first_camera(store, scene_record(store)), (effort.width, effort.height)
    scene = scene_of(store)
    parts = pictures or path_traced_parts(room_of_paths(scene).tracer, camera, size, effort.truth_spp, 4, progress)
    truth = Truth.of(parts)
    apart = replace(truth, encoded=truth.shown(parts[0])).errors(parts[1])
    bar = {"bar": apart["flip"], "bar_worst_tile": apart["flip_worst_tile"]}
    tracer = room_of_store(store, scene).tracer
    compile_kernels(tracer, camera, path=False)
    picture, begun = TracedPicture(tracer, camera, size), time.process_time()
    picture.guides()
    tracing = time.process_time() - begun
    denoising = 0.0
    for seconds in effort.seconds:
        while not picture.samples or tracing + denoising < seconds:
            begun = time.process_time()
            picture.sample()
            tracing += time.process_time() - begun
        begun = time.process_time()
        image = picture.denoised()
        denoising = time.process_time() - begun
        ended = min(picture.samples, ENDED)
        yield {
            "scene": store.folder.name, "seconds": round(tracing + denoising, 2), "denoising_s": round(denoising, 2),
            "ended": ended, "gathered": picture.samples - ended, **truth.errors(image), **bar,
        }  # fmt: skip
        progress(seconds, effort.seconds[-1], f"{store.folder.name} at rest")
