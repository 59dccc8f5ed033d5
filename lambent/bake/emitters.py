"""How often each emitter is sampled: in proportion to what it brings to the surfaces of the scene.

Mitsuba chooses emitters with equal probability, so that the sun of a room with ten lamps gets one sample in eleven.
The variance of choosing emitter i with probability p_i is least for p_i in proportion to the root of the mean square
of what it brings when chosen; a short pilot run measures that, shadows included.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.mitsuba_scene import SceneBuilder
from lambent.bake.surface_points import face_areas, points_in
from lambent.bake.vectors import array_of, vectors
from lambent.core.colour import luminance
from lambent.scenes.scene import Scene

Array = NDArray[np.floating]
POINTS, SAMPLES = 8192, 16
FLOOR = 0.1  # of the mean weight: no emitter is left out, what the pilot did not find is still there


def balance_emitters(builder: SceneBuilder) -> None:
    """Set the sampling weights of a builder's emitters, for the scenes it builds from now on. Deterministic.

    The environment is guided first (`sky_guide`): what it brings then depends on how it is sampled.
    """
    builder.guide_sky()
    emitters = builder.emitters()
    if len(emitters) < 2:
        return
    position, normal = _surface_points(builder.scene, POINTS)
    scene = builder.build()
    width = POINTS * SAMPLES
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, width)
    at = dr.arange(mi.UInt32, width) // SAMPLES
    si = dr.zeros(mi.SurfaceInteraction3f, width)
    si.p = dr.gather(mi.Point3f, vectors(mi.Point3f, position), at)
    si.n = mi.Normal3f(dr.gather(mi.Vector3f, vectors(mi.Vector3f, normal), at))
    ds, value = paths.sample_emitter(scene, si, sampler.next_2d(), mi.Bool(True), paths.has_holes(scene))
    value *= dr.maximum(dr.dot(ds.d, si.n), 0.0)
    brought = luminance(np.nan_to_num(array_of(value), posinf=0.0))
    chosen = np.array(dr.reinterpret_array(mi.UInt32, ds.emitter))
    numbers = [int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0]) for emitter in emitters]
    squares = np.bincount(chosen, brought**2, minlength=max(numbers) + 1)[numbers]
    counts = np.bincount(chosen, minlength=max(numbers) + 1)[numbers]
    weight = np.sqrt(squares / np.maximum(counts, 1))
    if weight.any():
        builder.weigh_emitters(weight / weight.mean() + FLOOR)


def _surface_points(scene: Scene, count: int) -> tuple[Array, Array]:
    """Points (count, 3) and normals, spread over all surfaces as the light map's texels are."""
    rng = np.random.default_rng(0)
    corners = scene.corners
    scale = np.concatenate([np.full(len(o.mesh.faces), o.light_map_scale) for o in scene.objects])
    area = face_areas(corners) * scale**2
    return points_in(corners, rng.choice(len(area), size=count, p=area / area.sum()), rng)
