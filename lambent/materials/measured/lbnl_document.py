"""Parser of the XML of LBNL's BSDF files (schema BSDF v1.4): blocks of numbers as text, with their metadata.

The file is untrusted. It is read by events, so nesting costs nothing. A document type declaration is refused, and so
are the entities it could define; the number of elements, their depth and the length of a tag are limited.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from lambent.core.errors import UserError

ROOT = "WindowElement"
_ROOT_TAG = re.compile(rb"<([\w.-]{1,64}:)?WindowElement[\s>/]")
_LONG_TAG = re.compile(rb"<[A-Za-z_:][^<>]{8192}")
_MOST_ELEMENTS, _DEEPEST, _LONGEST_FIELD = 50_000, 64, 10_000

_LAYER = f"{ROOT}/Optical/Layer"
_BASIS = f"{_LAYER}/DataDefinition/AngleBasis"
_RING = f"{_BASIS}/AngleBasisBlock"
_DATA = f"{_LAYER}/WavelengthData"
_BLOCK = f"{_DATA}/WavelengthDataBlock"


@dataclass
class Basis:
    """An angle basis as the file defines it, as text.

    Attributes
    ----------
    rings : list of dict
        `nPhis`, `LowerTheta` and `UpperTheta`, where given.
    """

    name: str = ""
    rings: list[dict[str, str]] = field(default_factory=list)


@dataclass
class Block:
    """One ScatteringData and its metadata; "" where the file gives none."""

    wavelength: str = ""
    direction: str = ""
    columns: str = ""
    rows: str = ""
    angles: str = ""
    quantity: str = ""
    text: bytes = b""


@dataclass
class Document:
    """Content of the first layer with data.

    Attributes
    ----------
    structure : str
        IncidentDataStructure: Columns, Rows, TensorTree3 or TensorTree4.
    name, maker : str
        Of the material.
    layers : int
        Number of layers in the file.
    """

    structure: str = ""
    name: str = ""
    maker: str = ""
    layers: int = 0
    bases: list[Basis] = field(default_factory=list)
    blocks: list[Block] = field(default_factory=list)


_OF_DOCUMENT = {
    f"{_LAYER}/DataDefinition/IncidentDataStructure": "structure",
    f"{_LAYER}/Material/Name": "name",
    f"{_LAYER}/Material/Manufacturer": "maker",
}
_OF_BLOCK = {
    f"{_BLOCK}/WavelengthDataDirection": "direction",
    f"{_BLOCK}/ColumnAngleBasis": "columns",
    f"{_BLOCK}/RowAngleBasis": "rows",
    f"{_BLOCK}/AngleBasis": "angles",
    f"{_BLOCK}/ScatteringDataType": "quantity",
}
_OF_RING = {
    f"{_RING}/nPhis": "nPhis",
    f"{_RING}/ThetaBounds/LowerTheta": "LowerTheta",
    f"{_RING}/ThetaBounds/UpperTheta": "UpperTheta",
}
_SCATTERING = f"{_BLOCK}/ScatteringData"
_BASIS_NAME = f"{_BASIS}/AngleBasisName"
_FIELDS = {*_OF_DOCUMENT, *_OF_BLOCK, *_OF_RING, _SCATTERING, _BASIS_NAME, f"{_DATA}/Wavelength"}
_KNOWN = {"/".join(path.split("/")[:n]) for path in _FIELDS for n in range(1, path.count("/") + 2)}


def claims_to_be(head: bytes) -> bool:
    """Whether a file that begins with `head` has this format's root element, in UTF-8 or UTF-16."""
    plain = head.replace(b"\0", b"").lstrip(b"\xef\xbb\xbf\xff\xfe \t\r\n")
    return plain.startswith(b"<") and _ROOT_TAG.search(plain) is not None


