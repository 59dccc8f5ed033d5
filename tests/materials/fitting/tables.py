"""Tables synthesised from known materials, the way a gonio-photometer would measure them."""

from __future__ import annotations

import numpy as np

from lambent.core.frames import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect

ALANOD = Material(kd=0.003, lobes=(Lobe(k=0.9, mx=0.11, my=0.072, r0=0.89, alpha=0.43),))
FOIL = Material(
    kd=0.76,
    lobes=(
        Lobe(k=0.78, mx=0.124, my=0.136, r0=0.029, alpha=0.5),
        Lobe(side="transmission", k=0.67, mx=0.25, my=0.17, r0=0.75, alpha=0.6),
    ),
)
ANISOTROPIC = np.meshgrid([0.0, 5, 20, 35, 50, 65], np.arange(0.0, 91, 15), indexing="ij")
ISOTROPIC = (np.array([0.0, 5, 19, 33, 47, 61, 75]), np.zeros(7))


def measured(
    material: Material,
    incident: tuple[np.ndarray, np.ndarray] = ANISOTROPIC,
    *,
    noise: float = 0.02,
    step_deg: float = 3.0,
    isotropic: bool = False,
    grey: bool = True,
    seed: int = 1,
) -> MeasuredSamples:
    """The material over the thesis's incident directions and an even grid of outgoing ones, with relative noise and
    the cone around the source shadowed by the device."""
    wi = direction(np.radians(incident[0]).ravel(), np.radians(incident[1]).ravel())
    top = 180.0 if material.transmits else 90.0
    theta, phi = np.meshgrid(np.arange(step_deg / 2, top, step_deg), np.arange(0.0, 360, step_deg), indexing="ij")
    wo = direction(np.radians(theta).ravel(), np.radians(phi).ravel())
    wi, wo = np.repeat(wi, len(wo), axis=0), np.tile(wo, (len(wi), 1))
    f = MaterialBSDF(material).eval(wi, wo)[:, : 1 if grey else 3]
    f = f * (1 + noise * np.random.default_rng(seed).standard_normal(f.shape))
    shadowed = np.sum(wi * wo, axis=1) > np.cos(np.radians(8.0))
    info = TableInfo("synthetic", "synthetic", isotropic, material.transmits, f.shape[1], "f")
    return collect(wi, wo, f, np.sqrt(1 - wo[:, 2] ** 2), info, shadowed)
