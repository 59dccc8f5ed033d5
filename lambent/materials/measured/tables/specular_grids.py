"""Tables with one grid of outgoing directions about the direction of mirror reflection or undeviated transmission."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.materials.measured.parts.gonio_rows import spanned_symmetry
from lambent.materials.measured.tables.gonio import GonioTable, Sheets
from lambent.materials.measured.tables.sheets import Sheet, specular_frame


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
        azimuth, values, images = _mirrored(azimuth, values)
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


def _mirrored(azimuth: Floats, values: Floats) -> tuple[Floats, Floats, Flags]:
    """Azimuths and values of the full turn, mirrored from a to -a, and flags (radials, azimuths) of the images."""
    half = azimuth <= 180
    inner = (azimuth > 0) & (azimuth < 180)
    whole = np.concatenate([azimuth[half], 360 - azimuth[inner][::-1]])
    images = np.broadcast_to(whole > 180, (values.shape[3], len(whole)))
    return whole, np.concatenate([values[:, :, half], values[:, :, inner][:, :, ::-1]], axis=2), images
