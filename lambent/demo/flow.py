"""The whole workflow on the built-in room: measure, fit, place, bake, walk, compare.

Each step writes its results to one folder, and the next step reads only them, as the commands do:

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
from functools import cached_property
from pathlib import Path
from typing import Any

from lambent.baking.bake import bake
from lambent.baking.quality import DRAFT, Quality, quality_named
from lambent.baking.reference.goniophotometer import measure
from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.light.colour import shown, srgb_decode
from lambent.core.pictures.images import to_bytes, write_image, write_shown
from lambent.core.pictures.metrics import compare
from lambent.core.plain import plain
from lambent.core.progress import Progress, part_of
from lambent.core.views.camera import Camera, CameraPath
from lambent.materials import measured
from lambent.materials.document import load_material
from lambent.materials.fitting.fit import fit
from lambent.materials.fitting.shown.plot import save_plots
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import adapter_info, open_device
from lambent.realtime.renderer import Renderer
from lambent.render import Settings, images, write_frames
from lambent.scenes.camera_paths import camera_at, path_length
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene
from lambent.site.export import export
from lambent.store.store import Store

SCENE = "builtin:room"
SPECIMEN_OF = {  # room material -> specimen measured for it
    "copper": "rough copper",
    "brushed_aluminium": "brushed aluminium",
    "varnished_wood": "varnished wood",
    "frosted_glass": "frosted glass",
}
PACE_M_S = 1.2  # of the film: somebody looking around
STILLS = 8


@dataclass(frozen=True)
class Effort:
    """Sizes of a demo: images in pixels, film frames per second, samples per pixel of the compared view.

    The fit uses `tuples` samples of each table, or all if None. `moving_frames` are averaged to the view in motion, so
    that its edges can be compared.
    """

    quality: Quality
    tuples: int | None
    still: tuple[int, int]
    film: tuple[int, int]
    film_fps: int
    compared: tuple[int, int]
    path_spp: int
    rest_spp: int
    moving_frames: int = 16
    first_spp: int = 16


FIRST = 640, 400  # pixels of the first picture
FULL = Effort(quality_named("preview"), None, (1680, 1050), (720, 450), 20, (840, 525), 48, 48)
QUICK = Effort(DRAFT, 3_000, (960, 600), (480, 300), 10, (420, 262), 32, 24, 4)


def cameras(path: CameraPath, count: int) -> list[Camera]:
    """`count` cameras along a path, evenly spaced in time."""
    return [camera_at(path, k / (count - 1) * path.seconds) for k in range(count)]


def walked(path: CameraPath, fps: int) -> list[Camera]:
    """Cameras of a film along a path at `PACE_M_S`."""
    return cameras(path, max(2, round(path_length(path) / PACE_M_S * fps)))


class Flow:
    """The steps in order; `report` collects the contents of demo.json."""

    def __init__(self, out: Path, effort: Effort, progress: Progress) -> None:
        self.out, self.effort, self.progress = Path(out), effort, progress
        self.report: dict[str, Any] = {"seconds": {}, "fits": {}}
        self._plots = ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
        self._plotted: list[Future[list[Path]]] = []
        if not (self.out / "measured").is_dir() and (self.out.is_file() or list(self.out.glob("*"))):
            hint = "choose another folder with --out"
            raise UserError("is neither a demo folder nor empty", file=self.out, hint=hint)
        (self.out / "measured").mkdir(parents=True, exist_ok=True)

    @property
    def store_path(self) -> Path:
        return self.out / "store"

    def prepare(self) -> Scene:
        """Run all steps before the walk; returns the scene as baked."""
        tables = self.measure()
        try:
            scene = self.place(self.fit(tables))
            self.look(scene)
            self.bake(scene)
            with self._timed("plot"):  # the remaining plots, after the bake
                for plotted in self._plotted:
                    plotted.result()
        finally:
            self._plots.shutdown(wait=False, cancel_futures=True)
        return scene

    def measure(self) -> dict[str, Path]:
        """Gonio tables of the specimens, by room material."""
        paths = {}
        with self._timed("measure"):
            for seed, (name, specimen) in enumerate(SPECIMEN_OF.items()):
                paths[name] = self.out / "measured" / f"{name}.txt"
                write_gonio(paths[name], measure(specimen, seed=seed, name=specimen, progress=self.progress))
        return paths

    def fit(self, tables: Mapping[str, Path]) -> dict[str, Path]:
        """Material documents fitted to the tables, each with a plot.

        A separate process draws the plots during the bake: both have phases that use one core.
        """
        paths = {}
        for name, path in tables.items():
            with self._timed("fit"):
                samples = measured.load(path).samples(self.effort.tuples)
                result = fit(samples, source=path, progress=self.progress)
                paths[name] = self.out / "materials" / f"{name}.json"
                result.material.model_copy(update={"name": name}).save(paths[name])
            self._plotted.append(self._plots.submit(save_plots, samples, result.material, paths[name].parent, name))
            told = ("seconds", "errors", "lambertian_errors", "warnings")
            self.report["fits"][name] = {key: getattr(result, key) for key in told}
        return paths

    def place(self, materials: Mapping[str, Path]) -> Scene:
        """The room with the fitted materials."""
        with self._timed("place"):
            scene = load_scene(SCENE)
            fitted = {name: load_material(path) for name, path in materials.items()}
            scene = replace(scene, materials={**scene.materials, **fitted})
        triangles = sum(len(item.mesh.faces) for item in scene.objects)
        self.report["scene"] = {"name": scene.name, "objects": len(scene.objects), "triangles": triangles}
        return scene

    def look(self, scene: Scene) -> None:
        """A first picture, of whole paths, before anything is baked: first.png."""
        from lambent.baking.engine import engine

        engine()
        from lambent.baking.pictures.stored import scene_alone  # imports Mitsuba, whose variant is set now
        from lambent.baking.pictures.tracer import Tracer
        from lambent.traced.picture import TracedPicture

        file, spp = self.out / "first.png", self.effort.first_spp
        with self._timed("first picture"):
            self.progress(0, spp, f"first picture, {file}")
            traced = TracedPicture(Tracer.of_paths(scene_alone(scene)), scene.cameras[0], FIRST, path=True)
            while traced.samples < spp:
                traced.sample(spp - traced.samples)
                self.progress(traced.samples, spp, f"first picture, {file}")
            write_shown(file, to_bytes(shown(traced.denoised(), "filmic", scene.exposure_ev or 0.0)))

    def bake(self, scene: Scene) -> None:
        """Bake the store, or resume an interrupted bake."""
        with self._timed("bake"):
            store = bake(scene, self.store_path, quality=self.effort.quality, progress=self.progress)
        self.report["bake"] = {
            "quality": self.effort.quality.name,
            "noise": store.artefact("light_map/irradiance").meta.get("noise"),
            "probes": sum(artefact.name.endswith("/radiance") for artefact in store.artefacts("probe")),
        }

    def walk(self) -> None:
        """Traced stills, and a film drawn as in motion."""
        effort, renderer = self.effort, self._renderer
        path, exposure_ev = renderer.scene.record.paths[0], renderer.scene.record.exposure_ev or 0.0
        traced = images(Store.open(self.store_path), Settings(*effort.still, exposure_ev=exposure_ev))
        views = cameras(path, STILLS)
        with self._timed("stills"):
            for number, view in enumerate(views):
                part = part_of(self.progress, number / STILLS, (number + 1) / STILLS, "stills")
                write_shown(self.out / f"walk_{number + 1}.png", traced.displayed(view, part))
        frame = FrameState(views[0], *effort.film, exposure_ev=exposure_ev)

        def draw(camera: Camera) -> Any:
            return renderer.display_image(replace(frame, camera=camera))

        with self._timed("film"):
            path_cameras = walked(path, effort.film_fps)
            write_frames(self.out / "walk.mp4", path_cameras, draw, effort.film, effort.film_fps, self.progress)

    def compare(self, scene: Scene) -> None:
        """Compare one view in motion, at rest, and path traced."""
        from lambent.baking.reference.path_traced import (
            render_reference,  # imports Mitsuba, whose variant is set by the bake
        )

        effort, renderer, camera = self.effort, self._renderer, scene.cameras[0]
        state = FrameState(camera, *effort.compared)
        with self._timed("frame at rest"):
            settings = Settings(*effort.compared, samples=effort.rest_spp)
            rest = images(Store.open(self.store_path), settings).radiance(camera, self.progress)
        with self._timed("frame in motion"):
            moving = renderer.still_radiance(state, effort.moving_frames)
        with self._timed("path tracing"):
            truth, _ = render_reference(scene, camera, *effort.compared, effort.path_spp, progress=self.progress)
        folder = self.out / "compare"
        for name, image in (("moving", moving), ("rest", rest), ("path", truth)):
            write_image(folder / f"{name}.exr", image)
        self.report["compare"] = {"camera": camera.name, "spp": effort.path_spp}
        for name, reference, test in (
            ("change", rest, moving),  # between motion and rest
            ("rest", truth, rest),
            ("moving", truth, moving),
        ):
            self.report["compare"][name], difference = compare(reference, test, radiance=True)
            write_image(folder / f"{name}.png", srgb_decode(difference))

    def share(self) -> None:
        """The room as a web site, in which a browser walks."""
        with self._timed("site"):
            made = export(Store.open(self.store_path), self.out / "site", self.progress)
        self.report["site"] = {"bytes": made["bytes"], "files": made["files"]}

    @cached_property
    def _renderer(self) -> Renderer:
        with self._timed("open renderer"):
            device = open_device()
            renderer = Renderer(device, Store.open(self.store_path))
        self.report["adapter"] = adapter_info(device).name
        return renderer

    def finish(self) -> dict[str, Any]:
        """Write demo.json and return its contents."""
        seconds = self.report["seconds"]
        seconds["total"] = sum(seconds.values())
        write_text(self.out / "demo.json", json.dumps(plain(self.report), indent=1, allow_nan=False) + "\n")
        return self.report

    @contextmanager
    def _timed(self, name: str) -> Iterator[None]:
        started = time.perf_counter()
        yield
        seconds = self.report["seconds"]
        seconds[name] = seconds.get(name, 0.0) + time.perf_counter() - started
