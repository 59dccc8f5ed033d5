"""How far a material is from another BSDF, by integrals over both hemispheres."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.checking.check import Scatters


@dataclass(frozen=True)
class ByFormula:
    """A reflection given by its f alone; samples are cosines."""

    f: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def eval(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.where((wi[:, 2:] > 0) & (wo[:, 2:] > 0), self.f(wi, wo), 0.0)

    def pdf(self, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
        return np.maximum(wi[:, 2], 0) / np.pi

    def sample(self, wo: np.ndarray, u: np.ndarray) -> np.ndarray:
        r, phi = np.sqrt(u[:, 0]), 2 * np.pi * u[:, 1]
        return np.stack([r * np.cos(phi), r * np.sin(phi), np.sqrt(1 - u[:, 0])], axis=-1)


@dataclass(frozen=True)
class Distance:
    """Albedos (2, 3) of both, reflection first, and the integral (2, 3) of |f - f'| cos."""

    theirs: np.ndarray
    ours: np.ndarray
    apart: np.ndarray


def towards(theta_deg: float) -> np.ndarray:
    theta = np.radians(theta_deg)
    return np.array([np.sin(theta), 0.0, np.cos(theta)])


def distance(theirs: Scatters, ours: MaterialBSDF, theta_deg: float, count: int = 20000) -> Distance:
    """Distance seen from `theta_deg`; samples of both, and cosines on both sides, balanced."""
    random = np.random.default_rng(1)
    wo = np.broadcast_to(towards(theta_deg), (count, 3))
    cosines = ByFormula(lambda wi, wo: wi).sample(wo, random.random((count, 3)))
    cosines[::2, 2] *= -1
    found = np.zeros((3, 2, 3))
    for wi in (theirs.sample(wo, random.random((count, 3))), ours.sample(wo, random.random((count, 3))), cosines):
        valid = np.abs(wi[:, 2]) > 1e-5
        wi = np.where(valid[:, None], wi, (0.0, 0.0, 1.0))
        density = theirs.pdf(wi, wo) + ours.pdf(wi, wo) + np.abs(wi[:, 2]) / (2 * np.pi)
        weight = (valid * np.abs(wi[:, 2]) / np.maximum(density, 1e-12))[:, None]
        a, b = theirs.eval(wi, wo) * weight, ours.eval(wi, wo) * weight
        for side, there in enumerate((wi[:, 2:] > 0, wi[:, 2:] < 0)):
            found[:, side] += [np.where(there, values, 0).mean(axis=0) for values in (a, b, np.abs(a - b))]
    return Distance(*found)


def peak(bsdf: Scatters, theta_deg: float) -> tuple[float, float]:
    """Angle of the highest f in the plane of incidence, and the full width at half of it, degrees."""
    angles_deg = np.linspace(-80, 80, 3201)
    theta = np.radians(angles_deg)
    wi = np.stack([-np.sin(theta), 0 * theta, np.cos(theta)], axis=-1)
    f = bsdf.eval(wi, np.broadcast_to(towards(theta_deg), wi.shape)).mean(axis=-1)
    top = int(f.argmax())
    below = f < (f[top] + f[: len(f) // 4].min()) / 2
    left, right = np.flatnonzero(below[:top]), np.flatnonzero(below[top:])
    width = (right[0] if len(right) else len(f) - top) + (top - left[-1] if len(left) else top)
    return float(angles_deg[top]), float(width * (angles_deg[1] - angles_deg[0]))
