"""Cornell gonioreflectometer text, as pbrt-v2 reads it: isotropic BRDF at scattered directions, spectral.

Numbers separated by blanks and line ends, `#` begins a comment: the number K of wavelengths, the K wavelengths in nm,
then per measurement theta_i phi_i theta_o phi_o in radians and K values of f (no cosine: pbrt-v2 multiplies by it).
"""

from __future__ import annotations

import re
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.core.frames import Floats, direction
from lambent.core.sequences import radical_inverse
from lambent.materials.measured.merl import half_difference_angles
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect
from lambent.materials.measured.spectral import rgb_of_spectra
from lambent.materials.measured.table import IntegratedTable, require_values

NAME = "Cornell / pbrt-v2 text"
LIMIT_BYTES = 256 << 20
_NEIGHBOURS = 8
_WEIGHT_POINTS = 1 << 17
_COMMENT = re.compile(rb"\A\xef\xbb\xbf|#[^\r\n]*")  # and the byte order mark


def recognise(head: bytes, size: int) -> bool:
    """Whether the first number is a count of wavelengths and increasing wavelengths of light follow."""
    tokens = _COMMENT.sub(b"", head).split(maxsplit=5)[:4]
    try:
        count, *wavelengths = (float(token) for token in tokens)
    except ValueError:
        return False
    plausible = len(wavelengths) >= 1 and count >= 1 and count == int(count)
    first = wavelengths[: int(min(count, 3))] if plausible else []
    return plausible and all(100 <= w <= 5000 for w in first) and first == sorted(set(first))


def read(path: Path) -> CornellTable:
    """The table of a Cornell text file.

    Raises
    ------
    UserError
        Where a word is not a number, the counts do not fit, an angle is outside its range, or nothing was measured.
    """
    words = _COMMENT.sub(b"", read_bytes(path, LIMIT_BYTES)).split()
    try:
        numbers = np.array(words, dtype=np.float64)
    except ValueError as error:
        raise UserError(f"holds a word that is not a number ({error})", file=path) from error
    count = int(numbers[0])
    wavelengths, rest = numbers[1 : 1 + count], numbers[1 + count :]
    if len(wavelengths) < count or not (np.diff(wavelengths) > 0).all():
        raise UserError("wavelengths are missing or do not increase", file=path, expected=f"{count} wavelengths in nm")
    if len(rest) == 0 or len(rest) % (4 + count):
        expected = f"a multiple of 4 + {count}"
        raise UserError("number of values does not fit", file=path, got=f"{len(rest)} numbers", expected=expected)
    rows = rest.reshape(-1, 4 + count)
    theta = rows[:, [0, 2]]
    if not (np.isfinite(rows[:, :4]).all() and (theta >= 0).all() and (theta <= np.pi / 2 + 1e-3).all()):
        raise UserError("an angle is outside its range", file=path, expected="theta in [0, pi/2], radians")
    return CornellTable(rows, wavelengths, path)


class CornellTable(IntegratedTable):
    """Scattered isotropic samples; `eval` weighs the eight nearest in half and difference angles by distance^-2.

    Parameters
    ----------
    rows : (N, 4 + K)
        theta_i, phi_i, theta_o, phi_o in radians, then f at K wavelengths.
    wavelengths_nm : (K,)
    path : Path
    """

    def __init__(self, rows: Floats, wavelengths_nm: Floats, path: Path) -> None:
        self._wi, self._wo = direction(rows[:, 0], rows[:, 1]), direction(rows[:, 2], rows[:, 3])
        spectra = rows[:, 4:]
        usable = np.asarray((np.isfinite(spectra) & (spectra >= 0)).all(axis=1))
        require_values(spectra, usable, path)
        rgb = np.full((len(rows), 3), np.nan)
        rgb[usable] = spectra[usable] @ rgb_of_spectra(wavelengths_nm).T
        outside = int((rgb[usable] < 0).any(axis=1).sum())
        rgb[usable] = np.maximum(rgb[usable], 0)
        rgb[(spectra < 0).any(axis=1)] = -1
        self._f, self._usable = rgb, usable
        notes = ["spectra became linear RGB under D65"]
        if outside:
            notes.append(f"{outside} spectra are more saturated than Rec.709; the negative channel became 0")
        self.info = TableInfo(
            file=Path(path).name,
            format=NAME,
            isotropic=True,
            transmits=False,
            channels=3,
            stored="f",
            sizes={"samples": len(rows), "wavelengths": len(wavelengths_nm)},
            notes=tuple(notes),
        )

    @cached_property
    def _tree(self) -> Any:  # scipy's class is imported where it is needed
        from scipy.spatial import cKDTree

        return cKDTree(_place(self._wi[self._usable], self._wo[self._usable]))

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr; exact at the samples; 0 where wi or wo is below the surface."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        above = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        f = np.zeros(wi.shape)
        values = self._f[self._usable]
        k = min(_NEIGHBOURS, len(values))
        distance, index = self._tree.query(_place(wi[above], wo[above]), k=list(range(1, k + 1)))
        weight = 1 / np.maximum(distance, 1e-9) ** 2
        weight /= weight.sum(axis=-1, keepdims=True)
        f[above] = (values[index] * weight[..., None]).sum(axis=-2)
        return f

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """The file's tuples; the weight is the share of d_wi d_wo that lies nearest to the tuple, in sr^2."""
        from scipy.spatial import cKDTree

        k = np.arange(_WEIGHT_POINTS)
        u = np.stack([radical_inverse(k, base) for base in (2, 3, 5)])
        wi, wo = direction(np.arccos(u[0]), 0.0), direction(np.arccos(u[1]), 2 * np.pi * u[2])
        _, nearest = cKDTree(_place(self._wi, self._wo)).query(_place(wi, wo))
        weight = np.bincount(nearest, minlength=len(self._f)) * ((2 * np.pi) ** 2 / _WEIGHT_POINTS)
        shadowed = np.zeros(len(self._f), dtype=bool)
        return collect(self._wi, self._wo, self._f, weight, self.info, shadowed, max_count)


def _place(wi: Floats, wo: Floats) -> Floats:
    """(..., 3) point of a pair whose Euclidean distance follows theta_h (stretched near 0), theta_d and phi_d.

    phi_d is folded by reciprocity and by the mirror symmetry of isotropic materials; where its circle is small
    (theta_h or theta_d near 0) it counts for little.
    """
    theta_h, theta_d, phi_d = half_difference_angles(wi, wo)
    folded = np.minimum(phi_d, np.pi - phi_d) * (2 / np.pi)
    return np.stack(
        [np.sqrt(theta_h * 2 / np.pi), theta_d * 2 / np.pi, folded * np.sin(theta_h) * np.sin(theta_d)], axis=-1
    )
