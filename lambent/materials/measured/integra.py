"""Integra DDR and DDT text (Inspirer, Lumicept, libbsdf): diffuse distributions of reflection and of transmission.

    ;; a comment
    Source Measured
    TypeSym PlaneSymmetrical
    TypeColorModel RGB
    TypeData Luminance Absolute
    sigma 3
     0 30 60
    phi 7
     0 30 60 90 120 150 180
    theta 5
     0 10 30 60 90
    red
     kbdf
      0.3 0.3 0.4
     def
      (a line per sigma and phi, theta fastest)
     enddef

sigma is the angle of incidence, psi its azimuth; theta is the angle from the direction of mirror reflection (DDT: of
the transmitted light, whose angle `sigmat` gives), phi the azimuth about it, counter-clockwise, 0 towards the normal.
Channels are red, gre and blu, or bw, or one `wl` with its wavelength in nm each. Luminance is relative to the perfect
diffuser: f = value / pi; Intensity holds the cosine: f = value / cos theta_o. `kbdf` multiplies Absolute values, and
is the share of the light that Relative ones are scaled to.

Geometry: MPI's Atrium project, "BRDF format representation"; keywords and units as in libbsdf's DdrReader. Reflection
and transmission are not marked in the file: `sigmat`, or the suffix .ddt, indicates transmission.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.parts.gonio_rows import SpecularGrid, specular_table
from lambent.materials.measured.parts.spectral import rgb_of_measured
from lambent.materials.measured.parts.text_numbers import angles_after, counted, head_text, numbers, read_text, shown
from lambent.materials.measured.tables.gonio import GonioTable
from lambent.materials.measured.tables.table import sensible

NAME = "Integra DDR/DDT text"
HINT_SPECULAR = "load the diffuse distribution of the same material (.ddr or .ddt)"
_COMMENT = re.compile(rb";;[^\n]*")
_MODEL = re.compile(rb"^[ \t]*TypeColorModel[ \t]+(?:rgb|bw|spectral)\b", re.MULTILINE | re.IGNORECASE)
_SIGMA = re.compile(rb"^[ \t]*sigma[ \t]+\d", re.MULTILINE | re.IGNORECASE)
_KEY = re.compile(r"^\s*(TypeColorModel|TypeData)\s+([^\n]*?)\s*$", re.MULTILINE | re.IGNORECASE)
_CHANNEL = re.compile(rb"^[ \t]*(wl|bw|red|gre|green|blu|blue)\b", re.MULTILINE | re.IGNORECASE)
_DATA = re.compile(rb"\s*([-+.\d]\S*)?\s*(?:\bkbdf\b(.*?))?\bdef\b(.*?)(?:\benddef\b\s*|\Z)", re.DOTALL | re.IGNORECASE)
_RANGES = {"psi": (-360.0, 360.0), "sigma": (0.0, 90.0), "phi": (0.0, 360.0), "theta": (0.0, 180.0)}
_KINDS = ("luminance absolute", "luminance relative", "intensity absolute", "intensity relative")
_COS_MIN = 1e-6


@dataclass(frozen=True)
class _Channel:
    """Values (psi, sigma, phi, theta), kbdf (psi, sigma) or none, and the wavelength in nm of a spectrum."""

    values: Floats
    kbdf: Floats | None
    wavelength_nm: float


def recognise(head: bytes, size: int) -> bool:
    """Whether lines give the format's colour model and angles of incidence."""
    text = head_text(head)
    return text is not None and _MODEL.search(text) is not None and _SIGMA.search(_COMMENT.sub(b"", text)) is not None


