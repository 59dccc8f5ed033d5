"""`bake`: what each artefact costs, how noisy it is, and what an interruption costs on top.

Every artefact is baked into a store that holds what it needs; light maps in turns with an interrupted twin, stopped in
the middle and resumed. Of what has no middle the overhead is what finding it finished takes. `noise` is before
denoising, relative, root mean square: of light maps what the bake itself notes, of probes what two seeds differ by,
over the root of 2. One process bakes with all cores; kernels are compiled before anything counts.
"""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.colour import luminance
from lambent.core.progress import Cancelled, Progress, silent
from lambent.scenes import load_scene
from lambent.scenes.scene import Scene
from lambent.store.store import Store

NAME = "bake"
RUNS = 5
MAIN = "light_map, paths"  # the row that is scaled
FACTORS = (0.5, 2.0)  # of the texels


@dataclass(frozen=True)
class Case:
    """One artefact: what `bake` is asked for, which array's meta and size tell of it, and how it is made."""

    artefact: str
    kind: str
    array: str
    gathers: bool = False
    light_map: str = "paths"
    probes: str = "cached"


CASES = (
    Case("geometry", "geometry", "geometry/uv2"),
    Case("environment", "environment", "environment/radiance"),
    Case(MAIN, "light_map", "light_map/irradiance"),
    Case("light_map, paths and gathering", "light_map", "light_map/irradiance", gathers=True),
    Case("light_map, photons", "light_map", "light_map/irradiance", light_map="photons"),
    Case("probes, cached", "probe", "probe"),
    Case("probes, traced", "probe", "probe", probes="traced"),
)


def run(quick: bool, inputs: Sequence[Path], progress: Progress) -> dict[str, Any]:
    """Rows per artefact of the first input, a scene; without one, of the built-in box."""
    scene = load_scene(str(inputs[0]) if inputs else "builtin:box")
    quality = _quality(quick)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for number, case in enumerate(CASES):
            progress(number, len(CASES) + 1, case.artefact)
            rows.append(_row(scene, case, quality, Path(folder) / str(number)))
        progress(len(CASES), len(CASES) + 1, "scaling")
        scaled = [_scaled(scene, quality, factor, Path(folder) / f"x{factor}") for factor in FACTORS]
    main = next(row for row in rows if row["artefact"] == MAIN)
    sizes = [scaled[0]["texels"], main["texels"], scaled[1]["texels"]]
    seconds = [scaled[0]["seconds"], main["seconds"], scaled[1]["seconds"]]
    growth = float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
    return {"rows": rows, "summary": {"scene": scene.name, "runs": RUNS, "growth": growth, "scaled": scaled}}


def _quality(quick: bool) -> Any:
    from lambent.bake.quality import quality_named

    if not quick:
        return quality_named("preview")
    return replace(
        quality_named("preview"),
        name="bench",
        light_map_texels=96,
        tile_texels=64,  # several tiles, so that there is a middle to stop in
        light_map_samples=(8, 8),
        gather_samples=8,
        photons_per_texel=8,
        environment_texels=64,
        probe_texels=16,
        probe_samples=4,
    )


def _row(scene: Scene, case: Case, quality: Any, folder: Path) -> dict[str, Any]:
    quality = quality if case.gathers else replace(quality, gather_samples=0)
    ready = _ready(scene, case, quality, folder / "ready")
    whole, overhead = [], []
    for turn in range(RUNS + 1):
        one, store = _timed(scene, case, quality, ready, folder / "whole")
        if turn:  # the first compiled the kernels
            whole.append(one)
            overhead.append(_overhead(scene, case, quality, ready, folder, one))
    seconds = statistics.median(whole)
    texels, maps = _size(store, case)
    return {
        "artefact": case.artefact,
        "seconds": seconds,
        "seconds_min": min(whole),
        "seconds_max": max(whole),
        "noise": _noise(scene, case, quality, ready, store, folder / "other"),
        "texels": texels,
        "texels_per_s": texels / seconds,
        "maps_per_s": maps / seconds if case.kind in ("probe", "environment") else None,
        "workers": 1,
        "resume_overhead_s": statistics.median(overhead),
    }


