"""Equivalent albedos: the diffuse surface that reflects the same share of uniform light (Ben-Artzi 2007, 5.2.4).

    d = 1/pi  integral of f cos cos over both hemispheres = sum over bands of  c_j e_j        (5.21, 5.22)

e_j depends on the quotient and the angles alone, and is integrated once for each. Terms over angles about the half
vector are integrated over half vectors, so that the narrowest bands get as many nodes as the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.plain import Triple, triple
from lambent.materials.bsdf import specular_only
from lambent.materials.document import Material
from lambent.materials.factored.curve import END_RAD, Curve
from lambent.materials.factored.of_lobes import of_material
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.lobes import NUMPY, Vector


def possible_kd(material: Material, kd: Triple) -> Triple:
    """A diffuse colour, reduced so that with the material's lobes and transmission no more than all light is scattered.

    A metal has less room for one than a wall.
    """
    lobes = lobe_albedo(material, "reflection") + lobe_albedo(material, "transmission")
    return triple(np.minimum(kd, np.maximum(1 - lobes - np.array(material.kt_d), 0)))


def lobe_albedo(material: Material, side: str) -> Floats:
    """Equivalent diffuse albedo (3,) of a material's lobes on a side, "reflection" or "transmission"."""
    lobes = specular_only(material)
    return albedo(of_material(lobes), side) if lobes.lobes else np.zeros(3)


BANDS, BANDS_OF_TWO, BANDS_OF_VIEWER = 1024, 256, 64
VIEWERS, ELEVATIONS, AZIMUTHS, TURNS = 32, 1024, 32, 8  # nodes; turns of both directions for anisotropic terms
_made: dict[tuple[str, bool], Floats] = {}


@dataclass(frozen=True)
class _Axis:
    """An axis of a term: bands that narrow towards small angles, with ends END_RAD (k / bands)^2."""

    factor: Factor
    bands: int

    def band(self, angle_rad: Floats) -> Indices:
        """Number of the band of angles."""
        return np.asarray(np.minimum((np.sqrt(angle_rad / END_RAD) * self.bands).astype(np.int64), self.bands - 1))

    def means(self, curve: Curve) -> Floats:
        """(bands, 3) means of a curve over the bands."""
        inner = (np.arange(self.bands)[:, None] + np.array([0.1127, 0.5, 0.8873])) / self.bands  # Gauss-Legendre
        return np.asarray(np.einsum("jgc,g->jc", curve.at(inner**2 * END_RAD), np.array([5, 8, 5]) / 18))


def albedo(material: Editable, side: str) -> Floats:
    """(3,) equivalent albedo of a material's terms on one side, "reflection" (with retro lobes) or "transmission".

    Textures have mean 1 and do not change it.
    """
    mine = [term for term in material.terms if (term.side == "transmission") == (side == "transmission")]
    return np.asarray(sum((term_albedo(term, material.curves) for term in mine), np.zeros(3)))


def term_albedo(term: Term, curves: Mapping[str, Curve]) -> Floats:
    """(3,) equivalent albedo of one term."""
    axes = _axes(term)
    key = term.fixed, term.viewer is not None
    if key not in _made:
        _made[key] = _shares(term, axes)
    e = _made[key]
    for axis in axes:  # (J, K, ..., 3) -> (3,), curve by curve
        e = np.asarray(np.einsum("j...c,jc->...c", e, axis.means(curves[axis.factor.curve])))
    return np.asarray(term.scale) * e


def _axes(term: Term) -> list[_Axis]:
    bands = BANDS if len(term.factors) < 2 else BANDS_OF_TWO
    axes = [_Axis(factor, bands) for factor in term.factors]
    return [*axes, _Axis(Factor(term.viewer, "theta_o"), BANDS_OF_VIEWER)] if term.viewer else axes


def _shares(term: Term, axes: list[_Axis]) -> Floats:
    """e (bands of each axis, 3)."""
    wi, wo, weight = _nodes(not term.is_diffuse)
    turns = 1 if _is_isotropic(term, axes) else TURNS
    shape = [axis.bands for axis in axes]
    total = np.zeros((3, int(np.prod(shape, dtype=int))))
    for turn_rad in (np.arange(turns) + 0.5) / turns * 2 * np.pi:  # one at a time: each is a million nodes
        total += _sums(term, axes, _turned(wi, turn_rad), _turned(wo, turn_rad), weight / turns)
    return np.ascontiguousarray(total.T).reshape(*shape, 3)


