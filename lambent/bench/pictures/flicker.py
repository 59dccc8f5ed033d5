"""`flicker`: changes of a static scene's picture from frame to frame.

Rows are scene x case. `still` compares two frames of one resting camera in motion, `change over` such a frame with the
first traced picture that replaces it, and `at rest` each traced picture, as the window shows it, with the next one.
`walk` compares frames of a slow walk, STEP_M apart, and `walk, traced` those of a traced film. FLIP
compares each frame with the previous one, reprojected onto the surfaces that the later frame sees; pixels hidden in the
earlier frame count as unchanged. Reprojection blurs, and reflections really move: `walk, smooth` measures the same for
antialiased frames (16 samples per pixel) and is the lower bound. Anything above it is flicker.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from lambent.bench.measuring.reference import with_samples
from lambent.bench.scenes.views import first_camera, inputs_or_baked
from lambent.core.arrays import Flags, Floats
from lambent.core.light.colour import shown
from lambent.core.pictures import metrics
from lambent.core.plain import triple
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera, camera_axes, clip_from_world, pixel_rays
from lambent.realtime.frame_state import FrameState
from lambent.realtime.gpu.device import open_device
from lambent.realtime.renderer import Renderer
from lambent.scenes.camera_paths import path_length, sample_path
from lambent.store.contract import FAR, SceneRecord
from lambent.store.source import scene_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import room_of_store

NAME = "flicker"
CASES = 6
STEP_M = 0.02  # half a metre a second at 25 frames
NEAR_M = 1e-3
HIDDEN = 2e-3  # relative distance by which a point may lie behind the surface that the other camera sees
Distance = Callable[[Floats, Floats], Floats]
"""Metres (n,) from a point (3,) along unit directions (n, 3), FAR without a hit."""


@dataclass(frozen=True)
class Effort:
    """Pixels, places along the walk, samples of traced pictures; the scene that is baked if no store is given.

    `rest`: samples per pixel of the pictures that are shown at rest; `film`: of each frame of a film.
    """

    width: int = 960
    height: int = 540
    places: int = 5
    rest: tuple[int, ...] = (1, 2, 4, 8, 16, 24, 32, 48, 64)
    film: int = 8
    scene: str = "builtin:room"


FULL, QUICK = Effort(), Effort(240, 135, 2, (1, 4, 24), 4, "builtin:box")


def run(effort: Effort, inputs: Sequence[Path] = (), progress: Progress = silent) -> dict[str, Any]:
    """Rows of the inputs, which are baked stores; without inputs, of a scene baked here in `preview`."""
    with inputs_or_baked(inputs, effort.scene, progress) as stores:
        rows = [row for store in stores for row in rows_of(store, effort, progress)]
    return {"rows": rows, "summary": {f"{row['scene']} {row['case']}": row["flip"] for row in rows}}


def rows_of(store: Store, effort: Effort, progress: Progress = silent) -> list[dict[str, Any]]:
    """One row per case; FLIP's mean is over all pairs of frames, the worst tile over all."""
    from lambent.baking.engine import engine

    engine()  # before Mitsuba is imported
    from lambent.baking.tracing.rays import distances, rays_from
    from lambent.baking.tracing.scene_builder import bare_scene

    renderer = Renderer(open_device(), store)
    record, scene = renderer.scene.record, renderer.scene
    surfaces = bare_scene(scene.positions[scene.faces])
    state = FrameState(first_camera(store, record), effort.width, effort.height)
    exposure_ev = record.exposure_ev
    if exposure_ev is None:
        exposure_ev = metrics.display_exposure(renderer.image(state))
    state = replace(state, exposure_ev=exposure_ev)
    steps = list(_steps(record, effort.places))
    rows = []

    def row(case: str, errors: Sequence[Floats]) -> None:
        worst = max(float(metrics.tile_means(error).max()) for error in errors)
        mean = float(np.mean([error.mean() for error in errors]))
        told = {"scene": store.folder.name, "case": case, "pairs": len(errors)}
        rows.append({**told, "flip": round(mean, 5), "flip_worst_tile": round(worst, 4)})
        progress(len(rows), CASES, case)

    def frame(camera: Camera) -> Floats:
        return _encoded(renderer.display_image(replace(state, camera=camera)))

    def smooth(camera: Camera) -> Floats:
        return _encoded(renderer.still(replace(state, camera=camera)))

    def distance(origin: Floats, directions: Floats) -> Floats:
        return np.minimum(distances(surfaces, rays_from(origin, directions)), FAR)

    tracer = room_of_store(store, scene_of(store)).tracer

    def traced(camera: Camera, *samples: int) -> list[Floats]:
        """A picture after each number of samples."""
        picture, view = TracedPicture(tracer, camera, state.size), state.view_transform
        return [shown(with_samples(picture, n).denoised(), view, exposure_ev) for n in samples]

    drawn, series = frame(state.camera), traced(state.camera, *effort.rest)
    row("still", [metrics.flip_error(drawn, frame(state.camera))])
    row("change over", [metrics.flip_error(drawn, series[0])])
    row("at rest", [metrics.flip_error(a, b) for a, b in pairwise(series)])
    films = ("walk", frame), ("walk, traced", lambda camera: traced(camera, effort.film)[0]), ("walk, smooth", smooth)
    for case, draw in films:
        row(case, [_changed(draw(before), draw(after), before, after, distance) for before, after in steps])
    return rows


