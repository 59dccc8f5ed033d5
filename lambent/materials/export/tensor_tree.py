"""LBNL BSDF XML as tensor trees for Radiance: cells are fine where the subject varies, see tree_growth.py.

Rank 3 if turning the sheet does not change the subject, else rank 4. A tree that was read is written with its own cells
and values. Colour is luminance with u' and v' of CIE 1976, as in Radiance's tools.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import atomic_path
from lambent.core.geometry.directions import HALF_TURN, Floats, raised, rotation_about
from lambent.core.progress import Progress, part_of, silent
from lambent.materials.document import Material
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampling.lbnl_layout import END, END_OF_BLOCK, block_head, head, losses, pieces_of
from lambent.materials.export.resampling.resampled import (
    Scatterer,
    is_grey,
    knows_the_back,
    proposal_of,
    read_back,
    scatterer_of,
    tuples_of,
)
from lambent.materials.export.resampling.tree_growth import TOLERANCE, Growth, Scouts
from lambent.materials.lobes import COS_MIN
from lambent.materials.measured.lbnl_xml import ISOTROPIC_WITHIN, LbnlTable
from lambent.materials.measured.parts.spectral import equal_energy_of_rgb
from lambent.materials.measured.parts.tensor_tree import Rank, TensorTree, coordinates, disk_of
from lambent.materials.measured.parts.tree_part import TreePart, on_sphere

NAME = "LBNL BSDF XML, tensor tree"
ENDINGS = (".xml",)
TAKES: tuple[Kind, ...] = ("table", "material")

SCOUTS_LOG2 = 19  # directions drawn from lobes, for light from one side
MOST_TUPLES = 100_000  # tuples of a table, which serve as scouts too
CHROMA_TOLERANCE = 0.004  # range of u' and v' in a cell
_WAVELENGTHS = ("Visible", "CIE-u", "CIE-v")
_DIGITS, _ALL_DIGITS = 6, 9  # of means, and of values from a tree that was read
_LOST_PATCHES = "the patch borders, which do not match the cells; --as lbnl_xml keeps a matrix on Klems full"
_MENTIONED = 0.01  # share of the light in uneven cells above which it is reported

Trees = dict[str, tuple[TensorTree, ...]]
"""(Y,) or (Y, u', v') by the file's name of the direction, such as Reflection Back."""


def write(subject: Subject, path: Path, progress: Progress = silent, rank: Rank | None = None) -> Cost:
    """Write the file and return its losses.

    Parameters
    ----------
    rank : 3 or 4, optional
        By default 3 if turning the sheet changes the subject by at most 2 % of its mean, else 4.

    Raises
    ------
    UserError
        If the subject scatters nothing, or depends on azimuth with rank 3 requested.
    """
    scatterer = scatterer_of(subject)
    own = _own_trees(subject, rank)
    trees, lost = (own, []) if own else _grown(subject, scatterer, rank, progress)
    if not trees:
        raise UserError("scatters no light: there is nothing to write", file=scatterer.name)
    with atomic_path(Path(path)) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.writelines(_document(scatterer.name, trees, _ALL_DIGITS if own else _DIGITS))
    return read_back(subject, Path(path), tuple(lost))


def _document(name: str, trees: Trees, digits: int) -> Iterator[str]:
    """The file's text in pieces."""
    rank = next(iter(trees.values()))[0].rank
    yield head(name, f"TensorTree{rank}")
    for direction, several in trees.items():
        for wavelength, tree in zip(_WAVELENGTHS, several, strict=False):
            yield block_head(wavelength, "Y", direction, {"AngleBasis": "LBNL/Shirley-Chiu"})
            yield from pieces_of(tree, digits)
            yield END_OF_BLOCK
    yield END


def _own_trees(subject: Subject, rank: Rank | None) -> Trees | None:
    """The trees of a table that was read from trees, unless another rank is requested."""
    if not isinstance(subject, LbnlTable):
        return None
    found: Trees = {}
    for (way, side), part in subject.parts.items():
        if not isinstance(part, TreePart) or part.rank != (rank or part.rank):
            return None
        found[_direction(way == "transmission", side)] = part.trees
    return found


def _direction(through: bool, side: int) -> str:
    """The file's name; its Back is our +z."""
    return f"{'Transmission' if through else 'Reflection'} {'Back' if side > 0 else 'Front'}"


def _grown(subject: Subject, scatterer: Scatterer, asked: Rank | None, progress: Progress) -> tuple[Trees, list[str]]:
    """Trees for every way and side that scatter light, and their losses."""
    turning = _change_by_turning(subject, scatterer)
    if asked == 3 and turning > ISOTROPIC_WITHIN and scatterer.symmetry != "isotropic":
        got = f"turning the sheet changes f by {100 * turning:.2g} % of its mean"
        raise UserError("rank 3 is for isotropic sheets", file=scatterer.name, got=got, hint="use rank 4")
    rank: Rank = asked or (3 if turning <= ISOTROPIC_WITHIN else 4)
    material = isinstance(subject, Material)
    grey = scatterer.channels == 1 or (isinstance(subject, Material) and is_grey(subject))
    sides = (1, -1) if knows_the_back(subject) and not material else (1,)
    parts = [(side, through) for side in sides for through in (False, True) if scatterer.transmits or not through]
    trees: Trees = {}
    lost = [_LOST_PATCHES] if _is_matrix(subject) else []
    for k, (side, through) in enumerate(parts):
        name = _direction(through, side)
        step = part_of(progress, k / len(parts), (k + 1) / len(parts), f"dividing directions: {name}")
        content = _content(scatterer, rank, side, through, grey)
        growth = Growth(rank, content, _scouts(subject, content, rank, side, through), step)
        if growth.highest.any():
            trees[name] = _trees_of(growth)
            lost += _lost(growth, name)
    if material:  # equal from both sides
        trees |= {_direction(name.startswith("T"), -1): several for name, several in trees.items()}
    return trees, [*lost, *losses(trees, grey)]


