"""ALTA text: the data files of the ALTA library (Inria), a header of keys and then rows of numbers.

    #DIM 3 3
    #PARAM_IN  RUSIN_TH_TD_PD
    #PARAM_OUT RGB_COLOR
    0.1  0.2  1.5707963  0.041  0.052  0.31

DIM counts the columns of the directions and of the values; PARAM_IN names the parametrisation, PARAM_OUT the quantity.
VS gives, per value, how many columns of confidence follow (0, 1: a radius, 2: both bounds); they are not used. Angles
are in radians. Lines above the header are ignored; `#` followed by anything but a letter starts a comment. Rows below
the horizon, which ALTA's grids include, are dropped.

The parametrisations follow ALTA's params.h: H is the half vector of view V and light L, K that of V and the mirrored
light. If one drops an azimuth, the other columns suffice for an isotropic BRDF, up to mirroring and reciprocity.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError, did_you_mean
from lambent.core.geometry.directions import angles, direction, reflect
from lambent.materials.measured.columns import Layout, assemble
from lambent.materials.measured.parts.text_numbers import head_text, read_text, shown, without_comments
from lambent.materials.measured.parts.text_rows import rows_of
from lambent.materials.measured.protocol import MeasuredTable, Quantity

Pair = tuple[Floats, Floats]


@dataclass(frozen=True)
class Parametrisation:
    """One of ALTA's parametrisations.

    Attributes
    ----------
    inputs : int
        Number of columns.
    directions : function
        (N, columns) -> wi, wo (N, 3); NaN, or below the horizon, where a row is no pair of directions.
    isotropic : bool
        Whether the azimuth of the light is dropped.
    gridded : bool
        Whether the light's direction has columns of its own, so that incident directions can form a grid.
    bivariate : bool
        Whether the azimuth between the vectors is dropped as well; `directions` takes it as a further column.
    notes : tuple of str
    """

    inputs: int
    directions: Callable[[Floats], Pair]
    isotropic: bool = True
    gridded: bool = False
    bivariate: bool = False
    notes: tuple[str, ...] = ()


def _half_difference(theta_h: Floats, phi_h: Floats, theta_d: Floats, phi_d: Floats) -> Pair:
    """Rusinkiewicz's angles; V is the difference vector, turned by theta_h about y and by phi_h about n."""
    d = direction(theta_d, phi_d)
    c, s = np.cos(theta_h), np.sin(theta_h)
    x, z = c * d[:, 0] + s * d[:, 2], c * d[:, 2] - s * d[:, 0]
    c, s = np.cos(phi_h), np.sin(phi_h)
    view = np.stack([c * x - s * d[:, 1], s * x + c * d[:, 1], z], axis=-1)
    return reflect(view, direction(theta_h, phi_h)), view


def _polar(x: Floats, y: Floats) -> Pair:
    """theta and phi of theta (cos phi, sin phi)."""
    return np.hypot(x, y), np.arctan2(y, x)


def _back(p: Floats) -> Pair:
    """Light, and K in polar form: V is the mirrored light, mirrored about K."""
    light, back = direction(p[:, 0], 0.0), direction(*_polar(p[:, 1], p[:, 2]))
    return light, reflect(light * (-1, -1, 1), back)


def _retro(p: Floats) -> Pair:
    """Light, and V in polar form about it, from the side of the normal."""
    light, from_light, phi = direction(p[:, 0], 0.0), *_polar(p[:, 1], p[:, 2])
    up = np.stack([-np.cos(p[:, 0]), np.zeros(len(p)), np.sin(p[:, 0])], axis=-1)
    aside = np.cos(phi)[:, None] * up + np.sin(phi)[:, None] * np.array([0.0, 1.0, 0.0])
    return light, np.cos(from_light)[:, None] * light + np.sin(from_light)[:, None] * aside


