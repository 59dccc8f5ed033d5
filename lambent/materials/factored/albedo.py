"""Equivalent albedos: the diffuse surface that reflects as much of uniform light (Ben-Artzi 2007, section 5.2.4).

    d = 1/pi  integral of f cos cos over both hemispheres = sum over bands of  c_j e_j        (5.21, 5.22)

e_j depends on the quotient and the angles alone, and is integrated once for each. Terms over angles about the half
vector are integrated over half vectors, so that the narrowest bands get as many nodes as the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.materials.factored.curve import END_RAD, Curve
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.terms import Editable, Factor, Term
from lambent.materials.lobes import NUMPY, Vector

BANDS, BANDS_OF_TWO, BANDS_OF_VIEWER = 1024, 256, 64
VIEWERS, ELEVATIONS, AZIMUTHS, TURNS = 32, 1024, 32, 8  # nodes; turns of both directions for what is anisotropic
_made: dict[tuple[str, bool], Floats] = {}


@dataclass(frozen=True)
class _Axis:
    """A curve of a term, cut into bands that are narrow at small angles: their ends are END_RAD (k / bands)^2."""

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
    """(3,) equivalent albedo of a material's terms of one side, "reflection" (with what it returns) or "transmission".

    Textures have a mean of 1 and do not change it.
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
    wi, wo, weight = _nodes(not term.is_diffuse, 1 if _is_isotropic(term, axes) else TURNS)
    quotient = term.quotient.evaluate(wi, wo, NUMPY)
    value = (
        np.stack(np.broadcast_arrays(*quotient, weight)[:3], -1) if isinstance(quotient, tuple) else quotient[:, None]
    )
    value = value * weight[:, None] / np.pi
    place: Indices = np.zeros(len(weight), np.int64)
    for axis in axes:
        angle = angle_of(axis.factor.over, wi, wo, axis.factor.stretch)
        place = place * axis.bands + axis.band(angle)
    shape = [axis.bands for axis in axes]
    size = int(np.prod(shape, dtype=int))
    columns = [np.bincount(place, column, size) for column in np.broadcast_to(value, (len(place), 3)).T]
    return np.asarray(np.stack(columns, -1).reshape(*shape, 3), float)


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


def _nodes(about_half_vector: bool, turns: int) -> tuple[Vector, Vector, Floats]:
    """Pairs of directions above the surface, and their weight cos_i cos_o dwi dwo."""
    square_o = (np.arange(VIEWERS) + 0.5) / VIEWERS  # sin^2 theta_o: cosine distributed, each pi / VIEWERS of cos dw
    phi = (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * 2 * np.pi
    turn = (np.arange(turns) + 0.5) / turns * 2 * np.pi
    ends = (np.arange(ELEVATIONS + 1) / ELEVATIONS) ** 2 * END_RAD
    # Solid angles, and cosines over them, are exact: the albedo of a constant is 1 to the last digit.
    theta, solid = (ends[1:] + ends[:-1]) / 2, -np.diff(np.cos(ends))
    projected = np.diff(np.sin(ends) ** 2) / 2
    o, k, a, r = (x.ravel() for x in np.meshgrid(square_o, np.arange(ELEVATIONS), phi, turn, indexing="ij"))
    e, each = theta[k], (2 * np.pi / AZIMUTHS) * (np.pi / VIEWERS / turns)
    wo = np.sqrt(o) * np.cos(r), np.sqrt(o) * np.sin(r), np.sqrt(1 - o)
    w = np.sin(e) * np.cos(a + r), np.sin(e) * np.sin(a + r), np.cos(e)
    if not about_half_vector:
        return w, wo, projected[k] * each
    d = w[0] * wo[0] + w[1] * wo[1] + w[2] * wo[2]
    wi = 2 * d * w[0] - wo[0], 2 * d * w[1] - wo[1], 2 * d * w[2] - wo[2]
    weight = np.where((d > 0) & (wi[2] > 0), 4 * d * solid[k] * each * np.maximum(wi[2], 0), 0.0)
    kept = weight > 0
    x, y, z = (c[kept] for c in wi)
    return (x, y, z), (wo[0][kept], wo[1][kept], wo[2][kept]), weight[kept]
