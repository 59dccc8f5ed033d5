"""How planar reflectors are drawn, by the integrator of curved objects.

A planar integrator is a shader with `integrate_planar(index, wo, surface, place)` and a table of samples (rows as in
patterns.py). Integrators without one use the probes on planar reflectors, too.
"""

from __future__ import annotations

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.materials.document import Lobe
from lambent.materials.lobes import slope_radius
from lambent.realtime.integrators import patterns
from lambent.realtime.integrators.integrators import Integrator

TILE = 64  # pixels with interleaved samples of a lobe
MOST_SHARED = 7  # most samples per lobe, as the pixels of a tile share it
TURN = 0.088  # rotation of a pixel's samples relative to the previous pixel's, in turns
# Factors on the filter, found by experiment; 1 covers the lobe. Narrow filters are better if each sample finds its own
# hit, or if 64 pixels share the lobe: at grazing angles, round filters blur the slim lobe.
FIXED_BIAS, INTERLEAVED_BIAS = 0.4, 0.003


def interleaved_table(lobe: Lobe, n: int) -> Floats:
    """`rings_table` with narrower filters, then a spiral of n samples for each pixel of an 8 x 8 tile: (65 n, 4).

    Spiral o is r_k = sqrt(-ln(1 - (k + a)/n)), phi_k = 2 pi (.618034 k + beta), with a = (o + 1/2)/64 and
    beta = fract(TURN o). All 64 together cover the lobe's mass evenly, as does every fourth of them.
    """
    rows = patterns.rings_table(lobe, n)
    rows[:, 2] += 0.5 * np.log2(FIXED_BIAS / patterns.ring_bias(n))
    k, blocks = np.arange(n), [rows]
    for o in range(TILE):
        r = slope_radius((k + (o + 0.5) / TILE) / n, lobe)
        slopes = patterns.polar(r, 2 * np.pi * (0.618034 * k + TURN * o % 1))
        blocks.append(patterns.table(slopes, INTERLEAVED_BIAS / patterns.density(slopes, lobe), lobe))
    return np.concatenate(blocks)


MARCHED = Integrator("planar_interleaved.wgsl", interleaved_table)
PLANAR: dict[str, Integrator] = {"lamps": MARCHED, "rings": MARCHED}
AUTO, OFF = "auto", "off"
CHOICES = (AUTO, OFF)


def planar_integrator(integrator: str, method: str) -> Integrator | None:
    """Planar counterpart of an integrator; None if it has none, or with OFF: probes are shown."""
    known("method for planar reflectors", method, CHOICES)
    return None if method == OFF else PLANAR.get(integrator)