def _halved(h_xy: Floats, b_xy: Floats) -> Pair:
    """Light and view whose half sum and half difference have these projections (Neumann & Neumann)."""
    with np.errstate(invalid="ignore"):
        lit, seen = (np.column_stack([w, np.sqrt(1 - (w**2).sum(axis=1))]) for w in (h_xy + b_xy, h_xy - b_xy))
    return lit, seen


def _stark(h: Floats, b: Floats, phi: Floats) -> Pair:
    """Light and view from |H_p| and |B| of their half sum and half difference, which are perpendicular."""
    with np.errstate(invalid="ignore"):
        z = np.sqrt(1 - h**2 - b**2)
    half = np.stack([h, np.zeros_like(h), z], axis=-1)
    tilt = np.arctan2(z, -h * np.cos(phi))  # elevation from n at which H.B = 0
    difference = b[:, None] * direction(tilt, phi)
    return half + difference, half - difference


def _stereographic(xy: Floats) -> Floats:
    """Directions (N, 3) of their projections x / (1 + z), y / (1 + z)."""
    square = (xy**2).sum(axis=1, keepdims=True)
    return np.asarray(np.concatenate([2 * xy, 1 - square], axis=1) / (1 + square))


def _unit(w: Floats) -> Floats:
    """Vectors (N, 3) at unit length; NaN for a zero vector in the file."""
    length = np.linalg.norm(w, axis=1, keepdims=True)
    return np.where(np.abs(length - 1) < 0.01, w / np.where(length > 0, length, 1), np.nan)


def _acos(x: Floats) -> Floats:
    with np.errstate(invalid="ignore"):
        return np.arccos(np.where(np.abs(x) <= 1 + 1e-6, x.clip(-1, 1), np.nan))


def _xy(r: Floats, phi: Floats) -> Floats:
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)


def _rusinkiewicz(p: Floats) -> Pair:
    return _half_difference(p[:, 0], np.zeros(len(p)), p[:, 1], p[:, 2])


def _cosines(p: Floats) -> Pair:
    return _rusinkiewicz(np.stack([_acos(p[:, 0]), _acos(p[:, 1]), p[:, 2]], axis=-1))


def _neumann(p: Floats) -> Pair:
    return _halved(_xy(p[:, 0], np.zeros(len(p))), _xy(p[:, 1], p[:, 2]))


AZIMUTHS = np.radians((0.0, 30.0, 60.0, 90.0))  # copies of tables without an azimuth; the rest mirrors them
_LIGHT_UP = ("the light is along the normal alone",)

PARAMETRISATIONS: dict[str, Parametrisation] = {
    "RUSIN_TH_TD_PD": Parametrisation(3, _rusinkiewicz),
    "RUSIN_TH_PH_TD_PD": Parametrisation(4, lambda p: _half_difference(*p.T), isotropic=False),
    "RUSIN_TH_TD": Parametrisation(2, _rusinkiewicz, bivariate=True),
    "COS_TH_TD": Parametrisation(2, _cosines, bivariate=True),
    "STARK_3D": Parametrisation(3, lambda p: _stark(*p.T)),
    "STARK_2D": Parametrisation(2, lambda p: _stark(*p.T), bivariate=True),
    "NEUMANN_3D": Parametrisation(3, _neumann),
    "NEUMANN_2D": Parametrisation(2, _neumann, bivariate=True),
    "ISOTROPIC_TV_TL_DPHI": Parametrisation(
        3, lambda p: (direction(p[:, 1], p[:, 2]), direction(p[:, 0], 0.0)), gridded=True
    ),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parametrisation(
        3, lambda p: (direction(p[:, 0], 0.0), direction(*_polar(p[:, 1], p[:, 2]))), gridded=True
    ),
    "ISOTROPIC_TV_PROJ_DPHI": Parametrisation(
        2, lambda p: (direction(0 * p[:, 0], 0.0), direction(*_polar(*p.T))), gridded=True, notes=_LIGHT_UP
    ),
    "SCHLICK_TL_TK_PROJ_DPHI": Parametrisation(3, _back, gridded=True),
    "RETRO_TL_TVL_PROJ_DPHI": Parametrisation(3, _retro, gridded=True),
    "SPHERICAL_TL_PL_TV_PV": Parametrisation(
        4, lambda p: (direction(p[:, 0], p[:, 1]), direction(p[:, 2], p[:, 3])), isotropic=False, gridded=True
    ),
    "STEREOGRAPHIC": Parametrisation(
        4, lambda p: (_stereographic(p[:, 2:]), _stereographic(p[:, :2])), isotropic=False, gridded=True
    ),
    "CARTESIAN": Parametrisation(6, lambda p: (_unit(p[:, 3:]), _unit(p[:, :3])), isotropic=False, gridded=True),
}
SLICES: dict[str, str] = {
    "COS_TH": "values over the cosine between n and the half vector alone",
    "COS_TK": "values over the cosine between n and the back vector alone",
    "COS_TLV": "values over the cosine between light and view alone",
    "COS_TLR": "values over the cosine between light and mirrored view alone",
    "RUSIN_VH": "values over the half vector alone",
    "SCHLICK_VH": "values over the back vector alone",
    "SCHLICK_VK": "values over the back vector alone",
}


