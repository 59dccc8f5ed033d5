"""Inspect a measured table: its content and its faults, as numbers and sentences.

Each fault comes as a number, with a list of one sentence if it matters, else empty.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from lambent.core.geometry.directions import HALF_TURN, Floats, angles, direction, normalize
from lambent.core.geometry.sequences import r2, radical_inverse
from lambent.materials.bsdf import more_than_arrives
from lambent.materials.measured.protocol import (
    GRAZING_DEG,
    MeasuredSamples,
    MeasuredTable,
    negative_readings,
    percentage,
)
from lambent.materials.measured.tables.gonio import GonioTable, Symmetry, groups, symmetry_of
from lambent.materials.measured.tables.scattered import ScatteredTable

RETRO_RATIO = 1.5  # f towards the light over that of the background, above which it is a peak
_INNER_DEG = np.array([0.0, 0.2, 0.5, 1.5, 3.0])  # rings about the light; peaks of prisms are narrower than 1 degree
_OUTER_DEG = np.array([7.0, 12.0, 18.0, 24.0])  # rings farther out; the last two are the background
_LEVEL = 1.05  # a ring exceeding the next inner one by less than this noise counts as level
_NEAR_DEG, _BACKGROUND_DEG, _LEAST_NEAR = (0.15, 0.4, 1.0, 3.0, 10.0), (18.0, 30.0), 3


def retro(table: MeasuredTable, samples: MeasuredSamples) -> tuple[float, list[str]]:
    """f towards the light over f 18 to 24 degrees beside it; 1 unless f falls from ring to ring about the light.

    A table with a grid of incident directions is tested at these, so that interpolation neither creates nor hides a
    peak. Each ring counts with its median over azimuth, which ignores lobes elsewhere and single wrong readings. The
    peak must appear at most incident directions, and in measured tuples near the light: the lamp often hides them, and
    `eval` then extrapolates.
    """
    found = []
    for theta_deg, phi_deg in _asked(table) if towards_light(samples) > (1 + RETRO_RATIO) / 2 else []:
        wi = direction(np.radians(theta_deg), np.radians(phi_deg))
        inner, rings = float(_rings(table, wi, _INNER_DEG).max()), _rings(table, wi, _OUTER_DEG)
        falling = (rings[1:-1] <= _LEVEL * rings[:-2]).all() and inner > max(rings[0], _LEVEL * rings[:-1].max())
        background = max(float(rings[-2:].mean()), 1e-9)
        found.append((inner / background if falling else 1.0, theta_deg))
    if not found or np.median([ratio for ratio, _ in found]) < RETRO_RATIO:
        return 1.0, []
    ratio, theta_i = max(found)
    return ratio, [
        f"is retro-reflective: at theta_i = {theta_i:.3g} degrees f towards the light is {ratio:.3g} times what it is "
        f"20 degrees beside it; {_between(table)}"
    ]


def towards_light(samples: MeasuredSamples) -> float:
    """The largest ratio, over theta_i, of median f of reflected tuples near the light to that beside it.

    1 if there are too few tuples. Only theta_i with a clearly separate mirror direction count.
    """
    theta_i = np.degrees(angles(samples.wi)[0])
    apart_deg = np.degrees(2 * np.arcsin((np.linalg.norm(samples.wi - samples.wo, axis=1) / 2).clip(0, 1)))
    counted, f = (theta_i > 20) & (theta_i < 70) & ~samples.transmitted, samples.f.mean(axis=1)
    background = counted & (apart_deg >= _BACKGROUND_DEG[0]) & (apart_deg < _BACKGROUND_DEG[1])
    near = [part for part in (counted & (apart_deg < reach) for reach in _NEAR_DEG) if part.sum() >= _LEAST_NEAR]
    if not near or background.sum() < _LEAST_NEAR:
        return 1.0
    return max(float(np.median(f[part])) for part in near) / max(float(np.median(f[background])), 1e-9)


def _between(table: MeasuredTable) -> str:
    """A description of the peak between incident directions."""
    if not isinstance(table, GonioTable):
        return "`lambent check` says how well the path tracer's look-up holds that peak"
    if table.choice.way == "back_vector":
        return "between incident directions that peak follows the light"
    if table.choice.errors:
        return (
            f"between incident directions {table.choice.way} predicts the table best, though that peak does not follow"
        )
    return (
        f"looked up by {table.choice.way}, that peak does not follow the light: --reconstruction back_vector aligns it"
    )


def _asked(table: MeasuredTable) -> list[tuple[float, float]]:
    """Incident directions in degrees with clearly separate light and mirror directions."""
    if not isinstance(table, GonioTable):
        return [(theta, 0.0) for theta in (30.0, 45.0, 60.0)]
    theta_i = [float(theta) for theta in table.theta_i_deg if 25 <= theta <= 65]
    return [(theta, float(phi)) for theta in theta_i for phi in table.phi_i_deg[:: max(1, len(table.phi_i_deg) // 4)]]


def _rings(table: MeasuredTable, wi: Floats, radii_deg: Floats) -> Floats:
    """(R,) median of f, mean over channels, on rings about wi."""
    x = normalize(np.cross(wi, np.array([0.0, 1.0, 0.0])))
    y = np.cross(wi, x)
    phi = np.arange(24) * (2 * np.pi / 24)
    offset = np.cos(phi)[:, None] * x + np.sin(phi)[:, None] * y
    r = np.radians(radii_deg)[:, None, None]
    wo = np.cos(r) * wi + np.sin(r) * offset
    f = table.eval(np.broadcast_to(wi, wo.shape), wo).mean(axis=-1)
    return np.asarray(np.median(f, axis=1))


_PAIRS = 4096
_REACH_DEG = 60  # of the swapped pairs, so that both directions lie within common incident grids
_CHANNELS = {1: ("",), 3: (" (red)", " (green)", " (blue)")}

NON_RECIPROCAL = 5.0  # percentages of the mean from which a difference is reported
ASYMMETRIC = 5.0
EXTRAPOLATED = 0.5  # percentage of the pairs of directions above which it is reported
BLACKEST, BRIGHTEST = 1e-4, 2.0  # albedos: a third of the darkest coating's, 3.6e-4; beyond any error of calibration
UNDER_SAMPLED = 0.5  # share of the peak that its neighbours must reach
SATURATED = 2.0  # tuples at the maximum, by tuples in the tenth below it, above which the maximum is a device's limit
_LEAST_SATURATED, _STANDS_OUT = 10, 2.0  # tuples at the maximum; its ratio to the median, which an even table lacks
_MOST_INCIDENT = 400  # a table with more incident directions than this has no grid of them
_LEAST_TUPLES = 12
_BY_LIGHT_DEG = 20  # where the lamp is in the way of most devices
_REASONS = {"shadowed": "not measured, or below the horizon", "not_finite": "not finite, or impossible"}


def left_out(samples: MeasuredSamples) -> tuple[dict[str, float], list[str]]:
    """Percentage of the tuples that are left out, by reason (`LeftOut`)."""
    counts, total = samples.left_out, len(samples) + samples.left_out.total
    percent = {name: 100 * getattr(counts, name) / total for name in _REASONS}
    said = [f"{percentage(percent[name])} of the tuples are {what}, and left out" for name, what in _REASONS.items()]
    return percent, [line for line, share in zip(said, percent.values(), strict=True) if share > 0]


def negative(samples: MeasuredSamples) -> list[str]:
    """Readings below zero due to noise; fits keep them, `eval` does not."""
    found = negative_readings(samples)
    return [f"{found}; a fit keeps them, drawing and conversion use 0"] if found else []


def non_reciprocity(table: MeasuredTable) -> tuple[float, list[str]]:
    """Mean |f(wi, wo) - f(wo, wi)| in percent of the mean f, for uniform pairs and pairs near the mirror direction."""
    u = np.concatenate([r2(_PAIRS), r2(_PAIRS, (0.25, 0.75))], axis=1)
    wi, wo = (_within_reach(u[:, k : k + 2]) for k in (0, 2))
    near = direction(*_mirrored(wi, u[:, 2:]))
    pairs = (np.concatenate([wi, wi]), np.concatenate([wo, near]))
    difference = _difference(table.eval(*pairs), table.eval(*pairs[::-1]))
    said = f"swapping light and viewer changes f by {percentage(difference)} on average"
    return difference, [
        f"{said}: a reciprocal model cannot fit closer than that"
    ] if difference > NON_RECIPROCAL else []


def asymmetry(table: MeasuredTable, symmetry: Symmetry) -> tuple[float, list[str]]:
    """Deviation of a table from the symmetry it claims: mean |f - f of the mirrored pair| in percent of the mean f.

    An isotropic material is symmetric about any plane of incidence, a quadrant one about x = 0 and y = 0; a table over
    half a turn can be tested only with light along the normal.
    """
    wo = _within_reach(r2(_PAIRS))
    theta_i = np.radians(np.linspace(0, _REACH_DEG, _PAIRS))
    across_y = (direction(theta_i, 0.0), np.array([1.0, -1.0, 1.0]))
    across_x = (direction(theta_i, np.pi / 2), np.array([-1.0, 1.0, 1.0]))
    turned = (direction(np.zeros(_PAIRS), 0.0), HALF_TURN)
    pairs = {"isotropic": [across_y], "quadrant": [across_y, across_x], "half": [turned], "none": []}[symmetry]
    off = max((_difference(table.eval(wi, wo), table.eval(wi, wo * flip)) for wi, flip in pairs), default=0.0)
    said = f"is taken as {symmetry}, but mirrored directions differ by {percentage(off)} of the mean"
    return off, [said] if off > ASYMMETRIC else []


def extrapolation(table: MeasuredTable) -> tuple[float, list[str]]:
    """Percentage of the direction pairs, uniform in solid angle up to GRAZING_DEG, at which a table extrapolates."""
    if not isinstance(table, ScatteredTable):
        return 0.0, []
    u = np.stack([radical_inverse(np.arange(_PAIRS), base) for base in (2, 3, 5)])
    cos_i, cos_o = 1 - u[:2] * (1 - np.cos(np.radians(GRAZING_DEG)))
    wi, wo = direction(np.arccos(cos_i), 0.0), direction(np.arccos(cos_o), 2 * np.pi * u[2])
    beyond = table.extrapolates(wi, wo)
    by_light = np.sum(wi * wo, axis=1) > np.cos(np.radians(_BY_LIGHT_DEG))
    low = np.minimum(cos_i, cos_o) < table.lowest_cosine
    places = {
        f"beyond theta {np.degrees(np.arccos(table.lowest_cosine)):.3g} degrees": low,
        f"within {_BY_LIGHT_DEG} degrees of the light": by_light & ~low,
        "elsewhere": ~by_light & ~low,
    }
    parts = [f"{percentage(100 * (beyond & there).mean())} {name}" for name, there in places.items()]
    share = 100 * float(beyond.mean())
    said = f"nothing was measured near {percentage(share)} of the direction pairs ({', '.join(parts)})"
    return share, [
        f"{said}: f is extrapolated there, within the range of the 16 nearest"
    ] if share > EXTRAPOLATED else []


def under_sampled(samples: MeasuredSamples) -> tuple[int, list[str]]:
    """Number of incident directions whose brightest tuple is isolated: its four neighbours reach less than half."""
    from scipy.spatial import cKDTree

    key = np.round(samples.wi, 5)
    if len(np.unique(key[:, 2])) > _MOST_INCIDENT:
        return 0, []
    incident, which = np.unique(key, axis=0, return_inverse=True)
    if len(incident) > _MOST_INCIDENT:
        return 0, []
    peaks = []
    for _, rows in groups(which, np.arange(len(which))):
        points, first = np.unique(np.round(samples.wo[rows], 6), axis=0, return_index=True)
        if len(points) < _LEAST_TUPLES:
            continue
        f = samples.f[rows][first].mean(axis=1)
        top = int(np.argmax(f))
        distance, near = cKDTree(points).query(points[top], k=5)
        beside = float(f[near[1:]].mean())
        if beside < UNDER_SAMPLED * f[top]:
            peaks.append((beside / f[top], rows[0], float(f[top]), beside, float(np.degrees(distance[1:].mean()))))
    if not peaks:
        return 0, []
    _, row, highest, beside, step_deg = min(peaks, key=lambda peak: peak[0])
    theta, phi = np.degrees(angles(samples.wi[row]))
    many = f"{len(peaks)} incident direction{'s' * (len(peaks) > 1)}"
    return len(peaks), [
        f"the peak is under-sampled at {many}: at theta_i = {theta:.3g}, phi_i = {phi:.3g} "
        f"degrees f falls from {highest:.3g} to {beside:.3g} /sr within one step of {step_deg:.2g} degrees"
    ]


def saturated(samples: MeasuredSamples) -> tuple[float, list[str]]:
    """Percentage of the tuples that are at the highest value of a channel, where this is the limit of the device.

    A peak falls off smoothly, so more tuples lie in the tenth below its maximum than exactly at it. Tables of a few
    discrete values have none there.
    """
    _, first = np.unique(np.round(np.hstack([samples.wi, samples.wo]), 6), axis=0, return_index=True)
    samples = samples.take(np.sort(first))  # a grid repeats theta_o = 0 at every phi_o
    share, said = 0.0, []
    for channel, name in zip(range(samples.f.shape[1]), _CHANNELS[samples.f.shape[1]], strict=True):
        f = samples.f[:, channel]
        highest = float(f.max(initial=0.0))
        at = f >= highest * (1 - 1e-6)
        below = np.count_nonzero((f > 0.9 * highest) & ~at)
        if at.sum() < _LEAST_SATURATED or not 0 < SATURATED * below < at.sum() or highest < _STANDS_OUT * np.median(f):
            continue
        share = max(share, 100 * float(at.mean()))
        said.append(
            f"{at.sum()} tuples have the highest value{name}, {highest:.3g} /sr, and only {below} are just below"
        )
    return share, [f"seems saturated: {'; '.join(said)}"] if said else []


def one_incident_angle(samples: MeasuredSamples) -> list[str]:
    """A line if all tuples have the same angle of incidence."""
    cosines = samples.wi[:, 2]
    if not len(cosines) or float(np.ptp(cosines)) > 1e-4:
        return []
    theta_deg = float(np.degrees(np.arccos(np.clip(cosines.mean(), -1, 1))))
    return [f"was measured at one angle of incidence, {theta_deg:.3g} degrees: f at all others is a guess"]


def too_bright(theta_i_deg: Floats, albedo: Floats) -> list[str]:
    """A line if more light returns than arrives, by `more_than_arrives`."""
    over = more_than_arrives(albedo)
    if not over.any():
        return []
    row, channel = np.unravel_index(int(np.argmax(albedo)), albedo.shape)
    name = _CHANNELS[albedo.shape[1]][int(channel)]
    at = ", ".join(f"{angle:g}" for angle in theta_i_deg[over.any(axis=1)])
    return [
        f"returns {albedo[row, channel]:.3g} of the light{name} at theta_i = {theta_i_deg[row]:g} degrees, "
        f"more than arrives; over 1 at {at} degrees"
    ]


def in_another_unit(albedo: Floats, peaks_missed: float) -> list[str]:
    """A line if no material scatters so much or so little; a peak that the grid misses can return any share."""
    most = float(albedo.max())
    if most >= BLACKEST and (most <= BRIGHTEST or peaks_missed):
        return []
    return [f"scatters at most {most:.3g} of the light, as no material does: are the values in 1/sr, not in percent or "
            "relative to something?"]  # fmt: skip


def _difference(one: Floats, other: Floats) -> float:
    mean = (one.mean() + other.mean()) / 2
    return 100 * float(np.abs(one - other).mean() / mean) if mean > 0 else 0.0


def _within_reach(u: Floats) -> Floats:
    return direction(np.arccos(1 - u[:, 0] * (1 - np.cos(np.radians(_REACH_DEG)))), 2 * np.pi * u[:, 1])


def _mirrored(wi: Floats, u: Floats) -> tuple[Floats, Floats]:
    """(theta, phi) up to 10 degrees around the mirror direction of wi."""
    theta = np.arccos(wi[:, 2]) + np.radians(20) * (u[:, 0] - 0.5)
    phi = np.arctan2(wi[:, 1], wi[:, 0]) + np.pi + np.radians(20) * (u[:, 1] - 0.5)
    return theta.clip(0, np.radians(_REACH_DEG)), phi


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
    percent, unusable = left_out(samples)
    judged = {
        "non_reciprocal_percent": non_reciprocity(table),
        "asymmetry_percent": asymmetry(table, symmetry_of(table)),
        "retro_ratio": retro(table, samples),
        "under_sampled": under_sampled(samples),
        "saturated_percent": saturated(samples),
        "extrapolated_percent": extrapolation(table),
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
            "not_measured_percent": percent["shadowed"],
            "not_finite_percent": percent["not_finite"],
            "negative_percent": 100 * samples.below_zero / len(samples),
            "albedo_max": float((r + t).max()),
            "energy_above_one": bool(more_than_arrives(r + t).any()),
            **{name: value for name, (value, _) in judged.items()},
        },
        "findings": [
            *unusable,
            *negative(samples),
            *too_bright(np.array(_THETA_I_DEG), r + t),
            *in_another_unit(r + t, judged["under_sampled"][0]),
            *(line for _, lines in judged.values() for line in lines),
            *one_incident_angle(samples),
        ],
    }


def _reconstruction(table: MeasuredTable) -> dict[str, Any]:
    if not isinstance(table, GonioTable):
        return {}
    percent = {f"{way}_percent": 100 * error for way, error in table.choice.errors.items()}
    return {"way": table.choice.way, **percent}
