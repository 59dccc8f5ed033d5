"""Parser of the XML of LBNL's BSDF files (schema BSDF v1.4): blocks of numbers as text, with their metadata.

The file is untrusted. It is parsed by events, so that nesting costs nothing. Document type declarations, and with them
entities, are refused; the number of elements, their depth and the length of a tag are limited. A few lines of text
before the XML are skipped, because genBSDF's own output begins with one ("Recover using: ...").
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path
from xml.parsers import expat

from lambent.core.errors import UserError

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
