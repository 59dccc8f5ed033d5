"""A simulated gonio-photometer: incident grid, outgoing grid, sensor noise, and directions hidden by the lamp's arm.

It measures any function f(wi, wo): here a material document, in `bake` any BSDF of the path tracer.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np

from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.materials.measured.tables.gonio import PHI_I_RANGE_DEG, GonioTable, Symmetry
from lambent.materials.measured.tables.sheets import Sheet

Evaluate = Callable[[Floats, Floats], Floats]
"""f (N, C) in 1/sr without the cosine, of wi and wo (N, 3)."""


@dataclass(frozen=True)
class Setup:
    """Settings of the simulated device.

    Attributes
    ----------
    theta_i_deg, phi_i_deg : tuple of float
        Incident grid.
    symmetry : str
        The specimen's, see `GonioTable`.
    step_deg, fine_deg, fine_reach_deg : float
        Spacing of the outgoing directions, and the finer one within `fine_reach_deg` of the mirror direction (of
        straight transmission on the far side).
    noise : float
        Standard deviation of a reading as a share of it.
    floor : float
        Standard deviation of a reading in the dark, as f in 1/sr.
    sector_deg : float
        Reflected directions closer to the lamp than this are hidden by its arm and not measured.
    grazing_deg : float
        Largest theta_o.
    about_lamp : bool
        Whether the finer spacing is about the lamp as well, for retro-reflectors.
    seed : int
        Of the noise; each incident direction has its own stream.
    """

    theta_i_deg: tuple[float, ...]
    phi_i_deg: tuple[float, ...] = (0.0,)
    symmetry: Symmetry = "isotropic"
    step_deg: float = 2.5
    fine_deg: float = 1.0
    fine_reach_deg: float = 10.0
    noise: float = 0.02
    floor: float = 1e-4
    sector_deg: float = 4.0
    grazing_deg: float = 85.0
    about_lamp: bool = False
    seed: int = 0

    def __post_init__(self) -> None:
        span = max(self.phi_i_deg) - min(self.phi_i_deg)
        if span > PHI_I_RANGE_DEG[self.symmetry]:
            raise UserError("phi_i spans more than the symmetry", field=self.symmetry, got=f"{span:g} degrees")
        for name in ("theta_i_deg", "phi_i_deg"):
            if not (np.diff(getattr(self, name)) > 0).all():
                raise UserError("angles do not increase", field=name, got=getattr(self, name))
        if not (min(self.theta_i_deg) >= 0 and max(self.theta_i_deg) < 90 and 0 < self.grazing_deg < 90):
            raise UserError("an angle is outside its range", expected="theta_i and grazing_deg in [0, 90) degrees")
        if not (0.1 <= self.fine_deg <= self.step_deg <= 45 and min(self.noise, self.floor, self.sector_deg) >= 0):
            raise UserError("impossible setup", expected="0.1 <= fine_deg <= step_deg <= 45, noise and sector >= 0")


# The incident grids of the thesis (figure 2.6, and its isotropic specimens).
ANISOTROPIC = Setup((0, 5, 20, 35, 50, 65), tuple(range(0, 91, 15)), "quadrant")
ISOTROPIC = Setup((0, 5, 19, 33, 47, 61, 75))


def record(
    evaluate: Evaluate, name: str, setup: Setup, *, transmits: bool = False, progress: Progress = silent
) -> GonioTable:
    """Measure `evaluate`, a specimen called `name`, with the device of `setup`.

    Parameters
    ----------
    evaluate : callable
        f (N, C) of wi, wo (N, 3); wo.z < 0 only with `transmits`.
    """
    sides: list[list[Sheet]] = [[], []]
    incident = list(product(setup.theta_i_deg, setup.phi_i_deg))
    for index, (theta_i, phi_i) in enumerate(tracked(incident, progress, f"measuring {name}")):
        noise = np.random.default_rng([setup.seed, index])
        for far in range(1 + transmits):
            sides[far].append(_sheet(evaluate, theta_i, phi_i, bool(far), setup, noise))
    theta, phi = np.array(setup.theta_i_deg, float), np.array(setup.phi_i_deg, float)
    near, far_side = (tuple(tuple(s[k : k + len(phi)]) for k in range(0, len(s), len(phi))) for s in sides)
    return GonioTable(name, theta, phi, near, far_side, setup.symmetry)


def synthesise(material: Material, setup: Setup | None = None, progress: Progress = silent) -> GonioTable:
    """The table of a material document, for fits with a known answer; by default on the thesis's grids."""
    setup = setup or (ANISOTROPIC if any(lobe.mx != lobe.my for lobe in material.lobes) else ISOTROPIC)
    evaluate = MaterialBSDF(material).eval
    return record(evaluate, material.name, setup, transmits=material.transmits, progress=progress)


def outgoing_grid(theta_i_deg: float, phi_i_deg: float, setup: Setup) -> tuple[Floats, Floats]:
    """(theta_o, phi_o) in degrees for one incident direction: regular, and finer around its peaks."""
    step, fine, reach = setup.step_deg, setup.fine_deg, setup.fine_reach_deg
    theta = np.arange(0, setup.grazing_deg + 1e-9, step)
    near = theta_i_deg + np.arange(-reach, reach + 1e-9, fine)
    theta = np.union1d(theta, near[(near >= 0) & (near <= setup.grazing_deg)].round(6))
    phi = np.arange(0, 360, step)
    across = max(np.sin(np.radians(theta_i_deg)), 1e-3)  # a step in phi is shorter on the sphere by this factor
    if fine / across < step:
        for middle in (180, 0) if setup.about_lamp else (180,):
            near = phi_i_deg + middle + np.arange(-reach, reach + 1e-9, fine) / across
            phi = np.union1d(phi, (near % 360).round(4) % 360)
    return theta, phi


def _sheet(
    evaluate: Evaluate, theta_i: float, phi_i: float, far: bool, setup: Setup, noise: np.random.Generator
) -> Sheet:
    theta, phi = outgoing_grid(theta_i, phi_i, setup)
    wo = direction(*np.radians(np.meshgrid(theta, phi, indexing="ij")))
    wi = np.broadcast_to(direction(np.radians(theta_i), np.radians(phi_i)), wo.shape)
    towards = wo * FLIP_Z if far else wo
    f = np.asarray(evaluate(wi.reshape(-1, 3), towards.reshape(-1, 3)), dtype=float).reshape(*wo.shape[:2], -1)
    f = f * (1 + setup.noise * noise.standard_normal(f.shape)) + setup.floor * noise.standard_normal(f.shape)
    hidden = np.sum(wi * wo, axis=-1) > np.cos(np.radians(setup.sector_deg))
    if not far:
        f[hidden] = np.nan
    return Sheet(theta, phi, f)
