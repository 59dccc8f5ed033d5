"""The whole flow on the built-in room: measure, fit, place, bake, walk, compare.

Each step writes what it made under one folder and hands the next only that, as the commands do:

    measured/NAME.txt      gonio tables of four specimens
    materials/NAME.json    the fitted materials, each with its plots NAME_*.png
    store/                 the baked room
    walk_1.png ... _8.png  stills of the walk, walk.mp4 the film
    compare/               one view in real time, converged and path traced, with their differences
    demo.json              every time and every error
"""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lambent.bake.quality import Quality, quality_named
from lambent.core.files import write_text
from lambent.core.plain import plain
from lambent.core.progress import Progress
from lambent.materials.document import Material
from lambent.scenes.scene import Scene

SCENE = "builtin:room"
SPECIMEN_OF = {  # material of the room -> specimen that is measured for it
    "copper": "rough copper",
    "brushed_aluminium": "brushed aluminium",
    "varnished_wood": "varnished wood",
    "frosted_glass": "frosted glass",
}
STILLS = 8


@dataclass(frozen=True)
class Effort:
    """Sizes of one kind of demo: pictures in pixels, film in seconds, samples per pixel of the compared view.

    `tuples` is how many of a table's tuples are fitted, all where None; `still_frames` how many frames make a still,
    `moving_frames` how many the view in motion, so that its edges can be compared.
    """

    quality: Quality
    tuples: int | None
    still: tuple[int, int]
    still_frames: int
    film: tuple[int, int]
    film_seconds: float
    film_fps: int
    compared: tuple[int, int]
    path_spp: int
    qmc_spp: int
    moving_frames: int = 16


DRAFT = Quality("draft", 192, (16, 16), 0.5, 6, 128, 64, 8, gather_samples=64)
FULL = Effort(quality_named("preview"), None, (1680, 1050), 2, (720, 450), 5.0, 20, (840, 525), 48, 256)
QUICK = Effort(DRAFT, 3_000, (960, 600), 1, (480, 300), 3.0, 10, (420, 262), 32, 128, 4)


