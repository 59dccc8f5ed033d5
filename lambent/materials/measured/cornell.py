"""Cornell gonioreflectometer text, as pbrt-v2 reads it: isotropic BRDF at scattered directions, spectral.

Numbers are separated by blanks and line ends; `#` begins a comment. The file holds the number K of wavelengths, the K
wavelengths in nm, then per measurement theta_i phi_i theta_o phi_o in radians and K values of f (without the cosine,
which pbrt-v2 multiplies by).
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from lambent.core.ceilings import CORNELL_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.parts.spectral import rgb_of_measured
from lambent.materials.measured.parts.text_numbers import numbers, read_text, without_comments
from lambent.materials.measured.tables.scattered import ScatteredTable
from lambent.materials.measured.tables.table import isotropic_brdf, require_values, sensible, unmarked, usable_values

NAME = "Cornell / pbrt-v2 text"
_COMMENT = re.compile(rb"\A\xef\xbb\xbf|#[^\r\n]*")  # and the byte order mark


def recognise(head: bytes, size: int) -> bool:
    """Whether the first number is a count of wavelengths and increasing wavelengths of light follow."""
    tokens = _COMMENT.sub(b"", head).split(maxsplit=5)[:4]
    try:
        count, *wavelengths = (float(token) for token in tokens)
    except ValueError:
        return False
    plausible = len(wavelengths) >= 1 and count >= 1 and count.is_integer()
    first = wavelengths[: int(min(count, 3))] if plausible else []
    return plausible and all(100 <= w <= 5000 for w in first) and first == sorted(set(first))


def read(path: Path) -> ScatteredTable:
    """The table of a Cornell text file.

    Raises
    ------
    UserError
        A word is not a number, the counts do not fit, an angle is outside its range, or nothing was measured.
    """
    values = numbers(without_comments(read_text(path, CORNELL_BYTES)), path)
    if not (len(values) > 1 and 1 <= values[0] <= len(values)):
        got = f"{len(values)} numbers" + (f", the first {values[0]:g}" if len(values) else "")
        raise UserError("does not begin with a count of wavelengths", file=path, got=got)
    count = int(values[0])
    wavelengths, rest = values[1 : 1 + count], values[1 + count :]
    if len(wavelengths) < count or not (np.diff(wavelengths) > 0).all():
        raise UserError("wavelengths are missing or do not increase", file=path, expected=f"{count} wavelengths in nm")
    if len(rest) == 0 or len(rest) % (4 + count):
        expected = f"a multiple of 4 + {count}"
        raise UserError("wrong number of values", file=path, got=f"{len(rest)} numbers", expected=expected)
    rows = rest.reshape(-1, 4 + count)
    theta = rows[:, [0, 2]]
    if not (np.isfinite(rows[:, :4]).all() and (theta >= 0).all() and (theta <= np.pi / 2 + 1e-3).all()):
        raise UserError("an angle is outside its range", file=path, expected="theta in [0, pi/2], radians")
    spectra = unmarked(rows[:, 4:])
    require_values(spectra, usable_values(spectra), path)
    rgb, notes = rgb_of_measured(spectra, sensible(spectra), wavelengths)
    sizes = {"samples": len(rows), "wavelengths": count}
    wi, wo = direction(rows[:, 0], rows[:, 1]), direction(rows[:, 2], rows[:, 3])
    return ScatteredTable(wi, wo, rgb, isotropic_brdf(path, NAME, sizes, notes))
