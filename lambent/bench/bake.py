"""`bake`: time and noise of each artefact, and the cost of an interruption.

Every artefact is baked into a store that has its inputs. Light maps are baked alternately with a twin that is stopped
halfway and resumed; for an artefact without a middle, the overhead is the time to find it finished. `noise` is the
relative root mean square before denoising: for light maps the bake's own figure, for probes the difference of two seeds
over the root of 2. One process bakes on all cores; kernels are compiled before timing starts.
"""

from __future__ import annotations

import shutil
import statistics
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lambent.baking.quality import Quality, quality_named
from lambent.core.light.colour import luminance
from lambent.core.progress import Cancelled, Progress, silent
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene
from lambent.store.store import Store

NAME = "bake"
MAIN = "light_map, paths"  # the row that is repeated at other sizes
FACTORS = (0.5, 2.0)  # on the number of texels


@dataclass(frozen=True)
class Effort:
    """The quality of the bakes, and the repetitions of each timing."""

    quality: Quality
    runs: int = 5


FULL = Effort(quality_named("preview"))
QUICK = Effort(
    FULL.quality.changed(
        "bench",
        geometry={"texels": 96},
        light_map={
            "samples": (8, 8),
            "gather_samples": 8,
            "photons_per_texel": 8,
            "tile_texels": 64,  # several tiles, so that a bake can be stopped in the middle
        },
        environment={"texels": 64},
        probe={"texels": 16, "samples": 4},
    )
)


@dataclass(frozen=True)
class Case:
    """One artefact: the kind and methods for `bake`, and the array whose meta and size describe it."""

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


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """One row per artefact of the first input, a scene; without input, of the built-in box."""
    scene, steps, rows = load_scene(str(inputs[0]) if inputs else "builtin:box"), len(CASES) + 1, []
    with tempfile.TemporaryDirectory() as folder:
        for number, case in enumerate(CASES):
            progress(number, steps, case.artefact)
            rows.append(row_of(scene, case, effort, Path(folder) / str(number)))
        progress(steps - 1, steps, "scaling")
        scaled = [_scaled(scene, effort, factor, Path(folder) / f"x{factor}") for factor in FACTORS]
    main = next(row for row in rows if row["artefact"] == MAIN)
    sizes, seconds = ([scaled[0][key], main[key], scaled[1][key]] for key in ("texels", "seconds"))
    growth = float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])
    return {"rows": rows, "summary": {"scene": scene.name, "runs": effort.runs, "growth": growth, "scaled": scaled}}


def row_of(scene: Scene, case: Case, effort: Effort, folder: Path) -> dict[str, Any]:
    """Time, noise and overhead of one artefact, baked in `folder`."""
    quality = effort.quality if case.gathers else effort.quality.changed(light_map={"gather_samples": 0})
    bakes = Bakes(scene, case, quality, folder)
    bakes.timed("whole")  # compiles the kernels
    whole, overhead = [], []
    for _ in range(effort.runs):
        seconds, store = bakes.timed("whole")
        whole.append(seconds)
        overhead.append(bakes.interrupted_s() - seconds if case.kind == "light_map" else bakes.again_s("whole"))
    seconds = statistics.median(whole)
    texels, maps = _size(store, case)
    return {
        "artefact": case.artefact,
        "seconds": seconds,
        "seconds_min": min(whole),
        "seconds_max": max(whole),
        "noise": bakes.noise(store),
        "texels": texels,
        "texels_per_s": texels / seconds,
        "maps_per_s": maps / seconds if case.kind in ("probe", "environment") else None,
        "workers": 1,
        "resume_overhead_s": statistics.median(overhead),
    }


@dataclass(frozen=True)
class Bakes:
    """Bakes of one artefact into stores below `folder`, each with all inputs of the artefact."""

    scene: Scene
    case: Case
    quality: Quality
    folder: Path

    def __post_init__(self) -> None:
        from lambent.baking.bake import found

        if needs := found()[self.case.kind].NEEDS:
            self._bake("ready", only=needs)

    def _bake(self, name: str, only: Sequence[str] = (), progress: Progress = silent, seed: int = 0) -> Store:
        from lambent.baking.bake import bake

        return bake(
            self.scene, self.folder / name, quality=self.quality, only=only or (self.case.kind,), progress=progress,
            seed=seed, light_map=self.case.light_map, probes=self.case.probes,
        )  # fmt: skip

    def _begin(self, name: str) -> None:
        ready, folder = self.folder / "ready", self.folder / name
        shutil.rmtree(folder, ignore_errors=True)
        if ready.exists():
            shutil.copytree(ready, folder)

    def timed(self, name: str, seed: int = 0) -> tuple[float, Store]:
        """Seconds of a complete bake, and its store."""
        self._begin(name)
        began = time.perf_counter()
        store = self._bake(name, seed=seed)
        return time.perf_counter() - began, store

    def again_s(self, name: str) -> float:
        """Seconds to find a bake finished."""
        began = time.perf_counter()
        self._bake(name)
        return time.perf_counter() - began

    def interrupted_s(self) -> float:
        """Seconds of a bake that is stopped after half a step, plus its resumption."""
        self._begin("broken")

        def stop(done: float, total: float, what: str) -> None:
            if 0.5 <= done / total < 1:
                raise Cancelled

        began = time.perf_counter()
        with suppress(Cancelled):
            self._bake("broken", progress=stop)
        self._bake("broken")
        return time.perf_counter() - began

    def noise(self, store: Store) -> float | None:
        """Relative noise of the artefact in `store`; None if it has none."""
        arrays = _arrays(store, self.case)
        if self.case.kind == "light_map":
            return float(store.artefact(arrays[0]).meta["noise"])
        if self.case.kind != "probe" or not arrays:
            return None
        both = store, self.timed("other", seed=1)[1]
        one, two = (np.concatenate([luminance(s.read(name).astype(float)).ravel() for name in arrays]) for s in both)
        mean = (one + two).mean() / 2
        return float(np.sqrt(((one - two) ** 2).mean() / 2) / mean) if mean > 0 else 0.0


def _arrays(store: Store, case: Case) -> list[str]:
    if case.kind != "probe":
        return [case.array]
    return [a.name for a in store.artefacts("probe") if a.name.endswith("/radiance")]


def _size(store: Store, case: Case) -> tuple[int, int]:
    """Number of texels, and number of maps: a cube counts as one."""
    if case.kind == "geometry":
        width, height = store.artefact(case.array).meta["light_map_size"]
        return width * height, 1
    shapes = [store.artefact(name).shape for name in _arrays(store, case)]
    return sum(int(np.prod(shape[:-1])) for shape in shapes), len(shapes)


def _scaled(scene: Scene, effort: Effort, factor: float, folder: Path) -> dict[str, Any]:
    """Seconds of the main row with `factor` times its texels."""
    from lambent.baking.artefacts import geometry

    case = next(case for case in CASES if case.artefact == MAIN)
    texels = round(effort.quality.settings("geometry", geometry.SETTINGS).texels * factor**0.5)
    quality = effort.quality.changed(geometry={"texels": texels}, light_map={"gather_samples": 0})
    bakes = Bakes(scene, case, quality, folder)
    runs = [bakes.timed("whole") for _ in range(effort.runs)]
    return {"texels": _size(runs[0][1], case)[0], "seconds": statistics.median(seconds for seconds, _ in runs)}
