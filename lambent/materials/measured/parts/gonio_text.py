"""Writer of gonio text, Lambent's own text format of gonio-photometer tables; columns.py reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.files import atomic_path
from lambent.core.geometry.directions import Floats, angles
from lambent.core.plain import printable
from lambent.materials.measured.protocol import Quantity
from lambent.materials.measured.tables.gonio import AnySheet, GonioTable
from lambent.materials.measured.tables.sheets import Sheet

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")


def write_gonio(path: Path, table: GonioTable, quantity: Quantity = "p") -> None:
    """Write `table` as gonio text, atomically, with six significant digits of the values.

    Parameters
    ----------
    quantity : {"f", "f_cos", "p"}
        f_cos and p both hold f |cos theta_o|, in 1/sr.
    """
    channels = ("",) if table.info.channels == 1 else ("_r", "_g", "_b")
    names = " ".join([*ANGLES, *(quantity + channel for channel in channels)])
    formats = ["%.8g"] * len(ANGLES) + ["%.6g"] * len(channels)
    with atomic_path(Path(path)) as temporary, temporary.open("w", encoding="utf-8") as file:
        file.write(f"# name: {printable(table.name)}\n# symmetry: {table.symmetry}\n{names}\n")
        for entry in table.entries():
            np.savetxt(file, _columns(*entry, quantity), fmt=formats)


def _columns(theta_i_deg: float, phi_i_deg: float, sheet: AnySheet, far: bool, quantity: Quantity) -> Floats:
    """(N, 4 + C) rows of one incident direction and side."""
    if isinstance(sheet, Sheet) and sheet.frame is None:  # keeps phi where theta is 0
        theta, phi = (grid.ravel() for grid in np.meshgrid(sheet.theta_deg, sheet.phi_deg, indexing="ij"))
    else:
        theta, phi = (np.degrees(angle) for angle in angles(sheet.directions))
    kept = sheet.measured & (theta <= 90)
    theta, phi, values = theta[kept], phi[kept], sheet.values[kept]
    if quantity != "f":
        values = values * np.cos(np.radians(theta))[:, None]
    fixed = np.broadcast_to((theta_i_deg, phi_i_deg), (len(theta), 2))
    return np.column_stack([fixed, 180 - theta if far else theta, phi, values])
