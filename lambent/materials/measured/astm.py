"""ASTM E1392 (E1392-96, angle resolved optical scatter): a header of keywords, then tuples.

    SAMPLE_NAME  "krylon blue"
    NUM_POINTS   1439
    VARS         theta_i,phi_i,theta_s,phi_s,R,G,B
    0.5236,3.1416,0.1745,0.0,0.041,0.052,0.31

A line is a keyword in capitals and its value, until VARS, which names the columns and ends the header; then a tuple per
line. This reader follows the files that are in circulation (Cornell's .astm and what libbsdf and ALTA read): values are
the BRDF in 1/sr unless the name says cosine-corrected (CCBRDF, f_cos), or R,G,B, X,Y,Z or one column per wavelength.
Angles are absolute; theta_s and phi_s are the scattered direction's. The standard does not fix their unit in the file:
radians where no theta exceeds pi/2, else degrees. Where phi_i is neither a column nor a keyword it is the standard's
180 degrees, so that phi_s = 0 lies ahead, where a mirror sends the light.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.materials.measured.columns import assemble, layout_of, rows_of
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.text_numbers import head_text, read_text, without_comments

NAME = "ASTM E1392"
PHI_I_DEG = 180.0
_VARS = re.compile(rb"^[ \t]*VARS[ \t=:]+([^\n]*)\n?", re.MULTILINE | re.IGNORECASE)
_KEYWORD = re.compile(rb"^[ \t]*([A-Z][A-Z0-9_ ]*?)[ \t]*[=:]?[ \t]+(\S[^\n]*?)[ \t]*$", re.MULTILINE)


def recognise(head: bytes, size: int) -> bool:
    """Whether a line VARS names an incident and a scattered angle."""
    text = head_text(head)
    found = _VARS.search(text) if text is not None else None
    return found is not None and re.search(rb"theta_?i.*theta_?s", found[1], re.IGNORECASE) is not None


def read(path: Path) -> MeasuredTable:
    """The table of an ASTM E1392 file.

    Raises
    ------
    UserError
        Where VARS is missing, a column is of no known kind, NUM_POINTS does not fit, or an angle is outside its range.
    """
    text = without_comments(read_text(path))
    found = _VARS.search(text)
    if found is None:
        raise UserError("has no line VARS", file=path)
    keys = {key.decode(): value.decode("utf-8", "replace") for key, value in _KEYWORD.findall(text[: found.start()])}
    names = [name for name in re.split(r"[\s,;]+", found[1].decode("utf-8", "replace").strip()) if name]
    layout = layout_of(names, path)
    layout = replace(layout, quantity=layout.quantity or "f")
    rows = rows_of(text[found.end() :], len(names), path)
    _check_count(keys, len(rows), path)
    columns = [layout.angles[name] for name in ("theta_i", "theta_o")]
    radians = layout.radians or _in_radians(rows[:, columns])
    notes = (f"angles are taken as {'radians' if radians else 'degrees'}, by their range",)
    name = keys.get("SAMPLE_NAME", Path(path).stem).strip("\"' ") or Path(path).stem
    return assemble(rows, replace(layout, radians=radians), PHI_I_DEG, path, NAME, name, notes)


def _in_radians(theta: Floats) -> bool:
    finite = theta[np.isfinite(theta)]
    return len(finite) > 0 and float(np.abs(finite).max()) <= np.pi / 2 + 1e-3


def _check_count(keys: dict[str, str], count: int, path: Path) -> None:
    stated = keys.get("NUM_POINTS")
    if stated is not None and stated.split()[0] != str(count):
        raise UserError("number of tuples does not fit", file=path, field="NUM_POINTS", got=count, expected=stated)