NAME = "ALTA text"
_DIM = re.compile(rb"^#DIM[ \t]+(\d{1,3})[ \t]+(\d{1,3})[ \t]*$", re.MULTILINE)
_FIRST = re.compile(rb"^#(?:DIM|PARAM_IN|PARAM_OUT|VS)\b", re.MULTILINE)
_HEADER = re.compile(rb"(?:[ \t]*(?:#[^\n]*)?(?:\n|\Z))*")
_FUNCTION = re.compile(rb"^#(?:FUNC|ALTA FUNC HEADER)\b", re.MULTILINE)
_KEY = re.compile(rb"^#([A-Z_]+)[ \t]+(\S[^\n]*?)[ \t]*$", re.MULTILINE)
_QUANTITIES: dict[str, tuple[Quantity, str]] = {
    "INV_STERADIAN": ("f", "rgb"),
    "INV_STERADIAN_COSINE_FACTOR": ("f_cos", "rgb"),
    "RGB_COLOR": ("f", "rgb"),
    "XYZ_COLOR": ("f", "xyz"),
}
_A_TURN = 6.3  # radians
_ABOVE = 1e-6  # least cosine of a direction above the horizon


def recognise(head: bytes, size: int) -> bool:
    """Whether a line is the format's #DIM."""
    text = head_text(head)
    return text is not None and _DIM.search(text) is not None


def read(path: Path) -> MeasuredTable:
    """The table of an ALTA text file.

    Raises
    ------
    UserError
        The parametrisation or the quantity is unknown or not stated, the file holds a slice of a BRDF, or a row is
        broken.
    """
    text = read_text(path)
    dim = _DIM.search(text)
    if dim is None:
        raise UserError("has no line #DIM", file=path)
    if _FUNCTION.search(text) is not None:
        raise UserError("is a function fitted by ALTA, not data", file=path, hint="load the data that it was fitted to")
    first = _FIRST.search(text)
    header = _HEADER.match(text, first.start() if first else 0)
    assert header is not None  # the pattern also matches an empty header
    keys = {key.decode(): shown(value) for key, value in reversed(_KEY.findall(header[0]))}
    inputs, outputs = int(dim[1]), int(dim[2])
    parametrisation = _parametrisation(keys.get("PARAM_IN"), inputs, path)
    quantity, kind = _quantity(keys.get("PARAM_OUT"), outputs, path)
    rows = _rows(without_comments(text[header.end() :]), inputs + outputs, keys.get("VS", ""), path)
    widest = float(np.abs(np.nan_to_num(rows[:, :inputs])).max())
    if widest > _A_TURN:
        raise UserError("an angle is more than a turn", file=path, got=f"{widest:g}", expected="radians")
    notes = (f"parametrisation {keys['PARAM_IN']}, angles in radians", *parametrisation.notes)
    coordinates = rows[:, :inputs]
    if parametrisation.bivariate:
        coordinates = np.column_stack([np.repeat(coordinates, len(AZIMUTHS), axis=0), np.tile(AZIMUTHS, len(rows))])
        rows = np.repeat(rows, len(AZIMUTHS), axis=0)
        notes += (f"f is given without an azimuth: a value counts as measured at {len(AZIMUTHS)} azimuths",)
    wi, wo = parametrisation.directions(coordinates)
    above = np.isfinite(wi).all(axis=1) & np.isfinite(wo).all(axis=1) & (wi[:, 2] > _ABOVE) & (wo[:, 2] > _ABOVE)
    if not above.all():
        notes += (f"{int((~above).sum())} of {len(above)} pairs are below the horizon and left out",)
    if not above.any():
        raise UserError("holds no pair of directions above the horizon", file=path, got=f"{len(rows)} rows")
    (theta_i, phi_i), (theta_o, phi_o) = (np.degrees(angles(w[above])) for w in (wi, wo))
    if parametrisation.isotropic:
        phi_i, phi_o = np.zeros_like(phi_i), phi_o - phi_i
    table = np.column_stack([theta_i, phi_i, theta_o, phi_o, rows[above, inputs : inputs + outputs]])
    layout = Layout.absolute(quantity, kind if outputs == 3 else "grey", outputs)
    layout = layout if parametrisation.gridded else replace(layout, gridded=False)
    return assemble(table, layout, path, NAME, Path(path).stem, notes)


