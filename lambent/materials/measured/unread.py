"""Formats of measured materials that Lambent recognises but cannot read, each with advice.

Used only for files that no reader recognises.
"""

from __future__ import annotations

import re

_HEAD_BYTES = 4096
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
    return next(((name, remedy) for name, signature, remedy in _KINDS if re.search(signature, begin)), None)