def _changed(earlier: Floats, later: Floats, before: Camera, after: Camera, distance: Distance) -> Floats:
    moved, seen = reprojected(earlier, before, after, distance)
    return metrics.flip_error(later, np.where(seen[..., None], moved, later))


def reprojected(picture: Floats, before: Camera, after: Camera, distance: Distance) -> tuple[Floats, Flags]:
    """A picture (H, W, 3) of camera `before` reprojected to `after`, and (H, W) whether both see the same surface.

    Without flicker, it stays fixed on the surfaces.
    """
    height, width = picture.shape[:2]
    rays = pixel_rays(after, width, height).reshape(-1, 3)
    points = np.asarray(after.position) + rays * distance(np.asarray(after.position), rays)[:, None]
    offset = points - np.asarray(before.position)
    far = np.linalg.norm(offset, axis=1)
    seen = distance(np.asarray(before.position), offset / far[:, None]) > far * (1 - HIDDEN)
    clip = (
        np.concatenate([points, np.ones((len(points), 1))], axis=1) @ clip_from_world(before, width, height, NEAR_M).T
    )
    w = np.where(clip[:, 3] > NEAR_M, clip[:, 3], np.inf)
    column, row = (clip[:, 0] / w + 1) / 2 * width - 0.5, (1 - clip[:, 1] / w) / 2 * height - 0.5
    seen &= np.isfinite(w) & (column >= 0) & (column <= width - 1) & (row >= 0) & (row <= height - 1)
    channels = [
        map_coordinates(channel, (row, column), order=1, mode="nearest") for channel in np.moveaxis(picture, -1, 0)
    ]
    return np.stack(channels, axis=-1).reshape(picture.shape), seen.reshape(height, width)


def _steps(record: SceneRecord, places: int) -> Iterator[tuple[Camera, Camera]]:
    """Pairs of cameras STEP_M apart: along the first path that has a length, otherwise sideways from each camera."""
    path = next((path for path in record.paths if len(path.keys) > 1 and path_length(path) > STEP_M), None)
    if path is not None:
        share = STEP_M / path_length(path)
        for t in (np.arange(places) + 0.5) / places:
            yield sample_path(path, float(t)), sample_path(path, float(t + share))
        return
    for camera in record.cameras[:places]:
        aside = STEP_M * np.asarray(camera_axes(camera)[0])
        position, target = (triple(np.asarray(at) + aside) for at in (camera.position, camera.target))
        yield camera, replace(camera, position=position, target=target)


def _encoded(image: Any) -> Floats:
    return np.asarray(image, np.float32) / np.float32(255)
