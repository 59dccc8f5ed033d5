"""Gonio text, Lambent's own plain columns: the tuples of a gonio table, unchanged.

Other subjects (MERL, RGL, LBNL, a material) are measured by the simulated gonio-photometer, without noise, with finer
steps about the mirror direction.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.core.progress import Progress, silent
from lambent.materials.document import Material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampling.resampled import Scatterer, read_back, scatterer_of
from lambent.materials.measured.inspecting.synthetic import Setup, record
from lambent.materials.measured.parts.gonio_text import write_gonio
from lambent.materials.measured.protocol import Quantity
from lambent.materials.measured.tables.gonio import GonioTable

NAME = "gonio text"
ENDINGS = (".txt", ".gonio")
TAKES: tuple[Kind, ...] = ("table", "material")
QUANTITY: Quantity = "f"
THETA_I_DEG = {"isotropic": tuple(range(0, 81, 5)), "other": (0, 10, 20, 30, 40, 50, 60, 70, 80)}
PHI_STEP_DEG = 15
TURN_DEG = {"isotropic": (0.0,), "quadrant": range(0, 91, PHI_STEP_DEG), "half": range(0, 180, PHI_STEP_DEG)}
STEP_DEG, WIDEST_FINE_DEG, FINEST_DEG = 3.0, 1.0, 0.1
WIDEST_RETURNED_DEG = 12.0  # a peak about the light is narrower: f falls to half within this
FINE_STEPS = 10  # to either side of the mirror direction


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and return its losses."""
    if isinstance(subject, GonioTable):
        write_gonio(Path(path), subject, QUANTITY)
        return read_back(subject, Path(path), ())
    scatterer = scatterer_of(subject)
    setup = _setup(scatterer)
    table = record(scatterer.eval, scatterer.name, setup, transmits=scatterer.transmits, progress=progress)
    write_gonio(Path(path), table, QUANTITY)
    what = "the formula: " if isinstance(subject, Material) else "the original directions: "
    count, about = len(setup.theta_i_deg) * len(setup.phi_i_deg), " and of the light" if setup.about_lamp else ""
    lost = f"{what}sampled at {count} incident directions, outgoing ones {setup.step_deg:g} degrees apart" + (
        f" and {setup.fine_deg:g} within {setup.fine_reach_deg:g} degrees of the mirror direction{about}"
    )
    return read_back(subject, Path(path), (lost,))


def _setup(scatterer: Scatterer) -> Setup:
    symmetry = scatterer.symmetry
    theta_i = THETA_I_DEG["isotropic" if symmetry == "isotropic" else "other"]
    phi_i = TURN_DEG.get(symmetry, range(0, 360, PHI_STEP_DEG))
    mirrored, returned = (_lobe_widths_deg(scatterer, phi) for phi in (np.pi, 0.0))
    returns = max(returned) < WIDEST_RETURNED_DEG
    fine = float(np.clip(min(mirrored + returned * returns) / 4, FINEST_DEG, WIDEST_FINE_DEG))
    setup = Setup(tuple(map(float, theta_i)), tuple(map(float, phi_i)), symmetry, STEP_DEG, fine, FINE_STEPS * fine)
    return replace(setup, noise=0.0, floor=0.0, sector_deg=0.0, grazing_deg=87.0, about_lamp=returns)


def _lobe_widths_deg(scatterer: Scatterer, phi: float) -> list[float]:
    """Angles at which f falls to half near theta_i = 30 degrees, in the plane of incidence and across it.

    Measured from the mirror direction for phi = pi, from the light for phi = 0; 30 if f does not fall to half.
    """
    offset = np.geomspace(0.05, 30, 200)
    wi = np.broadcast_to(direction(np.radians(30), 0.0), (len(offset), 3))
    narrow = []
    for wo in (direction(np.radians(30 + offset), phi), direction(np.radians(30), phi + np.radians(2 * offset))):
        f = scatterer.eval(wi, wo).mean(axis=1)
        below = np.flatnonzero(f < f[0] / 2)
        narrow.append(float(offset[below[0]]) if len(below) else 30.0)
    return narrow
