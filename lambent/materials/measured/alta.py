"""ALTA text: the data files of the ALTA library (Inria), a header of keys and then rows of numbers.

    #DIM 3 3
    #PARAM_IN  RUSIN_TH_TD_PD
    #PARAM_OUT RGB_COLOR
    0.1  0.2  1.5707963  0.041  0.052  0.31

DIM counts the columns of the directions and of the values; PARAM_IN names the parametrisation, PARAM_OUT the quantity.
VS gives, per value, how many columns of confidence follow (0, 1: a radius, 2: both bounds); they are not used. Angles
are in radians. Lines above the header are ignored; `#` followed by anything but a letter starts a comment. The
parametrisations are those of ALTA's params.h, in alta_directions.py. Rows below the horizon, which ALTA's grids
include, are dropped.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError, did_you_mean
from lambent.core.geometry.directions import angles
from lambent.materials.measured.columns import Layout, assemble, rows_of
from lambent.materials.measured.parts.alta_directions import AZIMUTHS, PARAMETRISATIONS, SLICES, Parametrisation
from lambent.materials.measured.parts.text_numbers import head_text, read_text, shown, without_comments
from lambent.materials.measured.protocol import MeasuredTable, Quantity

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
    return rows_of(body, found or stated, path)
