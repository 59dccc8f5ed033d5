"""Object freezing: tails as a polynomial in the albedos of one material (Ben-Artzi 2007, eqs 6.7, 6.8)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from lambent.baked.transport.tails import FIXED, SecondBands, Tails
from lambent.core.arrays import Floats, Indices
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.terms import Editable, Factor, Term

Active = tuple[int | None, ...]  # for each term of a material, the factor whose curve is edited


@dataclass(frozen=True)
class Powers:
    """The tails of a view while one material is edited.

    Attributes
    ----------
    material : str
    weight : (Z, 3)
        Factor of each tail from all frozen materials.
    power : (Z,)
        Number of each tail's monomial.
    exponents : (Q, slots)
        Of the edited material's slots, by monomial; 0 for all others.
    row : (Z,)
        Index, in `second`, of each tail's coefficient of the edited material at the second surface.
    """

    tails: Tails
    material: str
    active: Active
    weight: Floats
    power: Indices
    exponents: Indices
    row: Indices

    def values(self, material: Editable) -> Floats:
        """(Q, 3) monomials of the material as edited."""
        albedos = _albedos(self.tails, {self.material: material})
        return np.asarray(np.prod(albedos[None] ** self.exponents[:, :, None], axis=1))

    def second(self, material: Editable) -> Floats:
        """(R, 3) coefficients of the material as edited: 1, then its terms at the second surface.

        A term has one coefficient per band of its active curve, or a single one without an active curve.
        """
        found = [np.ones((1, 3))]
        for one in self.tails.second:
            if one.material == self.material:
                term, at = material.terms[one.term], self.active[one.term]
                found.append(np.asarray(term.scale) * active_bands(term, one.counts, material, at))
        return np.concatenate(found)

    def weighing(self, met: Indices) -> Indices:
        """The given tails that contribute."""
        return met[self.weight[met].any(axis=1)]


def powers(
    tails: Tails,
    materials: Mapping[str, Editable],
    edited: str,
    hits: tuple[int, int] = (2, 99),
    active: Active | None = None,
) -> Powers:
    """Freeze all materials but one, and all curves of that one but the active ones.

    Parameters
    ----------
    edited
        Name of the edited material; "" freezes all.
    hits
        Least and most surfaces on the paths that count.
    active
        By default no curve.
    """
    own = np.array([material == edited for material, _ in tails.slots], bool) & bool(edited)
    frozen = {name: material for name, material in materials.items() if name != edited}
    active = active or (None,) * (len(materials[edited].terms) if edited else 0)
    weight = tails.weights(_albedos(tails, frozen))
    row = np.zeros(len(tails), np.int64)
    if tails.second:
        coefficient, rows, begin = [], [], 1
        for one in tails.second:
            if one.material != edited or not edited:
                coefficient.append(_coefficients(one, frozen))
                rows.append(np.zeros(one.size, np.int64))
                continue
            term, at = materials[edited].terms[one.term], active[one.term]
            coefficient.append(bands_of(term.factors, one.counts, materials[edited], at))
            rows.append(begin + band_of(one.counts, at))
            begin += one.counts[at] if at is not None else 1
        weight = weight * np.concatenate(coefficient)[tails.band_of_second]
        row = np.concatenate(rows)[tails.band_of_second]
    weight = np.where(((tails.hits >= hits[0]) & (tails.hits <= hits[1]))[:, None], weight, 0.0)
    exponents, power = np.unique(np.where(own, tails.exponents, 0), axis=0, return_inverse=True)
    return Powers(tails, edited, active, weight, power.reshape(-1), exponents, row)


def _albedos(tails: Tails, materials: Mapping[str, Editable]) -> Floats:
    """(slots, 3); 1 for slots of materials that are not in `materials`."""
    found = np.ones((len(tails.slots), 3))
    for k, (material, side) in enumerate(tails.slots):
        if side != FIXED and material in materials:
            found[k] = albedo(materials[material], side)
    return found


def _coefficients(one: SecondBands, materials: Mapping[str, Editable]) -> Floats:
    if one.material not in materials:
        return np.ones((one.size, 3))
    material = materials[one.material]
    term = material.terms[one.term]
    return np.asarray(term.scale) * bands_of(term.factors, one.counts, material)


def active_of(material: Editable, curves: Collection[str]) -> Active:
    """The first factor of each term with one of these curves."""
    return tuple(next((k for k, f in enumerate(t.factors) if f.curve in curves), None) for t in material.terms)


def active_bands(term: Term, counts: tuple[int, ...], material: Editable, at: int | None) -> Floats:
    """(J, 3) coefficients of a term's factor `at`, or a single 1 for None."""
    if at is None:
        return np.ones((1, 3))
    factor = term.factors[at]
    return material.curves[factor.curve].band_means(counts[at], factor.polar)


def band_of(counts: tuple[int, ...], at: int | None) -> Indices:
    """For each product of bands, the band of the factor `at`; 0 for None."""
    return np.asarray(np.indices(counts)[at].reshape(-1) if at is not None else np.zeros(int(np.prod(counts)), int))


def bands_of(
    factors: tuple[Factor, ...], counts: tuple[int, ...], material: Editable, but: int | None = None
) -> Floats:
    """(J, 3) coefficients of products of bands, first curve first; the factor `but` counts as 1."""
    found = np.ones((1, 3))
    for k, (factor, count) in enumerate(zip(factors, counts, strict=True)):
        means = np.ones((count, 3)) if k == but else material.curves[factor.curve].band_means(count, factor.polar)
        found = (found[:, None] * means[None]).reshape(-1, 3)
    return found