def read(path: Path) -> GonioTable:
    """The table of a DDR or DDT file.

    Raises
    ------
    UserError
        The file is a table of specular shares, a keyword is missing or unknown, a count does not fit, or an angle is
        outside its range.
    """
    text = _COMMENT.sub(b"", read_text(path))
    first = _CHANNEL.search(text)
    head = text[: first.start()] if first else text
    keys = {key.lower(): " ".join(value.lower().split()) for key, value in _KEY.findall(shown(head))}
    if re.search(rb"^[ \t]*theta\s", head, re.MULTILINE | re.IGNORECASE) is None:
        got = "a share of the light per angle of incidence, without directions"
        raise UserError("is a table of specular reflectance", file=path, got=got, hint=HINT_SPECULAR)
    grid = _grid(head, path)
    kind = keys.get("typedata", "")
    if kind not in _KINDS:
        expected, what = f"one of: {', '.join(_KINDS)}", "quantity of the values is not stated"
        raise UserError(what, file=path, field="TypeData", got=kind or None, expected=expected)
    channels = _channels(text[first.start() :] if first else b"", grid, keys.get("typecolormodel", ""), path)
    values = np.stack([channel.values for channel in channels], axis=-1)
    cos_o = _cos_theta_o(grid)[..., None]
    # Writers fill the horizon and everything below with 0.
    values = np.where(np.isfinite(values) & np.isfinite(cos_o), values, np.nan)
    with np.errstate(over="ignore"):
        values = values / cos_o if kind.startswith("intensity") else values / np.pi
    far = grid.specular is not None or Path(path).suffix.lower() == ".ddt"
    notes: tuple[str, ...] = (f"read as {'transmission' if far else 'reflection'}, {kind}",)
    shares = [channel.kbdf for channel in channels if channel.kbdf is not None]
    kbdf = np.stack(shares, axis=-1) if len(shares) == len(channels) else None
    grid, values, kbdf, said = _below_90(grid, values, kbdf)
    notes += said
    # Azimuths up to 180 degrees cover half a turn, whatever TypeSym says.
    mirrored = len(grid.azimuth) > 1 and grid.azimuth[-1] <= 180
    if kind.endswith("absolute"):
        values = values if kbdf is None else values * kbdf[:, :, None, None]
    elif kbdf is None:
        what = "is relative and does not state the share of the light (kbdf)"
        raise UserError(what, file=path, field="kbdf", expected="its values")
    else:
        values = values * _scale(specular_table(grid, values, path, NAME, far=far, mirrored=mirrored), grid, kbdf)
        notes += ("relative values are scaled to the shares of the light that the file states (kbdf)",)
    if keys["typecolormodel"].startswith("spectral"):
        values, said = _coloured(values, np.array([channel.wavelength_nm for channel in channels]), path)
        notes += said
    return specular_table(grid, values, path, NAME, far=far, mirrored=mirrored, notes=notes)


def _grid(head: bytes, path: Path) -> SpecularGrid:
    """The lists of angles."""
    has_psi = re.search(rb"\bpsi\b", head, re.IGNORECASE) is not None
    lists = {name: angles_after(name, *ends, head, path) for name, ends in _RANGES.items() if name != "psi" or has_psi}
    refracted = re.search(rb"^[ \t]*sigmat((?:\s+[-+.\de]+)*)", head, re.MULTILINE | re.IGNORECASE)
    specular = None
    if refracted is not None:
        specular = numbers(refracted[1], path, "sigmat")
        if len(specular) != len(lists["sigma"]) or not ((specular >= 0) & (specular <= 90)).all():
            expected = f"{len(lists['sigma'])} degrees from 0 to 90, one per sigma"
            raise UserError("is not a list of angles", file=path, field="sigmat", got=len(specular), expected=expected)
    return SpecularGrid(lists.get("psi", np.zeros(1)), lists["sigma"], lists["phi"], lists["theta"], specular)


