"""Intensities of luminaires on the device: linear between the angles of their photometry, 0 beyond."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.core.arrays import Floats
from lambent.scenes.photometry.distribution import Photometry

EDGE_RAD = 1e-6  # tolerance beyond the first and the last vertical angle


class Candela:
    """Intensities by luminaire number.

    Attributes
    ----------
    theta, phi : mi.Float
        Vertical and horizontal angles in radians, luminaire after luminaire.
    """

    def __init__(self, photometries: Sequence[Photometry]) -> None:
        angles = [(np.radians(one.vertical_deg), np.radians(one.horizontal_deg)) for one in photometries]
        self.theta, self._theta_at = _packed([theta for theta, _ in angles])
        self.phi, self._phi_at = _packed([phi for _, phi in angles])
        self._candela, self._candela_at = _packed([np.array(one.candela).ravel() for one in photometries])
        self._longest = max(max(len(theta), len(phi)) for theta, phi in angles)

    def towards(self, luminaire: Any, x: Any, y: Any, z: Any, active: Any = True) -> Any:
        """Candela towards the unit direction with these components along `IesLight.axes`."""
        theta, phi = dr.safe_acos(z), dr.atan2(y, x)
        phi = dr.select(phi < 0, phi + 2 * dr.pi, phi)
        i, s, _, _ = self._place(self.phi, self._phi_at, luminaire, phi, active)
        j, t, ends, row = self._place(self.theta, self._theta_at, luminaire, theta, active)
        first = dr.gather(mi.UInt32, self._candela_at[0], luminaire, active)
        corner = [
            dr.gather(mi.Float, self._candela, first + (i + a) * row + j + b, active) for a in (0, 1) for b in (0, 1)
        ]
        found = dr.lerp(dr.lerp(corner[0], corner[1], t), dr.lerp(corner[2], corner[3], t), s)
        inside = (theta >= ends[0] - EDGE_RAD) & (theta <= ends[1] + EDGE_RAD)
        return dr.select(active & inside, found, 0.0)

    def _place(self, nodes: Any, at: Any, luminaire: Any, x: Any, active: Any) -> tuple[Any, Any, list[Any], Any]:
        """The interval of a luminaire's ascending nodes with x, the position in it, its end nodes, and their count."""
        first, count = (dr.gather(mi.UInt32, one, luminaire, active) for one in at)

        def node(k: Any) -> Any:
            return dr.gather(mi.Float, nodes, first + dr.minimum(k, count - 1), active)

        found = dr.binary_search(0, self._longest, lambda k: (k + 2 < count) & (node(k + 1) <= x))
        i = dr.minimum(mi.UInt32(found), count - 2)
        low, high = node(i), node(i + 1)
        return i, dr.clip((x - low) / (high - low), 0.0, 1.0), [node(mi.UInt32(0)), node(count - 1)], count


def _packed(arrays: Sequence[Floats]) -> tuple[Any, tuple[Any, Any]]:
    """Concatenated arrays; the start and length of each."""
    lengths = np.array([len(one) for one in arrays], np.uint32)
    first = np.concatenate([[0], np.cumsum(lengths)[:-1]]).astype(np.uint32)
    return mi.Float(np.concatenate(arrays).astype(np.float32)), (mi.UInt32(first), mi.UInt32(lengths))
