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
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.materials.measured.columns import Layout, assemble
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.text_numbers import head_text, numbers, read_text, shown, without_comments

NAME = "LightTools BSDF text"
LIGHT_AZIMUTH_DEG = 90.0
_LISTS = {"ScatterAzimuth": 360.0, "ScatterRadial": 90.0}
_BLOCK = re.compile(rb"^[ \t]*AOI\s", re.MULTILINE)
_TIS = re.compile(rb"\bTIS\s+\S+")
_KEY = re.compile(r"\b(AOI|POI|Side|Wavelength|ScatterType|TristimulusValue)\s+(\S+)")
_TRISTIMULUS = ("TrisX", "TrisY", "TrisZ")
_KNOWN = {"Side": ("Front", "Back"), "ScatterType": ("BRDF", "BTDF"), "TristimulusValue": ("", *_TRISTIMULUS)}
Block = tuple[dict[str, str], Floats]  # its words, and its values (azimuths, radials)


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
    azimuth, radial = (_angles(head, name, path) for name in _LISTS)
    content = re.search(rb"SpectralContent\s+(\w+)", head)
    coloured = content is not None and shown(content[1]).lower() == "xyz"
    blocks = _blocks(body.partition(b"DataEnd")[0], (len(azimuth), len(radial)), path)
    side = "Front" if any(words["Side"] == "Front" for words, _ in blocks) else "Back"
    kept = [(words, values) for words, values in blocks if words["Side"] == side]
    notes: tuple[str, ...] = (f"light from the {side.lower()}",)
    if len(kept) < len(blocks):
        notes += ("the file's data of light from the back are not used",)
    if len({words["POI"] for words, _ in kept}) > 1:
        got = f"{len({words['POI'] for words, _ in kept})} planes of incidence (POI)"
        raise UserError(
            "several planes of incidence are not supported", file=path, got=got, expected="one: isotropic data"
        )
    channels = _channels(kept, coloured, path)
    rows = []
    for kind, aoi in sorted({(words["ScatterType"], _aoi(words, path)) for words, _ in kept}):
        found = {
            _channel(words, coloured, path): values
            for words, values in kept
            if (words["ScatterType"], _aoi(words, path)) == (kind, aoi)
        }
        if set(found) != set(channels):
            field = f"{kind} at AOI {aoi:g}"
            raise UserError("channels are missing", file=path, field=field, got=len(found), expected=len(channels))
        once = azimuth < azimuth[0] + 360  # a final azimuth of 360 repeats the first
        phi_o, theta_o = np.meshgrid(azimuth[once], radial, indexing="ij")
        theta_o = 180 - theta_o if kind == "BTDF" else theta_o
        lit = np.broadcast_to((aoi, LIGHT_AZIMUTH_DEG), (theta_o.size, 2))
        values = [found[channel][once].ravel() for channel in channels]
        rows.append(np.column_stack([lit, theta_o.ravel(), phi_o.ravel(), *values]))
    kind = "xyz" if coloured else "spectra" if len(channels) > 1 else "grey"
    places = {"theta_i": 0, "phi_i": 1, "theta_o": 2, "phi_o": 3}
    layout = Layout(places, tuple(range(4, 4 + len(channels))), "f", kind, channels if kind == "spectra" else ())
    return assemble(np.concatenate(rows), layout, 0.0, path, NAME, Path(path).stem, notes)


def _angles(head: bytes, name: str, path: Path) -> Floats:
    found = re.search(rb"\b" + name.encode() + rb"\s([^A-Za-z]*)", head)
    if found is None or not found[1].strip():
        raise UserError("is missing", file=path, field=name)
    count, *listed = numbers(found[1], path, name)
    if not listed or count != len(listed):
        got = f"{count:g} and {len(listed)}"
        raise UserError("count differs from the number of angles", file=path, field=name, got=got)
    angles = np.array(listed)
    if not ((np.diff(angles) > 0).all() and angles[0] >= 0 and angles[-1] <= _LISTS[name]):
        expected = f"increasing degrees from 0 to {_LISTS[name]:g}"
        raise UserError("is not a list of angles", file=path, field=name, got=listed, expected=expected)
    return angles


def _blocks(body: bytes, shape: tuple[int, int], path: Path) -> list[Block]:
    """The blocks; each ends with its values, which follow its TIS."""
    blocks: list[Block] = []
    end = 0
    starts = [found.start() for found in _BLOCK.finditer(body)]
    for number, tis in enumerate(_TIS.finditer(body), 1):
        field = f"block {number}"
        words = dict(_KEY.findall(shown(body[end : tis.start()])))
        for name in ("AOI", "Side", "ScatterType"):
            if name not in words:
                raise UserError("is missing", file=path, field=f"{field}, {name}")
        words = {"POI": "0", "TristimulusValue": "", **words}
        for name, known in _KNOWN.items():
            if words[name] not in known:
                expected = f"one of: {', '.join(word for word in known if word)}"
                raise UserError("is unknown", file=path, field=f"{field}, {name}", got=words[name], expected=expected)
        after = re.compile(rb"[A-Za-z]{2,}").search(body, tis.end())
        end = after.start() if after else len(body)
        values = numbers(body[tis.end() : end], path, field)
        if len(values) != shape[0] * shape[1]:
            expected = f"{shape[0]} azimuths x {shape[1]} radial angles"
            raise UserError("wrong number of values", file=path, field=field, got=len(values), expected=expected)
        blocks.append((words, values.reshape(shape)))
    if not blocks or len(starts) != len(blocks):
        got = f"{len(starts)} AOI and {len(blocks)} TIS"
        raise UserError("wrong number of blocks", file=path, got=got, expected="a TIS after each AOI")
    return blocks


def _aoi(words: dict[str, str], path: Path) -> float:
    """The angle of incidence from the lit side's normal; for a back it may be given from the front's."""
    angle = _number(words["AOI"], "AOI", path)
    return 180 - angle if words["Side"] == "Back" and angle > 90 else angle


def _channel(words: dict[str, str], coloured: bool, path: Path) -> float:
    """Index of X, Y or Z, or the wavelength in nm."""
    if coloured:
        return float(_TRISTIMULUS.index(words["TristimulusValue"])) if words["TristimulusValue"] else -1.0
    return _number(words.get("Wavelength", "0"), "Wavelength", path)


def _channels(blocks: list[Block], coloured: bool, path: Path) -> tuple[float, ...]:
    found = tuple(sorted({_channel(words, coloured, path) for words, _ in blocks}))
    if coloured and found != (0.0, 1.0, 2.0):
        expected = ", ".join(_TRISTIMULUS)
        raise UserError("is missing", file=path, field="TristimulusValue", expected=expected)
    return found


def _number(word: str, name: str, path: Path) -> float:
    value = numbers(word.encode(), path, name)
    if len(value) != 1 or not np.isfinite(value[0]):
        raise UserError("is not a number", file=path, field=name, got=word)
    return float(value[0])
