"""Inspect a measured table: its content and its faults, as numbers and sentences."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import more_than_arrives
from lambent.materials.measured.inspecting import faults
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.gonio import GonioTable, symmetry_of

_THETA_I_DEG = (0, 15, 30, 45, 60, 75)


def inspect_table(table: MeasuredTable) -> dict[str, Any]:
    """Format, dimensions, symmetry, albedo over theta_i, and faults of a table, as plain values for JSON.

    Returns
    -------
    dict
        `file`, `format`, `stored`, `channels`, `symmetry`, `transmits`, `sizes`, `notes` as in `TableInfo`;
        `reconstruction`: of a gonio table, the way in use between incident directions, and E of each way in percent
        of E against black, see gonio.py;
        `albedo`: `theta_i_deg` and, per angle and channel, `reflectivity` and `transmissivity`;
        `tuples`: used, how many of these are below zero in a channel, and left out by reason;
        `faults`: `not_measured_percent`, `not_finite_percent` of the tuples, `negative_percent` of those used,
        `albedo_max`, `energy_above_one` (`more_than_arrives`), `non_reciprocal_percent`, `asymmetry_percent`,
        `retro_ratio` (1 where there is no peak towards the light), `under_sampled` (incident directions),
        `saturated_percent` of the tuples, `extrapolated_percent` (of the direction pairs, scattered tables alone);
        `findings`: a sentence for each fault that matters.
    """
    info, samples = table.info, table.samples()
    wi = direction(np.radians(_THETA_I_DEG), 0.0)
    r, t = table.reflectivity(wi), table.transmissivity(wi)
    left_out, unusable = faults.left_out(samples)
    judged = {
        "non_reciprocal_percent": faults.non_reciprocity(table),
        "asymmetry_percent": faults.asymmetry(table, symmetry_of(table)),
        "retro_ratio": faults.retro(table, samples),
        "under_sampled": faults.under_sampled(samples),
        "saturated_percent": faults.saturated(samples),
        "extrapolated_percent": faults.extrapolation(table),
    }
    return {
        "file": info.file,
        "format": info.format,
        "stored": info.stored,
        "channels": info.channels,
        "symmetry": "isotropic" if info.isotropic else "anisotropic",
        "transmits": info.transmits,
        "sizes": dict(info.sizes),
        "notes": list(info.notes),
        "reconstruction": _reconstruction(table),
        "albedo": {
            "theta_i_deg": list(_THETA_I_DEG),
            "reflectivity": r.round(5).tolist(),
            "transmissivity": t.round(5).tolist(),
        },
        "tuples": samples.counts,
        "faults": {
            "not_measured_percent": left_out["shadowed"],
            "not_finite_percent": left_out["not_finite"],
            "negative_percent": 100 * samples.below_zero / len(samples),
            "albedo_max": float((r + t).max()),
            "energy_above_one": bool(more_than_arrives(r + t).any()),
            **{name: value for name, (value, _) in judged.items()},
        },
        "findings": [
            *unusable,
            *faults.negative(samples),
            *faults.too_bright(np.array(_THETA_I_DEG), r + t),
            *(line for _, lines in judged.values() for line in lines),
            *faults.one_incident_angle(samples),
        ],
    }


def _reconstruction(table: MeasuredTable) -> dict[str, Any]:
    if not isinstance(table, GonioTable):
        return {}
    percent = {f"{way}_percent": 100 * error for way, error in table.choice.errors.items()}
    return {"way": table.choice.way, **percent}
