"""What a measured table holds and what is wrong with it, as numbers."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from lambent.core.frames import Floats, direction
from lambent.core.sequences import r2
from lambent.materials.measured.protocol import MeasuredTable

_THETA_I_DEG = (0, 15, 30, 45, 60, 75)
_PAIRS = 4096
_REACH_DEG = 60  # of the pairs that are swapped: both are then inside the usual incident grids


def inspect_table(table: MeasuredTable) -> dict[str, Any]:
    """Format, dimensions, symmetry, albedo over theta_i, and faults of a table; plain values, fit for JSON.

    Returns
    -------
    dict
        `file`, `format`, `stored`, `channels`, `symmetry`, `transmits`, `sizes`, `notes` as in `TableInfo`;
        `albedo`: `theta_i_deg` and, per angle and channel, `reflectivity` and `transmissivity`;
        `tuples`: used, and left out by reason;
        `faults`: `not_measured_percent`, `not_finite_percent`, `negative_percent` of the tuples, `albedo_max`,
        `energy_above_one` (whether it exceeds 1), `non_reciprocal_percent` (mean of |f(wi, wo) - f(wo, wi)| over the
        mean of f, of the reflection, directions up to 60 degrees).
    """
    info, samples = table.info, table.samples()
    wi = direction(np.radians(_THETA_I_DEG), 0.0)
    r, t = table.reflectivity(wi), table.transmissivity(wi)
    left_out, count = samples.left_out, len(samples) + samples.left_out.total
    albedo_max = float((r + t).max())
    return {
        "file": info.file,
        "format": info.format,
        "stored": info.stored,
        "channels": info.channels,
        "symmetry": "isotropic" if info.isotropic else "anisotropic",
        "transmits": info.transmits,
        "sizes": dict(info.sizes),
        "notes": list(info.notes),
        "albedo": {
            "theta_i_deg": list(_THETA_I_DEG),
            "reflectivity": r.round(5).tolist(),
            "transmissivity": t.round(5).tolist(),
        },
        "tuples": {"used": len(samples), **asdict(left_out)},
        "faults": {
            "not_measured_percent": 100 * left_out.shadowed / count,
            "not_finite_percent": 100 * left_out.not_finite / count,
            "negative_percent": 100 * left_out.negative / count,
            "albedo_max": albedo_max,
            "energy_above_one": albedo_max > 1,
            "non_reciprocal_percent": 100 * _non_reciprocity(table),
        },
    }


def _non_reciprocity(table: MeasuredTable) -> float:
    """Mean of |f(wi, wo) - f(wo, wi)| over the mean of f: evenly spread pairs, and pairs near the mirror direction."""
    u = np.concatenate([r2(_PAIRS), r2(_PAIRS, (0.25, 0.75))], axis=1)
    wi, wo = (_within_reach(u[:, k : k + 2]) for k in (0, 2))
    near = direction(*_mirrored(wi, u[:, 2:]))
    pairs = (np.concatenate([wi, wi]), np.concatenate([wo, near]))
    forth, back = table.eval(*pairs), table.eval(*pairs[::-1])
    mean = (forth.mean() + back.mean()) / 2
    return float(np.abs(forth - back).mean() / mean) if mean > 0 else 0.0


def _within_reach(u: Floats) -> Floats:
    return direction(np.arccos(1 - u[:, 0] * (1 - np.cos(np.radians(_REACH_DEG)))), 2 * np.pi * u[:, 1])


def _mirrored(wi: Floats, u: Floats) -> tuple[Floats, Floats]:
    """(theta, phi) up to 10 degrees around the mirror direction of wi."""
    theta = np.arccos(wi[:, 2]) + np.radians(20) * (u[:, 0] - 0.5)
    phi = np.arctan2(wi[:, 1], wi[:, 0]) + np.pi + np.radians(20) * (u[:, 1] - 0.5)
    return theta.clip(0, np.radians(_REACH_DEG)), phi
