"""The texels of the light map as senders and receivers of light: their surface, material and light, on both sides."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.rays import MOST_POINTS
from lambent.baking.running.tiles import slices
from lambent.baking.surfaces.texels import POINTS
from lambent.baking.tracing.lights.sun import SunRays
from lambent.baking.tracing.rays import array_of, vectors
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import luminance
from lambent.scenes.scene import Scene

AT_ONCE = 1 << 19  # texels
LEAST = 0.02  # of the albedo that light within a patch is compared by: black surfaces may get a colour


@dataclass(frozen=True, eq=False)
class Spots:
    """The K texels of `Texels`, in their order.

    Attributes
    ----------
    lit : (2, K) bool
        Whether light was sampled there, on the normal's side and on the other.
    there : (2, K) bool
        Whether there is a light map.
    irradiance, direct : (G, 2, K, 3) float32
        All light and direct light by group, W/m^2, the sun's included in both.
    sun : (2, K, 3) float32
        Direct irradiance of the sun, W/m^2.
    area : (K,) m^2, about.
    object, material, chart : (K,) integers; charts are no more than points have names (`in_few_charts`).
    position, normal : (K, 3)
    index : (K,) row * width + column
    """

    lit: Flags
    there: Flags
    irradiance: NDArray[np.float32]
    direct: NDArray[np.float32]
    sun: NDArray[np.float32]
    area: Floats
    object: Indices
    material: Indices
    chart: Indices
    position: Floats
    normal: Floats
    index: Indices

    @property
    def light(self) -> NDArray[np.float32]:
        """(2, K, 3) irradiance by all groups."""
        return np.asarray(self.irradiance.sum(axis=0))

    def exitance(self, scene: Scene) -> Floats:
        """(G, 2, K) luminance of what each side sends out by each group, but for its texture.

        Texels of a patch are weighed by it.
        """
        materials = list(scene.materials.values())
        reflected = np.array([float(luminance(np.array(m.kd))) for m in materials])[self.material] + LEAST
        transmitted = np.array([float(luminance(np.array(m.kt_d))) for m in materials])[self.material]
        light = luminance(self.irradiance)
        return np.asarray(reflected * light + transmitted * light[:, ::-1])


def spots_of(traced: TracedScene, maps: list[Floats], directs: list[Floats], of_sun: int | None) -> Spots:
    """Spots of a light map and of its direct light.

    Parameters
    ----------
    maps, directs
        By side, one or both: all light and direct light (G, H, W, 3) by group.
    of_sun : int, optional
        The sun's group; None where there is no sun.
    """
    texels, scene = traced.texels, traced.scene
    counts = [len(o.mesh.faces) for o in scene.objects]
    object_of = np.repeat(np.arange(len(counts)), counts)[texels.face[:, 0]]
    names = list(scene.materials)
    material = np.array([names.index(o.material) for o in scene.objects])[object_of]
    count = len(texels.index)
    lit, there = np.zeros((2, count), bool), np.zeros((2, count), bool)
    light, direct = np.zeros((2, len(directs[0]), 2, count, 3), np.float32)
    sun = sun_at(traced)
    for side, (of_map, of_direct) in enumerate(zip(maps, directs, strict=True)):
        lit[side] = traced.in_view((1.0, -1.0)[side])[0].valid.any(axis=1)
        there[side] = np.ones(count, bool) if side == 0 else traced.crossed[texels.face[:, 0]]
        light[:, side] = of_map.reshape(len(of_map), -1, 3)[:, texels.index]
        direct[:, side] = of_direct.reshape(len(of_direct), -1, 3)[:, texels.index]
    if of_sun is not None:
        light[of_sun] += sun
        direct[of_sun] += sun
    light *= there[..., None]
    direct *= there[..., None]
    found = Spots(
        lit & there, there, light, direct, sun * there[..., None],
        texels.spacing.astype(float) ** 2, object_of, material,
        traced.labels.reshape(-1)[texels.index], texels.positions.mean(axis=1).astype(float),
        normalize(texels.normals.mean(axis=1).astype(float)), texels.index,
    )  # fmt: skip
    return in_few_charts(found)


def in_few_charts(spots: Spots) -> Spots:
    """Spots of which each chart can have a point: in place of too many charts come the objects, or one for all."""
    for chart in (spots.chart, spots.object, np.zeros_like(spots.object)):
        if sum(len(np.unique(chart[lit])) for lit in spots.lit) <= MOST_POINTS:
            break
    return replace(spots, chart=chart)


def sun_at(traced: TracedScene) -> NDArray[np.float32]:
    """(2, K, 3) direct irradiance of the sun at the texels, on both sides: means over their points."""
    texels = traced.texels
    found = np.zeros((2, len(texels.index), 3), np.float32)
    if traced.sun is None:
        return found
    sun = SunRays(traced.sun, traced.whole(diffuse=False))
    for part in slices(len(texels.index), AT_ONCE):
        light = array_of(sun(_interactions(texels, part), mi.Bool(True))).reshape(-1, POINTS, 3)
        found[0, part], found[1, part] = np.maximum(light, 0).mean(axis=1), np.maximum(-light, 0).mean(axis=1)
    return found


def _interactions(texels: Any, part: slice) -> Any:
    """Surface interactions at the points of some texels, as far as the sun asks for them."""
    p = vectors(mi.Point3f, texels.positions[part])
    si = dr.zeros(mi.SurfaceInteraction3f, dr.width(p))
    si.p, si.n = p, vectors(mi.Normal3f, texels.flat[part])
    si.sh_frame = mi.Frame3f(vectors(mi.Normal3f, texels.normals[part]))
    return si
