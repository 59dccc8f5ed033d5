"""`gi-edit`: editing a view with interreflections, from the bake to the frame, against path tracing with a denoiser.

Rows with `samples` are scenes with the series of their published figures; `thesis_seconds` is the time for the
published number of samples at the measured rate. Errors are those of smaller pictures of `error_size` with
`error_samples`, against path traced pictures with as many surfaces. `opened_` refers to the scene's own materials; the
others are means over random `settings` unknown to the bake (`gi_edit_states`), for each kind, and the worst. `flip`
covers all pixels; `relmse` and `flip_inside` only those whose neighbours show the same object, because a stored pixel
is a point and a path traced one a mean. `noise_flip` is between two halves of the reference, `noise_relmse` is the
noise of the whole. A `_limit` is extrapolated from half and all of the samples to infinitely many, without the
reference's noise, assuming that squares add up: the error that more samples would not remove. `rival_` is path tracing,
guides and Open Image Denoise of the first setting, with the fewest samples, in powers of two, that reach the same FLIP;
its seconds are those of the large picture.

Rows with `error_mib` compare series in small pictures with paths of up to `surfaces` surfaces, so that light omitted by
a short series counts: the relative error (root of `relmse`) times MiB, and times seconds of the bake. The summary names
the smallest per scene. Frames are those of the drag of `direct-edit`; the vase's lobe has two slopes, and widens along
one of them.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from lambent.baking.bake import bake
from lambent.baking.interreflection.settings import Bounces
from lambent.baking.quality import quality_named
from lambent.baking.transport.view import View
from lambent.bench.direct_edit import MIB, drag, held_bytes
from lambent.bench.measuring.reference import path_traced
from lambent.bench.scenes.gi_edit_states import KINDS, flip_between, interior, relative_mse, setting, summed_up
from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.files import folder_bytes
from lambent.core.progress import Progress, silent, tracked
from lambent.editing.interreflection.picture import FrozenPicture
from lambent.editing.interreflection.stored import Interreflections, PartLight, interreflections
from lambent.editing.interreflection.whole import WholePicture
from lambent.editing.session.session import Session
from lambent.editing.stored import edited_picture
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.terms import Editable
from lambent.scenes.loaders.load import load_scene
from lambent.scenes.scene import Scene
from lambent.store.store import Store

NAME = "gi-edit"
SERIES = ((64, 1), (64, 1, 1), (64, 1, 1, 1), (128, 1, 1, 1), (64, 16), (128, 8, 1), (16, 8, 1, 1))
SURFACES = 8  # on the longest paths against which series are compared


@dataclass(frozen=True)
class Case:
    """A scene with its published series: size, samples per pixel, and the dragged material."""

    scene: str
    series: tuple[int, ...]
    size: tuple[int, int]
    published: int
    material: str
    fixed: frozenset[str] = frozenset()


CASES = (
    Case("cornell", (64, 1, 1, 1), (450, 450), 12_000, "floor"),
    Case("vase", (64, 1, 1, 1), (512, 512), 4_000, "vase"),
    Case("loft", (64, 1, 1), (640, 480), 8_000, "floor", frozenset({"books", "toys"})),
    Case("teatray", (128, 1, 1, 1), (320, 240), 10_000, "glaze"),
    Case("teatray", (16, 8, 1, 1), (320, 240), 10_000, "glaze"),
    Case("teatray", (128, 8, 1), (320, 240), 10_000, "glaze"),
    Case("ring", (64, 16), (400, 400), 4_000, "ring"),
)


@dataclass(frozen=True)
class Effort:
    """Pictures are smaller by `shrink`, those for errors by a further `error_shrink`; samples are per pixel.

    `settings` is the number of random settings per row; `rival_s` limits the time of one picture of the rival; `edge`
    is the side of the pictures for comparing `series`.
    """

    shrink: int = 1
    samples: int = 64
    error_shrink: int = 4
    error_samples: int = 1024
    reference_spp: int = 2048
    settings: int = 20
    frames: int = 40
    rival_s: float = 20.0
    edge: int = 80
    lights: int = 1000
    series: tuple[tuple[int, ...], ...] = SERIES
    cases: tuple[Case, ...] = CASES


FULL = Effort()
QUICK = Effort(
    10, 32, error_shrink=2, error_samples=64, reference_spp=128, settings=3, frames=6, rival_s=0.5, edge=24,
    lights=100, series=((64, 1), (16, 8, 1)), cases=(CASES[0], CASES[-1]),
)  # fmt: skip


def run(effort: Effort, settings: int | None = None, progress: Progress = silent) -> dict[str, Any]:
    """Rows per scene and series; the summary has the best series of each scene.

    `settings` overrides the effort's number of random settings per row.
    """
    from lambent.baking.engine import engine

    if settings is not None:
        if settings < 1:
            raise UserError("no settings", field="--settings", got=settings, expected="at least 1")
        effort = replace(effort, settings=settings)
    engine()
    rows = [_row(case, effort) for case in tracked(effort.cases, progress, "scenes")]
    scenes = {case.scene: case for case in effort.cases}
    compared = [row for case in tracked(list(scenes.values()), progress, "series") for row in _series(case, effort)]
    best = {
        name: {
            key: min((row for row in compared if row["scene"] == name), key=lambda row: row[key])["series"]
            for key in ("relmse", "error_mib", "error_seconds")
        }
        for name in scenes
    }
    return {"rows": rows + compared, "summary": {"reference_spp": effort.reference_spp, "best_series": best}}


class Room:
    """One view of a scene in its own store, with its direct light."""

    def __init__(self, case: Case, size: tuple[int, int], folder: Path, lights: int) -> None:
        self.case, self.size, self._folder = case, size, folder
        self.scene: Scene = load_scene(f"builtin:{case.scene}")
        self.camera = self.scene.cameras[0]
        self.start = {name: of_material(material) for name, material in self.scene.materials.items()}
        self.session = Session.new(f"builtin:{case.scene}", self.camera, self.scene.materials, size=size)
        quality = quality_named("normal").changed("bench", visibility={"lights": (lights,)})
        self.store = bake(self.scene, folder, quality=quality, only={"transport"}, views=[View(self.camera, *size)])

    def bake(self, series: tuple[int, ...], samples: int) -> float:
        """Bake the interreflections up to `samples`; returns seconds."""
        began, view, bounces = time.perf_counter(), View(self.camera, *self.size), Bounces(series, samples, self.fixed)
        self.store = bake(self.scene, self._folder, only={"interreflection"}, views=[view], bounces=bounces)
        return time.perf_counter() - began

    @property
    def fixed(self) -> frozenset[str]:
        return self.case.fixed

    def light(self) -> Interreflections:
        return interreflections(self.store, self.camera, self.size, self.start)

    def picture(self, light: Interreflections) -> WholePicture:
        whole = WholePicture(edited_picture(self.store, self.session))
        whole.give(light, self.start)
        return whole

    def settings(self, count: int) -> list[dict[str, Editable]]:
        """Random settings of each kind in turn; uneditable materials stay."""
        found = []
        for k in range(count):
            rng = np.random.default_rng(k)
            found.append(
                {
                    name: self.start[name] if name in self.fixed else setting(KINDS[k % len(KINDS)], material, rng)
                    for name, material in self.scene.materials.items()
                }
            )
        return found

    def reference(self, materials: dict[str, Editable], surfaces: int, spp: int) -> tuple[Floats, Floats]:
        """A path traced picture in two halves."""
        from lambent.baking.reference.path_traced import render_reference

        edited = {name: one for name, one in materials.items() if name not in self.fixed}
        return tuple(
            render_reference(
                self.scene, self.camera, *self.size, max(2, spp // 2), seed, max_depth=surfaces, edited=edited
            )[0]
            for seed in (1, 2)
        )  # type: ignore[return-value]

    def inner(self) -> Flags:
        return interior(self.store, self.camera, self.size)


def _drawn(whole: WholePicture, materials: dict[str, Editable]) -> Floats:
    for name, one in materials.items():
        whole.show(name, one)
    whole.draw()
    return np.array(whole.image())


def _stored(store: Store) -> int:
    return sum(folder_bytes(store.folder / one.name) for one in store.artefacts("interreflection"))


def _row(case: Case, effort: Effort) -> dict[str, Any]:
    width, height = (edge // effort.shrink for edge in case.size)
    with tempfile.TemporaryDirectory() as folder:
        Room(case, (16, 12), Path(folder) / "warm", 16).bake(case.series, 16)
        room = Room(case, (width, height), Path(folder) / "room", effort.lights)
        first = room.bake(case.series, min(16, effort.samples))
        whole = first + room.bake(case.series, effort.samples)
        light = room.light()
        points = sum(len(part.pixel) for part in light.parts.values())
        rate = points * effort.samples / whole
        terms = [(len(part.pixel), term) for part in light.parts.values() for term in part.terms]
        room_for = sum(count * term.bands * len(light.tails) for count, term in terms)
        small = Room(
            case, (width // effort.error_shrink, height // effort.error_shrink), Path(folder) / "small", effort.lights
        )
        return {
            "scene": case.scene, "series": _said(case.series), "size": f"{width}x{height}", "points": points,
            "slots": len(light.tails.slots), "tails": len(light.tails), "samples": effort.samples,
            "bake_seconds": round(whole, 2), "first_seconds": round(first, 2),
            "samples_per_second": round(rate), "thesis_samples": case.published,
            "thesis_seconds": round(case.published * points / rate), "stored_mib": round(_stored(room.store) / MIB, 1),
            "memory_mib": round(held_bytes(light) / MIB, 1),
            "share_not_zero": round(sum(len(term.values) for _, term in terms) / max(1, room_for), 4),
            **_times(room, light, effort), **_errors(small, room, effort),
        }  # fmt: skip


def _times(room: Room, light: Interreflections, effort: Effort) -> dict[str, Any]:
    """Times of freezing each material for edits of its sharpest curve, and of frames while dragging one."""
    whole, freezing = room.picture(light), {}
    whole.draw()
    for name in light.parts:
        if name not in room.fixed:
            began = time.perf_counter()
            FrozenPicture(light, room.start, name, whole.direct.canvas, {sharpest(light.parts[name])})
            freezing[name] = time.perf_counter() - began
    material, frames = room.case.material, []
    curve = next(name for name in room.start[material].curves if "highlight" in name)
    whole.activate(material, curve)
    whole.draw()
    for state in islice(drag(room.scene.materials[material]), effort.frames + 2):
        began = time.perf_counter()
        whole.show(material, state)
        whole.step()
        whole.image()
        frames.append(1e3 * (time.perf_counter() - began))
    whole.close()
    slowest = max(freezing, key=lambda name: freezing[name])
    return {
        "freeze_seconds": round(freezing[slowest], 2), "freeze_of": slowest,
        "frozen_mib": round(held_bytes(whole) / MIB, 1),
        "frame_ms": round(statistics.median(frames[2:]), 2), "frame_worst_ms": round(max(frames[2:]), 2),
    }  # fmt: skip


def sharpest(part: PartLight) -> str:
    """The curve with the most bands."""
    pairs = zip(part.start.terms, part.terms, strict=True)
    counts = [one for term, light in pairs for one in zip(light.counts, term.factors, strict=True)]
    return max(counts, key=lambda one: one[0])[1].curve


def _errors(room: Room, large: Room, effort: Effort) -> dict[str, Any]:
    """Errors for the scene as it is and for the settings; the rival's time in the large view for the first one."""
    states, pictures = [room.start, *room.settings(effort.settings)], []
    for samples in (effort.error_samples // 2, effort.error_samples):
        room.bake(room.case.series, samples)
        whole = room.picture(room.light())
        pictures.append([_drawn(whole, state) for state in states])
        whole.close()
    inner, found, rival = room.inner(), [], dict[str, Any]()
    for k, (state, half, full) in enumerate(zip(states, *pictures, strict=True)):
        one, other = room.reference(state, len(room.case.series), effort.reference_spp)
        found.append(_error(half, full, (one, other), inner))
        if k == 1:
            converged = np.mean([one, other], axis=0)
            rival = _rival(room, large, state, converged, found[1]["flip"], effort)
    size = f"{room.size[0]}x{room.size[1]}"
    opened = {f"opened_{key}": float(f"{value:.3g}") for key, value in found[0].items()}
    said = {"error_size": size, "error_samples": samples, "settings": effort.settings}
    return {**said, **opened, **summed_up(found[1:]), **rival}


def _error(half: Floats, full: Floats, references: tuple[Floats, Floats], inner: Flags) -> dict[str, float]:
    """Errors of pictures with half the samples and with all."""
    converged = np.mean(references, axis=0)
    noise = relative_mse(*references, inner) / 4  # of the mean of both
    relmse = [relative_mse(one, converged, inner) for one in (half, full)]
    inside = [flip_between(converged, one, inner) for one in (half, full)]
    noise_inside = flip_between(*references, inner) / 2
    flip_limit = np.sqrt(max(0.0, 2 * inside[1] ** 2 - inside[0] ** 2 - noise_inside**2))
    return {
        "flip": flip_between(converged, full), "flip_inside": inside[1], "flip_limit": float(flip_limit),
        "noise_flip": flip_between(*references), "relmse": relmse[1], "noise_relmse": noise,
        "relmse_limit": max(0.0, 2 * relmse[1] - relmse[0] - noise),
    }  # fmt: skip


def _rival(
    room: Room, large: Room, state: dict[str, Editable], converged: Floats, wanted: float, effort: Effort
) -> dict[str, Any]:
    """The fewest samples that reach the error in the small view, and their seconds in the large one."""
    from lambent.baking.reference.path_traced import tracer_of

    edited = {name: one for name, one in state.items() if name not in room.fixed}
    depth = len(room.case.series)
    tracer = tracer_of(room.scene, max_depth=depth, edited=edited)
    small, whole = ((tracer, room.camera, size) for size in (room.size, large.size))
    path_traced(*whole, 2, seed=3).denoised()  # compiles
    spp, seconds, flip = 1, 0.0, np.inf
    while flip > wanted and seconds < effort.rival_s / 2:
        spp *= 2
        flip = flip_between(converged, path_traced(*small, spp, seed=3).denoised())
        began = time.perf_counter()
        path_traced(*whole, spp, seed=3).denoised()
        seconds = time.perf_counter() - began
    said: dict[str, Any] = {"rival_spp": spp, "rival_seconds": round(seconds, 2)}
    if flip > wanted:
        said = {key: f"> {value}" for key, value in said.items()}
    return {**said, "rival_flip": round(flip, 4)}


def _series(case: Case, effort: Effort) -> list[dict[str, Any]]:
    """Each series in one small picture, with equal samples, against paths of any length."""
    size = effort.edge, round(effort.edge * case.size[1] / case.size[0])
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        room = Room(case, size, Path(folder), effort.lights)
        settings, inner = room.settings(effort.settings), room.inner()
        references = [np.mean(room.reference(state, SURFACES, effort.reference_spp), axis=0) for state in settings]
        for series in effort.series:
            room.bake(series, 1)  # compiles
            seconds = room.bake(series, effort.error_samples)
            whole = room.picture(room.light())
            compared = list(zip([_drawn(whole, state) for state in settings], references, strict=True))
            relmse = float(np.mean([relative_mse(image, reference, inner) for image, reference in compared]))
            flip = float(np.mean([flip_between(reference, image) for image, reference in compared]))
            mib = _stored(room.store) / MIB
            whole.close()
            rows.append(
                {
                    "scene": case.scene, "series": _said(series), "size": f"{size[0]}x{size[1]}", "surfaces": SURFACES,
                    "bake_seconds": round(seconds, 2), "stored_mib": round(mib, 2), "flip": round(flip, 4),
                    "relmse": float(f"{relmse:.3g}"), "error_mib": float(f"{np.sqrt(relmse) * mib:.3g}"),
                    "error_seconds": float(f"{np.sqrt(relmse) * seconds:.3g}"),
                }
            )  # fmt: skip
    return rows


def _said(series: tuple[int, ...]) -> str:
    return ",".join(map(str, series))
