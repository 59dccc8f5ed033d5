"""Lamps at points: their direct light by shadow rays, which a light map adds to the light that it samples."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.bake.tracing import rays
from lambent.core.arrays import Floats


class LampRays:
    """Irradiance of lamps on surfaces of a mi.Scene `whole`, by one shadow ray to each lamp.

    Parameters
    ----------
    emitters : list of mi.Emitter
        The lamps.
    factors : (n, 3), optional
        Factors on their light, by lamp and channel; 1 by default.
    """

    def __init__(self, whole: Any, emitters: Sequence[Any], factors: Floats | None = None) -> None:
        self._scene, self._holes, self.count = whole, rays.has_holes(whole), len(emitters)
        numbers = [int(dr.reinterpret_array(mi.UInt32, mi.EmitterPtr(emitter))[0]) for emitter in emitters]
        self._numbers = mi.UInt32(np.array(numbers, np.uint32))
        factors = np.ones((self.count, 3)) if factors is None else factors
        self._factors = mi.Color3f(*(mi.Float(channel.astype(np.float32)) for channel in np.asarray(factors).T))

    def of(self, lamp: Any, si: Any, active: Any) -> Any:
        """Irradiance (mi.Color3f) of lamp number `lamp` (mi.UInt32), with the cosine of the shading normal.

        It is negative where light comes from behind.
        """
        emitter = dr.reinterpret_array(mi.EmitterPtr, dr.gather(mi.UInt32, self._numbers, lamp, active))
        ds, light = emitter.sample_direction(si, mi.Point2f(0.5), active)
        cosine = dr.dot(ds.d, si.sh_frame.n)
        lit = active & (cosine != 0) & (dr.max(light) > 0)
        lit &= ~rays.hidden(self._scene, si.p, si.n, ds.p, lit, self._holes)
        return dr.select(lit, light * cosine, 0.0) * dr.gather(mi.Color3f, self._factors, lamp, active)

    def __call__(self, si: Any, active: Any) -> tuple[Any, Any]:
        """Irradiance (mi.Color3f) of all lamps on the side of the shading normal, and on the other."""
        both: tuple[Any, Any] = _sums(self, self.count, si, mi.Bool(active))
        return both


@dr.syntax
def _sums(lamps, count, si, active):  # type: ignore[no-untyped-def]
    width = dr.width(si.p)
    front, back = dr.zeros(mi.Color3f, width), dr.zeros(mi.Color3f, width)
    lamp = dr.zeros(mi.UInt32, width)
    while lamp < dr.opaque(mi.UInt32, count):
        light = lamps.of(lamp, si, active)
        front += dr.maximum(light, 0.0)
        back += dr.maximum(-light, 0.0)
        lamp += 1
    return front, back
