"""Formats of measured materials that Lambent recognises but cannot read, each with advice.

Used only for files that no reader recognises.
"""

from __future__ import annotations

import re

from lambent.core.plain import is_number
from lambent.materials.measured.parts.text_numbers import HINT_QUANTITY, shown

_HEAD_BYTES = 4096
_LEAST_NUMBERS = 5  # of a row of columns
_TEXT_EXPORT = "export it as Zemax BSDF, ASTM E1392 or plain columns with named angles"
_KINDS = (
    ("ALTA binary", rb"#FORMAT[ \t]+binary", "convert it to ALTA text: data2data without `format binary`"),
    ("SPEOS (OPTIS) BSDF", rb"OPTIS\s*-[^\n]*surface file", _TEXT_EXPORT),
    ("Surface Scattering Distribution Data (SSDD)", rb"(?m)^DATA_TYPE[ \t]+(?:brdf|btdf|specular_\w+)\b",
     "export it from BSDF Processor as Integra DDR or DDT"),
    ("NVIDIA MDL measured BSDF (MBSDF)", rb"NVIDIA ARC MBSDF", "load the measurement that it was made of"),
    ("VIAVI, RPC Photonics or Light Tec text with columns of its own",
     rb"(?i:\bVIAVI\b|RPC[ _-]Photonics|Engineered Diffuser|Light[ -]?Tec\b)|\bED[CSLF]\d?-\d",
     "take the same specimen's Zemax BSDF file (.bsdf), or name the columns: theta_i phi_i theta_o phi_o f"),
    ("HDF5 or MATLAB 7.3", rb"\A\x89HDF\r\n", _TEXT_EXPORT),
    ("ZIP archive", rb"\APK\x03\x04", "unpack it, and load the file inside"),
    ("gzip archive", rb"\A\x1f\x8b", "unpack it, and load the file inside"),
)  # fmt: skip


def kind_of(head: bytes) -> tuple[str, str] | None:
    """Format of a file that begins with `head`, and advice on it; None if unknown."""
    begin = head[:_HEAD_BYTES]
    found = next(((name, remedy) for name, signature, remedy in _KINDS if re.search(signature, begin)), None)
    row = re.match(r"(?:\s*(?:[#%]|//)[^\n]*\n)*\s*([^\n]*)", shown(begin))
    words = re.split(r"[\s;]+|,\s+", row[1].strip()) if row else []
    if found is None and len(words) >= _LEAST_NUMBERS and all(is_number(word.replace(",", ".")) for word in words):
        return "columns without names", f"{HINT_QUANTITY}, without decimal commas"
    return found
