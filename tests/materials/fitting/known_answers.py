"""The thesis's fitted materials (tables 3.1 and 3.2), measured again in software, in grey."""

from __future__ import annotations

from dataclasses import replace

from lambent.bench.fit import ALANOD, FOIL
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.measured.synthetic import ANISOTROPIC, ISOTROPIC, Setup, synthesise

__all__ = ["ALANOD", "ANISOTROPIC", "FEW", "FOIL", "ISOTROPIC", "PAINT", "grey"]
PAINT = Material(name="paint", kd=0.2, lobes=(Lobe(k=0.7, mx=0.15, my=0.15, r0=0.06, alpha=0.3),))
FEW = replace(ISOTROPIC, step_deg=6.0, fine_deg=3.0)


def grey(material: Material, setup: Setup = ANISOTROPIC) -> MeasuredSamples:
    """Tuples of the synthesised table, first channel alone."""
    samples = synthesise(material, setup).samples()
    return replace(samples, f=samples.f[:, :1], info=replace(samples.info, channels=1))
