"""Convert measured values to a gonio table, for text formats.

Rows (theta_i, phi_i, theta_o, phi_o, f): incident directions form a grid, outgoing directions another, with holes, or
none. Specular grids: one grid of outgoing directions about the direction of mirror reflection or undeviated
transmission.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction
from lambent.materials.measured.protocol import Quantity
from lambent.materials.measured.tables.gonio import PHI_I_RANGE_DEG, AnySheet, GonioTable, Sheets, Symmetry
from lambent.materials.measured.tables.sheets import ScatteredSheet, Sheet, specular_frame
from lambent.materials.measured.tables.table import sensible


@dataclass(frozen=True)
class SpecularGrid:
    """Angles of a file, in degrees.

    Attributes
    ----------
    rotation : (R,)
        Of the specimen; it becomes phi_i.
    theta_i : (I,) increasing
    azimuth : (A,) increasing
        About the specular direction, counter-clockwise, 0 towards the normal.
    radial : (T,) increasing
        From the specular direction.
    specular : (I,), optional
        Angle of the specular direction from the normal, where refraction changes it.
    """

    rotation: Floats
    theta_i: Floats
    azimuth: Floats
    radial: Floats
    specular: Floats | None = None

    @property
    def shape(self) -> tuple[int, int, int, int]:
        return len(self.rotation), len(self.theta_i), len(self.azimuth), len(self.radial)


def specular_table(
    grid: SpecularGrid,
    values: Floats,
    path: Path,
    format: str,
    *,
    far: bool,
    mirrored: bool,
    notes: tuple[str, ...] = (),
) -> GonioTable:
    """The table of f (rotations, incidences, azimuths, radials, C) in 1/sr.

    Parameters
    ----------
    far : bool
        Whether the light is transmitted.
    mirrored : bool
        Whether azimuths 0 to 180 stand for the whole turn.

    Raises
    ------
    UserError
        Nothing was measured for an incident direction.
    """
    azimuth, images = grid.azimuth, None
    if mirrored:
        azimuth, values, images = _whole_azimuths(azimuth, values)
    elif azimuth[-1] - azimuth[0] >= 360:
        azimuth, values = azimuth[:-1], values[:, :, :-1]
    phi_i, order = np.unique(grid.rotation % 360, return_index=True)
    symmetry = spanned_symmetry(phi_i)
    if len(phi_i) > 1:
        notes += (f"sample rotation is taken as phi_i, and the symmetry as {symmetry} from its range",)
    else:
        phi_i = np.zeros(1)
    specular = grid.theta_i if grid.specular is None else grid.specular

    def sheet(i: int, k: int, phi: float) -> Sheet:
        frame = specular_frame(specular[i], phi)
        made = Sheet(grid.radial, azimuth, values[k, i].swapaxes(0, 1), frame, images)
        if not np.isfinite(made.values).all(axis=1).any():
            field = f"angle of incidence {grid.theta_i[i]:g}, rotation {phi:g}"
            raise UserError("an incident direction has no measured value", file=path, field=field)
        return made

    rotations = list(zip(order, phi_i, strict=True))
    sheets = tuple(tuple(sheet(i, k, phi) for k, phi in rotations) for i in range(len(grid.theta_i)))
    nodes = np.concatenate([sheet.directions[sheet.measured] for row in sheets for sheet in row])
    if below := int((nodes[:, 2] <= 0).sum()):
        notes += (f"{below} of {len(nodes)} directions are below the horizon and left out",)
    sides: tuple[Sheets, Sheets] = ((), sheets) if far else (sheets, ())
    file = Path(path)
    return GonioTable(
        file.stem, grid.theta_i, phi_i, *sides, symmetry=symmetry, file=file.name, notes=notes, format=format
    )


def _whole_azimuths(azimuth: Floats, values: Floats) -> tuple[Floats, Floats, Flags]:
    """Azimuths and values of the full turn, mirrored from a to -a, and flags (radials, azimuths) of the images."""
    half = azimuth <= 180
    inner = (azimuth > 0) & (azimuth < 180)
    whole = np.concatenate([azimuth[half], 360 - azimuth[inner][::-1]])
    images = np.broadcast_to(whole > 180, (values.shape[3], len(whole)))
    return whole, np.concatenate([values[:, :, half], values[:, :, inner][:, :, ::-1]], axis=2), images


_WORDS: dict[str, Quantity] = {
    **dict.fromkeys(("f", "fr", "ft", "fs", "brdf", "btdf", "bsdf", "integrated"), "f"),
    **dict.fromkeys(("fcos", "ccbrdf", "ccbtdf", "ccbsdf", "brdfcos", "btdfcos", "bsdfcos"), "f_cos"),
    **dict.fromkeys(("p", "transfer", "transferprobability"), "p"),
}
LONGEST_NAME = 64  # of a column
DECIMALS = 5  # of the angles in degrees: directions equal to this precision are merged
_LEAST_FILLED = 0.3  # share of nodes that a grid of outgoing directions must fill; otherwise it is a scattered set
_PLANE_DEG = 0.1  # a scan this close to the plane of incidence counts as in it


_HINT_RAISED = "angles that count from the surface are named elevation_i and elevation_o"


def check_angles(angles_deg: Floats, path: Path) -> None:
    """Raise `UserError` if an angle (N, 4) is not finite or out of range."""
    expected = "degrees: theta_i in [0, 90), theta_o in [0, 180], phi up to 3600"
    theta_i, theta_o, phi = angles_deg[:, 0], angles_deg[:, 2], np.abs(angles_deg[:, [1, 3]])
    finite = np.isfinite(angles_deg).all(axis=1)
    inside = finite & (theta_i >= 0) & (theta_i < 90) & (theta_o >= 0) & (theta_o <= 180) & (phi <= 3600).all(axis=1)
    if not inside.all():
        row = int(np.argmin(inside))
        got = ", ".join(f"{angle:g}" for angle in angles_deg[row])
        field = f"measurement {row + 1}"
        hint = _HINT_RAISED if theta_i.max(initial=0) == 90 else None
        raise UserError("an angle is outside its range", file=path, field=field, got=got, expected=expected, hint=hint)


def quantity_of(word: str) -> Quantity | None:
    """The quantity of a column of this name; None for other names."""
    if len(word) > LONGEST_NAME:
        return None
    return _WORDS.get(re.sub(r"\(.*?\)|\[.*?\]|[^a-z]", "", word.lower()))


def to_f(values: Floats, quantity: Quantity, theta_o_deg: Floats) -> Floats:
    """f (N, C) of stored values: f_cos and p are divided by |cos theta_o|; NaN where that is 0."""
    if quantity == "f":
        return values
    cos_o = np.abs(np.cos(np.radians(theta_o_deg)))[:, None]
    with np.errstate(over="ignore"):
        return np.divide(values, cos_o, out=np.full_like(values, np.nan), where=cos_o > 1e-6)


def table_of(
    angles_deg: Floats,
    f: Floats,
    path: Path,
    format: str,
    name: str,
    *,
    stored: Quantity = "f",
    named: str | None = None,
    notes: tuple[str, ...] = (),
) -> GonioTable:
    """The table of single measurements.

    Parameters
    ----------
    angles_deg : (N, 4)
        theta_i, phi_i, theta_o, phi_o in absolute directions; theta_o > 90 is on the far side.
    f : (N, C)
        1/sr, NaN where it was not measured.
    named : str, optional
        The symmetry as the file names it.

    Raises
    ------
    UserError
        The symmetry is unknown or contradicted, the incident directions do not form a grid, or one of them has no
        measured value.
    """
    angles = np.round(angles_deg, DECIMALS)
    theta_i, phi_i = np.unique(angles[:, 0]), np.unique(angles[:, 1])
    symmetry = spanned_symmetry(phi_i) if named is None else _checked_symmetry(named, phi_i, path)
    if named is None:
        notes += (f"symmetry not stated, taken as {symmetry} from phi_i",)
    images = np.zeros(len(angles), dtype=bool)
    if symmetry == "isotropic":
        angles[:, 3] -= angles[:, 1]
        angles[:, 1], phi_i = 0, np.zeros(1)
        angles, f, images = _mirrored(angles, f)
    far = angles[:, 2] > 90
    angles[far, 2] = np.round(180 - angles[far, 2], DECIMALS)
    angles[:, 3] = np.round(angles[:, 3] % 360, DECIMALS) % 360
    at_pole = angles[:, 2] == 0
    if len(np.unique(angles[at_pole, 3])) == 1:  # otherwise the file has theta_o = 0 as regular grid nodes
        angles[at_pole, 3] = 0
    angles, f, far, images, repeated = _averaged(angles, f, far, images)
    if repeated:
        notes += (f"{repeated} measurements repeat a direction; their mean was taken",)
    near, beyond = (_side(angles[side], f[side], images[side], (theta_i, phi_i), path) for side in (~far, far))
    file = Path(path).name
    return GonioTable(name, theta_i, phi_i, near, beyond, symmetry, stored, file=file, notes=notes, format=format)


def spanned_symmetry(phi_i_deg: Floats) -> Symmetry:
    """The symmetry with the range that the increasing phi_i span."""
    span = phi_i_deg[-1] - phi_i_deg[0]
    return next((name for name, whole in PHI_I_RANGE_DEG.items() if span <= whole), "none")


def _checked_symmetry(named: str, phi_i_deg: Floats, path: Path) -> Symmetry:
    """The symmetry the file names; `UserError` if the phi_i span more."""
    symmetry = cast(Symmetry, known("symmetry", named, PHI_I_RANGE_DEG, file=path, field="symmetry"))
    if phi_i_deg[-1] - phi_i_deg[0] > PHI_I_RANGE_DEG[symmetry]:
        got = f"phi_i from {phi_i_deg[0]:g} to {phi_i_deg[-1]:g}"
        expected = f"a span of at most {PHI_I_RANGE_DEG[symmetry]:g} degrees"
        raise UserError("phi_i spans more than the symmetry", file=path, field=symmetry, got=got, expected=expected)
    return symmetry


def _mirrored(angles_deg: Floats, f: Floats) -> tuple[Floats, Floats, Flags]:
    """Rows of an isotropic specimen, their f, and flags of mirror images.

    Mirror images are added if the rows cover only one side of the plane of incidence.
    """
    phi = np.round(angles_deg[:, 3] % 360, DECIMALS) % 360
    left, right = (phi > 0) & (phi < 180), phi > 180
    inner = left | right if left.any() != right.any() else np.zeros(len(f), dtype=bool)
    images = np.concatenate([np.zeros(len(f), dtype=bool), np.ones(int(inner.sum()), dtype=bool)])
    return np.concatenate([angles_deg, angles_deg[inner] * (1, 1, 1, -1)]), np.concatenate([f, f[inner]]), images


def _averaged(angles: Floats, f: Floats, far: Flags, images: Flags) -> tuple[Floats, Floats, Flags, Flags, int]:
    """The rows sorted by direction, with f of repeated directions averaged, and the number of repeats."""
    order = np.lexsort((angles[:, 3], angles[:, 2], angles[:, 1], angles[:, 0], far))
    angles, f, far, images = angles[order], f[order], far[order], images[order]
    same = (angles[1:] == angles[:-1]).all(axis=1) & (far[1:] == far[:-1])
    first = np.flatnonzero(np.concatenate([[True], ~same]))
    if same.any():
        usable = np.isfinite(f)
        total = np.add.reduceat(np.where(usable, f, 0), first, axis=0)
        count = np.add.reduceat(usable, first, axis=0, dtype=np.int64)
        f = np.divide(total, count, out=np.full_like(total, np.nan), where=count > 0)
    return angles[first], f, far[first], images[first], int(same.sum())


def _side(angles_deg: Floats, f: Floats, images: Flags, incident_deg: tuple[Floats, Floats], path: Path) -> Sheets:
    """The sheets of one side, by theta_i then phi_i; a single sheet at theta_i = 0 serves every phi_i."""
    theta_i, phi_i = incident_deg
    if len(angles_deg) == 0:
        return ()
    incident: Indices = np.searchsorted(theta_i, angles_deg[:, 0]) * len(phi_i)
    incident += np.searchsorted(phi_i, angles_deg[:, 1])
    found, starts = np.unique(incident, return_index=True)
    parts = [np.split(array, starts[1:]) for array in (angles_deg, f, images)]
    sheets: dict[int, AnySheet] = {
        int(k): sheet_of(part, values, same, path) for k, part, values, same in zip(found, *parts, strict=True)
    }
    if theta_i[0] == 0:
        at_normal = [sheets[k] for k in range(len(phi_i)) if k in sheets]
        if len(at_normal) == 1:
            sheets |= dict.fromkeys(range(len(phi_i)), at_normal[0])
    if len(sheets) != len(theta_i) * len(phi_i):
        expected = f"{len(theta_i)} theta_i x {len(phi_i)} phi_i, on either side the same"
        raise UserError("incident directions do not form a grid", file=path, got=len(sheets), expected=expected)
    whole = [sheets[k] for k in range(len(sheets))]
    return tuple(tuple(whole[k : k + len(phi_i)]) for k in range(0, len(whole), len(phi_i)))


def sheet_of(angles_deg: Floats, f: Floats, images: Flags, path: Path) -> AnySheet:
    """The sheet of one incident direction and side, from rows (N, 4) sorted by theta_o then phi_o, without repeats.

    Angles are in degrees: theta_i, phi_i, theta_o, phi_o; f (N, C) is in 1/sr, and `images` (N,) flags mirror images.

    Raises
    ------
    UserError
        If no value was measured.
    """
    theta_i, phi_i = angles_deg[0, :2]
    if not sensible(f).any():
        where = f"theta_i {theta_i:g}, phi_i {phi_i:g}"
        raise UserError("an incident direction has no measured value", file=path, field=where)
    frame = specular_frame(theta_i, phi_i)
    wo = direction(*np.radians(angles_deg[:, 2:].T))
    theta, phi = np.unique(angles_deg[:, 2]), np.unique(angles_deg[angles_deg[:, 2] > 0, 3])
    in_plane = float(np.abs(wo @ frame[1]).max()) < np.sin(np.radians(_PLANE_DEG))
    if in_plane or len(phi) < 3 or len(angles_deg) < _LEAST_FILLED * len(theta) * len(phi):
        return ScatteredSheet(wo, f, frame, images)
    phi = np.union1d(phi, angles_deg[:, 3])
    row, column = np.searchsorted(theta, angles_deg[:, 2]), np.searchsorted(phi, angles_deg[:, 3])
    grid = np.full((len(theta), len(phi), f.shape[1]), np.nan)
    grid[row, column] = f
    repeats = np.zeros(grid.shape[:2], dtype=bool)
    repeats[:, np.setdiff1d(column[images], column[~images])] = True
    if theta[0] == 0 and (row == 0).sum() == 1:
        grid[0], repeats[0] = f[0], np.arange(len(phi)) != column[0]  # a reading along n serves every phi_o
    return Sheet(theta, phi, grid, images=repeats)
