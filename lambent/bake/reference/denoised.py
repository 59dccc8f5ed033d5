"""A view path traced and denoised: the alternative way to show an edit early."""

from __future__ import annotations

from collections.abc import Mapping

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.bsdfs.material_plugin import DIFFUSE_ATTRIBUTE, NORMAL_ATTRIBUTE, SPECULAR_ATTRIBUTE
from lambent.bake.light.denoise import denoise_image
from lambent.bake.reference.path_traced import MAX_DEPTH, built, camera_rays, traced
from lambent.bake.tracing.rays import block_sums, has_holes, independent, intersect
from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.materials.document import Material
from lambent.materials.factored.albedo import term_albedo
from lambent.materials.factored.terms import Editable
from lambent.scenes.scene import Scene

GUIDING = 16  # samples per pixel of albedo and normals


class DenoisedView:
    """One view of a scene by path tracing; the scene is built once.

    Parameters
    ----------
    max_depth
        Surfaces on the longest path; 1 is direct light alone.
    edited
        By material name, terms and curves that replace those of documents.
    """

    def __init__(
        self,
        scene: Scene,
        camera: Camera,
        width: int,
        height: int,
        *,
        max_depth: int = MAX_DEPTH,
        edited: Mapping[str, Editable] | None = None,
    ) -> None:
        self._builder, self._scene = built(scene, edited)
        self._camera, self._size, self._max_depth = camera, (width, height), max_depth
        looks = {name: _look(material, (edited or {}).get(name)) for name, material in scene.materials.items()}
        worn = np.array([looks[o.material] for o in scene.objects], np.float32)
        self._diffuse, self._specular = (mi.Color3f(np.ascontiguousarray(column.T)) for column in worn.swapaxes(0, 1))

    def image(self, spp: int, seed: int = 0) -> NDArray[np.float32]:
        """(H, W, 3) radiance with `spp` samples per pixel, at least 2; box filter."""
        image, _ = traced(self._scene, self._camera, *self._size, spp, seed, max_depth=self._max_depth)
        return image

    def denoised(self, spp: int, seed: int = 0) -> Floats:
        """`image`, denoised by Open Image Denoise with albedo and normals."""
        return denoise_image(self.image(spp, seed), *self._guides(min(spp, GUIDING), seed))

    def _guides(self, samples: int, seed: int) -> tuple[Floats, Floats]:
        """Albedo and normals (H, W, 3); 0 without a surface."""
        sampler = independent(seed, self._size[0] * self._size[1] * samples)
        ray = camera_rays(self._camera, self._size, samples, sampler)
        si = intersect(self._scene, ray, mi.Bool(True), has_holes(self._scene))
        hit, bsdf = si.is_valid(), si.bsdf()
        number = self._builder.numbers.at(si, hit)
        albedo = mi.Color3f(0.0)
        for values, texture in ((self._diffuse, DIFFUSE_ATTRIBUTE), (self._specular, SPECULAR_ATTRIBUTE)):
            albedo += dr.gather(mi.Color3f, values, number, hit) * bsdf.eval_attribute_3(texture, si, hit)
        normal = bsdf.eval_attribute_3(NORMAL_ATTRIBUTE, si, hit)
        shape = (self._size[1], self._size[0], 3)
        sums = (block_sums(dr.select(hit, v, 0.0), samples) for v in (dr.clip(albedo, 0, 1), normal))
        means = [(s / samples).reshape(shape) for s in sums]
        return means[0], means[1]


def _look(material: Material, edited: Editable | None) -> Floats:
    """(2, 3) approximate reflectance of the diffuse term and of all others; for lobes, at normal incidence."""
    if edited is None:
        specular = sum((np.multiply(lobe.k, lobe.r0) for lobe in material.lobes), np.zeros(3))
        return np.stack([np.broadcast_to(material.kd, 3), specular])
    found = np.zeros((2, 3))
    for term in edited.terms:
        found[0 if term.is_diffuse else 1] += term_albedo(term, edited.curves)
    return found
