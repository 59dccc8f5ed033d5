"""Retro-reflective tapes and their simulated measurement: a peak about the light, for every direction of the light.

They are defined by angles on the sphere, not by our lobe: exp(-(d / width)^2) of the angle d between light and viewer,
reduced towards grazing by a power of both cosines, on a diffuse base, below a weak varnish.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.geometry.directions import Floats
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import Setup, record
from lambent.materials.measured.tables.gonio import GonioTable

_VARNISH = Lobe(mx=0.08, my=0.08)


@dataclass(frozen=True)
class Tape:
    """A tape; `share` is the fraction of light along the normal that the peak returns, `width_deg` its half-width.

    At that angle from the light the peak has fallen to 1/e. `falloff` is the power of cos_i cos_o; `varnish` scales the
    mirror-like lobe.
    """

    name: str
    width_deg: float
    share: float
    falloff: float
    kd: float
    varnish: float = 1.0

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 1) in 1/sr, without the cosine; reciprocal."""
        width = np.radians(self.width_deg)
        apart = 2 * np.arcsin((np.linalg.norm(wi - wo, axis=-1) / 2).clip(0, 1))
        cosines = np.abs(wi[..., 2] * wo[..., 2])
        peak = self.share / (np.pi * width**2) * cosines**self.falloff * np.exp(-((apart / width) ** 2))
        base = Material(kd=(self.kd,) * 3, lobes=(_VARNISH.model_copy(update={"k": (self.varnish,) * 3}),))
        return np.asarray(peak[..., None] + MaterialBSDF(base).eval(wi, wo)[..., :1])

    def measured(self, step_deg: float = 5.0) -> GonioTable:
        """The tape's table: nine incident directions, noise of 2 %, dense readings about light and mirror direction."""
        fine = min(max(self.width_deg / 5, 0.1), 1.0)
        setup = Setup(
            (0, 5, 10, 20, 30, 40, 50, 60, 70), step_deg=step_deg, fine_deg=fine,
            fine_reach_deg=max(4 * self.width_deg, 2.0), sector_deg=0.0, about_lamp=True,
        )  # fmt: skip
        return record(self.eval, self.name, setup)


TAPES = (
    Tape("retro tape, prisms", width_deg=0.5, share=0.4, falloff=2.0, kd=0.1),
    Tape("retro tape, beads", width_deg=2.5, share=0.25, falloff=1.0, kd=0.25),
    Tape("retro paint, no varnish", width_deg=8.0, share=0.2, falloff=0.5, kd=0.4, varnish=0.0),
)
