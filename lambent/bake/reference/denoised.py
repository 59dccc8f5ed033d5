"""Direct light path traced and denoised: the other way to see an edit soon."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE, NORMAL_ATTRIBUTE, SPECULAR_ATTRIBUTE
from lambent.bake.light.denoise import denoise_image
from lambent.bake.reference.path_traced import built, camera_rays, traced
from lambent.bake.tracing.rays import block_sums, has_holes, independent, intersect
from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.materials.document import Material
from lambent.scenes.scene import Scene

GUIDING = 16  # samples a pixel of albedo and normals


class DirectLight:
    """Direct light of a scene in one view by path tracing; the scene is built once."""

    def __init__(self, scene: Scene, camera: Camera, width: int, height: int) -> None:
        self._builder, self._scene = built(scene)
        self._camera, self._size = camera, (width, height)
        worn = [scene.materials[o.material] for o in scene.objects]
        self._diffuse = mi.Color3f(np.array([np.broadcast_to(m.kd, 3) for m in worn], np.float32).T)
        self._specular = mi.Color3f(np.array([_specular(m) for m in worn], np.float32).T)

    def image(self, spp: int, seed: int = 0) -> NDArray[np.float32]:
        """(H, W, 3) radiance of `spp` samples a pixel, at least 2; pixels filtered by a box."""
        image, _ = traced(self._scene, self._camera, *self._size, spp, seed, max_depth=1)
        return image

    def denoised(self, spp: int, seed: int = 0) -> Floats:
        """`image`, denoised by Open Image Denoise with albedo and normals."""
        return denoise_image(self.image(spp, seed), *self._guides(min(spp, GUIDING), seed))

    def _guides(self, samples: int, seed: int) -> tuple[Floats, Floats]:
        """Albedo and normals (H, W, 3); 0 where no surface is."""
        sampler = independent(seed, self._size[0] * self._size[1] * samples)
        ray = camera_rays(self._camera, self._size, samples, sampler)
        si = intersect(self._scene, ray, mi.Bool(True), has_holes(self._scene))
        hit, bsdf = si.is_valid(), si.bsdf()
        number = dr.gather(mi.UInt32, self._builder.object_numbers(), dr.reinterpret_array(mi.UInt32, si.shape), hit)
        albedo = mi.Color3f(0.0)
        for values, texture in ((self._diffuse, DIFFUSE_ATTRIBUTE), (self._specular, SPECULAR_ATTRIBUTE)):
            albedo += dr.gather(mi.Color3f, values, number, hit) * bsdf.eval_attribute_3(texture, si, hit)
        normal = bsdf.eval_attribute_3(NORMAL_ATTRIBUTE, si, hit)
        shape = (self._size[1], self._size[0], 3)
        sums = (block_sums(dr.select(hit, v, 0.0), samples) for v in (dr.clip(albedo, 0, 1), normal))
        means = [(s / samples).reshape(shape) for s in sums]
        return means[0], means[1]


def _specular(material: Material) -> Floats:
    """(3,) what lobes reflect of light from straight above, about."""
    return np.asarray(sum((np.multiply(lobe.k, lobe.r0) for lobe in material.lobes), np.zeros(3)))
