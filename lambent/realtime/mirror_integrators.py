"""The specular integrators on planar reflectors, by the name they have on curved objects.

Each is a shader with `integrate_planar(index, wo, surface, place)` and a table of samples (patterns.py says what a row
is). What has none here is left to the probes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError, did_you_mean
from lambent.materials.document import Lobe
from lambent.realtime import patterns
from lambent.realtime.integrators import Integrator

Floats = NDArray[np.floating]
TILE = 64  # pixels that sample a lobe in turns
TURN = 0.088  # of a pixel's samples against those of the one before it in turn
# Of the filter, against one that covers the lobe: found by experiment. The narrower the better where each sample finds
# its own hit, and where 64 pixels share the lobe.
FIXED_BIAS, INTERLEAVED_BIAS = 0.4, 0.03
MOST_RINGS = 3
THREE_STEPS = {"MARCH_STEPS": 0}
# Hidden hits count a fifth. What the mirror picture does not hold is filtered in the probe as fixed rings are.
SHARED = {"HIDDEN_DROP": 0.8, "BEYOND_WIDER": 1.75}


def multi_ring_table(lobe: Lobe, n: int) -> Floats:
    """The thesis's pattern on planes (4.5.3): a centre and up to three rings of equal count, radii evenly spaced.

    Lobes much longer than wide keep the line. Its figure for n = 10 is 3 rings of 3.
    """
    rings = next((r for r in range(MOST_RINGS, 1, -1) if n > 1 and (n - 1) % r == 0 and (n - 1) // r >= 3), 1)
    count = (n - 1) // rings
    shares = [np.zeros((1, 2))]
    for ring in range(rings if count else 0):
        phi = 2 * np.pi * (np.arange(count) + ring / rings) / count
        share = (ring + 1) / (rings + 1)
        shares.append(share * np.stack([np.cos(phi), np.sin(phi)], axis=-1))
    return patterns.lobe_table_at(lobe, np.concatenate(shares))


def fixed_table(lobe: Lobe, n: int) -> Floats:
    """The rings of curved objects with the filter that is best on planes; a line for long lobes."""
    rows = patterns.rings_table(lobe, n)
    rows[:, 2] += 0.5 * np.log2(FIXED_BIAS / patterns.ring_bias(n))
    return rows


def interleaved_table(lobe: Lobe, n: int, bias: float = INTERLEAVED_BIAS) -> Floats:
    """`fixed_table`, then 64 spirals of n samples, one for each pixel of a tile of 8 x 8: (65 n, 4).

    Spiral o is r_k = sqrt(-ln(1 - (k + a)/n)), phi_k = 2 pi (.618034 k + beta), with a = (o + 1/2)/64 and
    beta = fract(TURN o): all 64 together cover the lobe's mass evenly, and so do every fourth of them.
    """
    ggx = lobe.distribution == "ggx"
    k, blocks = np.arange(n), [fixed_table(lobe, n)]
    for o in range(TILE):
        r = patterns.radius((k + (o + 0.5) / TILE) / n, ggx)
        phi = 2 * np.pi * (0.618034 * k + TURN * o % 1)
        slopes = np.stack([r * np.cos(phi), r * np.sin(phi)], axis=-1)
        blocks.append(patterns.table(slopes, bias / patterns.relative_density(slopes, ggx), lobe))
    return np.concatenate(blocks)


PLANAR: dict[str, dict[str, Integrator]] = {
    "rings": {
        "marched": Integrator("planar_interleaved.wgsl", interleaved_table, {"MARCH_STEPS": 12, **SHARED}),
        "interleaved": Integrator("planar_interleaved.wgsl", interleaved_table, {"CELL_STEPS": 3, **SHARED}),
        "fixed": Integrator("planar_quadrature.wgsl", fixed_table, THREE_STEPS),
    },
    "lobe-4.24": {"thesis": Integrator("planar_thesis.wgsl", multi_ring_table, {"FORMULA": 24})},
    "lobe-4.25": {"thesis": Integrator("planar_thesis.wgsl", multi_ring_table, {"FORMULA": 25})},
    "fis": {"fis": Integrator("planar_quadrature.wgsl", patterns.fis_table, THREE_STEPS)},
    "qmc": {"qmc": Integrator("planar_qmc.wgsl")},
    "qmc-lobe": {"qmc": Integrator("planar_qmc.wgsl")},  # its samples follow the lobe already
}
AUTO, OFF = "auto", "off"
CHOICES = tuple(dict.fromkeys([AUTO, OFF, *(name for ways in PLANAR.values() for name in ways if name != "qmc")]))


def planar_integrator(integrator: str, way: str) -> Integrator | None:
    """How planar reflectors are drawn with an integrator: the `way` said, else its first, else None, by probes."""
    if way not in CHOICES:
        hint = did_you_mean(way, CHOICES)
        raise UserError("unknown way to draw planar reflectors", got=way, expected=", ".join(CHOICES), hint=hint)
    ways = PLANAR.get(integrator, {})
    if way == OFF or not ways:
        return None
    return ways.get(way, next(iter(ways.values())))


def check_planar(integrator: str, way: str) -> None:
    """Raise `UserError` where an integrator does not know a way: a frame would draw with its first."""
    planar_integrator(integrator, way)
    known = (AUTO, OFF, *PLANAR.get(integrator, {}))
    if way not in known:
        expected = ", ".join(known)
        raise UserError(f"{integrator} does not draw reflectors so", field="--planar", got=way, expected=expected)


def is_interleaved(how: Integrator) -> bool:
    """Whether neighbouring pixels sample lobes in turns, so that the picture is cleaned afterwards."""
    return how.table is interleaved_table


def is_searched(how: Integrator) -> bool:
    """Whether hits are searched for in the cells of `passes.near`."""
    return how.constants.get("CELL_STEPS", 0) > 0
