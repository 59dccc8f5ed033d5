"""LightTools BSDF text: one grid about the normal, and a block of values per angle of incidence, side and channel.

    Symmetry Asymmetric
    SpectralContent Monochrome
    ScatterAzimuth 4
    0 90 180 270
    ScatterRadial 3
    0 30 60
    DataBegin
    AOI 30
    POI 0
    Side Front
    Wavelength 550
    ScatterType BRDF
    TIS 0.31
      (a line per azimuth, with the BSDF in 1/sr per radial angle)
    DataEnd

`#` begins a comment. The radial angle is measured from the normal of the side that the light leaves by. The light is at
azimuth 90, as in libbsdf's reader, so that its mirror direction is at 270. XYZ files have three blocks instead of one,
with `TristimulusValue` TrisX, TrisY and TrisZ. The back is used if the file has no front.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.plain import is_number
from lambent.materials.measured.columns import Layout, assemble
from lambent.materials.measured.parts.text_numbers import (
    angles_after,
    counted,
    head_text,
    read_text,
    shown,
    without_comments,
)
from lambent.materials.measured.protocol import MeasuredTable

NAME = "LightTools BSDF text"
LIGHT_AZIMUTH_DEG = 90.0
_LISTS = {"ScatterAzimuth": 360.0, "ScatterRadial": 90.0}
_BLOCK = re.compile(rb"^[ \t]*AOI\s", re.MULTILINE)
_TIS = re.compile(rb"\bTIS\s+\S+")
_WORD = re.compile(rb"[A-Za-z]{2,}")
_KEY = re.compile(r"\b(AOI|POI|Side|Wavelength|ScatterType|TristimulusValue)\s+(\S+)")
_TRISTIMULUS = {"TrisX": 0.0, "TrisY": 1.0, "TrisZ": 2.0}


@dataclass(frozen=True)
class _Block:
    """Values (azimuths, radials) of one angle of incidence, from the normal of the lit side, and of one channel.

    `channel` is the wavelength in nm, or the index of X, Y or Z.
    """

    side: str
    kind: str
    plane: str
    aoi: float
    channel: float
    values: Floats


def recognise(head: bytes, size: int) -> bool:
    """Whether the header has the format's grid, and its first block an angle of incidence."""
    text = head_text(head)
    if text is None or b"ScatterRadial" not in text or b"DataBegin" not in text:
        return False
    head, _, body = without_comments(text).partition(b"DataBegin")
    return b"AngleOfIncidence" not in head and re.match(rb"\s*(?:AOI|POI|Side)\s", body) is not None


def read(path: Path) -> MeasuredTable:
    """The table of a LightTools file.

    Raises
    ------
    UserError
        A keyword is missing or unknown, a count does not fit, or there are several planes of incidence.
    """
    head, _, body = without_comments(read_text(path)).partition(b"DataBegin")
    azimuth, radial = (angles_after(name, 0, most, head, path) for name, most in _LISTS.items())
    coloured = re.search(rb"SpectralContent\s+xyz\b", head, re.IGNORECASE) is not None
    every = _blocks(body.partition(b"DataEnd")[0], (len(azimuth), len(radial)), coloured, path)
    side = "Front" if any(block.side == "Front" for block in every) else "Back"
    blocks = [block for block in every if block.side == side]
    notes: tuple[str, ...] = (f"light from the {side.lower()}",)
    if len(blocks) < len(every):
        notes += ("the file's data of light from the back are not used",)
    if (planes := len({block.plane for block in blocks})) > 1:
        got, what = f"{planes} planes of incidence (POI)", "several planes of incidence are not supported"
        raise UserError(what, file=path, got=got, expected="one: isotropic data")
    channels = tuple(sorted({block.channel for block in blocks}))
    once = azimuth < azimuth[0] + 360  # a final azimuth of 360 repeats the first
    phi_o, theta_o = (grid.ravel() for grid in np.meshgrid(azimuth[once], radial, indexing="ij"))
    rows = []
    for kind, aoi in sorted({(block.kind, block.aoi) for block in blocks}):
        found = {
            block.channel: block.values[once].ravel() for block in blocks if (block.kind, block.aoi) == (kind, aoi)
        }
        if set(found) != set(channels):
            field = f"{kind} at AOI {aoi:g}"
            raise UserError("channels are missing", file=path, field=field, got=len(found), expected=len(channels))
        lit = np.broadcast_to((aoi, LIGHT_AZIMUTH_DEG), (len(phi_o), 2))
        values = [found[channel] for channel in channels]
        rows.append(np.column_stack([lit, 180 - theta_o if kind == "BTDF" else theta_o, phi_o, *values]))
    content = "xyz" if coloured else "spectra" if len(channels) > 1 else "grey"
    layout = Layout.absolute("f", content, len(channels), channels if content == "spectra" else ())
    return assemble(np.concatenate(rows), layout, path, NAME, Path(path).stem, notes)


def _blocks(body: bytes, shape: tuple[int, int], coloured: bool, path: Path) -> list[_Block]:
    """The blocks; each ends with its values, which follow its TIS."""
    blocks: list[_Block] = []
    end = 0
    for tis in _TIS.finditer(body):
        words = {"POI": "0", "Wavelength": "0"} | dict(_KEY.findall(shown(body[end : tis.start()])))
        after = _WORD.search(body, tis.end())
        end = after.start() if after else len(body)
        blocks.append(_block(words, body[tis.end() : end], shape, coloured, path, f"block {len(blocks) + 1}"))
    starts = len(_BLOCK.findall(body))
    if not blocks or starts != len(blocks):
        got = f"{starts} AOI and {len(blocks)} TIS"
        raise UserError("wrong number of blocks", file=path, got=got, expected="a TIS after each AOI")
    if coloured and len({block.channel for block in blocks}) != 3:
        raise UserError("is missing", file=path, field="TristimulusValue", expected=", ".join(_TRISTIMULUS))
    return blocks


def _block(
    words: dict[str, str], values: bytes, shape: tuple[int, int], coloured: bool, path: Path, field: str
) -> _Block:
    for name in ("AOI", "Side", "ScatterType", *(("TristimulusValue",) if coloured else ())):
        if name not in words:
            raise UserError("is missing", file=path, field=f"{field}, {name}")
    side = known("Side", words["Side"], ("Front", "Back"), file=path, field=field)
    kind = known("ScatterType", words["ScatterType"], ("BRDF", "BTDF"), file=path, field=field)
    aoi = _number(words["AOI"], "AOI", path)
    aoi = 180 - aoi if side == "Back" and aoi > 90 else aoi  # given from the front's normal
    if coloured:
        channel = _TRISTIMULUS[
            known("TristimulusValue", words["TristimulusValue"], _TRISTIMULUS, file=path, field=field)
        ]
    else:
        channel = _number(words["Wavelength"], "Wavelength", path)
    return _Block(side, kind, words["POI"], aoi, channel, counted(values, shape, path, field))


def _number(word: str, name: str, path: Path) -> float:
    if not (is_number(word) and np.isfinite(float(word))):
        raise UserError("is not a number", file=path, field=name, got=word)
    return float(word)
