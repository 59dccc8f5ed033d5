"""LBNL's BSDF files (schema BSDF v1.4): parse the XML, choose blocks, bases and colour, and parse the numbers.

The file is untrusted. It is parsed by events, so that nesting costs nothing. Document type declarations, and with them
entities, are refused; the number of elements, their depth and the length of a tag are limited. A few lines of text
before the XML are skipped, because genBSDF's own output begins with one ("Recover using: ...").
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from xml.parsers import expat

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.materials.measured.parts.klems import BUILT_IN, AngleBasis, PatchMatrix
from lambent.materials.measured.parts.spectral import rgb_of_equal_energy, within_rec709
from lambent.materials.measured.parts.tensor_tree import (
    Malformed,
    Rank,
    TensorTree,
    count_words,
    numbers_of,
    parse_tree,
)
from lambent.materials.measured.parts.tree_part import TreePart

ROOT = "WindowElement"
_ROOT_TAG = re.compile(rb"<([\w.-]{1,64}:)?WindowElement[\s>/]")
_LONG_TAG = re.compile(rb"<[A-Za-z_:][^<>]{8192}")
_PREAMBLE = re.compile(  # at most 16 lines of at most 1024 bytes, without markup
    rb"(?:\xef\xbb\xbf)?(?:(?![ \t]*<)[^\r\n\x00-\x08\x0e-\x1f]{0,1024}(?:\r\n?|\n)){1,16}?[ \t]*"
    rb"(?=<\?xml\s|<(?:[\w.-]{1,64}:)?WindowElement[\s>/])"
)
_MOST_ELEMENTS, _DEEPEST, _LONGEST_FIELD = 50_000, 64, 10_000

Texts = dict[str, str]
"""Text by the name of its element."""


@dataclass(frozen=True)
class Document:
    """Content of the first layer with data.

    Attributes
    ----------
    structure : str
        IncidentDataStructure: Columns, Rows, TensorTree3 or TensorTree4.
    layers : int
        Number of layers in the file.
    bases : list of (str, list of dict)
        Name of an angle basis, and `nPhis`, `LowerTheta` and `UpperTheta` of its rings, where given.
    blocks : list of dict
        Text of the elements of a WavelengthDataBlock, and its `Wavelength`, where given.
    """

    structure: str
    layers: int
    bases: list[tuple[str, list[Texts]]]
    blocks: list[Texts]


def preamble(head: bytes) -> bytes:
    """The lines of text before the XML of a file that begins with `head`; empty if there are none, or too many."""
    found = _PREAMBLE.match(head)
    return found[0] if found else b""


def claims_to_be(head: bytes) -> bool:
    """Whether a file that begins with `head` has this format's root element, in UTF-8 or UTF-16."""
    plain = head[len(preamble(head)) :].replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return plain.startswith(b"<") and _ROOT_TAG.search(plain) is not None


def parse(content: bytes, path: Path) -> Document:
    """The document of a file's content.

    Raises
    ------
    UserError
        The content is not XML, another document, declares a document type, or is beyond the limits.
    """
    if b"\0" in content:
        raise UserError("has NUL bytes", file=path, expected="XML in UTF-8")
    if _LONG_TAG.search(content):
        raise UserError("has a tag of over 8192 bytes", file=path)
    tree = ET.TreeBuilder()
    elements = depth = 0

    def start(tag: str, _: dict[str, str]) -> None:
        nonlocal elements, depth
        elements, depth = elements + 1, depth + 1
        if elements > _MOST_ELEMENTS or depth > _DEEPEST:
            raise UserError("has more or deeper elements than any BSDF file", file=path)
        name = tag.rpartition(":")[2]
        if depth == 1 and name != ROOT:
            raise UserError("wrong kind of XML", file=path, got=tag, expected=ROOT)
        tree.start(name, {})

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        tree.end(tag.rpartition(":")[2])

    def refuse_doctype(*_: object) -> None:
        raise UserError("declares a document type, which is not supported", file=path)

    parser = expat.ParserCreate()
    parser.buffer_text, parser.buffer_size = True, 1 << 16
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = tree.data, refuse_doctype
    try:
        parser.Parse(memoryview(content)[len(preamble(content)) :], True)
    except expat.ExpatError as error:
        raise UserError(f"not well-formed XML ({error})", file=path) from error
    except (LookupError, ValueError) as error:  # an encoding unknown to Python, or of several bytes
        raise UserError("encoding cannot be read", file=path, got=error, expected="XML in UTF-8") from error
    return _document(tree.close(), path)


