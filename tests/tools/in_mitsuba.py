"""Mitsuba's BSDFs asked at directions of the canonical frame; the fixture `mi` must have chosen the variant."""

from __future__ import annotations

from typing import Any

import numpy as np


def interaction(wo: np.ndarray) -> Any:
    """Surface interactions with the viewer at `wo` (N, 3), the normal along z."""
    import drjit as dr
    import mitsuba as mi

    si = dr.zeros(mi.SurfaceInteraction3f, len(wo))
    si.sh_frame = mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.wi = vectors(wo)
    return si


def vectors(w: np.ndarray) -> Any:
    """mi.Vector3f of directions (N, 3)."""
    import mitsuba as mi

    return mi.Vector3f(np.ascontiguousarray(w.T, np.float32))


def f_cos(bsdf: Any, wi: np.ndarray, wo: np.ndarray) -> np.ndarray:
    """f times the light's cosine, (N, 3), of a BSDF or of the dictionary of one."""
    import mitsuba as mi

    plugin = mi.load_dict(bsdf) if isinstance(bsdf, dict) else bsdf
    return np.array(plugin.eval(mi.BSDFContext(), interaction(wo), vectors(wi)), dtype=float).T
