"""Edited curves as a measured table, so that lobes can be fitted to them as to any measurement.

Its tuples lie on a grid of half vectors that is fine where the highlight's curves are steep. It resolves a highlight of
any width, and any ring drawn by hand.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import FLIP_Z, direction
from lambent.materials.factored.curve import END_RAD, angles_rad
from lambent.materials.factored.terms import Editable
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable, TableInfo, collect

FORMAT = "edited curves"
THETA_I_DEG = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0)
PHI_I_DEG = (0.0, 30.0, 60.0, 90.0, 120.0, 150.0)  # of an anisotropic material
RINGS, SECTORS = 96, 24  # of half vectors
PER_HALF_VECTOR = {"theta_h": 1.0, "slope_t": 1.0, "slope_b": 1.0, "gamma_t": 1.0, "gamma_b": 1.0, "theta_r": 0.5}


class EditedTable(MeasuredTable):
    """The table that a gonio-photometer would measure, without noise, from a material made of curves."""

    def __init__(self, material: Editable, name: str) -> None:
        self.material = material
        isotropic = _is_isotropic(material)
        transmits = any(term.side == "transmission" for term in material.terms)
        sizes = {"theta_i": len(THETA_I_DEG), "phi_i": 1 if isotropic else len(PHI_I_DEG)}
        self.info = TableInfo(name, FORMAT, isotropic, transmits, 3, "f", sizes)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return np.maximum(self.material.eval(wi, wo), 0.0)

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        phi_i = (0.0,) if self.info.isotropic else PHI_I_DEG
        theta_h, phi_h, solid_angle = _half_vectors(self.material, SECTORS if self.info.isotropic else SECTORS // 2)
        h = direction(theta_h, phi_h)
        parts = []
        for theta in THETA_I_DEG:
            for phi in phi_i:
                wi = np.broadcast_to(direction(np.radians(theta), np.radians(phi)), h.shape)
                cos_d = np.sum(wi * h, axis=-1)
                wo = 2 * cos_d[..., None] * h - wi
                here = (cos_d > 0) & (wo[..., 2] > 0)
                parts.append((wi[here], wo[here], (4 * cos_d * solid_angle)[here]))
        wi, wo, weight = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        if self.info.transmits:
            wi, weight = np.tile(wi, (2, 1)), np.tile(weight, 2)
            wo = np.concatenate([wo, wo * FLIP_Z])
        return collect(wi, wo, self.eval(wi, wo), weight, self.info, np.zeros(len(wi), bool), max_count)


def _half_vectors(material: Editable, sectors: int) -> tuple[Floats, Floats, Floats]:
    """theta_h (R, 1), phi_h (1, S) in radians, and solid angles (R, 1) of a grid of half vectors."""
    edges = _edges(material)
    middle = (edges[:-1] + edges[1:]) / 2
    phi = (np.arange(2 * sectors) + 0.5) * (np.pi / sectors)
    solid_angle = (np.cos(edges[:-1]) - np.cos(edges[1:])) * (np.pi / sectors)
    return middle[:, None], phi[None, :], solid_angle[:, None]


def _edges(material: Editable) -> Floats:
    """(RINGS + 1,) edges of rings of theta_h in radians: half of them where curves change, half denser towards 0."""
    theta = angles_rad()
    rise = np.zeros(len(theta))
    for term in material.terms:
        for factor in term.factors:
            if (per_half := PER_HALF_VECTOR.get(factor.over)) is not None:
                values = material.curves[factor.curve].at(theta / per_half).sum(axis=1)
                rise += np.abs(np.gradient(values)) / max(np.abs(np.diff(values)).sum(), 1e-30)
    changed = np.cumsum(rise) / max(rise.sum(), 1e-30)
    share = np.linspace(0, 1, RINGS + 1)
    even = np.sqrt(theta / END_RAD)
    mixed = (changed + even) / 2 if rise.any() else even
    mixed = (mixed - mixed[0]) / (mixed[-1] - mixed[0])
    edges = np.interp(share, mixed, theta)
    edges[0], edges[-1] = 0.0, END_RAD
    return np.asarray(edges)


def _is_isotropic(material: Editable) -> bool:
    """Whether f is unchanged when both directions turn about the normal."""
    rng = np.random.default_rng(0)
    theta, phi = np.arccos(rng.uniform(0.1, 1, (2, 500))), rng.uniform(0, 2 * np.pi, (2, 500))
    theta[1, :250], phi[1, :250] = theta[0, :250] + 0.05, phi[0, :250] + np.pi  # near the mirror direction
    theta = np.minimum(theta, 1.5)
    for side in (1.0, FLIP_Z):
        one, other = (
            material.eval(direction(theta[0], phi[0] + a), direction(theta[1], phi[1] + a) * side) for a in (0, 0.7)
        )
        if not np.allclose(one, other, rtol=1e-6, atol=1e-9 * np.abs(one).max()):
            return False
    return True


def part_of(material: Editable, names: set[str]) -> Editable:
    """The terms of these names, with their curves."""
    terms = tuple(term for term in material.terms if term.name in names)
    used = {curve for term in terms for curve in term.curves}
    return replace(material, terms=terms, curves={n: c for n, c in material.curves.items() if n in used})