def _change_by_turning(subject: Subject, scatterer: Scatterer) -> float:
    """Change of f when the sheet is turned, over the mean of f, at the subject's tuples; 0 if it is isotropic.

    A matrix that claims isotropy is tested too: its patches agree at some azimuths, but others lie between them.
    """
    if scatterer.symmetry == "isotropic" and not _is_matrix(subject):
        return 0.0
    samples = tuples_of(subject, MOST_TUPLES // 5)
    f = scatterer.eval(samples.wi, samples.wo)
    weight = samples.weight * np.abs(samples.wo[:, 2])
    size = float((weight @ f).sum())
    normal = np.array([0.0, 0.0, 1.0])
    turned = [
        scatterer.eval(*(w @ rotation_about(normal, np.radians(angle)).T for w in (samples.wi, samples.wo)))
        for angle in (23.0, 61.0, 90.0)
    ]
    return max(float((weight @ np.abs(g - f)).sum()) for g in turned) / size if size > 0 else 0.0


def _is_matrix(subject: Subject) -> bool:
    """Whether a table is constant over patches."""
    return isinstance(subject, LbnlTable) and "outgoing patches" in subject.info.sizes


def _content(scatterer: Scatterer, rank: Rank, side: int, through: bool, grey: bool) -> Callable[[Floats], Floats]:
    """f (N, 1), or as XYZ (N, 3), at places (N, rank)."""
    far = -side if through else side

    def content(place: Floats) -> Floats:
        wi, wo = _pairs_at(rank, place)
        f = np.maximum(scatterer.eval(wi * (1, 1, side), wo * (1, 1, far)), 0)
        return f[:, :1] if grey else equal_energy_of_rgb(f)

    return content


def _pairs_at(rank: Rank, place: Floats) -> tuple[Floats, Floats]:
    """wi and wo (N, 3) with z > 0 of places (N, rank): the inverse of `coordinates`."""
    if rank == 4:
        entering = disk_of(place[:, :2])
    else:
        entering = np.stack([1 - 2 * place[:, 0].clip(0, 0.5), np.zeros(len(place))], axis=-1)
    wi, wo = (on_sphere(disk) for disk in (entering, disk_of(place[:, rank - 2 :])))
    return np.maximum(wi * HALF_TURN, (-1, -1, COS_MIN)), np.maximum(wo, (-1, -1, COS_MIN))


def _scouts(subject: Subject, content: Callable[[Floats], Floats], rank: Rank, side: int, through: bool) -> Scouts:
    """Places drawn from the lobes that the subject may have, and from a table's own tuples."""
    from scipy.stats import qmc

    proposal = proposal_of(subject)
    through_sign = -1 if through else 1

    def density_at(place: Floats) -> Floats:
        wi, wo = _pairs_at(rank, place)
        used = 1.0 if rank == 4 else 2.0  # rank 3 has wi in one half of its cube only
        return np.asarray((used * np.pi * 2**SCOUTS_LOG2) * proposal.pdf(wo * (1, 1, through_sign), wi) / wo[:, 2])

    u = qmc.Sobol(rank + 1, scramble=True, rng=0).random_base2(SCOUTS_LOG2)
    start = u[:, : rank - 2] if rank == 4 else u[:, :1] / 2
    wi, _ = _pairs_at(rank, np.concatenate([start, np.full((len(u), 2), 0.5)], axis=1))
    wo = proposal.sample(wi, u[:, rank - 2 :])
    chosen = wo[:, 2] * through_sign > COS_MIN
    drawn = coordinates(rank, wi[chosen] * HALF_TURN, raised(wo[chosen]))
    density = density_at(drawn)
    if not isinstance(subject, Material) and side > 0:
        samples = subject.samples(MOST_TUPLES)
        here = samples.transmitted == through
        measured = coordinates(rank, samples.wi[here] * HALF_TURN, raised(samples.wo[here]))
        drawn = np.concatenate([drawn, measured])
        density = np.concatenate([density, np.full(len(measured), np.inf)])
    drawn = drawn.clip(0, np.nextafter(1, 0))
    return Scouts(drawn, content(drawn), density, density_at)


def _trees_of(growth: Growth) -> tuple[TensorTree, ...]:
    channels = growth.mean.shape[1]
    luminance = growth.tree(lambda mean: mean[:, channels // 2])
    if channels == 1:
        return (luminance,)
    u = growth.tree(lambda mean: _uv(mean)[:, 0], CHROMA_TOLERANCE)
    v = growth.tree(lambda mean: _uv(mean)[:, 1], CHROMA_TOLERANCE)
    return luminance, u, v


def _uv(xyz: Floats) -> Floats:
    """u' and v' (N, 2) of CIE 1976 of XYZ (N, 3); those of grey where it is black."""
    xyz = np.where(xyz[:, 1:2] > 0, xyz, 1.0)
    return np.asarray(xyz[:, :2] * (4, 9) / (xyz @ (1, 15, 3))[:, None])


def _lost(growth: Growth, name: str) -> list[str]:
    lost = []
    if growth.uneven_share > _MENTIONED:
        finest = f"{growth.smallest_deg:.2g} degrees"
        lost.append(
            f"{name}: {growth.uneven_share:.0%} of the light is in cells that vary by more than {TOLERANCE:.0%}; the "
            f"finest are {finest} wide"
        )
    if growth.kept_peak < 1 - TOLERANCE:
        lost.append(f"{name}: the peak, {growth.kept_peak:.0%} of which is left; its energy is kept")
    return lost
