"""Where a subject scatters light: a BSDF to draw directions from, and a test for light from behind."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Lobe, Material
from lambent.materials.export.contract import Subject
from lambent.materials.measured.tables.retro import retro

_WIDTHS = (0.004, 0.02, 0.08, 0.3)  # of the lobes of the proposal for a table
_MOST_TUPLES = 100_000  # tuples of a table used to detect retro-reflection
_ASKED_DEG, _TURN_DEG = (1.0, 20.0, 45.0, 70.0), 45.0  # theta, and steps of phi, at which light from behind is tested


def proposal_of(subject: Subject) -> MaterialBSDF:
    """A material itself; for a table, a material with lobes of every width that measured lobes can have.

    For a retro-reflective table, lobes about the light are added.
    """
    if isinstance(subject, Material):
        return MaterialBSDF(subject)
    white, part = (1.0, 1.0, 1.0), (1 / len(_WIDTHS),) * 3
    lobes = [Lobe(distribution="ggx", mx=m, my=m, r0=white, k=part) for m in _WIDTHS]
    if retro(subject, subject.samples(_MOST_TUPLES))[0] > 1:
        lobes += [lobe.of_kind("retro") for lobe in lobes]
    if subject.info.transmits:
        lobes += [lobe.model_copy(update={"side": "transmission", "r0": BLACK}) for lobe in lobes if lobe.mirrors]
    quarter = (0.25, 0.25, 0.25)
    return MaterialBSDF(Material(kd=quarter, kt_d=quarter if subject.info.transmits else BLACK, lobes=tuple(lobes)))


def knows_the_back(subject: Subject) -> bool:
    """Whether light from -z is scattered: as the table's `has_a_back` states, or as found at any of many directions.

    A material is equal from both sides.
    """
    if isinstance(subject, Material):
        return True
    stated: bool | None = getattr(subject, "has_a_back", None)
    if stated is not None:
        return stated
    theta, phi = np.meshgrid(180 - np.array(_ASKED_DEG), np.arange(0, 360, _TURN_DEG))
    return bool(subject.albedo(direction(np.radians(theta), np.radians(phi))).any())