def _document(root: ET.Element, path: Path) -> Document:
    """The first layer with data, or the last one."""
    layers = root.findall("Optical/Layer")
    with_data = [layer for layer in layers if layer.find("WavelengthData/WavelengthDataBlock") is not None]
    layer = (with_data[:1] or layers[-1:] or [root])[0]
    _texts(layer.find("Material"), path)  # unused names, checked for length
    structure, bases, blocks = "", [], []
    for definition in layer.findall("DataDefinition"):
        structure = _texts(definition, path).get("IncidentDataStructure", structure)
        for basis in definition.findall("AngleBasis"):
            rings = [
                _texts(ring, path) | _texts(ring.find("ThetaBounds"), path) for ring in basis.findall("AngleBasisBlock")
            ]
            bases.append((_texts(basis, path).get("AngleBasisName", ""), rings))
    for data in layer.findall("WavelengthData"):
        wavelength = _texts(data, path).get("Wavelength", "")
        blocks += [{**_texts(block, path), "Wavelength": wavelength} for block in data.findall("WavelengthDataBlock")]
    return Document(structure, len(layers), bases, blocks)


def _texts(element: ET.Element | None, path: Path) -> Texts:
    """Texts of the children, the last of repeated ones, with blanks collapsed; ScatteringData's unchanged."""
    found = {}
    for child in element if element is not None else ():
        text = child.text or ""
        if child.tag != "ScatteringData":
            if len(text) > _LONGEST_FIELD:
                raise UserError("is too long", file=path, field=child.tag)
            text = " ".join(text.split())
        found[child.tag] = text
    return found


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
_SATURATED = 1e-3  # relative to Y: smaller negative values are rounding in the file


def parts_of(document: Document, file: Path) -> tuple[dict[Where, Part], tuple[str, ...]]:
    """The parts of a file by way and side, and notes on the choices made.

    Parts that are zero everywhere are dropped, as in Radiance: the other side's transmission then serves both sides.

    Raises
    ------
    UserError
        If a basis, structure, quantity or value is not of this format, or nothing is usable.
    """
    structure = next((s for s in _STRUCTURES if s.lower() == document.structure.lower()), None)
    if structure is None:
        got, expected = document.structure, ", ".join(_STRUCTURES)
        raise UserError("unknown", file=file, field="IncidentDataStructure", got=got, expected=expected)
    chosen, notes = _choose(document, file)
    made: list[str] = []
    parts: dict[Where, Part]
    if structure in ("Columns", "Rows"):
        bases = _bases_of(document, file, made)
        parts = {where: _matrix_of(blocks, structure == "Rows", bases, file, made) for where, blocks in chosen.items()}
    else:
        rank: Rank = 3 if structure == "TensorTree3" else 4
        parts = {where: TreePart(tuple(_tree(one, rank, file) for one in blocks)) for where, blocks in chosen.items()}
    lit = {where: part for where, part in parts.items() if not part.dark}
    if not lit:
        raise UserError("has no value above zero", file=file)
    if any(where[0] == "transmission" for where in parts) and not any(where[0] == "transmission" for where in lit):
        notes.append("transmission is zero throughout: opaque")
    if document.layers > 1:
        notes.append(f"the first layer with data, of {document.layers}")
    return lit, (*notes, *made)


def sizes_of(parts: Iterable[Part]) -> dict[str, int]:
    """Grid dimensions by name; the leaves of all trees are added up."""
    total: dict[str, int] = {}
    for part in parts:
        for name, size in part.sizes.items():
            total[name] = total.get(name, 0) + size if name == "leaves" else size
    return total


def _choose(document: Document, file: Path) -> tuple[dict[Where, list[Texts]], list[str]]:
    """Blocks by way and side, [luminance] or [luminance, X or u', Z or v'], and notes; the last duplicate wins."""
    names = {block["Wavelength"].lower(): block["Wavelength"] for block in document.blocks}
    main = next((n for n in (*_LUMINANCE, "solar") if n in names), None)
    if main is None:
        got = ", ".join(names.values()) or None
        raise UserError("has no usable block", file=file, field="Wavelength", got=got, expected="Visible")
    found: dict[Where, dict[int, Texts]] = {}
    repeated = 0
    for block in document.blocks:
        where = _DIRECTIONS.get(block.get("WavelengthDataDirection", "").lower())
        name = block["Wavelength"].lower()
        slot = 0 if name == main else 1 + _CHROMA[name] if name in _CHROMA and main in _LUMINANCE else None
        if where is None or slot is None:
            continue
        quantity = block.get("ScatteringDataType", "")
        if quantity.lower() not in _QUANTITIES:
            expected = "BTDF or BRDF, in 1/sr"
            raise UserError("unknown", file=file, field="ScatteringDataType", got=quantity, expected=expected)
        slots = found.setdefault(where, {})
        repeated += slot in slots
        slots[slot] = block
    chosen = {w: [b[k] for k in range(3 if len(b) == 3 else 1)] for w, b in found.items() if 0 in b}
    if not chosen:
        expected = "Transmission or Reflection, Front or Back"
        raise UserError("no block has a side", file=file, field="WavelengthDataDirection", expected=expected)
    return chosen, _wavelength_notes(names, main, chosen, repeated)


