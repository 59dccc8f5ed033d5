"""The XML around the numbers of LBNL's BSDF files (schema BSDF v1.4), as WINDOW and Radiance expect it."""

from __future__ import annotations

import re
from collections.abc import Iterable
from xml.sax.saxutils import escape

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
