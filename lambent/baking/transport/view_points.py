"""The surface points that the pixels of a view show: positions, shading frames, and the viewer's directions."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.bsdfs.material_plugin import (
    DIFFUSE_ATTRIBUTE,
    NORMAL_ATTRIBUTE,
    ROUGHNESS_ATTRIBUTE,
    SHEET_ATTRIBUTE,
    SPECULAR_ATTRIBUTE,
    TANGENT_ATTRIBUTE,
)  # fmt: skip
from lambent.baking.tracing.rays import array_of, has_holes, intersect, rays_from
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.views.camera import Camera, pixel_rays

Floats32 = NDArray[np.float32]


@dataclass(frozen=True)
class ViewPoints:
    """The surface points at P pixels of a view; float32.

    Attributes
    ----------
    pixel, object : (P,) int
        row * width + column, and the number of the object in the scene.
    p, flat : (P, 3)
        Position and geometric normal, world space.
    t, b, n : (P, 3)
        Shading frame in world space, oriented to have the viewer above.
    wo : (P, 3)
        Direction to the viewer in that frame.
    diffuse, specular : (P, 3)
        Textures' factors on diffuse and specular terms.
    roughness : (P,)
        Texture's factor on the slopes of highlights.
    sheet : (P, 3)
        Normal of the mesh, world space, on the viewer's side, if a normal map bends the frame: light must be on the
        same side of both. Otherwise 0.
    """

    pixel: NDArray[np.int64]
    object: NDArray[np.int64]
    p: Floats32
    flat: Floats32
    t: Floats32
    b: Floats32
    n: Floats32
    wo: Floats32
    diffuse: Floats32
    specular: Floats32
    roughness: Floats32
    sheet: Floats32

    def __len__(self) -> int:
        return len(self.pixel)

    def where(self, chosen: NDArray[np.bool_ | np.integer] | slice) -> ViewPoints:
        """Select points by a mask, by indices or by a slice."""
        return replace(self, **{name: getattr(self, name)[chosen] for name in self.__dataclass_fields__})


def view_points(builder: SceneBuilder, scene: Any, camera: Camera, width: int, height: int) -> ViewPoints:
    """The points at the pixels' centres; pixels without a surface have none."""
    origin = np.asarray(camera.position, float)
    ray = rays_from(origin, pixel_rays(camera, width, height).reshape(-1, 3))
    si = intersect(scene, ray, mi.Bool(True), has_holes(scene))
    hit = si.is_valid()
    bsdf = si.bsdf()
    n = bsdf.eval_attribute_3(NORMAL_ATTRIBUTE, si, hit)
    t = bsdf.eval_attribute_3(TANGENT_ATTRIBUTE, si, hit)
    n, t = mi.Vector3f(n.x, n.y, n.z), mi.Vector3f(t.x, t.y, t.z)
    to_viewer = -ray.d
    below = dr.dot(n, to_viewer) < 0
    n = dr.select(below, -n, n)
    t = dr.normalize(t - n * dr.dot(n, t))
    b = dr.cross(n, t)
    wo = mi.Vector3f(dr.dot(to_viewer, t), dr.dot(to_viewer, b), dr.dot(to_viewer, n))
    number = builder.numbers.at(si, hit)
    names = (DIFFUSE_ATTRIBUTE, SPECULAR_ATTRIBUTE, ROUGHNESS_ATTRIBUTE, SHEET_ATTRIBUTE)
    *textures, rough, sheet = (bsdf.eval_attribute_3(name, si, hit) for name in names)
    sheet = dr.select(below, -sheet, sheet)
    arrays = [array_of(v) for v in (si.p, si.n, t, b, n, wo, *textures, rough, sheet)]
    arrays[-2] = arrays[-2][:, 0]
    shown = np.flatnonzero(np.array(hit))
    objects = np.array(number)[shown].astype(np.int64)
    return ViewPoints(shown, objects, *(a[shown] for a in arrays))
