"""A material on the GPU: its numbers, its lobes, the tables of samples of an integrator, and its textures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.materials import shader_layout
from lambent.materials.document import Lobe, Material
from lambent.materials.slope_curve import curve_rows
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.structs import MATERIAL_DTYPE, PLACED_LOBE_DTYPE, Record
from lambent.realtime.integrators.albedo import roughness_level
from lambent.realtime.integrators.integrators import Integrator
from lambent.realtime.integrators.patterns import border
from lambent.realtime.materials.textures import BoundTextures

KEPT = 16  # bind groups per material: shading, planar reflections, mirrored views, each for some integrators and n


class MaterialBuffers:
    """Bind groups of one material of a scene: an immutable one for each document, integrator and n."""

    def __init__(self, layouts: Layouts, sampler: Any, textures: BoundTextures) -> None:
        self._layouts = layouts
        self.textures = textures
        self._bound = (sampler, *(texture.view for texture in textures.textures))
        self._made: list[tuple[tuple[Material, Integrator, int], Any]] = []  # most recently used first

    def group(self, material: Material, how: Integrator, n: int) -> Any:
        """Group 1 of `material` for an integrator of n samples per lobe."""
        key = (material, how, n)
        found = next((made for made in self._made if made[0] == key), None) or (key, self._new(material, how, n))
        self._made = [found, *(made for made in self._made if made is not found)][:KEPT]
        return found[1]

    def _new(self, material: Material, how: Integrator, n: int) -> Any:
        lobes = material.lobes if how.specular else ()
        samples, (curves, of_lobes, of_kd) = sample_data(lobes, how, n), curve_rows(material)
        first = len(samples)
        rows = [(shape + first, fresnel + first if fresnel >= 0 else 0) for shape, fresnel in of_lobes]
        numbers = material_data(material, self.textures)
        numbers["kt_d"][0, 3] = of_kd + first if of_kd >= 0 else 0
        tables = lobe_data(lobes, rows[: len(lobes)]), np.concatenate([samples, curves]).astype(np.float32)
        buffers = (self._layouts.buffer("STORAGE", data) for data in tables)
        return self._layouts.group(
            self._layouts.material, self._layouts.buffer("UNIFORM", numbers), *buffers, *self._bound
        )


def material_data(material: Material, textures: BoundTextures) -> Record:
    """Record of MATERIAL_DTYPE."""
    data = np.zeros(1, MATERIAL_DTYPE)
    data["kd"][0], data["kt_d"][0, :3] = (*material.kd, material.kd_coupled), material.kt_d
    data["diffuse_scale"][0] = (*textures.scale("diffuse"), textures.cutoff)
    data["specular_scale"][0, :3] = textures.scale("specular")
    data["lie"][0] = textures.lie
    return data


def lobe_data(lobes: tuple[Lobe, ...], rows: Sequence[tuple[int, int]]) -> Record:
    """(max(1, L),) records of PLACED_LOBE_DTYPE; storage buffers cannot be empty. `rows` as for `packed_lobes`."""
    data = np.zeros(max(1, len(lobes)), PLACED_LOBE_DTYPE)
    if lobes:
        data["lobe"] = shader_layout.packed_lobes(lobes, rows)
        data["border"] = [border(lobe) for lobe in lobes]
        data["level"] = [roughness_level(lobe) for lobe in lobes]
    return data


def sample_data(lobes: tuple[Lobe, ...], how: Integrator, n: int) -> NDArray[np.float32]:
    """(L rows, 4) float32: the integrator's tables of all lobes in order."""
    if not lobes:
        return np.zeros((1, 4), np.float32)
    return np.concatenate([how.table(lobe, n) for lobe in lobes]).astype(np.float32)
