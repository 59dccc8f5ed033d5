"""Means of f over pairs of patches of an angle basis, which preserve energy in a matrix of patches.

The mean is over the projected solid angle of both patches. A lobe can be far narrower than a patch, and lobes rarely
reach a dim patch; directions are therefore drawn both uniformly within every patch and from a BSDF's lobes, and
weighted by the sum of both densities (Veach & Guibas 1995, the balance heuristic). The smallest value of each pair is
subtracted first, so that a constant comes out exactly.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import FLIP_Z, HALF_TURN, raised
from lambent.core.progress import Progress, tracked
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.lobes import COS_MIN
from lambent.materials.measured.parts.klems import OUTSIDE, AngleBasis

EVEN_LOG2, LOBES_LOG2 = 3, 13  # log2 of directions per pair of patches, and per incident patch from lobes

Evaluate = Callable[[Floats, Floats], Floats]


def patch_means(evaluate: Evaluate, basis: AngleBasis, proposal: MaterialBSDF, side: int, progress: Progress) -> Floats:
    """Mean f (2, outgoing patches, incident patches, C) in 1/sr of light from one side: reflected, then transmitted.

    Parameters
    ----------
    evaluate : callable
        f (N, C) of wi and wo (N, 3), on any side.
    proposal : MaterialBSDF
        BSDF to draw directions from; the closer its lobes are to f, the less noise.
    side : +1 or -1
        The side of wi.
    """
    patches = tracked(range(basis.count), progress, "averaging over patches")
    whole = np.stack([_column(evaluate, basis, proposal, side, i) for i in patches], axis=1)
    return whole.reshape(2, basis.count, *whole.shape[1:])


def _column(evaluate: Evaluate, basis: AngleBasis, proposal: MaterialBSDF, side: int, i: int) -> Floats:
    """(2 outgoing patches, C) means of one incident patch: all patches of reflection, then all of transmission."""
    wi, wo, patch = _directions(basis, proposal, i)
    cosine = np.abs(wo[:, 2])
    density = (1 << EVEN_LOG2) / basis.projected_sr[patch] + (1 << LOBES_LOG2) * proposal.pdf(wo, wi) / cosine
    f = np.maximum(evaluate(wi * (1, 1, side), wo * (1, 1, side)), 0)
    bin_of = patch + np.where(wo[:, 2] < 0, basis.count, 0)
    order = np.argsort(bin_of, kind="stable")
    starts = np.searchsorted(bin_of[order], np.arange(2 * basis.count))
    lowest = np.minimum.reduceat(f[order], starts)
    excess = np.add.reduceat(((f - lowest[bin_of]) / density[:, None])[order], starts)
    return np.asarray(lowest + excess / np.tile(basis.projected_sr, 2)[:, None])


def _directions(basis: AngleBasis, proposal: MaterialBSDF, i: int) -> tuple[Floats, Floats, Indices]:
    """wi (N, 3) in patch i of the upper side, wo (N, 3) on both sides, and the outgoing patch (N,) of each."""
    from scipy.stats import qmc

    patch = np.repeat(np.tile(np.arange(basis.count), 2), 1 << EVEN_LOG2)
    u = qmc.Sobol(4, rng=2 * i).random_base2(int(len(patch) - 1).bit_length())[: len(patch)]
    v = qmc.Sobol(5, rng=2 * i + 1).random_base2(LOBES_LOG2)
    wi = basis.points(np.full(len(u) + len(v), i), np.concatenate([u, v[:, :4]])[:, :2]) * HALF_TURN
    even = basis.points(patch, u[:, 2:])
    even[len(even) // 2 :] *= FLIP_Z
    lobes = proposal.sample(wi[len(u) :], v[:, 2:])
    wo = np.concatenate([even, lobes])
    patch = np.concatenate([patch, basis.index(raised(lobes))])
    scattered = (np.abs(wo[:, 2]) > COS_MIN) & (patch != OUTSIDE)  # lobe samples can end at the horizon
    return wi[scattered], wo[scattered], patch[scattered]
