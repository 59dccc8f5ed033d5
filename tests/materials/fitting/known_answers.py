"""Materials with synthesised tables, whose fit is therefore known: the thesis's, and small grey ones."""

from __future__ import annotations

from dataclasses import replace

from lambent.bench.scenes.known_answers import KNOWN, setup_of
from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, ISOTROPIC, Setup, synthesise
from lambent.materials.measured.protocol import MeasuredSamples

__all__ = ["ANISOTROPIC", "FEW", "FOIL", "ISOTROPIC", "KNOWN", "PAINT", "TWO_LOBES", "grey", "setup_of"]
FOIL = KNOWN["white foil"]
PAINT = Material(name="paint", kd=0.2, lobes=(Lobe(k=0.7, mx=0.15, my=0.15, r0=0.06, alpha=0.3),))
_SHARP = PAINT.lobes[0].model_copy(update={"mx": 0.04, "my": 0.04, "k": (0.3,) * 3})
TWO_LOBES = PAINT.model_copy(update={"lobes": (PAINT.lobes[0], _SHARP)})
FEW = replace(ISOTROPIC, step_deg=6.0, fine_deg=3.0)


def grey(material: Material, setup: Setup = ANISOTROPIC) -> MeasuredSamples:
    """Tuples of the synthesised table, first channel alone."""
    samples = synthesise(material, setup).samples()
    return replace(samples, f=samples.f[:, :1], info=replace(samples.info, channels=1))
