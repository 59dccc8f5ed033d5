"""Rejection sampling of a measured table (thesis M, 3.1 and 3.2).

A photon is reflected, transmitted or absorbed with the probabilities r, t and 1 - r - t. Its direction is the first of
uniform low-discrepancy candidates that is accepted with p over the largest p of the row, p = f |cos theta_o|. That
needs 2 pi p_max / r candidates a photon: 3 for white paper, 20 for satin, 40,000 for chrome. `TableBSDF`, which draws
from a CDF, needs one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.core.errors import UserError
from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.materials.measured.protocol import RETRO_PROPOSAL, MeasuredTable, quadrature

CANDIDATES_LIMIT = 200_000  # per photon, before rejection gives up
MARGIN = 1.2  # factor on the largest p at the candidates of a quadrature: p can be higher between them
BATCH = 1 << 13
_STEP = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of Roberts' additive sequence (2018): the root of x^4 = x + 1


@dataclass(frozen=True)
class Photons:
    """Photons after scattering.

    Attributes
    ----------
    wo : (N, 3)
        New directions; (0, 0, 0) for absorbed photons.
    weight : (N, C)
        Weight per channel, whose mean is 1; 0 for absorbed photons.
    candidates : int
        Number of candidates tried.
    """

    wo: Floats
    weight: Floats
    candidates: int


def scatter(table: MeasuredTable, wi: Floats, count: int, seed: int = 0) -> Photons:
    """`count` photons from wi (3,) above the surface, after scattering; more light than arrives is a weight over 1.

    Raises
    ------
    UserError
        A lobe is so narrow that CANDIDATES_LIMIT candidates per photon do not find it.
    """
    rng = np.random.default_rng(seed)
    r, t = (float(share.mean()) for share in (table.reflectivity(wi), table.transmissivity(wi)))
    excess = max(r + t, 1.0)
    fates = rng.permutation(
        np.repeat([1, -1, 0], rng.multinomial(count, [r / excess, t / excess, 1 - (r + t) / excess]))
    )
    wo, weight, candidates = np.zeros((count, 3)), np.zeros((count, table.info.channels)), 0
    for side in (1, -1):
        here = np.flatnonzero(fates == side)
        wo[here], f, tried = _accepted(table, wi, side, len(here), rng)
        weight[here] = excess * f / f.mean(axis=1, keepdims=True)
        candidates += tried
    return Photons(wo, weight, candidates)


def _accepted(
    table: MeasuredTable, wi: Floats, side: int, count: int, rng: np.random.Generator
) -> tuple[Floats, Floats, int]:
    """The first `count` accepted candidates (N, 3) of a side, f (N, C) there, and the number of candidates tried."""
    flip = FLIP_Z if side < 0 else 1.0
    offset, tried, found = rng.random(3), 0, [(np.zeros((0, 3)), np.zeros((0, table.info.channels)))]
    around, _ = quadrature(wi, RETRO_PROPOSAL)
    bound = MARGIN * float((table.eval(wi, around * flip).mean(axis=-1) * around[:, 2]).max())
    while sum(len(wo) for wo, _ in found) < count:
        if tried > CANDIDATES_LIMIT * count:
            hint = "use the tabulated sampler, or fit lobes"
            raise UserError("lobe too narrow for rejection sampling", file=table.info.file, hint=hint)
        u = (offset + np.arange(tried + 1, tried + BATCH + 1)[:, None] * _STEP) % 1.0
        wo = direction(np.arccos(1 - u[:, 0]), 2 * np.pi * u[:, 1]) * flip
        f = table.eval(wi, wo)
        accepted = u[:, 2] * bound < f.mean(axis=1) * np.abs(wo[:, 2])
        found.append((wo[accepted], f[accepted]))
        tried += BATCH
    order = rng.permutation(count)
    wo, f = (np.concatenate(parts)[:count][order] for parts in zip(*found, strict=True))
    return wo, f, tried
