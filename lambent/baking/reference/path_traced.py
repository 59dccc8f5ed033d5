"""Path traced images of a scene, with variance: the reference for the renderer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

from lambent.baking.pictures.tracer import Tracer, camera_rays
from lambent.baking.quality import MAX_DEPTH
from lambent.baking.running.tiles import seed_of
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.lights.emitters import balance_emitters
from lambent.baking.tracing.rays import block_sums, independent
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.materials.factored.terms import Editable
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import Scene

PATHS_AT_ONCE = 1 << 20


def render_reference(
    scene: Scene,
    camera: Camera,
    width: int,
    height: int,
    spp: int,
    seed: int = 0,
    progress: Progress = silent,
    *,
    max_depth: int = MAX_DEPTH,
    edited: Mapping[str, Editable] | None = None,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Path trace the view of a pinhole camera, with a box filter.

    Parameters
    ----------
    width, height : int
        Size of the image in pixels.
    spp : int
        Samples per pixel, at least 2; rounded up to whole passes.
    seed : int
        The same seed gives the same image.
    max_depth : int
        Surfaces on the longest path.
    edited : mapping, optional
        By material name, terms and curves that replace those of documents.

    Returns
    -------
    image, variance : (height, width, 3) float32
        Radiance in W/(sr m^2), row 0 on top; variance of each pixel's mean, in that unit squared.
    """
    _, whole = built(scene, edited)
    return traced(whole, camera, width, height, spp, seed, progress, max_depth=max_depth)


def built(scene: Scene, edited: Mapping[str, Editable] | None = None) -> tuple[SceneBuilder, Any]:
    """A scene for `traced`, with its builder."""
    builder = SceneBuilder(replace(scene, textures=prepared(scene.textures)), edited=edited)
    balance_emitters(builder)
    return builder, builder.build()


def tracer_of(scene: Scene, *, max_depth: int = MAX_DEPTH, edited: Mapping[str, Editable] | None = None) -> Tracer:
    """Samples for pictures by whole paths; arguments as of `render_reference`."""
    builder, whole = built(scene, edited)
    return Tracer(whole, builder, path_tracer.AllLight(), max_depth=max_depth)


def traced(
    whole: Any,
    camera: Camera,
    width: int,
    height: int,
    spp: int,
    seed: int = 0,
    progress: Progress = silent,
    *,
    max_depth: int = MAX_DEPTH,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """`render_reference` for a scene from `built`."""
    per_pass = max(1, min(spp, PATHS_AT_ONCE // (width * height)))
    passes = -(-spp // per_pass)
    total, squares = np.zeros((2, width * height, 3))
    for k in range(passes):
        sums = _pass(whole, camera, (width, height), per_pass, seed_of(seed, "reference", k), max_depth)
        total, squares = total + sums[0], squares + sums[1]
        progress(k + 1, passes, f"path tracing {camera.name}")
    samples = passes * per_pass
    mean = total / samples
    variance = np.maximum(squares / samples - mean**2, 0) / max(1, samples - 1)
    shape = (height, width, 3)
    return mean.reshape(shape).astype(np.float32), variance.reshape(shape).astype(np.float32)


def _pass(scene: object, camera: Camera, size: tuple[int, int], samples: int, seed: int, max_depth: int) -> Floats:
    """Sums and sums of squares (2, pixels, 3) over `samples` paths per pixel."""
    sampler = independent(seed, size[0] * size[1] * samples)
    ray = camera_rays(camera, size, samples, sampler)
    value = path_tracer.radiance(scene, sampler, path_tracer.camera_start(ray), max_depth)
    value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
    dr.eval(value)
    return np.stack([block_sums(v, samples) for v in (value, value * value)]).astype(float)
