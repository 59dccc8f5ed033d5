"""Object freezing: tails as a polynomial in the albedos of one material (Ben-Artzi 2007, eqs 6.7, 6.8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.materials.factored.albedo import albedo
from lambent.materials.factored.terms import Editable, Factor
from lambent.store.tails import FIXED, Tails


@dataclass(frozen=True)
class Powers:
    """The tails of a view while one material is edited.

    Attributes
    ----------
    material : str
    weight : (Z, 3)
        Factor of each tail by all other materials.
    power : (Z,)
        Number of each tail's monomial.
    exponents : (Q, slots)
        Of the edited material's slots, by monomial; 0 for all others.
    band : (Q,)
        Band of the second surface that a monomial has of the edited material, or -1.
    """

    tails: Tails
    material: str
    weight: Floats
    power: Indices
    exponents: Indices
    band: Indices

    def values(self, material: Editable) -> Floats:
        """(Q, 3) monomials of the material as it is edited."""
        albedos = _albedos(self.tails, {self.material: material})
        found = np.prod(albedos[None] ** self.exponents[:, :, None], axis=1)
        if (self.band >= 0).any():
            second = second_coefficients(self.tails, {self.material: material})
            found = found * np.where((self.band >= 0)[:, None], second[self.band], 1.0)
        return np.asarray(found)


def powers(tails: Tails, materials: Mapping[str, Editable], edited: str, hits: tuple[int, int] = (2, 99)) -> Powers:
    """Freeze all materials but one.

    Parameters
    ----------
    hits
        Least and most surfaces on the paths that count.
    """
    own = np.array([material == edited for material, _ in tails.slots], bool)
    frozen = {name: material for name, material in materials.items() if name != edited}
    weight = tails.weights(_albedos(tails, frozen))
    band = np.full(len(tails), -1)
    if tails.second:
        owner = np.repeat([one.material == edited for one in tails.second], [one.size for one in tails.second])
        mine = owner[tails.band_of_second]
        weight = weight * np.where(mine[:, None], 1.0, second_coefficients(tails, frozen)[tails.band_of_second])
        band = np.where(mine, tails.band_of_second, -1)
    weight = np.where(((tails.hits >= hits[0]) & (tails.hits <= hits[1]))[:, None], weight, 0.0)
    exponents = np.where(own, tails.exponents, 0)
    found, power = np.unique(np.column_stack([exponents, band]), axis=0, return_inverse=True)
    return Powers(tails, edited, weight, power.reshape(-1), found[:, :-1], found[:, -1])


def _albedos(tails: Tails, materials: Mapping[str, Editable]) -> Floats:
    """(slots, 3); 1 for slots of materials that are not named."""
    found = np.ones((len(tails.slots), 3))
    for k, (material, side) in enumerate(tails.slots):
        if side != FIXED and material in materials:
            found[k] = albedo(materials[material], side)
    return found


def second_coefficients(tails: Tails, materials: Mapping[str, Editable]) -> Floats:
    """(W, 3) coefficients of the bands of second surfaces; 1 for materials that are not named."""
    parts = []
    for one in tails.second:
        if one.material not in materials:
            parts.append(np.ones((one.size, 3)))
            continue
        material = materials[one.material]
        term = material.terms[one.term]
        parts.append(np.asarray(term.scale) * bands_of(term.factors, one.counts, material))
    return np.concatenate(parts) if parts else np.ones((1, 3))


def bands_of(
    factors: tuple[Factor, ...], counts: tuple[int, ...], material: Editable, but: int | None = None
) -> Floats:
    """(J, 3) coefficients of products of bands, first curve first; that of the factor `but` counts as 1."""
    found = np.ones((1, 3))
    for k, (factor, count) in enumerate(zip(factors, counts, strict=True)):
        means = np.ones((count, 3)) if k == but else material.curves[factor.curve].band_means(count, factor.polar)
        found = (found[:, None] * means[None]).reshape(-1, 3)
    return found
