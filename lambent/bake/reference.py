"""Path traced pictures of a scene, with their variance: what the real-time pictures are measured against."""

from __future__ import annotations

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.emitters import balance_emitters
from lambent.bake.mitsuba_scene import SceneBuilder
from lambent.bake.work import seed_of
from lambent.core.camera import Camera, camera_axes
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Scene
from lambent.scenes.textures import prepared

PATHS_AT_ONCE = 1 << 20
MAX_DEPTH = 16


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
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Path trace what a pinhole camera sees, pixels filtered by a box.

    Parameters
    ----------
    spp : int
        Samples per pixel, at least 2; rounded up to whole passes.
    seed : int
        The same seed gives the same picture.

    Returns
    -------
    image, variance : (height, width, 3) float32
        Radiance in W/(sr m^2), row 0 on top; variance of each pixel's mean, in its square.
    """
    builder = SceneBuilder(replace(scene, textures=prepared(scene.textures)))
    balance_emitters(builder)
    whole = builder.build()
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


def _pass(
    scene: object, camera: Camera, size: tuple[int, int], samples: int, seed: int, max_depth: int
) -> NDArray[np.floating]:
    """Sums and sums of squares (2, pixels, 3) over `samples` paths per pixel."""
    width, height = size
    count = width * height * samples
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count)
    pixel = dr.arange(mi.UInt32, count) // samples
    jitter = sampler.next_2d()
    half_height = np.tan(np.radians(camera.fov_y_deg) / 2)
    x = ((pixel % width + jitter.x) / width * 2 - 1) * (half_height * width / height)
    y = (1 - (pixel // width + jitter.y) / height * 2) * half_height
    right, up, forward = (mi.Vector3f(*map(float, axis)) for axis in camera_axes(camera))
    origin = mi.Point3f(*map(float, camera.position)) + dr.zeros(mi.Point3f, count)
    ray = mi.Ray3f(origin, dr.normalize(right * x + up * y + forward))
    value = paths.radiance(scene, sampler, paths.camera_start(ray), max_depth)
    value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
    dr.eval(value)
    sums = [[np.array(dr.block_sum(c, samples)) for c in (v.x, v.y, v.z)] for v in (value, value * value)]
    return np.moveaxis(np.array(sums, dtype=float), 1, 2)
