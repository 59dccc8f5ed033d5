"""Fill in unmeasured directions from mirror-symmetric ones.

A surface whose grain runs along x or y is symmetric in both axes, and under a turn of 180 degrees. An isotropic one,
whose tuples are turned to phi_i = 0, is symmetric in the plane of incidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.materials.fitting.shown.incidence import Incidence

ALIKE_DEG = 1.0
# Signs of x and y, and the azimuth that phi maps to: sign * phi + offset, in degrees.
MIRRORS = (((1, -1), -1, 0.0), ((-1, 1), -1, 180.0), ((-1, -1), 1, 180.0))


def mirrored(entry: Incidence, entries: Sequence[Incidence]) -> Incidence | None:
    """Tuples of `entries`, mirrored so that their incident direction becomes that of `entry`; None without any."""
    found = []
    for other in entries:
        if abs(other.theta_deg - entry.theta_deg) > ALIKE_DEG:
            continue
        for signs, sign, offset in MIRRORS:
            away = (sign * other.phi_deg + offset - entry.phi_deg + 180) % 360 - 180
            if abs(away) <= ALIKE_DEG or entry.theta_deg < ALIKE_DEG:
                found.append((other.wo * np.array((*signs, 1)), other.f, other.weight))
    if not found:
        return None
    wo, f, weight = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return replace(entry, wo=wo, f=f, weight=weight)
