"""BSDF files of LBNL WINDOW and Radiance: Klems and other matrices, tensor trees, both sides of a sheet.

n = +z is the side that the files call Back and Radiance calls front; x and y agree. f is evaluated as in Radiance,
without its jitter: constant over patches or leaves, never interpolated. A transmission given for one side only is
reversed for the other; a reflection that is not given is black.

Sources: Klems 1994, "A new method for predicting the solar heat gain of complex fenestration systems"; Ward, Kurt &
Bonneel 2012, "A practical framework for sharing and rendering real-world bidirectional scattering distribution
functions"; Radiance's own evaluation, against which this is tested.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.ceilings import MEASURED_BYTES
from lambent.core.geometry.directions import HALF_TURN, Floats, raised
from lambent.core.inputs import read_bytes
from lambent.materials.measured.parts import lbnl_parts
from lambent.materials.measured.parts.lbnl_parts import Part, Side, Way, Where
from lambent.materials.measured.parts.text_numbers import shown
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable, TableInfo, collect
from lambent.materials.measured.tables.table import on_flat_pairs

NAME = "LBNL BSDF XML"
ISOTROPIC_WITHIN = 0.02  # relative to the mean of f
_DIRECT_SHARE = 0.5

_NAMES: dict[Where, str] = {
    ("reflection", 1): "reflection of the side +z",
    ("reflection", -1): "reflection of the side -z",
    ("transmission", 1): "transmission from +z",
    ("transmission", -1): "transmission from -z",
}


def recognise(head: bytes, size: int) -> bool:
    """Whether the root element is WindowElement."""
    return lbnl_parts.claims_to_be(head)


def read(path: Path) -> LbnlTable:
    """The table of a BSDF file.

    Raises
    ------
    UserError
        The file is not well-formed, declares a document type, names an unknown basis, has another number of values
        than its bases need, a word that is no number or a value that is not finite, or nothing above zero.
    """
    content = read_bytes(path, MEASURED_BYTES)
    parts, notes = lbnl_parts.parts_of(lbnl_parts.parse(content, path), path)
    if skipped := shown(lbnl_parts.preamble(content)).split():
        notes = (*notes, f"skipped before the XML: {' '.join(skipped)[:120]}")
    return LbnlTable(path.name, parts, notes)


@dataclass(frozen=True)
class Use:
    """The part used for light from one side: its own, or the other side's with reversed light."""

    part: Part
    backwards: bool


class LbnlTable(MeasuredTable):
    """Both sides of a sheet, each with the reflection and transmission that the file has.

    `uses` maps (way, side of the light) to the part to use.

    Parameters
    ----------
    file : str
        Name of the file.
    parts : dict
        (way, side) -> part; side +1 is light from +z.
    notes : tuple of str
        On choices made while reading the file.
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
        """Whether the table has data for light from -z."""
        return any(side == -1 for _, side in self.uses)

    @property
    def tuples_from_behind(self) -> int:
        """Number of tuples of light from -z that `samples` leaves out."""
        parts = [part for (_, side), part in self.parts.items() if side == -1 and not self._turned]
        return sum(len(part.tuples()[2]) for part in parts)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr of wi, wo (..., 3) on any side; 0 at the horizon."""
        return on_flat_pairs(self._eval, wi, wo)

    def _eval(self, wi: Floats, wo: Floats) -> Floats:
        f = np.zeros((len(wi), self.info.channels))
        for (way, side), use in self.uses.items():
            far = -side if way == "transmission" else side
            here = (wi[:, 2] * side > 0) & (wo[:, 2] * far > 0)
            entering, leaving = _entering(wi[here]), raised(wo[here])
            if use.backwards:
                entering, leaving = leaving * HALF_TURN, entering * HALF_TURN
            f[here] = use.part.at(entering, leaving)
        return f

    def reflectivity(self, wi: Floats) -> Floats:
        """r (..., C): the exact sum over patches or leaves, on the side of wi."""
        return self._hemispherical(wi, "reflection")

    def transmissivity(self, wi: Floats) -> Floats:
        """t (..., C): the exact sum over patches or leaves, on the far side."""
        return self._hemispherical(wi, "transmission")

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """Tuples of the side +z: all pairs of patches, or the leaves at a uniform choice of wi.

        A file with light from -z alone is turned over, z becomes -z.
        """
        side: Side = -1 if self._turned else 1
        tuples = []
        for (way, from_side), use in self.uses.items():
            if from_side == side:
                entering, leaving, f, weight = use.part.tuples_reversed() if use.backwards else use.part.tuples()
                f = np.broadcast_to(f, (len(f), self.info.channels))
                far = -1.0 if way == "transmission" else 1.0
                tuples.append((entering * HALF_TURN, leaving * (1, 1, far), f, weight))
        wi, wo, f, weight = (np.concatenate(column) for column in zip(*tuples, strict=True))
        return collect(wi, wo, f, weight, self.info, np.zeros(len(f), dtype=bool), max_count)

    def _hemispherical(self, wi: Floats, way: Way) -> Floats:
        flat = np.asarray(wi, float).reshape(-1, 3)
        total = np.zeros((len(flat), self.info.channels))
        for (way_of, side), use in self.uses.items():
            here = flat[:, 2] * side > 0
            if way_of != way or not here.any():
                continue
            look_up = use.part.hemispherical_reversed if use.backwards else use.part.hemispherical
            total[here] = look_up(_entering(flat[here]) * (HALF_TURN if use.backwards else 1.0))
        return total.reshape(*wi.shape[:-1], total.shape[-1])

    def _notes(self, anisotropy: float) -> list[str]:
        notes = ["+z is the side the file calls Back and Radiance calls front"]
        for where, name in _NAMES.items():
            if where not in self.uses and where[0] == "reflection":
                notes.append(f"{name} is not in the file, or zero: black")
            if where in self.uses and self.uses[where].backwards:
                notes.append(f"{name} is not in the file, or zero: reversed from the other side, as in Radiance")
        if self._turned:
            notes.append("the file has light from -z only: for a fit the sheet is turned over")
        if 0 < anisotropy <= ISOTROPIC_WITHIN:
            notes.append(f"turning the sheet changes f by {100 * anisotropy:.2g} %: taken as isotropic")
        negative = {where: part.negative for where, part in self.parts.items() if part.negative}
        notes += [f"{_NAMES[where]}: {count} values are negative" for where, count in negative.items()]
        direct = {where: part.direct_share for where, part in self.parts.items() if part.direct_share > _DIRECT_SHARE}
        if direct:
            shares = ", ".join(f"{100 * share:.0f} % of the {_NAMES[where]}" for where, share in direct.items())
            notes.append(
                f"{shares} is in the patch of the mirrored or the straight direction: neither the file nor a fit can "
                "tell how much sharper than a patch that is; a width below the patch's is a guess"
            )
        return notes


def _entering(wi: Floats) -> Floats:
    """Headings (N, 3), z >= 0, of light from wi."""
    return np.asarray(raised(wi) * HALF_TURN)


def _use(parts: dict[Where, Part], where: Where) -> Use | None:
    way, side = where
    other: Where = (way, 1 if side == -1 else -1)
    if where in parts:
        return Use(parts[where], backwards=False)
    return Use(parts[other], backwards=True) if way == "transmission" and other in parts else None
