"""Tuples of a table grouped by incident direction, for the plots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.geometry.directions import Floats, angles, direction
from lambent.materials.measured.protocol import MeasuredSamples

MOST_ANGLES = 12  # more distinct angles than this are grouped in bins
THETA_CENTRES_DEG = np.array([2.5, 15.0, 30.0, 45.0, 60.0, 75.0])
PHI_CENTRES_DEG = np.array([0.0, 90.0, 180.0, 270.0])  # every ring of a Klems basis has patches there
BIN_HALF_WIDTH_DEG = 2.5
ROUND_DEG = 1.0
LEAST_TUPLES = 16


@dataclass(frozen=True)
class Incidence:
    """The tuples of one incident direction.

    Attributes
    ----------
    theta_deg, phi_deg : float
        Of wi; phi is 0 for an isotropic table, whose tuples are turned there.
    wi : (3,)
    wo : (N, 3)
    f : (N, C) in 1/sr
    weight : (N,)
    """

    theta_deg: float
    phi_deg: float
    wi: Floats
    wo: Floats
    f: Floats
    weight: Floats

    def albedo(self, far: bool) -> Floats:
        """Integral (C,) of f |cos theta_o| over the near or the far side; gaps count as the mean of the rest."""
        here = (self.wo[:, 2] < 0) == far
        if not here.any():
            return np.zeros(self.f.shape[1])
        cosine = self.weight[here] * np.abs(self.wo[here, 2])
        return np.asarray(np.pi * (cosine @ self.f[here]) / cosine.sum())


def incidences(samples: MeasuredSamples) -> list[Incidence]:
    """One entry per incident direction with at least 16 tuples, by theta then phi.

    A table without incident directions of its own (MERL, Cornell) is grouped in bins of theta_i.
    """
    theta, phi = angles(samples.wi)
    theta_o, phi_o = angles(samples.wo)
    if samples.info.isotropic:
        phi_o, phi = phi_o - phi, np.zeros_like(phi)
    wo = direction(theta_o, phi_o)
    phi = np.where(theta < np.radians(ROUND_DEG) / 2, 0.0, phi)  # meaningless at the normal
    theta_key, phi_key = _keys(np.degrees(theta), THETA_CENTRES_DEG), _keys(np.degrees(phi), PHI_CENTRES_DEG)
    gathered = []
    for theta_deg in np.unique(theta_key[theta_key >= 0]):
        for phi_deg in np.unique(phi_key[(theta_key == theta_deg) & (phi_key >= 0)]):
            here = (theta_key == theta_deg) & (phi_key == phi_deg)
            if here.sum() >= LEAST_TUPLES:
                wi, f, weight = direction(*np.radians((theta_deg, phi_deg))), samples.f[here], samples.weight[here]
                gathered.append(Incidence(float(theta_deg), float(phi_deg), wi, wo[here], f, weight))
    return gathered


def _keys(angle_deg: Floats, centres_deg: Floats) -> Floats:
    """The key angle of each tuple: the rounded angle if there are few, else its bin's centre or -1."""
    rounded = np.round(angle_deg / ROUND_DEG) * ROUND_DEG % 360
    if len(np.unique(rounded)) <= MOST_ANGLES:
        return rounded
    away = np.abs((angle_deg[:, None] - centres_deg + 180) % 360 - 180)
    nearest = np.argmin(away, axis=1)
    return np.where(away.min(axis=1) <= BIN_HALF_WIDTH_DEG, centres_deg[nearest], -1.0)
