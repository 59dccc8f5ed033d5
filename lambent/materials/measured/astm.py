"""ASTM E1392 (E1392-96, angle resolved optical scatter): a header of keywords, then tuples.

    SAMPLE_NAME  "krylon blue"
    NUM_POINTS   1439
    VARS         theta_i,phi_i,theta_s,phi_s,R,G,B
    0.5236,3.1416,0.1745,0.0,0.041,0.052,0.31

A header line is a keyword in capitals and its value; VARS names the columns and ends the header; a tuple per line
follows. The reader follows the files in circulation (Cornell's .astm, and those libbsdf and ALTA read): values are the
BRDF in 1/sr unless the name says cosine-corrected (CCBRDF, f_cos), in one column, R,G,B, X,Y,Z or one per wavelength.
Angles are absolute; theta_s and phi_s are the scattered direction's. The standard does not fix their unit: they are
radians if no theta exceeds pi/2, else degrees. Without a column for phi_i it is the standard's 180 degrees, so that
phi_s = 0 lies ahead, in the mirror direction.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.materials.measured.columns import assemble, layout_of, rows_of
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.text_numbers import head_text, read_text, shown, without_comments

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
        VARS is missing, a column is of no known kind, NUM_POINTS does not fit, or an angle is outside its range.
    """
    text = without_comments(read_text(path))
    found = _VARS.search(text)
    if found is None:
        raise UserError("has no line VARS", file=path)
    keys = {key.decode(): shown(value) for key, value in _KEYWORD.findall(text[: found.start()])}
    names = [name for name in re.split(r"[\s,;]+", shown(found[1]).strip()) if name]
    layout = layout_of(names, path)
    layout = replace(layout, quantity=layout.quantity or "f")
    rows = rows_of(text[found.end() :], len(names), path)
    stated = keys.get("NUM_POINTS")
    if stated is not None and stated.split()[0] != str(len(rows)):
        expected = f"{len(rows)}, the number of rows"
        raise UserError("wrong number of tuples", file=path, field="NUM_POINTS", got=stated, expected=expected)
    theta = rows[:, [layout.angles["theta_i"], layout.angles["theta_o"]]]
    finite = np.abs(theta[np.isfinite(theta)])
    radians = layout.radians or (len(finite) > 0 and float(finite.max()) <= np.pi / 2 + 1e-3)
    notes = (f"angles are taken as {'radians' if radians else 'degrees'}, by their range",)
    name = keys.get("SAMPLE_NAME", Path(path).stem).strip("\"' ") or Path(path).stem
    return assemble(rows, replace(layout, radians=radians), PHI_I_DEG, path, NAME, name, notes)