def _sums(term: Term, axes: list[_Axis], wi: Vector, wo: Vector, weight: Floats) -> Floats:
    """(3, bands of all axes) sums over nodes."""
    quotient = term.quotient.evaluate(wi, wo, NUMPY)
    place: Indices = np.zeros(len(weight), np.int64)
    for axis in axes:
        place = place * axis.bands + axis.band(angle_of(axis.factor.over, wi, wo, axis.factor.stretch))
    size = int(np.prod([axis.bands for axis in axes], dtype=int))
    if not isinstance(quotient, tuple):
        return np.broadcast_to(np.bincount(place, quotient * weight / np.pi, size), (3, size))
    return np.stack([np.bincount(place, channel * weight / np.pi, size) for channel in quotient])


def _turned(w: Vector, by_rad: float) -> Vector:
    """Directions turned about the normal."""
    c, s = np.cos(by_rad), np.sin(by_rad)
    return c * w[0] - s * w[1], s * w[0] + c * w[1], w[2]


def _is_isotropic(term: Term, axes: list[_Axis]) -> bool:
    """Whether turning both directions about the normal changes nothing, at pairs drawn at random."""
    rng = np.random.default_rng(0)
    z, phi = rng.uniform(0.05, 1, (2, 64)), rng.uniform(0, 2 * np.pi, (2, 64))
    found = []
    for turn in (0.0, 0.7, 1.9):
        wi, wo = (
            (np.sqrt(1 - c * c) * np.cos(a + turn), np.sqrt(1 - c * c) * np.sin(a + turn), c)
            for c, a in zip(z, phi, strict=True)
        )
        quotient = term.quotient.evaluate(wi, wo, NUMPY)
        angles = [angle_of(axis.factor.over, wi, wo, axis.factor.stretch) for axis in axes]
        found.append(np.concatenate([*np.atleast_2d(quotient), *angles]))
    return all(np.allclose(found[0], other, rtol=1e-4, atol=1e-6) for other in found[1:])


def _nodes(about_half_vector: bool) -> tuple[Vector, Vector, Floats]:
    """Pairs of directions above the surface, wo without y, and their weight cos_i cos_o dwi dwo."""
    square_o = (np.arange(VIEWERS) + 0.5) / VIEWERS  # sin^2 theta_o: cosine distributed, each pi / VIEWERS of cos dw
    phi = (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * 2 * np.pi
    ends = (np.arange(ELEVATIONS + 1) / ELEVATIONS) ** 2 * END_RAD
    # Solid angles, and cosines over them, are exact: the albedo of a constant is exactly 1.
    theta, solid = (ends[1:] + ends[:-1]) / 2, -np.diff(np.cos(ends))
    projected = np.diff(np.sin(ends) ** 2) / 2
    o, e, a = np.broadcast_arrays(square_o[:, None, None], theta[:, None], phi)
    each = (2 * np.pi / AZIMUTHS) * (np.pi / VIEWERS)
    wo = np.sqrt(o), np.zeros(o.shape), np.sqrt(1 - o)
    w = np.sin(e) * np.cos(a), np.sin(e) * np.sin(a), np.cos(e)
    if not about_half_vector:
        weight = np.broadcast_to(projected[:, None] * each, o.shape)
        return _flat(w), _flat(wo), weight.ravel()
    d = w[0] * wo[0] + w[2] * wo[2]
    wi = 2 * d * w[0] - wo[0], 2 * d * w[1], 2 * d * w[2] - wo[2]
    kept = (d > 0) & (wi[2] > 0)
    weight = 4 * d * solid[:, None] * each * wi[2]
    return _flat(wi, kept), _flat(wo, kept), weight[kept]


def _flat(w: Vector, kept: Any = slice(None)) -> Vector:
    x, y, z = (c[kept].ravel() for c in w)
    return x, y, z
