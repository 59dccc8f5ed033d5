"""The thesis's fitted materials (tables 3.1 and 3.2), and simulated measurements of them.

Their tables have the thesis's incident grids, 2 % sensor noise and a sector hidden by the lamp's arm. A fit's
parameters can be compared with the true ones.
"""

from __future__ import annotations

from dataclasses import replace

from lambent.materials.document import Lobe, Material
from lambent.materials.measured.inspecting.synthetic import ANISOTROPIC, Setup

NARROW = 0.02  # roughness below which outgoing directions must be denser than usual
NARROW_STEP_DEG = 0.25


def _reflection(k: float, mx: float, my: float, r0: float, alpha: float) -> Lobe:
    return Lobe(k=(k,) * 3, mx=mx, my=my, r0=(r0,) * 3, alpha=alpha)


_MATERIALS = (
    Material(name="alanod", kd=(0.003,) * 3, lobes=(_reflection(0.9, 0.11, 0.072, 0.89, 0.43),)),
    Material(
        name="alanod, two lobes",
        kd=(0.003,) * 3,
        lobes=(_reflection(0.9, 0.11, 0.07, 0.87, 0.45), _reflection(0.12, 0.25, 0.17, 0.89, 0.6)),
    ),
    Material(
        name="white foil",
        kd=(0.76,) * 3,
        lobes=(
            _reflection(0.78, 0.124, 0.136, 0.029, 0.5),
            _reflection(0.67, 0.25, 0.17, 0.75, 0.6).model_copy(update={"side": "transmission"}),
        ),
    ),
    Material(name="miro 5", kd=(0.003,) * 3, lobes=(_reflection(0.98, 0.0068, 0.0297, 0.84, 0.49),)),
    Material(
        name="miro 5, two lobes",
        kd=(0.003,) * 3,
        lobes=(_reflection(0.57, 0.0046, 0.0267, 0.94, 0.5), _reflection(0.54, 0.013, 0.1199, 0.84, 0.38)),
    ),
)
KNOWN = {material.name: material for material in _MATERIALS}


def setup_of(material: Material) -> Setup:
    """The device for a material: the thesis's anisotropic grid, with dense directions around narrow lobes."""
    narrow = min(min(lobe.mx, lobe.my) for lobe in material.lobes) < NARROW
    return replace(ANISOTROPIC, fine_deg=NARROW_STEP_DEG) if narrow else ANISOTROPIC
