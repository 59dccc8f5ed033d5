"""How diffuse reflection depends on its directions, for surfaces known by the number of their material."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.materials.bsdf import coupling, under_fresnel
from lambent.materials.document import COSINE_NODES, Material
from lambent.materials.slope_curve import WEIGHTS, normalised


class DiffuseShares:
    """`bsdf.diffuse_share` and `bsdf.diffuse_seen` of numbered materials."""

    def __init__(self, materials: Sequence[Material]) -> None:
        self._coupled = mi.Bool(np.array([m.kd_coupled for m in materials], bool))
        curves = [normalised(m.kd_curve or (1.0,) * COSINE_NODES) for m in materials]
        self._weights = mi.Float(np.array(WEIGHTS, np.float32))
        self._nodes = mi.Float(np.array(curves, np.float32).ravel()) if any(m.kd_curve for m in materials) else None

    def seen(self, number: Any, cosine: Any, active: Any) -> Any:
        """Albedo of the diffuse reflection over kd, towards a viewer at `cosine` from the normal."""
        found = dr.select(dr.gather(mi.Bool, self._coupled, number, active), under_fresnel(cosine, dr), 1.0)
        return found if self._nodes is None else found * self._at(number, cosine, active)

    def between(self, number: Any, cos_i: Any, cos_o: Any, active: Any) -> Any:
        """Factor of kd/pi between two directions of one side."""
        coupled = dr.gather(mi.Bool, self._coupled, number, active)
        found = dr.select(coupled, coupling(dr.clip(cos_i, 0, 1), cos_o, dr), 1.0)
        if self._nodes is None:
            return found
        return found * self._at(number, cos_i, active) * self._at(number, cos_o, active)

    def _at(self, number: Any, cosine: Any, active: Any) -> Any:
        """`slope_curve.at_cosine` of the material's curve."""
        cosine = dr.clip(cosine, 0, 1)
        first = mi.UInt32(dr.minimum(dr.floor(cosine * (COSINE_NODES - 1)), COSINE_NODES - 2))
        low, high = (dr.gather(mi.Float, self._weights, first + k, active) for k in (0, 1))
        below, above = (dr.gather(mi.Float, self._nodes, number * COSINE_NODES + first + k, active) for k in (0, 1))
        m = 1 - cosine
        m2 = m * m
        return dr.lerp(below, above, (low - m2 * m2 * m) / (low - high))
