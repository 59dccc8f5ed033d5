"""What the texels of a light map send: the light of a former map, or direct light by few shadow rays."""

from __future__ import annotations

from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.surfaces.texels import POINTS, Sides
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.lights.lit_texels import SentLight
from lambent.baking.tracing.lights.sun import SunRays
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance


def sent_light(
    traced: TracedScene, sides: Sequence[Sides], maps: Sequence[Floats | None], *, whole: bool, diffuse: bool
) -> SentLight | None:
    """What texels send, by `maps` (H, W, 3) or (n, H, W, 3) of the `sides`, added up and broadcast; None in the dark.

    They lack the sun and, unless they are of the `whole` light, direct light of emitters other than lamps. `diffuse`
    is as in `TracedScene.whole`.
    """
    texels, scene = traced.texels, traced.whole(diffuse=diffuse)
    sun = None if traced.sun is None else SunRays(traced.sun, scene)
    unseen = None if whole else traced.unseen(diffuse=diffuse)
    light = np.zeros(len(texels.index))
    for side, irradiance in zip(sides, maps, strict=True):
        assert irradiance is not None, "each side has one"
        total = irradiance.reshape(-1, *irradiance.shape[-3:]).sum(axis=0, dtype=float)
        light += luminance(np.broadcast_to(total, (texels.height, texels.width, 3)).reshape(-1, 3)[texels.index])
        valid = side.valid.reshape(-1)
        if not valid.any():
            continue
        surface = zip((texels.positions, texels.normals, texels.flat), (1, side.sign, side.sign), strict=True)
        at = path_tracer.Points(*(rays.vectors(mi.Vector3f, v.reshape(-1, 3)[valid] * sign) for v, sign in surface))
        found = mi.Color3f(0.0) if sun is None else sun.on(at.position, at.normal, at.flat, mi.Bool(True))
        if not whole:
            found = found + path_tracer.direct(scene, at, rays.independent(0, dr.width(at.position)), unseen)
        by_point = np.zeros(len(valid))
        by_point[valid] = luminance(np.broadcast_to(rays.array_of(found), (valid.sum(), 3)))
        light += by_point.reshape(-1, POINTS).mean(axis=1)
    return SentLight.of(texels, traced.merged, light * _colours(traced)[texels.face[:, 0]])


def _colours(traced: TracedScene) -> Floats:
    """(T,) share of diffuse light that faces send on, of those with one; textures, which lower it, are left out."""
    materials, objects = traced.scene.materials, traced.scene.objects
    known = {name: float(luminance(np.add(one.kd, one.kt_d))) for name, one in materials.items()}
    return np.repeat([known.get(o.material, 1.0) for o in objects], [len(o.mesh.faces) for o in objects])