def _ready(scene: Scene, case: Case, quality: Any, folder: Path) -> Path:
    """A store that holds all that the artefact needs."""
    from lambent.bake.bake import NEEDS, bake

    if NEEDS[case.kind]:
        bake(scene, folder, quality=quality, only=NEEDS[case.kind], light_map=case.light_map, probes=case.probes)
    return folder


def _timed(scene: Scene, case: Case, quality: Any, ready: Path, folder: Path, seed: int = 0) -> tuple[float, Store]:
    _copied(ready, folder)
    began = time.perf_counter()
    store = _bake(scene, case, quality, folder, silent, seed)
    return time.perf_counter() - began, store


def _overhead(scene: Scene, case: Case, quality: Any, ready: Path, folder: Path, whole_s: float) -> float:
    if case.kind == "light_map":
        return _interrupted(scene, case, quality, ready, folder / "broken") - whole_s
    began = time.perf_counter()
    _bake(scene, case, quality, folder / "whole", silent, 0)
    return time.perf_counter() - began


def _interrupted(scene: Scene, case: Case, quality: Any, ready: Path, folder: Path) -> float:
    """Seconds of a bake that is stopped when half of a step is done, and of its resumption."""
    _copied(ready, folder)

    def stop(done: float, total: float, what: str) -> None:
        if 0.5 <= done / total < 1:
            raise Cancelled

    began = time.perf_counter()
    try:
        _bake(scene, case, quality, folder, stop, 0)
    except Cancelled:
        _bake(scene, case, quality, folder, silent, 0)
    return time.perf_counter() - began


def _bake(scene: Scene, case: Case, quality: Any, folder: Path, progress: Progress, seed: int) -> Store:
    from lambent.bake.bake import bake

    return bake(
        scene, folder, quality=quality, only=(case.kind,), progress=progress, seed=seed,
        light_map=case.light_map, probes=case.probes,
    )  # fmt: skip


def _copied(ready: Path, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    if ready.exists():
        shutil.copytree(ready, folder)


def _arrays(store: Store, case: Case) -> list[str]:
    if case.kind != "probe":
        return [case.array]
    return [a.name for a in store.artefacts("probe") if a.name.endswith("/radiance")]


def _size(store: Store, case: Case) -> tuple[int, int]:
    """Texels, and maps: a cube counts as one."""
    if case.kind == "geometry":
        width, height = store.artefact(case.array).meta["light_map_size"]
        return width * height, 1
    shapes = [store.artefact(name).shape for name in _arrays(store, case)]
    return sum(int(np.prod(shape[:-1])) for shape in shapes), len(shapes)


def _noise(scene: Scene, case: Case, quality: Any, ready: Path, store: Store, folder: Path) -> float | None:
    if case.kind == "light_map":
        return float(store.artefact(case.array).meta["noise"])
    if case.kind != "probe" or not _arrays(store, case):
        return None
    other = _timed(scene, case, quality, ready, folder, seed=1)[1]
    pairs = [[luminance(s.read(name).astype(float)).ravel() for s in (store, other)] for name in _arrays(store, case)]
    one, two = (np.concatenate(values) for values in zip(*pairs, strict=True))
    mean = (one + two).mean() / 2
    return float(np.sqrt(((one - two) ** 2).mean() / 2) / mean) if mean > 0 else 0.0


def _scaled(scene: Scene, quality: Any, factor: float, folder: Path) -> dict[str, Any]:
    """Seconds of the main row at `factor` times its texels."""
    case = next(case for case in CASES if case.artefact == MAIN)
    texels = round(quality.light_map_texels * factor**0.5)
    quality = replace(quality, gather_samples=0, light_map_texels=texels)
    ready = _ready(scene, case, quality, folder / "ready")
    runs = [_timed(scene, case, quality, ready, folder / "whole") for _ in range(RUNS)]
    return {"texels": _size(runs[0][1], case)[0], "seconds": statistics.median(seconds for seconds, _ in runs)}
