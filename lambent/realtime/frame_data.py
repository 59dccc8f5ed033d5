"""Layouts shared with the shaders, as numpy dtypes, and how materials and cameras are written into them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.materials import shader_layout
from lambent.materials.document import Lobe, Material
from lambent.realtime.integrators import Integrator
from lambent.realtime.patterns import border
from lambent.realtime.split_sum import roughness_level
from lambent.realtime.textures import PARTS, MaterialPictures

FRAME_DTYPE = np.dtype(  # Frame in shaders/frame.wgsl
    [
        ("clip_from_world", "f4", (4, 4)), ("eye", "f4", 4), ("across", "f4", 4), ("up", "f4", 4),
        ("forward", "f4", 4), ("show", "f4", 4), ("first_sample", "u4"), ("view_transform", "u4"),
        ("exposure", "f4"), ("prior", "f4"), ("scale", "f4", 4),
    ]
)  # fmt: skip
LOBE_DTYPE = np.dtype(  # PlacedLobe in shaders/surface.wgsl
    [("lobe", shader_layout.LOBE_DTYPE), ("border", "f4", 2), ("level", "f4"), ("unused", "f4")]
)
MATERIAL_DTYPE = np.dtype(  # Material in shaders/material.wgsl
    [
        ("kd", "f4", 4), ("kt_d", "f4", 4), ("diffuse_scale", "f4", 4), ("specular_scale", "f4", 4),
        ("lie", "f4", (2 * len(PARTS), 4)),
    ]
)  # fmt: skip
OBJECT_DTYPE = np.dtype([("centre", "f4", 4), ("emission", "f4", 4), ("irradiance", "f4", 12)])


def lobe_data(lobes: tuple[Lobe, ...]) -> NDArray[np.void]:
    """(max(1, L),) records of LOBE_DTYPE; storage buffers cannot be empty."""
    data = np.zeros(max(1, len(lobes)), LOBE_DTYPE)
    if lobes:
        data["lobe"] = shader_layout.packed_lobes(lobes)
        data["border"] = [border(lobe) for lobe in lobes]
        data["level"] = [roughness_level(lobe) for lobe in lobes]
    return data


def sample_data(lobes: tuple[Lobe, ...], how: Integrator, n: int) -> NDArray[np.float32]:
    """(L rows, 4) float32: the integrator's table of every lobe, one after the other."""
    if not lobes:
        return np.zeros((1, 4), np.float32)
    return np.concatenate([how.table(lobe, n) for lobe in lobes]).astype(np.float32)


def material_data(material: Material, pictures: MaterialPictures) -> NDArray[np.void]:
    data = np.zeros(1, MATERIAL_DTYPE)
    data["kd"][0], data["kt_d"][0, :3] = (*material.kd, material.kd_coupled), material.kt_d
    data["diffuse_scale"][0] = (*pictures.scale("diffuse"), pictures.cutoff)
    data["specular_scale"][0, :3] = pictures.scale("specular")
    data["lie"][0] = pictures.lie
    return data