def _parametrisation(name: str | None, inputs: int, path: Path) -> Parametrisation:
    """The parametrisation of this name; `UserError` for slices, unknown names, or a wrong number of columns."""
    full = "directions of light and view, in one of: " + ", ".join(PARAMETRISATIONS)
    if name in SLICES:
        got = f"{name}: {SLICES[name]}"
        raise UserError("is a slice that does not determine the BRDF", file=path, got=got, expected=full)
    if inputs == 1:
        got = f"#DIM {inputs}, #PARAM_IN {name or 'not stated'}"
        raise UserError("is a curve over one variable, not a BRDF", file=path, got=got, expected=full)
    if name is None or name not in PARAMETRISATIONS:
        hint = did_you_mean(name, PARAMETRISATIONS) if name else None
        raise UserError("is unknown", file=path, field="#PARAM_IN", got=name or "nothing", expected=full, hint=hint)
    found = PARAMETRISATIONS[name]
    if found.inputs != inputs:
        expected = f"{found.inputs} for {name}"
        raise UserError("wrong number of columns", file=path, field="#DIM", got=inputs, expected=expected)
    return found


def _quantity(name: str | None, outputs: int, path: Path) -> tuple[Quantity, str]:
    """The quantity of the values, and, for three values, their kind."""
    if name not in _QUANTITIES:
        expected = f"one of: {', '.join(_QUANTITIES)}"
        hint = "state the quantity in the header, if you know it"
        got = name or "nothing"
        raise UserError(
            "quantity of the values is not stated", file=path, field="#PARAM_OUT", got=got, expected=expected, hint=hint
        )
    if outputs not in (1, 3) or (name == "XYZ_COLOR" and outputs == 1):
        expected = "3 values" if name == "XYZ_COLOR" else "1 value or 3 (R, G, B): nothing states wavelengths"
        raise UserError("number of values cannot be read", file=path, field="#DIM", got=outputs, expected=expected)
    return _QUANTITIES[name]


def _rows(body: bytes, stated: int, confidence: str, path: Path) -> Floats:
    """(N, stated or more) numbers: rows may or may not end with the columns of confidence that #VS counts."""
    first = body.strip().split(b"\n", 1)[0].replace(b",", b" ").replace(b";", b" ")
    found = len(first.split())
    further = sum(int(count) for count in confidence.split() if count in ("1", "2"))
    widths = {stated, stated + further}
    if found and found not in widths:
        expected = " or ".join(str(width) for width in sorted(widths)) + " by #DIM and #VS"
        raise UserError("wrong number of columns", file=path, got=found, expected=expected)
    return rows_of(body, found or stated, path)[0]
