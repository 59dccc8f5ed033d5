"""LBNL BSDF XML on the Klems full basis: 145 x 145 patches, both sides, reflection and transmission.

Every pair of patches holds the mean of f over the projected solid angle of both, so that each patch receives the same
light as from the subject. A lobe can be far narrower than a patch, and lobes rarely reach a dim patch; directions are
therefore drawn both uniformly within every patch and from a BSDF's lobes, and weighted by the sum of both densities
(Veach & Guibas 1995, the balance heuristic). The smallest value of each pair is subtracted first, so that a constant
comes out exactly. Colour follows Radiance's tools: Visible is the luminance; CIE-X and CIE-Z are added.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.errors import UserError
from lambent.core.files import write_text
from lambent.core.geometry.directions import FLIP_Z, HALF_TURN, raised
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampling.lbnl_layout import END, END_OF_BLOCK, block_head, head, losses
from lambent.materials.export.resampling.resampled import (
    Scatterer,
    is_grey,
    knows_the_back,
    proposal_of,
    read_back,
    scatterer_of,
)
from lambent.materials.lobes import COS_MIN
from lambent.materials.measured.parts.klems import KLEMS_FULL, OUTSIDE, AngleBasis
from lambent.materials.measured.parts.spectral import equal_energy_of_rgb

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


NAME = "LBNL BSDF XML"
ENDINGS = (".xml",)
TAKES: tuple[Kind, ...] = ("table", "material")

BASIS = KLEMS_FULL
_DIRECT_SHARE = 0.5
_EXACT = 1e-4  # share of the subject's size below which the subject is a matrix of these patches itself
_WAVELENGTHS = (("CIE-X", "X"), ("Visible", "Y"), ("CIE-Z", "Z"))
_BASES = {"ColumnAngleBasis": BASIS.name, "RowAngleBasis": BASIS.name}


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and return its losses.

    Raises
    ------
    UserError
        If the subject scatters nothing; a file of zeros would be invalid.
    """
    scatterer = scatterer_of(subject)
    grey = scatterer.channels == 1 or (isinstance(subject, Material) and is_grey(subject))
    front, back = _means(subject, scatterer, progress)
    sides = (("Back", front), ("Front", back))  # the format's Back is our +z
    blocks = {f"{way} {side}": f[k] for k, way in enumerate(("Reflection", "Transmission")) for side, f in sides}
    lit = {name: values for name, values in blocks.items() if values.any()}
    if not lit:
        raise UserError("scatters no light: there is nothing to write", file=scatterer.name)
    write_text(Path(path), _document(scatterer.name, lit, grey))
    cost = read_back(subject, Path(path), losses(lit, grey))
    if max(cost.share.values()) < _EXACT:
        return cost
    return replace(cost, lost=(*_lost_detail(front), *cost.lost))


def _means(subject: Subject, scatterer: Scatterer, progress: Progress) -> tuple[Floats, Floats]:
    """Mean f for light from +z and from -z; for a material, which is the same from both sides, exactly reciprocal."""
    if isinstance(subject, Material):
        means = patch_means(scatterer.eval, BASIS, proposal_of(subject), 1, progress)
        means = np.stack([_reciprocal(f) for f in means])
        return means, means
    proposal = proposal_of(subject)
    front = patch_means(scatterer.eval, BASIS, proposal, 1, progress)
    if not knows_the_back(subject):
        return front, np.zeros_like(front)
    return front, patch_means(scatterer.eval, BASIS, proposal, -1, progress)


def _reciprocal(f: Floats) -> Floats:
    """The mean of f (outgoing, incident, C) and of f for reversed light.

    Reversed light enters by the patch opposite to the one by which the light left.
    """
    back = BASIS.opposite
    return np.asarray((f + np.swapaxes(f, 0, 1)[back][:, back]) / 2)


def _lost_detail(front: Floats) -> list[str]:
    lost = ["detail finer than a patch, 10 to 15 degrees wide: a patch holds its mean"]
    for name, values in zip(("reflected", "transmitted"), front, strict=True):
        share = BASIS.direct_share(values.sum(axis=-1))
        if share > _DIRECT_SHARE:
            where = f"{100 * share:.0f} % of the {name} light is in one patch; --as tensor_tree keeps more of it"
            lost.append(f"the shape of the highlight: {where}")
    return lost


def _document(name: str, blocks: dict[str, Floats], grey: bool) -> str:
    data = []
    for part, values in blocks.items():
        xyz = np.repeat(values[..., :1], 3, axis=-1) if grey else equal_energy_of_rgb(values)
        for c, (wavelength, detector) in enumerate(_WAVELENGTHS):
            if wavelength == "Visible" or not grey:
                data += [block_head(wavelength, detector, part, _BASES), *_rows(xyz[..., c]), END_OF_BLOCK]
    return "".join([head(name, "Columns", _basis()), *data, END])


def _basis() -> str:
    rings = zip(BASIS.edges_deg[:-1], BASIS.edges_deg[1:], BASIS.n_phis, strict=True)
    blocks = "".join(
        f"\t\t\t<AngleBasisBlock>\n\t\t\t\t<Theta>{0 if n == 1 else (lower + upper) / 2:g}</Theta>\n"
        f"\t\t\t\t<nPhis>{n}</nPhis>\n\t\t\t\t<ThetaBounds>\n\t\t\t\t\t<LowerTheta>{lower:g}</LowerTheta>\n"
        f"\t\t\t\t\t<UpperTheta>{upper:g}</UpperTheta>\n\t\t\t\t</ThetaBounds>\n\t\t\t</AngleBasisBlock>\n"
        for lower, upper, n in rings
    )
    name = f"\t\t\t<AngleBasisName>{BASIS.name}</AngleBasisName>\n"
    return f"\t\t<AngleBasis>\n{name}{blocks}\t\t</AngleBasis>\n"


def _rows(values: Floats) -> list[str]:
    return ["\t".join(f"{v:.6e}" if v else "0" for v in row) + "\n" for row in values.tolist()]