def _channels(body: bytes, grid: SpecularGrid, model: str, path: Path) -> list[_Channel]:
    """The channels, in the order of RGB or of wavelengths."""
    starts = [*_CHANNEL.finditer(body)]
    ends = [found.start() for found in starts[1:]] + [len(body)]
    parts: dict[str, _Channel] = {}
    for found, end in zip(starts, ends, strict=False):  # `ends` has one more than there are channels
        name = shown(found[1]).lower()[:3]
        channel = _channel(body[found.end() : end], name, grid, path)
        key = f"wl {channel.wavelength_nm:g}" if name == "wl" else name
        if key in parts:
            raise UserError("is duplicated", file=path, field=key)
        parts[key] = channel
    wanted = {"rgb": ["red", "gre", "blu"], "bw": ["bw"]}.get(model, [])
    if model.startswith("spectral"):
        wanted = sorted((key for key in parts if key.startswith("wl")), key=lambda key: parts[key].wavelength_nm)
        stated = model.split()[1:2]
        if not wanted or stated not in ([], [str(len(wanted))]):
            got = f"{len(wanted)} wavelengths"
            raise UserError("wrong number of wavelengths", file=path, field="TypeColorModel", got=got)
    if not wanted or set(wanted) != set(parts):
        field, got = f"TypeColorModel {model}", ", ".join(parts) or "none"
        raise UserError("channels do not match the colour model", file=path, field=field, got=got)
    return [parts[key] for key in wanted]


def _channel(part: bytes, name: str, grid: SpecularGrid, path: Path) -> _Channel:
    data = _DATA.match(part)
    if data is None or data.end() != len(part) or (data[1] is None) == (name == "wl"):
        expected = "kbdf and its values, def, the values, enddef" + (", after the wavelength" if name == "wl" else "")
        raise UserError("block is malformed", file=path, field=name, expected=expected)
    wavelength = float(numbers(data[1], path, name)[0]) if data[1] else np.nan
    if name == "wl" and not (np.isfinite(wavelength) and wavelength > 0):
        raise UserError("is not a wavelength in nm", file=path, field=name, got=shown(data[1]))
    values = counted(data[3], grid.shape, path, f"{name} def")
    kbdf = None if data[2] is None else counted(data[2], grid.shape[:2], path, f"{name} kbdf")
    return _Channel(values, kbdf, wavelength)


def _cos_theta_o(grid: SpecularGrid) -> Floats:
    """(1, sigma, phi, theta) |cos theta_o|; NaN at the horizon and below."""
    specular = np.radians(grid.theta_i if grid.specular is None else grid.specular)[:, None, None]
    azimuth, radial = np.radians(grid.azimuth)[:, None], np.radians(grid.radial)
    cosine = np.cos(specular) * np.cos(radial) + np.sin(specular) * np.sin(radial) * np.cos(azimuth)
    return np.where(cosine > _COS_MIN, cosine, np.nan)[None]


def _below_90(
    grid: SpecularGrid, values: Floats, kbdf: Floats | None
) -> tuple[SpecularGrid, Floats, Floats | None, tuple[str, ...]]:
    """The grid and values without grazing incidence, which receives no light."""
    kept = grid.theta_i < 90
    if kept.all() or not kept.any():
        return grid, values, kbdf, ()
    specular = None if grid.specular is None else grid.specular[kept]
    grid = replace(grid, theta_i=grid.theta_i[kept], specular=specular)
    return grid, values[:, kept], None if kbdf is None else kbdf[:, kept], ("sigma of 90 degrees is left out",)


def _scale(table: GonioTable, grid: SpecularGrid, kbdf: Floats) -> Floats:
    """(psi, sigma, 1, 1, C) factors by which the table scatters its kbdf."""
    wi = direction(*np.radians(np.meshgrid(grid.theta_i, grid.rotation)))
    scattered = table.transmissivity(wi) if table.transmitted else table.reflectivity(wi)
    return np.divide(kbdf, scattered, out=np.zeros_like(kbdf), where=scattered > 0)[:, :, None, None]


def _coloured(values: Floats, wavelengths_nm: Floats, path: Path) -> tuple[Floats, tuple[str, ...]]:
    """Linear RGB of spectra; one wavelength stays grey."""
    if len(wavelengths_nm) == 1:
        return values, (f"one wavelength, {wavelengths_nm[0]:g} nm",)
    flat = values.reshape(-1, len(wavelengths_nm))
    rgb, notes = rgb_of_measured(flat, sensible(flat), wavelengths_nm)
    return rgb.reshape(*values.shape[:-1], 3), notes
