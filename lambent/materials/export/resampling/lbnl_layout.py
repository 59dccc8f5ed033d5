"""LBNL's BSDF files (schema BSDF v1.4) as text: the XML that WINDOW and Radiance expect, and tensor trees in braces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from xml.sax.saxutils import escape

from lambent.materials.measured.parts.tensor_tree import TensorTree

_PER_LINE, _AT_ONCE = 8, 1 << 14  # values per line and per piece of text, at most


def pieces_of(tree: TensorTree, digits: int) -> Iterator[str]:
    """The text in small pieces, with `digits` significant digits."""
    stack: list[int | None] = [tree.root]  # None closes a brace
    while stack:
        code = stack.pop()
        if code is None:
            yield "}\n"
        elif code >= 0:
            yield "{\n"
            stack += [None, *reversed(tree.children[code].tolist())]
        else:
            yield from _grid(tree, -1 - code, digits)


def _grid(tree: TensorTree, number: int, digits: int) -> Iterator[str]:
    start = int(tree.starts[number])
    end = start + (1 << tree.rank * int(tree.logs[number]))
    yield "{ "
    for at in range(start, end, _AT_ONCE):
        words = [f"{v:.{digits}g}" for v in tree.values[at : min(at + _AT_ONCE, end)].tolist()]
        yield "\n".join(" ".join(words[k : k + _PER_LINE]) for k in range(0, len(words), _PER_LINE))
        yield "\n" if at + _AT_ONCE < end else " "
    yield "}\n"


_NO_XML = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd]")
_HEAD = """<?xml version="1.0" encoding="UTF-8"?>
<WindowElement xmlns="http://windows.lbl.gov" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" \
xsi:schemaLocation="http://windows.lbl.gov/BSDF-v1.4.xsd">
<WindowElementType>System</WindowElementType>
<FileType>BSDF</FileType>
<Optical>
<Layer>
\t<Material>
\t\t<Name>{name}</Name>
\t\t<Manufacturer>unknown</Manufacturer>
\t\t<DeviceType>Other</DeviceType>
\t</Material>
\t<DataDefinition>
\t\t<IncidentDataStructure>{structure}</IncidentDataStructure>
{basis}\t</DataDefinition>
"""
_BLOCK = """\t<WavelengthData>
\t\t<LayerNumber>System</LayerNumber>
\t\t<Wavelength unit="Integral">{wavelength}</Wavelength>
\t\t<SourceSpectrum>CIE Illuminant D65 1nm.ssp</SourceSpectrum>
\t\t<DetectorSpectrum>ASTM E308 1931 {detector}.dsp</DetectorSpectrum>
\t\t<WavelengthDataBlock>
\t\t\t<WavelengthDataDirection>{direction}</WavelengthDataDirection>
{bases}\t\t\t<ScatteringDataType>{quantity}</ScatteringDataType>
\t\t\t<ScatteringData>
"""
END_OF_BLOCK = """\t\t\t</ScatteringData>
\t\t</WavelengthDataBlock>
\t</WavelengthData>
"""
END = "</Layer>\n</Optical>\n</WindowElement>\n"


def head(name: str, structure: str, basis: str = "") -> str:
    """The text before the first block; `basis` is an AngleBasis element."""
    return _HEAD.format(name=escape(_NO_XML.sub(" ", name)), structure=structure, basis=basis)


def block_head(wavelength: str, detector: str, direction: str, bases: dict[str, str]) -> str:
    """The text before a block's numbers; `bases` names angle bases by their elements."""
    named = "".join(f"\t\t\t<{element}>{basis}</{element}>\n" for element, basis in bases.items())
    quantity = "BRDF" if direction.startswith("Reflection") else "BTDF"
    return _BLOCK.format(wavelength=wavelength, detector=detector, direction=direction, bases=named, quantity=quantity)


def losses(directions: Iterable[str], grey: bool) -> tuple[str, ...]:
    """Sentences on what a file with blocks of these directions omits."""
    lost = []
    if not grey:
        lost.append("colour in tools other than Radiance: they read only the block Visible, the luminance")
    if not any(name.endswith("Front") for name in directions):
        lost.append("light from behind is unknown: Radiance takes the back as black, transmission as reciprocal")
    return tuple(lost)