class Flow:
    """The steps in order; `report` collects what demo.json holds."""

    def __init__(self, out: Path, effort: Effort, progress: Progress) -> None:
        self.out, self.effort, self.progress = Path(out), effort, progress
        self.report: dict[str, Any] = {"seconds": {}, "fits": {}}
        self._plots = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
        self._plotted: list[Future[list[Path]]] = []
        self.out.mkdir(parents=True, exist_ok=True)

    @property
    def store_path(self) -> Path:
        return self.out / "store"

    def prepare(self) -> Scene:
        """Everything before the walk; returns the scene as it was baked."""
        tables = self.measure()
        try:
            scene = self.place(self.fit(tables))
            self.bake(scene)
            with self._timed("plot"):  # what is left of it
                for plotted in self._plotted:
                    plotted.result()
        finally:
            self._plots.shutdown(wait=False, cancel_futures=True)
        return scene

    def measure(self) -> dict[str, Path]:
        """Gonio tables of the specimens, by the room's material names."""
        from lambent.bake.goniophotometer import measure
        from lambent.materials.measured.gonio_text import write_gonio

        paths = {}
        with self._timed("measure"):
            for seed, (name, specimen) in enumerate(SPECIMEN_OF.items()):
                paths[name] = self.out / "measured" / f"{name}.txt"
                write_gonio(paths[name], measure(specimen, seed=seed, name=specimen, progress=self.progress))
        return paths

    def fit(self, tables: Mapping[str, Path]) -> dict[str, Path]:
        """Material documents fitted to the table files, with a plot beside each.

        Plots are drawn by a process of their own while the bake goes on: both have times when they use one core.
        """
        from lambent.materials import measured
        from lambent.materials.fitting.fit import fit
        from lambent.materials.fitting.plot import save_plots

        paths = {}
        for name, path in tables.items():
            with self._timed("fit"):
                samples = measured.load(path).samples(self.effort.tuples)
                result = fit(samples, source=path, progress=self.progress)
                paths[name] = self.out / "materials" / f"{name}.json"
                result.material.model_copy(update={"name": name}).save(paths[name])
            self._plotted.append(self._plots.submit(save_plots, samples, result.material, paths[name].parent, name))
            self.report["fits"][name] = {
                "seconds": result.seconds,
                "errors": result.errors,
                "lambertian_errors": result.lambertian_errors,
                "warnings": result.warnings,
            }
        return paths

    def place(self, materials: Mapping[str, Path]) -> Scene:
        """The room with the fitted materials in place of its own."""
        from lambent.materials.document import load_material
        from lambent.scenes import load_scene

        with self._timed("place"):
            scene = load_scene(SCENE)
            fitted: dict[str, Material] = {name: load_material(path) for name, path in materials.items()}
            scene = replace(scene, materials={**scene.materials, **fitted})
        triangles = sum(len(item.mesh.faces) for item in scene.objects)
        self.report["scene"] = {"name": scene.name, "objects": len(scene.objects), "triangles": triangles}
        return scene

    def bake(self, scene: Scene) -> None:
        """The store, or what is missing of it after an interruption."""
        from lambent.bake.bake import bake

        with self._timed("bake"):
            store = bake(scene, self.store_path, quality=self.effort.quality, progress=self.progress)
        self.report["bake"] = {
            "quality": self.effort.quality.name,
            "noise": store.artefact("light_map/irradiance").meta.get("noise"),
            "probes": sum(artefact.name.endswith("/radiance") for artefact in store.artefacts("probe")),
        }

    def walk(self) -> None:
        """Stills along the walk and the film of it, from the frame code of the window."""
        from lambent.core.film import film_writer
        from lambent.core.images import write_shown
        from lambent.realtime.device import adapter_info
        from lambent.realtime.frame import FrameState
        from lambent.scenes.camera_paths import camera_at

        renderer = self._renderer()
        path = renderer.scene.record.paths[0]
        exposure_ev = renderer.scene.record.exposure_ev

        def state(share: float, size: tuple[int, int]) -> FrameState:
            return FrameState(camera_at(path, share * path.seconds), *size, exposure_ev=exposure_ev)

        renderer.display_image(state(0.0, self.effort.still))  # the first frame also builds the pipelines
        with self._timed("stills"):
            for k in range(STILLS):
                view = state(k / (STILLS - 1), self.effort.still)
                started = time.perf_counter()
                picture = renderer.still(view, self.effort.still_frames)
                frame_ms = (time.perf_counter() - started) * 1e3 / self.effort.still_frames
                self.report.setdefault("frame_ms", []).append(frame_ms)
                write_shown(self.out / f"walk_{k + 1}.png", picture)
                self.progress(k + 1, STILLS, "stills")
        frames = round(self.effort.film_seconds * self.effort.film_fps)
        planar = "interleaved" if adapter_info(renderer.device).is_software else "auto"  # half the time, seen in motion
        with (
            self._timed("film"),
            film_writer(self.out / "walk.mp4", *self.effort.film, fps=self.effort.film_fps) as write,
        ):
            for k in range(frames):
                view = replace(state(k / (frames - 1), self.effort.film), planar=planar)
                write(renderer.display_image(view))
                self.progress(k + 1, frames, "film")

    def compare(self, scene: Scene) -> None:
        """One view three ways: in motion (`rings`), at rest (`qmc`), and path traced."""
        from lambent.bake.reference import render_reference
        from lambent.core.colour import srgb_decode
        from lambent.core.images import write_image
        from lambent.core.metrics import compare
        from lambent.realtime.frame import FrameState

        renderer, camera = self._renderer(), scene.cameras[0]
        state = FrameState(
            next(c for c in renderer.scene.record.cameras if c.name == camera.name), *self.effort.compared
        )
        with self._timed("frame at rest"):
            rest = renderer.converged(state, self.effort.qmc_spp, self.progress)
        with self._timed("frame in motion"):
            moving = renderer.still_radiance(state, self.effort.moving_frames)
        with self._timed("path tracing"):
            truth, _ = render_reference(
                scene, camera, *self.effort.compared, self.effort.path_spp, progress=self.progress
            )
        folder = self.out / "compare"
        for name, picture in (("moving", moving), ("rest", rest), ("path", truth)):
            write_image(folder / f"{name}.exr", picture)
        self.report["compare"] = {"camera": camera.name, "spp": self.effort.path_spp}
        for name, reference, test in (
            ("sampling", rest, moving),  # what the few filtered samples cost
            ("total", truth, rest),  # what probes, parallax and light map cost
            ("moving_total", truth, moving),
        ):
            figures, difference = compare(reference, test, radiance=True)
            write_image(folder / f"{name}.png", srgb_decode(difference))
            self.report["compare"][name] = figures

    def _renderer(self) -> Any:
        if not hasattr(self, "_opened"):
            from lambent.realtime.device import adapter_info, open_device
            from lambent.realtime.frame import Renderer
            from lambent.store.store import Store

            with self._timed("open renderer"):
                device = open_device()
                self._opened = Renderer(device, Store.open(self.store_path))
            self.report["adapter"] = str(adapter_info(device).name)
        return self._opened

    def finish(self) -> dict[str, Any]:
        """Write demo.json and return what it holds."""
        seconds = self.report["seconds"]
        seconds["in all"] = sum(seconds.values())
        write_text(self.out / "demo.json", json.dumps(plain(self.report), indent=1, allow_nan=False) + "\n")
        return self.report

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        started = time.perf_counter()
        yield
        seconds = self.report["seconds"]
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - started
