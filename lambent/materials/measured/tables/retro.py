"""Detect retro-reflection: a peak about the light, away from the mirror direction."""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import Floats, angles, direction, normalize
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable
from lambent.materials.measured.tables.gonio import GonioTable

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
