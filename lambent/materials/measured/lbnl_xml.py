"""BSDF files of LBNL WINDOW and Radiance: Klems and other matrices, tensor trees, both sides of a sheet.

n = +z is the side the files call Back and Radiance calls front; both take x and y as they stand. f is what Radiance
evaluates, without its jitter: constant over patches or leaves, never interpolated. A transmission that is given for one
side alone is used backwards for the other; a reflection that is not given is black.

Sources: Klems 1994, "A new method for predicting the solar heat gain of complex fenestration systems"; Ward, Kurt &
Bonneel 2012, "A practical framework for sharing and rendering real-world bidirectional scattering distribution
functions"; Radiance's own evaluation, against which this is tested.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.files import read_bytes
from lambent.materials.measured import lbnl_document, lbnl_parts
from lambent.materials.measured.lbnl_parts import Part, Side, Way
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect

NAME = "LBNL BSDF XML"
LIMIT_BYTES = 1 << 30
ISOTROPIC_WITHIN = 0.02  # of the mean of f
_DIRECT_SHARE = 0.5

Where = tuple[Way, Side]
_NAMES: dict[Where, str] = {
    ("reflection", 1): "reflection of the side +z",
    ("reflection", -1): "reflection of the side -z",
    ("transmission", 1): "transmission from +z",
    ("transmission", -1): "transmission from -z",
}


def recognise(head: bytes, size: int) -> bool:
    """Whether the root element is WindowElement."""
    return lbnl_document.claims_to_be(head)


def read(path: Path) -> LbnlTable:
    """The table of a BSDF file.

    Raises
    ------
    UserError
        Where it is not well-formed, declares a document type, names an unknown basis, holds another count of values
        than its bases need, a word that is no number or a value that is not finite, or nothing above zero.
    """
    content = read_bytes(path, LIMIT_BYTES)
    document = lbnl_document.parse(content, path)
    del content
    parts, notes = lbnl_parts.parts_of(document, path)
    return LbnlTable(path.name, parts, notes)


@dataclass(frozen=True)
class Use:
    """How light that comes from one side is answered: by a part of the file, or by the other side's backwards."""

    part: Part
    backwards: bool


