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
from typing import Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.scenes.photometry.distribution import Photometry, check_angles

FINENESS = (1, 2, 4, 8)
PLANES = 72  # of type C at fineness 1
MOST_NODES = 1 << 20
TOLERANCE = 0.005  # of the largest intensity, at the file's own angles, and of the flux
HALF_TURN = 180.0


def type_c(
    kind: Literal["A", "B"], vertical_deg: Floats, horizontal_deg: Floats, candela: Floats, file: Path
) -> Photometry:
    """Resample candela (H, V) of type A or B onto type C angles.

    Horizontal or vertical angles that start at 0 are mirrored there. The grid is refined until values at the file's
    angles and the flux agree to half a per cent.
    """
    for name, angles in (("vertical angles", vertical_deg), ("horizontal angles", horizontal_deg)):
        check_angles(angles, -90, 90, file, name)
    horizontal_deg, candela = _both_sides(horizontal_deg, candela)
    vertical_deg, turned = _both_sides(vertical_deg, candela.T)
    latitude, longitude = (vertical_deg, horizontal_deg) if kind == "A" else (horizontal_deg, vertical_deg)
    values = turned.T if kind == "A" else turned
    own = Photometry.of(90 - latitude[::-1], longitude + HALF_TURN, values[:, ::-1])
    nodes = _type_c_angles(kind, *np.meshgrid(latitude, longitude))
    offsets = np.unique(np.abs(np.concatenate([latitude, longitude, [0.0, 90.0]])))
    for fineness in FINENESS:
        shares = np.arange(len(offsets) * fineness - fineness + 1) / fineness
        gamma, c = np.interp(shares, np.arange(len(offsets)), offsets), np.linspace(0, 360, PLANES * fineness + 1)
        found = Photometry.of(gamma, c, _sampled(kind, own, *np.meshgrid(gamma, c)))
        error = np.abs(found.at(*nodes) - values).max() / max(values.max(), 1e-300)
        if (
            max(error, abs(found.lumens / max(own.lumens, 1e-300) - 1)) < TOLERANCE
            or 4 * gamma.size * c.size > MOST_NODES
        ):
            break
    return found


def _both_sides(angles_deg: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Angles, and values (N, ...) there, mirrored at 0 if they start there."""
    if angles_deg[0] != 0:
        return angles_deg, values
    return np.concatenate([-angles_deg[:0:-1], angles_deg]), np.concatenate([values[:0:-1], values])


def _sampled(kind: str, own: Photometry, gamma_deg: Floats, c_deg: Floats) -> Floats:
    """Candela of `own`, whose axis is that of the planes, towards type C angles."""
    gamma, c = np.radians(gamma_deg), np.radians(c_deg)
    up, left, ahead = np.sin(gamma) * np.cos(c), np.sin(gamma) * np.sin(c), np.cos(gamma)
    sine, across = (up, -left) if kind == "A" else (-left, up)
    latitude = np.arcsin(np.clip(sine, -1, 1))
    return own.at(90 - np.degrees(latitude), np.degrees(np.arctan2(across, ahead)) + HALF_TURN)


def _type_c_angles(kind: str, latitude_deg: Floats, longitude_deg: Floats) -> tuple[Floats, Floats]:
    """gamma and C of angles about the axis of the planes and along them."""
    latitude, longitude = np.radians(latitude_deg), np.radians(longitude_deg)
    sine, across = np.sin(latitude), np.cos(latitude) * np.sin(longitude)
    up, left = (sine, -across) if kind == "A" else (across, -sine)
    ahead = np.cos(latitude) * np.cos(longitude)
    return np.degrees(np.arctan2(np.hypot(up, left), ahead)), np.degrees(np.arctan2(left, up))
