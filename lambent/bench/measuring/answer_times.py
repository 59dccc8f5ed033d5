"""Time of colour edits of baked light: step by step, for dimming, and while a colour is dragged.

Times are medians over rounds through all edits, in milliseconds of wall clock. `edit_to_picture_ms` covers solving,
gathering, upsampling and upload, after which the next frame shows the light; `edit_to_picture_cpu_ms` is the processor
time of all threads meanwhile. `dimming_ms` covers mixing the light groups again, for the light map of an edit, and its
upload; it is None if light is not separated by group. While a colour is dragged, the window's background thread
computes the light, and its picture of DRAG_WIDTH x DRAG_HEIGHT pixels is drawn with a moving camera, as small and with
as few mirrored views as the window's pacing chooses: `drag_width_px` is the median width, `drag_cpu_ms` the processor
time of all threads per frame.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lambent.baked.answering.albedos import edited_albedos
from lambent.baked.answering.answer import Answer, solved
from lambent.baked.answering.stored import StoredAnswer
from lambent.bench.scenes.views import first_camera
from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.materials.document import Material
from lambent.realtime.answering.answering import AnsweredLight
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.light.baked import read_baked
from lambent.realtime.renderer import Renderer
from lambent.store.store import Store
from lambent.viewer.modes.walk.light.answering import Answering, AnsweringLight
from lambent.viewer.picture import Picture
from lambent.viewer.screen import Pace, Screen

DRAG_WIDTH, DRAG_HEIGHT = 1280, 720
DRAG_STEP_M = 0.002  # of the camera along x, per frame
DRAG_TURN = 40  # frames in which the colour fades to black and back
DIMMED = 0.5
Edit = Mapping[str, Triple]  # diffuse colours, linear RGB, by material


def changed(materials: Mapping[str, Material], edit: Edit) -> dict[str, Material]:
    """The materials after an edit."""
    return {name: materials[name].model_copy(update={"kd": colour}) for name, colour in edit.items()}


def darkened(colour: Triple, factor: float) -> Triple:
    """A colour times a factor."""
    return colour[0] * factor, colour[1] * factor, colour[2] * factor


def timed(
    store: Store, stored: StoredAnswer, materials: Mapping[str, Material], edits: Mapping[str, Edit], turns: int
) -> dict[str, dict[str, float | None]]:
    """Median times of each edit, after a round that compiles the code, and the bound on its error in percent."""
    baked = read_baked(store)
    reference = stored.answer.reference()
    renderer, light = Renderer(open_device(), baked), AnsweredLight(baked, stored)
    found: dict[str, list[dict[str, float]]] = {name: [] for name in edits}
    for _ in range(turns + 1):
        for name, edit in edits.items():
            edited = changed(materials, edit)
            now = [edited.get(one, materials[one]) for one in stored.materials]
            steps = _steps(stored.answer, reference, now, [materials[one] for one in stored.materials])
            found[name].append(steps | _shown(renderer, light, edited))
    bounds = {name: light.likely_error(light.lit(changed(materials, edit))) for name, edit in edits.items()}
    medians = {
        name: {key: round(statistics.median(run[key] for run in runs[1:]), 2) for key in runs[0]}
        for name, runs in found.items()
    }
    none = {} if baked.groups is not None else {"dimming_ms": None}
    return {name: {"likely_error": round(100 * bounds[name], 2), **medians[name], **none} for name in edits}


def _shown(renderer: Renderer, light: AnsweredLight, edited: Mapping[str, Material]) -> dict[str, float]:
    """Milliseconds from an edit until its light is on the GPU, and of dimming that light."""
    begun, busy = time.perf_counter(), time.process_time()
    lit = light.lit(edited)
    groups = light.groups(lit)
    factors = np.ones((0 if groups is None else len(groups.records), 3))
    layers = light.layers(lit) if groups is None else groups.light_map(factors)
    computed = time.perf_counter()
    renderer.resources.show_light_map(list(layers))
    renderer.finish()
    ended = time.perf_counter()
    found = {
        "upload_ms": 1e3 * (ended - computed),
        "edit_to_picture_ms": 1e3 * (ended - begun),
        "edit_to_picture_cpu_ms": 1e3 * (time.process_time() - busy),
    }
    if groups is None:
        return found
    begun = time.perf_counter()
    renderer.resources.show_light_map(list(groups.light_map(DIMMED * factors)))
    renderer.finish()
    return found | {"dimming_ms": 1e3 * (time.perf_counter() - begun)}


def _steps(answer: Answer, reference: Floats, now: list[Material], given: list[Material]) -> dict[str, float]:
    """Milliseconds of solving, gathering and upsampling, and the number of sweeps of the solution."""
    marks = [time.perf_counter()]
    albedos = edited_albedos(given, now)
    solution = solved(answer.patches, albedos)
    marks.append(time.perf_counter())
    light = answer.indirect(albedos, solution)
    marks.append(time.perf_counter())
    answer.at_texels(light, reference)
    marks.append(time.perf_counter())
    steps = dict(zip(("solve_ms", "gather_ms", "upsample_ms"), (1e3 * np.diff(marks)).tolist(), strict=True))
    return {**steps, "sweeps": float(solution.sweeps)}


def dragged(store: Store, materials: Mapping[str, Material], edit: Edit, seconds: float) -> dict[str, float | None]:
    """Frames and updates of the light per second while an edit's colours are dragged and the camera moves."""
    baked = read_baked(store)
    if not baked.record.cameras:
        return dict.fromkeys(("drag_frames_per_s", "drag_edits_per_s", "drag_width_px", "drag_cpu_ms"))
    renderer, camera = Renderer(open_device(), baked), first_camera(store, baked.record)
    renderer.waits = False  # as in the window: probes of a mix follow in a thread
    answering, screen = AnsweringLight(store, renderer, Answering()), Screen(pace=Pace(dragging=True))
    picture = Picture(renderer, screen)

    def draw(frame: int) -> None:
        share = abs(2 * (frame / DRAG_TURN % 1) - 1)
        edited = changed(materials, {name: darkened(colour, share) for name, colour in edit.items()})
        answering.update(edited)
        x, y, z = camera.position
        moved = replace(camera, position=(x + frame * DRAG_STEP_M, y, z))
        maps, mixed = renderer.light_version, renderer.mixer.version
        picture.update(FrameState(moved, DRAG_WIDTH, DRAG_HEIGHT, materials=edited, maps=maps, mixed=mixed))

    for frame in range(DRAG_TURN):  # the first edit loads the answer
        draw(frame)
    widths: list[int] = []
    changes = renderer.resources.light_version
    begun, busy = time.perf_counter(), time.process_time()
    while (passed := time.perf_counter() - begun) < seconds:
        draw(DRAG_TURN + len(widths))
        widths.append(screen.statistics.resolution[0])
    busy = time.process_time() - busy
    answering.close()
    shown = renderer.resources.light_version - changes
    return {
        "drag_frames_per_s": round(len(widths) / passed, 1), "drag_edits_per_s": round(shown / passed, 1),
        "drag_width_px": statistics.median(widths), "drag_cpu_ms": round(1e3 * busy / len(widths), 1),
    }  # fmt: skip