def _wavelength_notes(names: Texts, main: str, chosen: dict[Where, list[Texts]], repeated: int) -> list[str]:
    used = {block["Wavelength"].lower() for blocks in chosen.values() for block in blocks}
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


def _bases_of(document: Document, file: Path, notes: list[str]) -> dict[str, AngleBasis]:
    """The built-in bases and those that the file defines, by lower-case name."""
    bases = {basis.name.lower(): basis for basis in BUILT_IN}
    for name, rings in document.bases:
        if not name or not rings:
            continue
        basis, usual = _basis_of(name, rings, file), bases.get(name.lower())
        if usual is not None:
            if _same(usual, basis):
                continue
            notes.append(f"{name} differs from the standard basis: the file's definition is used, unlike in Radiance")
        bases[name.lower()] = basis
    return bases


def _matrix_of(
    blocks: list[Texts], by_rows: bool, bases: dict[str, AngleBasis], file: Path, notes: list[str]
) -> PatchMatrix:
    """The part of blocks stored by columns or rows."""
    channels = [_matrix(block, by_rows, bases, file) for block in blocks]
    incident, outgoing, _ = channels[0]
    if any((i, o) != (incident, outgoing) for i, o, _ in channels):
        raise UserError("colour blocks have a different angle basis than Visible", file=file)
    values = np.stack([values for _, _, values in channels], axis=-1)
    if len(channels) == 3:
        read = np.asarray((values >= 0).all(axis=-1, keepdims=True))  # otherwise it is noise, not a saturated colour
        rgb = rgb_of_equal_energy(values[..., [1, 0, 2]])
        outside = int((rgb.min(axis=-1) < -_SATURATED * values[..., 0])[read[..., 0]].sum())
        if outside:
            notes.append(f"{outside} values are more saturated than Rec.709 and were desaturated")
        values = np.where(read, within_rec709(rgb), rgb)
    return PatchMatrix(incident, outgoing, values)


def _matrix(
    block: Texts, by_rows: bool, bases: dict[str, AngleBasis], file: Path
) -> tuple[AngleBasis, AngleBasis, Floats]:
    """Incident basis, outgoing basis, and values (outgoing, incident)."""
    named = []
    for field in ("ColumnAngleBasis", "RowAngleBasis"):
        name = block.get(field, "")
        if name.lower() not in bases:
            known("angle basis", name or "none", [b.name for b in bases.values()], file=file, field=field)
        named.append(bases[name.lower()])
    incident, outgoing = named
    shape, text = (outgoing.count, incident.count), _data(block)
    words = count_words(text)
    if words != shape[0] * shape[1]:
        field, expected = block["WavelengthDataDirection"], f"{shape[0]} x {shape[1]} values"
        raise UserError("wrong number of values", file=file, field=field, got=words, expected=expected)
    try:
        values = _finite(numbers_of(text), block, file)
    except Malformed as error:
        raise UserError(f"holds {error}", file=file, field=block["WavelengthDataDirection"]) from error
    return incident, outgoing, values.reshape(shape[::-1]).T if by_rows else values.reshape(shape)


def _tree(block: Texts, rank: Rank, file: Path) -> TensorTree:
    named = block.get("AngleBasis", "")
    if named.lower() != _SHIRLEY_CHIU.lower():
        got = named or "none"
        raise UserError("unknown angle basis", file=file, field="AngleBasis", got=got, expected=_SHIRLEY_CHIU)
    try:
        tree = parse_tree(_data(block), rank)
    except Malformed as error:
        field = block["WavelengthDataDirection"]
        raise UserError(f"tensor tree is malformed ({error})", file=file, field=field) from error
    _finite(tree.values, block, file)
    return tree


def _data(block: Texts) -> bytes:
    """ScatteringData; non-ASCII letters are replaced by one that is not a number and is rejected later."""
    return block.get("ScatteringData", "").encode("ascii", "replace")


def _finite(values: Floats, block: Texts, file: Path) -> Floats:
    count = int((~np.isfinite(values)).sum())
    if count:
        raise UserError("has values that are not finite", file=file, field=block["WavelengthDataDirection"], got=count)
    return values


def _basis_of(name: str, rings: list[Texts], file: Path) -> AngleBasis:
    """The basis that the file defines, or a `UserError`."""

    def refuse(why: str) -> UserError:
        return UserError(f"impossible angle basis: {why}", file=file, field=name)

    if len(rings) > _MOST_RINGS:
        raise refuse(f"{len(rings)} rings, at most {_MOST_RINGS}")
    edges, counts = [0.0], []
    for ring in rings:
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
    return AngleBasis(name, tuple(edges), tuple(counts))


def _same(a: AngleBasis, b: AngleBasis) -> bool:
    return a.n_phis == b.n_phis and np.allclose(a.edges_deg, b.edges_deg, rtol=0, atol=_SAME_DEG)