def parse(content: bytes, path: Path) -> Document:
    """The document of a file's content.

    Raises
    ------
    UserError
        The content is not XML, another document, declares a document type, or is beyond the limits.
    """
    if b"\0" in content:
        raise UserError("holds NUL bytes", file=path, expected="XML in UTF-8")
    if _LONG_TAG.search(content):
        raise UserError("has a tag of over 8192 bytes", file=path)
    handler = _Handler(path)
    parser = expat.ParserCreate()
    parser.buffer_text, parser.buffer_size = True, 1 << 16
    parser.StartElementHandler = handler.start
    parser.EndElementHandler = handler.end
    parser.CharacterDataHandler = handler.text
    parser.StartDoctypeDeclHandler = handler.refuse_doctype
    try:
        parser.Parse(content, True)
    except expat.ExpatError as error:
        raise UserError(f"not well-formed XML ({error})", file=path) from error
    except (LookupError, ValueError) as error:  # an encoding unknown to Python, or of several bytes
        raise UserError(f"encoding cannot be read ({error})", file=path, expected="XML in UTF-8") from error
    return handler.document


class _Handler:
    """Collects the fields of the first layer with data; other elements are skipped."""

    def __init__(self, path: Path) -> None:
        self.document = Document()
        self._file = path
        self._open: list[str] = []  # paths of the open elements; "" where no known element can be below
        self._elements = 0
        self._skip = False  # this layer comes after the one with data
        self._text = bytearray()
        self._wavelength, self._first = "", 0  # of the open WavelengthData: its field, and its first block
        self._begin: dict[str, Callable[[], object]] = {
            _LAYER: self._begin_layer,
            _BASIS: lambda: self.document.bases.append(Basis()),
            _RING: lambda: self.document.bases[-1].rings.append({}),
            _DATA: self._begin_data,
            _BLOCK: lambda: self.document.blocks.append(Block()),
        }

    def refuse_doctype(self, *_: object) -> None:
        raise UserError("declares a document type, whose entities are not followed", file=self._file)

    def start(self, tag: str, _: dict[str, str]) -> None:
        self._elements += 1
        if self._elements > _MOST_ELEMENTS or len(self._open) == _DEEPEST:
            raise UserError("has more elements, or deeper ones, than any BSDF file", file=self._file)
        name = tag.rpartition(":")[2]
        if not self._open and name != ROOT:
            raise UserError("another kind of XML", file=self._file, got=tag, expected=ROOT)
        where = f"{self._open[-1]}/{name}" if self._open else name
        self._open.append(where if where in _KNOWN and (where == _LAYER or not self._skip) else "")
        self._text = bytearray()
        self._begin.get(self._open[-1], lambda: None)()

    def text(self, words: str) -> None:
        where = self._open[-1]
        if where not in _FIELDS:
            return
        if where == _SCATTERING:
            # Text that is not ASCII is no number; its replacement makes the reader of numbers refuse it.
            self._text += words.encode("ascii", "replace")
            return
        self._text += words.encode()
        if len(self._text) > _LONGEST_FIELD:
            raise UserError("is too long", file=self._file, field=where.rpartition("/")[2])

    def end(self, _: str) -> None:
        where, text = self._open.pop(), self._text
        self._text = bytearray()
        if where == _SCATTERING:
            self.document.blocks[-1].text = bytes(text)
        elif where in _FIELDS:
            self._keep(where, " ".join(text.decode().split()))
        elif where == _DATA:
            for block in self.document.blocks[self._first :]:
                block.wavelength = self._wavelength

    def _begin_layer(self) -> None:
        self.document.layers += 1
        self._skip = bool(self.document.blocks)
        if not self._skip:
            self.document.structure, self.document.bases = "", []

    def _begin_data(self) -> None:
        self._wavelength, self._first = "", len(self.document.blocks)

    def _keep(self, where: str, text: str) -> None:
        if where in _OF_DOCUMENT:
            setattr(self.document, _OF_DOCUMENT[where], text)
        elif where in _OF_BLOCK:
            setattr(self.document.blocks[-1], _OF_BLOCK[where], text)
        elif where in _OF_RING:
            self.document.bases[-1].rings[-1][_OF_RING[where]] = text
        elif where == _BASIS_NAME:
            self.document.bases[-1].name = text
        else:
            self._wavelength = text
