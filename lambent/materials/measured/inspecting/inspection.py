"""Inspect a measured table: its content and its faults, as numbers and sentences."""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import more_than_arrives
from lambent.materials.measured.inspecting import faults
from lambent.materials.measured.inspecting.faults import retro
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
        `albedo_max`,
        `energy_above_one` (`more_than_arrives`), `non_reciprocal_percent`, `asymmetry_percent`, `retro_ratio` (1 where
        there is no peak towards the light), `under_sampled` (incident directions), `saturated_percent` of the tuples,
        `extrapolated_percent` (of the pairs of directions, scattered tables alone), see `faults`;
        `findings`: a sentence for each fault that matters.
    """
    info, samples = table.info, table.samples()
    wi = direction(np.radians(_THETA_I_DEG), 0.0)
    r, t = table.reflectivity(wi), table.transmissivity(wi)
    symmetry = symmetry_of(table)
    percent, unusable = faults.left_out(samples)
    negative = faults.negative(samples)
    non_reciprocal, not_mutual = faults.non_reciprocity(table)
    off, asymmetric = faults.asymmetry(table, symmetry)
    retro_ratio, towards_light = retro(table, samples)
    isolated, under_sampled = faults.under_sampled(samples)
    extrapolated, beyond = faults.extrapolation(table)
    saturated, at_limit = faults.saturated(samples)
    too_bright = faults.too_bright(np.array(_THETA_I_DEG), r + t)
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
            "not_measured_percent": percent["shadowed"],
            "not_finite_percent": percent["not_finite"],
            "negative_percent": 100 * samples.below_zero / len(samples),
            "albedo_max": float((r + t).max()),
            "energy_above_one": bool(more_than_arrives(r + t).any()),
            "non_reciprocal_percent": 100 * non_reciprocal,
            "asymmetry_percent": 100 * off,
            "retro_ratio": retro_ratio,
            "under_sampled": isolated,
            "saturated_percent": saturated,
            "extrapolated_percent": 100 * extrapolated,
        },
        "findings": [
            *unusable,
            *negative,
            *too_bright,
            *not_mutual,
            *asymmetric,
            *towards_light,
            *under_sampled,
            *at_limit,
            *faults.one_incident_angle(samples),
            *beyond,
        ],
    }


def _reconstruction(table: MeasuredTable) -> dict[str, Any]:
    if not isinstance(table, GonioTable):
        return {}
    percent = {f"{way}_percent": 100 * error for way, error in table.choice.errors.items()}
    return {"way": table.choice.way, **percent}
