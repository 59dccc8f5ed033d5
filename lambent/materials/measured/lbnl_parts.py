"""Make the parts of a BSDF file from its text: choose blocks, bases and colour, and parse the numbers."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.materials.measured.equal_energy import rgb_of_xyz, within_rec709
from lambent.materials.measured.klems import BUILT_IN, AngleBasis, PatchMatrix
from lambent.materials.measured.lbnl_document import Basis, Block, Document
from lambent.materials.measured.tensor_tree import Malformed, Rank, TensorTree, count_words, numbers_of, parse_tree
from lambent.materials.measured.tree_part import TreePart

Way = Literal["reflection", "transmission"]
Side = Literal[1, -1]
Where = tuple[Way, Side]
Part = PatchMatrix | TreePart
"""f of reflection or transmission on one side."""

# The files' Back is +z: Radiance's front, from which its tools trace.
_DIRECTIONS: dict[str, Where] = {
    "transmission back": ("transmission", 1),
    "transmission front": ("transmission", -1),
    "reflection back": ("reflection", 1),
    "reflection front": ("reflection", -1),
}
_STRUCTURES = ("Columns", "Rows", "TensorTree3", "TensorTree4")
_QUANTITIES = ("", "btdf", "brdf", "bsdf")
_LUMINANCE = ("visible", "cie-y")
_CHROMA = {"cie-x": 0, "cie-z": 1, "cie-u": 0, "cie-v": 1}
_SHIRLEY_CHIU = "LBNL/Shirley-Chiu"
_MOST_RINGS = 46  # Radiance's limit
_SAME_DEG = 1e-4
_SATURATED = 1e-3  # of Y: smaller negative values come from rounding in the file


def parts_of(document: Document, file: Path) -> tuple[dict[Where, Part], tuple[str, ...]]:
    """The parts of a file by way and side, and notes on the choices made.

    Parts that are zero throughout are left out, as by Radiance: the other side's transmission then stands for both.

    Raises
    ------
    UserError
        A basis, structure, quantity or value is not of this format, or nothing can be used.
    """
    structure = next((s for s in _STRUCTURES if s.lower() == document.structure.lower()), None)
    if structure is None:
        got, expected = document.structure, ", ".join(_STRUCTURES)
        raise UserError("unknown", file=file, field="IncidentDataStructure", got=got, expected=expected)
    chosen, notes = _choose(document, file)
    maker = _Matrices(document, structure, file) if structure in ("Columns", "Rows") else _Trees(structure, file)
    parts = {where: maker.part(blocks) for where, blocks in chosen.items()}
    lit = {where: part for where, part in parts.items() if not part.dark}
    if not lit:
        raise UserError("holds no value above zero", file=file)
    if any(where[0] == "transmission" for where in parts) and not any(where[0] == "transmission" for where in lit):
        notes.append("transmission is zero throughout: opaque")
    if document.layers > 1:
        notes.append(f"the first layer with data, of {document.layers}")
    return lit, (*notes, *maker.notes)


def sizes_of(parts: Iterable[Part]) -> dict[str, int]:
    """Grid dimensions by name; leaves of several trees are counted together."""
    total: dict[str, int] = {}
    for part in parts:
        for name, size in part.sizes.items():
            total[name] = total.get(name, 0) + size if name == "leaves" else size
    return total


def _choose(document: Document, file: Path) -> tuple[dict[Where, list[Block | None]], list[str]]:
    """Blocks [luminance, X or u', Z or v'] per way and side, and notes; of equal blocks the last counts."""
    names = {block.wavelength.lower(): block.wavelength for block in document.blocks}
    main = next((n for n in (*_LUMINANCE, "solar") if n in names), None)
    if main is None:
        got = ", ".join(names.values()) or None
        raise UserError("has no block that can be used", file=file, field="Wavelength", got=got, expected="Visible")
    chosen: dict[Where, list[Block | None]] = {}
    repeated = 0
    for block in document.blocks:
        where = _DIRECTIONS.get(" ".join(block.direction.lower().split()))
        name = block.wavelength.lower()
        slot = 0 if name == main else 1 + _CHROMA[name] if name in _CHROMA and main in _LUMINANCE else None
        if where is None or slot is None:
            continue
        if block.quantity.lower() not in _QUANTITIES:
            expected = "BTDF or BRDF, in 1/sr"
            raise UserError("unknown", file=file, field="ScatteringDataType", got=block.quantity, expected=expected)
        slots = chosen.setdefault(where, [None, None, None])
        repeated += slots[slot] is not None
        slots[slot] = block
    grey = {w: [b[0], None, None] if None in b else b for w, b in chosen.items() if b[0] is not None}
    if not grey:
        expected = "Transmission or Reflection, Front or Back"
        raise UserError("no block names a side", file=file, field="WavelengthDataDirection", expected=expected)
    return grey, _wavelength_notes(names, main, grey, repeated)


def _wavelength_notes(
    names: dict[str, str], main: str, chosen: dict[Where, list[Block | None]], repeated: int
) -> list[str]:
    used = {b.wavelength.lower() for blocks in chosen.values() for b in blocks if b is not None}
    ignored = [shown or "without a name" for name, shown in names.items() if name not in used]
    notes = [f"f is that of {names[main]}"]
    if len(used) > 1:
        notes = [f"colour of {', '.join(names[n] for n in names if n in used)}, grey where X = Y = Z, as in Radiance"]
    if main == "solar":
        notes = ["f is that of Solar: there is no Visible"]
    if ignored:
        notes.append(f"ignored: {', '.join(ignored)}")
    if repeated:
        notes.append(f"{repeated} blocks occur twice: the later one counts")
    return notes


class _Matrices:
    """Makes parts from blocks stored by columns or rows."""

    def __init__(self, document: Document, structure: str, file: Path) -> None:
        self.notes: list[str] = []
        self._by_rows, self._file = structure == "Rows", file
        self._bases = {basis.name.lower(): basis for basis in BUILT_IN}
        for defined in document.bases:
            self._define(defined)

    def _define(self, defined: Basis) -> None:
        if not defined.name or not defined.rings:
            return
        basis = _basis_of(defined, self._file)
        usual = self._bases.get(basis.name.lower())
        if usual is not None and _same(usual, basis):
            return
        if usual is not None:
            self.notes.append(
                f"{basis.name} is not the usual one; taken as the file defines it, which Radiance does not"
            )
        self._bases[basis.name.lower()] = basis

    def part(self, blocks: list[Block | None]) -> Part:
        channels = [self._matrix(block) for block in blocks if block is not None]
        incident, outgoing, _ = channels[0]
        if any((i, o) != (incident, outgoing) for i, o, _ in channels):
            raise UserError("colours have other bases than Visible", file=self._file)
        values = np.stack([values for _, _, values in channels], axis=-1)
        if len(channels) == 3:
            read = np.asarray((values >= 0).all(axis=-1, keepdims=True))
            rgb = rgb_of_xyz(values[..., [1, 0, 2]])
            outside = int((rgb.min(axis=-1) < -_SATURATED * values[..., 0])[read[..., 0]].sum())
            if outside:
                self.notes.append(f"{outside} values are more saturated than Rec.709 and were desaturated")
            values = np.where(read, within_rec709(rgb), -1.0)
        return PatchMatrix(incident, outgoing, values)

    def _matrix(self, block: Block) -> tuple[AngleBasis, AngleBasis, Floats]:
        """Incident basis, outgoing basis, and values (outgoing, incident)."""
        incident = self._basis(block.columns, "ColumnAngleBasis")
        outgoing = self._basis(block.rows, "RowAngleBasis")
        shape = (outgoing.count, incident.count)
        words = count_words(block.text)
        if words != shape[0] * shape[1]:
            expected = f"{shape[0]} x {shape[1]} values"
            raise UserError("count does not fit", file=self._file, field=block.direction, got=words, expected=expected)
        try:
            values = _finite(numbers_of(block.text), block, self._file)
        except Malformed as error:
            raise UserError(f"holds {error}", file=self._file, field=block.direction) from error
        return incident, outgoing, values.reshape(shape[::-1]).T if self._by_rows else values.reshape(shape)

    def _basis(self, name: str, field: str) -> AngleBasis:
        if name.lower() not in self._bases:
            known("angle basis", name or "none", [b.name for b in self._bases.values()], file=self._file, field=field)
        return self._bases[name.lower()]


class _Trees:
    """Makes parts from tensor trees."""

    def __init__(self, structure: str, file: Path) -> None:
        self.notes: list[str] = []
        self._rank: Rank = 3 if structure.endswith("3") else 4
        self._file = file

    def part(self, blocks: list[Block | None]) -> Part:
        return TreePart(tuple(self._tree(block) for block in blocks if block is not None))

    def _tree(self, block: Block) -> TensorTree:
        if block.angles.lower() != _SHIRLEY_CHIU.lower():
            got = block.angles or "none"
            raise UserError("unknown angle basis", file=self._file, field="AngleBasis", got=got, expected=_SHIRLEY_CHIU)
        try:
            tree = parse_tree(block.text, self._rank)
        except Malformed as error:
            raise UserError(f"tensor tree is broken ({error})", file=self._file, field=block.direction) from error
        _finite(tree.values, block, self._file)
        return tree


def _finite(values: Floats, block: Block, file: Path) -> Floats:
    count = int((~np.isfinite(values)).sum())
    if count:
        raise UserError("holds values that are not finite", file=file, field=block.direction, got=count)
    return values


def _basis_of(defined: Basis, file: Path) -> AngleBasis:
    """The basis that the file defines, or a `UserError`."""

    def refuse(why: str) -> UserError:
        return UserError(f"impossible angle basis: {why}", file=file, field=defined.name)

    if len(defined.rings) > _MOST_RINGS:
        raise refuse(f"{len(defined.rings)} rings, at most {_MOST_RINGS}")
    edges, counts = [0.0], []
    for ring in defined.rings:
        try:
            upper, lower = float(ring.get("UpperTheta", "")), float(ring.get("LowerTheta", edges[-1]))
            count = int(ring.get("nPhis", ""))
        except ValueError:
            raise refuse("ThetaBounds and nPhis are not all numbers") from None
        if not abs(lower - edges[-1]) <= _SAME_DEG or not lower < upper <= 90 + _SAME_DEG:
            raise refuse("theta does not rise from 0 to at most 90 degrees, ring upon ring")
        if count < 1 or (count == 1 and edges[-1] > 0):
            raise refuse(f"a ring of {count} patches from {edges[-1]:g} to {upper:g} degrees")
        edges.append(upper)
        counts.append(count)
    return AngleBasis(defined.name, tuple(edges), tuple(counts))


def _same(a: AngleBasis, b: AngleBasis) -> bool:
    return a.n_phis == b.n_phis and np.allclose(a.edges_deg, b.edges_deg, rtol=0, atol=_SAME_DEG)
