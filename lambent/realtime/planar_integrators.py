"""The specular integrators on planar reflectors, by the name they have on curved objects.

Each is a shader with `integrate_planar(index, wo, surface, place)` and a table of samples (rows as in patterns.py). An
integrator without one shows the probes on planar reflectors, too.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.materials.document import Lobe
from lambent.realtime import patterns
from lambent.realtime.integrators import Integrator

TILE = 64  # pixels that sample a lobe in turns
MOST_SHARED = 7  # samples per lobe that are chosen where the pixels of a tile share it
TURN = 0.088  # of a pixel's samples against those of the one before it in turn
# Factors on the filter, 1 where it covers the lobe, by experiment: the narrower the better where each sample finds its
# own hit, and where 64 pixels share the lobe: at grazing angles round filters blur the slim lobe.
FIXED_BIAS, INTERLEAVED_BIAS = 0.4, 0.003
MOST_RINGS = 3
THREE_STEPS = {"MARCH_STEPS": 0}
# Hidden hits count a fifth. Samples that leave the buffer are filtered in the probe as those of fixed rings are.
SHARED = {"HIDDEN_DROP": 0.8, "BEYOND_WIDER": 1.75}


def multi_ring_table(lobe: Lobe, n: int) -> Floats:
    """The thesis's pattern on planes (4.5.3): a centre and up to three rings of equal count, radii evenly spaced.

    Lobes much longer than wide keep the line. Its figure for n = 10 is 3 rings of 3.
    """
    rings = next((r for r in range(MOST_RINGS, 1, -1) if n > 1 and (n - 1) % r == 0 and (n - 1) // r >= 3), 1)
    count = (n - 1) // rings
    shares: list[Floats] = [np.zeros((1, 2))]
    for ring in range(rings if count else 0):
        phi = 2 * np.pi * (np.arange(count) + ring / rings) / count
        shares.append(patterns.polar((ring + 1) / (rings + 1), phi))
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
        slopes = patterns.polar(r, 2 * np.pi * (0.618034 * k + TURN * o % 1))
        blocks.append(patterns.table(slopes, bias / patterns.relative_density(slopes, ggx), lobe))
    return np.concatenate(blocks)


# Two searches for hits: `marched` is the better one on a real floor, `interleaved` takes .7 of its time and is as good
# where little stands on the floor (docs/performance.md).
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
PLANAR["oslf"] = PLANAR["oslf-points"] = PLANAR["qmc-lobe"]
# Small lamps leave the mirrored view (reflector_lamps.py); what that does not hold comes from the whole probe.
PLANAR["lamps"] = {name: replace(how, clears_views=True) for name, how in PLANAR["rings"].items()}
AUTO, OFF = "auto", "off"
CHOICES = tuple(dict.fromkeys([AUTO, OFF, *(name for methods in PLANAR.values() for name in methods if name != "qmc")]))


@cache
def with_lamps(how: Integrator, count: int) -> Integrator:
    """A planar integrator that evaluates `count` lamps of a reflector by themselves."""
    return replace(how, constants={**how.constants, "LAMPS": count})


def planar_integrator(integrator: str, method: str) -> Integrator | None:
    """How planar reflectors are drawn with an integrator: by `method`, else its first one, else None, by probes."""
    known("method for planar reflectors", method, CHOICES)
    methods = PLANAR.get(integrator, {})
    return None if method == OFF or not methods else methods.get(method, next(iter(methods.values())))


def check_planar(integrator: str, method: str) -> None:
    """Raise `UserError` where an integrator does not have a method: a frame would be drawn by its first."""
    planar_integrator(integrator, method)
    choices = (AUTO, OFF, *PLANAR.get(integrator, {}))
    if method not in choices:
        expected = ", ".join(choices)
        raise UserError(f"not supported by {integrator}", field="--planar", got=method, expected=expected)
