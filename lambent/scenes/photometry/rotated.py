"""Photometry of types A and B, of headlamps and floodlights, in type C angles.

Both have a horizontal angle H, clockwise seen from above, and a vertical angle V, upwards (ANSI/IESNA LM-63-2002, 3.0).
Planes of type A share the vertical axis, so that H names a plane and V an angle in it; planes of type B share the
horizontal axis, and V names the plane. The luminaire's axis is H = V = 0; V turns it towards horizontal angle 0 of type
C, H towards 270:

    type A: sin V = sin gamma cos C,    tan H = -tan gamma sin C
    type B: sin H = -sin gamma sin C,   tan V = tan gamma cos C

These are the conversions of CIE 121-1996, table of relations between systems of planes, with its C planes 90 degrees
ahead. So the axis of type A is the direction that LM-63 calls photometric horizontal: that in which a headlamp shines.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import angles, direction
from lambent.scenes.photometry.distribution import Photometry, check_angles

# Rows, in luminaire axes: towards H = V = 0, towards a growing angle of planes, and the axis that planes share.
FRAMES = {"A": [[0, 0, 1], [0, -1, 0], [1, 0, 0]], "B": [[0, 0, 1], [1, 0, 0], [0, -1, 0]]}
FINENESS = (1, 2, 4, 8, 16)
PLANES = 72  # of type C at fineness 1
MOST_NODES = 1 << 20
TOLERANCE = 0.005  # of the largest intensity, at the file's own angles, and of the flux
HALF_TURN = 180.0  # so that angles of planes, from -90 to 90 degrees, are positive


def type_c(kind: str, vertical_deg: Floats, horizontal_deg: Floats, candela: Floats, file: Path) -> Photometry:
    """Resample candela (H, V) of type "A" or "B" onto type C angles.

    Horizontal or vertical angles that start at 0 are mirrored there. The grid is refined until values at the file's
    angles and the flux agree to half a per cent.
    """
    check_angles(vertical_deg, -90, 90, file, "vertical angles", 2)
    check_angles(horizontal_deg, -90, 90, file, "horizontal angles", 2)
    (h_deg, h), (v_deg, v) = _both_sides(horizontal_deg), _both_sides(vertical_deg)
    values = candela[np.ix_(h, v)]
    in_plane, of_plane, values = (v_deg, h_deg, values) if kind == "A" else (h_deg, v_deg, values.T)
    own = Photometry.of(90 - in_plane[::-1], of_plane + HALF_TURN, values[:, ::-1])
    frame, offsets = np.array(FRAMES[kind]), np.unique(np.abs([*h_deg, *v_deg, 0.0, 90.0]))
    nodes = np.degrees(angles(direction(*np.radians(np.meshgrid(90 - in_plane, of_plane))) @ frame))
    for fineness in FINENESS:
        shares = np.arange((len(offsets) - 1) * fineness + 1) / fineness
        gamma, c = np.interp(shares, np.arange(len(offsets)), offsets), np.linspace(0, 360, PLANES * fineness + 1)
        polar, turn = np.degrees(angles(direction(*np.radians(np.meshgrid(gamma, c))) @ frame.T))
        found = Photometry.of(gamma, c, own.at(polar, turn + HALF_TURN))
        error = np.abs(found.at(*nodes) - values).max() / max(values.max(), 1e-300)
        error = max(error, abs(found.lumens / max(own.lumens, 1e-300) - 1))
        if error < TOLERANCE or 4 * gamma.size * c.size > MOST_NODES:
            break
    return found


def _both_sides(angles_deg: Floats) -> tuple[Floats, Any]:
    """Angles, mirrored at 0 if they start there, and the index of each in the file."""
    index = np.arange(len(angles_deg))
    if angles_deg[0] != 0:
        return angles_deg, index
    return np.concatenate([-angles_deg[:0:-1], angles_deg]), np.concatenate([index[:0:-1], index])
