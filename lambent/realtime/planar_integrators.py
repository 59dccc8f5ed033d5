"""Specular integrators on planar reflectors, by their names on curved objects.

Each is a shader with `integrate_planar(index, wo, surface, place)` and a table of samples (rows as in patterns.py).
Integrators without one use the probes on planar reflectors, too.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.materials.document import Lobe
from lambent.realtime import patterns
from lambent.realtime.integrators import Integrator

TILE = 64  # pixels with interleaved samples of a lobe
MOST_SHARED = 7  # most samples per lobe if the pixels of a tile share it
TURN = 0.088  # rotation of a pixel's samples relative to the previous pixel's, in turns
# Factors on the filter, found by experiment; 1 covers the lobe. Narrow filters are better if each sample finds its own
# hit, or if 64 pixels share the lobe: at grazing angles, round filters blur the slim lobe.
FIXED_BIAS, INTERLEAVED_BIAS = 0.4, 0.003
MOST_RINGS = 3
# Hidden hits have a weight of 1/5. Samples outside the buffer are filtered in the probe like fixed rings.
SHARED = {"HIDDEN_DROP": 0.8, "BEYOND_WIDER": 1.75}


def multi_ring_table(lobe: Lobe, n: int) -> Floats:
    """The thesis's pattern on planes (4.5.3): a centre and up to three rings of equal count, evenly spaced radii.

    Lobes much longer than wide keep the line. As in the thesis's figure, n = 10 has 3 rings of 3.
    """
    rings = next((r for r in range(MOST_RINGS, 1, -1) if n > 1 and (n - 1) % r == 0 and (n - 1) // r >= 3), 1)
    count = (n - 1) // rings
    shares: list[Floats] = [np.zeros((1, 2))]
    for ring in range(rings if count else 0):
        phi = 2 * np.pi * (np.arange(count) + ring / rings) / count
        shares.append(patterns.polar((ring + 1) / (rings + 1), phi))
    return patterns.lobe_table_at(lobe, np.concatenate(shares))


def fixed_table(lobe: Lobe, n: int) -> Floats:
    """The rings of curved objects with the best filter for planes; a line for long lobes."""
    rows = patterns.rings_table(lobe, n)
    rows[:, 2] += 0.5 * np.log2(FIXED_BIAS / patterns.ring_bias(n))
    return rows


def interleaved_table(lobe: Lobe, n: int, bias: float = INTERLEAVED_BIAS) -> Floats:
    """`fixed_table`, then 64 spirals of n samples, one for each pixel of a tile of 8 x 8: (65 n, 4).

    Spiral o is r_k = sqrt(-ln(1 - (k + a)/n)), phi_k = 2 pi (.618034 k + beta), with a = (o + 1/2)/64 and
    beta = fract(TURN o). All 64 together cover the lobe's mass evenly, as does every fourth of them.
    """
    ggx = lobe.distribution == "ggx"
    k, blocks = np.arange(n), [fixed_table(lobe, n)]
    for o in range(TILE):
        r = patterns.radius((k + (o + 0.5) / TILE) / n, ggx)
        slopes = patterns.polar(r, 2 * np.pi * (0.618034 * k + TURN * o % 1))
        blocks.append(patterns.table(slopes, bias / patterns.relative_density(slopes, ggx), lobe))
    return np.concatenate(blocks)


PLANAR: dict[str, dict[str, Integrator]] = {
    "rings": {
        "marched": Integrator("planar_interleaved.wgsl", interleaved_table, {"MARCH_STEPS": 12, **SHARED}),
        "fixed": Integrator("planar_quadrature.wgsl", fixed_table),
    },
    "lobe-4.24": {"thesis": Integrator("planar_thesis.wgsl", multi_ring_table, {"FORMULA": 24})},
    "lobe-4.25": {"thesis": Integrator("planar_thesis.wgsl", multi_ring_table, {"FORMULA": 25})},
    "fis": {"fis": Integrator("planar_quadrature.wgsl", patterns.fis_table)},
}
PLANAR["lamps"] = PLANAR["rings"]
AUTO, OFF = "auto", "off"
CHOICES = tuple(dict.fromkeys([AUTO, OFF, *(name for methods in PLANAR.values() for name in methods)]))


def planar_integrator(integrator: str, method: str) -> Integrator | None:
    """Planar counterpart of an integrator: `method`, else its first method, else None (probes)."""
    known("method for planar reflectors", method, CHOICES)
    methods = PLANAR.get(integrator, {})
    return None if method == OFF or not methods else methods.get(method, next(iter(methods.values())))


def check_planar(integrator: str, method: str) -> None:
    """Raise `UserError` for a method that an integrator lacks; a frame would silently use the first method."""
    planar_integrator(integrator, method)
    choices = (AUTO, OFF, *PLANAR.get(integrator, {}))
    if method not in choices:
        expected = ", ".join(choices)
        raise UserError(f"not supported by {integrator}", field="--planar", got=method, expected=expected)
