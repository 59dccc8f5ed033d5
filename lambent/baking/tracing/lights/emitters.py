"""Sampling weights of emitters, by the light they bring to the scene's surfaces.

Mitsuba chooses emitters with equal probability, so that the sun of a room with ten lamps gets one sample in eleven. To
minimise variance, the probability p_i of emitter i must be proportional to the root mean square of its contribution
when chosen; a short pre-pass measures that, shadows included.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.sky.guide import guided_sky, learn
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.rays import array_of, independent, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals
from lambent.core.light.colour import luminance
from lambent.scenes.scene import Scene

POINTS, SAMPLES = 8192, 16
FLOOR = 1.0  # of the mean weight, added to each: half of all samples are uniform, for dim lamps that are near


def balance_emitters(builder: SceneBuilder, effort: float = 1.0) -> None:
    """Set the sampling weights of a builder's emitters, for all scenes it builds from now on. Deterministic.

    The environment is guided first (`sky.guide.learn`, with this effort), because its contribution depends on its
    sampling.
    """
    if builder.environment is not None:
        whole = builder.build()
        guide = learn(builder.scene, whole, builder.environment, effort=effort)
        if guide is not None:
            builder.environment = guided_sky(builder.environment, guide, whole.bbox())
    emitters = builder.emitters()
    if len(emitters) < 2:
        return
    brought, chosen = _brought(builder.scene, scene := builder.build(), scene)
    numbers = [int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0]) for emitter in emitters]
    squares = np.bincount(chosen, brought**2, minlength=max(numbers) + 1)[numbers]
    counts = np.bincount(chosen, minlength=max(numbers) + 1)[numbers]
    weight = np.sqrt(squares / np.maximum(counts, 1))
    if weight.any():
        builder.weigh_emitters(weight / weight.mean() + FLOOR)


def brought_by(emitter: Any, scene: Scene, whole: Any) -> float:
    """Root mean square of the light that samples of one mi.Emitter bring to a scene's surfaces in `whole`."""
    alone = mi.load_dict({"type": "scene", "emitter": emitter}, optimize=False)
    emitter.set_scene(whole)
    return float(np.sqrt(np.mean(_brought(scene, whole, alone)[0] ** 2)))


def _brought(scene: Scene, whole: Any, lights: Any) -> tuple[Floats, Indices]:
    """Light brought by samples of the emitters of the mi.Scene `lights`, and Mitsuba's emitter numbers."""
    position, normal = _points_and_normals(scene, POINTS)
    width = POINTS * SAMPLES
    sampler = independent(0, width)
    at = dr.arange(mi.UInt32, width) // SAMPLES
    si = dr.zeros(mi.SurfaceInteraction3f, width)
    si.p = dr.gather(mi.Point3f, vectors(mi.Point3f, position), at)
    si.n = mi.Normal3f(dr.gather(mi.Vector3f, vectors(mi.Vector3f, normal), at))
    holes = rays.has_holes(whole)
    ds, value = path_tracer.sample_emitter(whole, lights, si, sampler.next_2d(), mi.Bool(True), holes)
    value *= dr.maximum(dr.dot(ds.d, si.n), 0.0)
    brought = luminance(np.nan_to_num(array_of(value), posinf=0.0))
    return brought, np.array(dr.reinterpret_array(mi.UInt32, ds.emitter))


def _points_and_normals(scene: Scene, count: int) -> tuple[Floats, Floats]:
    """Points (count, 3) and normals, distributed over all surfaces like the light map's texels."""
    rng = np.random.default_rng(0)
    corners = scene.corners
    scale = np.concatenate([np.full(len(o.mesh.faces), o.light_map_scale) for o in scene.objects])
    area = triangle_areas(corners) * scale**2
    face = rng.choice(len(area), size=count, p=area / area.sum())
    return points_on_triangles(corners, face, rng), triangle_normals(corners[face])


def number_of(emitter: Any) -> int:
    """The number of a mi.Emitter among all, as of mi.EmitterPtr on the device."""
    return int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0])