class LbnlTable:
    """Both sides of a sheet, each with reflection and transmission, as far as the file has them.

    `uses` says by (way, side of the light) which part answers.

    Parameters
    ----------
    file : str
        Name of the file.
    parts : dict
        (way, side) -> part; side +1 is light from +z.
    notes : tuple of str
        What the reading of the file had to choose.
    """

    def __init__(self, file: str, parts: dict[Where, Part], notes: tuple[str, ...] = ()) -> None:
        self.parts = parts
        self.uses = {where: use for where in _NAMES if (use := _use(parts, where)) is not None}
        self._turned = not any(side == 1 for _, side in parts)
        anisotropy = max(part.anisotropy for part in parts.values())
        self.info = TableInfo(
            file=file,
            format=NAME,
            isotropic=anisotropy <= ISOTROPIC_WITHIN,
            transmits=any(way == "transmission" for way, _ in parts),
            channels=max(part.channels for part in parts.values()),
            stored="f",
            sizes=lbnl_parts.sizes_of(parts.values()),
            notes=(*notes, *self._notes(anisotropy)),
        )

    @property
    def has_a_back(self) -> bool:
        """Whether the table says anything of light from -z."""
        return any(side == -1 for _, side in self.uses)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr of wi, wo (..., 3) on any side; 0 at the horizon."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        shape = wi.shape[:-1]
        wi, wo = wi.reshape(-1, 3), wo.reshape(-1, 3)
        f = np.zeros((len(wi), self.info.channels))
        for (way, side), use in self.uses.items():
            far = -side if way == "transmission" else side
            here = (wi[:, 2] * side > 0) & (wo[:, 2] * far > 0)
            entering, leaving = _entering(wi[here]), _leaving(wo[here])
            if use.backwards:
                entering, leaving = leaving * _BACK, entering * _BACK
            f[here] = use.part.at(entering, leaving)
        return f.reshape(*shape, -1)

    def reflectivity(self, wi: Floats) -> Floats:
        """r (..., C): the exact sum over patches or leaves, on the side of wi."""
        return self._hemispherical(wi, "reflection")

    def transmissivity(self, wi: Floats) -> Floats:
        """t (..., C): the exact sum over patches or leaves, on the far side."""
        return self._hemispherical(wi, "transmission")

    def albedo(self, wi: Floats) -> Floats:
        """r + t (..., C)."""
        return np.asarray(self.reflectivity(wi) + self.transmissivity(wi))

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """Tuples of the side +z: the middles of all pairs of patches, or of leaves at an even choice of wi.

        Of a file that knows light from -z alone the sheet is turned over, z for -z.
        """
        side: Side = -1 if self._turned else 1
        columns: list[list[Floats]] = [[], [], [], []]
        for (way, from_side), use in self.uses.items():
            if from_side == side:
                entering, leaving, f, weight = use.part.tuples_reversed() if use.backwards else use.part.tuples()
                far = -1.0 if way == "transmission" else 1.0
                new = (entering * _BACK, leaving * (1, 1, far), self._in_channels(f), weight)
                for column, values in zip(columns, new, strict=True):
                    column.append(values)
        wi, wo, f, weight = (np.concatenate(column) for column in columns)
        return collect(wi, wo, f, weight, self.info, np.zeros(len(f), dtype=bool), max_count)

    def _in_channels(self, f: Floats) -> Floats:
        return np.broadcast_to(f, (len(f), self.info.channels))

    def _hemispherical(self, wi: Floats, way: Way) -> Floats:
        flat = np.asarray(wi, float).reshape(-1, 3)
        total = np.zeros((len(flat), self.info.channels))
        for (way_of, side), use in self.uses.items():
            here = flat[:, 2] * side > 0
            if way_of != way or not here.any():
                continue
            entering = _entering(flat[here])
            if use.backwards:
                total[here] = use.part.hemispherical_reversed(entering * _BACK)
            else:
                total[here] = use.part.hemispherical(entering)
        return total.reshape(*wi.shape[:-1], -1)

    def _notes(self, anisotropy: float) -> list[str]:
        notes = ["+z is the side the file calls Back and Radiance calls front"]
        for where, name in _NAMES.items():
            if where not in self.uses:
                if where[0] == "reflection":
                    notes.append(f"{name} is not in the file, or zero: black")
            elif self.uses[where].backwards:
                notes.append(f"{name} is not in the file, or zero: the other side's backwards, as Radiance does")
        if self._turned:
            notes.append("the file knows light from -z alone: for a fit the sheet is turned over")
        if 0 < anisotropy <= ISOTROPIC_WITHIN:
            notes.append(f"turning the sheet changes f by {100 * anisotropy:.2g} %: taken as isotropic")
        for where, part in self.parts.items():
            if part.negative:
                notes.append(f"{_NAMES[where]}: {part.negative} negative values count as 0")
        direct = {where: part.direct_share for where, part in self.parts.items() if part.direct_share > _DIRECT_SHARE}
        if direct:
            shares = ", ".join(f"{100 * share:.0f} % of the {_NAMES[where]}" for where, share in direct.items())
            notes.append(
                f"{shares} is in the patch of the mirrored or the straight direction: how much sharper than a patch "
                "that is, the file does not say, and no fit can; a width below the patch's is a guess"
            )
        return notes


_BACK = np.array((-1.0, -1.0, 1.0))  # turns a heading round: light that comes from where it went


def _entering(wi: Floats) -> Floats:
    """Headings (N, 3), z >= 0, of light that comes from wi: the way it travels, projected on the sheet."""
    return np.column_stack([-wi[:, 0], -wi[:, 1], np.abs(wi[:, 2])])


def _leaving(wo: Floats) -> Floats:
    return np.column_stack([wo[:, 0], wo[:, 1], np.abs(wo[:, 2])])


def _use(parts: dict[Where, Part], where: Where) -> Use | None:
    way, side = where
    other: Where = (way, 1 if side == -1 else -1)
    if where in parts:
        return Use(parts[where], backwards=False)
    return Use(parts[other], backwards=True) if way == "transmission" and other in parts else None
