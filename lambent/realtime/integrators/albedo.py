"""Tables of lobe albedos over cos_o: the factors of `rings`, and the table of split-sum.

`rings` loses samples below the horizon, and the remaining ones represent wide lobes and grazing views badly: under
uniform light, n = 7 misses the albedo by .5, 2.4 and 4.4 % at m = .1, .25 and .4. The error depends almost on cos_o
alone, so a table of factors, smooth in cos_o, removes it. Measured gain: .4 dB.

Split-sum, the method of common engines (Karis 2013), is kept for comparison: a cube prefiltered by roughness
(passes/prefilter.py), and a table of albedos. It is isotropic, and its lobe has the same shape for every view.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.materials.document import Lobe
from lambent.materials.lobes import mean_reflectance, passed, widths
from lambent.realtime.integrators.patterns import gains, lobe_points, rings_table

FACTORS = 32  # at cos_o = (i + 1/2)/FACTORS, four to a row: FACTOR_ROWS in rings.wgsl
EXACT_SAMPLES = 512
AZIMUTHS = 6
LEAST, MOST = 0.5, 2.0
TABLE_ROWS = 32  # of split-sum
LEVELS = 7  # roughness m of level l is (l/(LEVELS - 1))^2: finer steps where they show


def normalised_rings_table(lobe: Lobe, n: int) -> Floats:
    """`rings_table`, then FACTORS/4 rows of factors: (n + FACTORS/4, 4) float32."""
    rows = rings_table(lobe, n)
    return np.concatenate([rows, factors(lobe, rows).reshape(-1, 4)])


def factors(lobe: Lobe, rows: Floats) -> NDArray[np.float32]:
    """Factors (FACTORS,): the lobe's albedo over its samples' (`rows`, (n, 4)), both averaged over azimuth."""
    slopes = lobe_points(EXACT_SAMPLES, lobe) * [lobe.mx, lobe.my]
    exact = _albedo(lobe, slopes, np.ones(EXACT_SAMPLES))
    found = _albedo(lobe, rows[:, :2].astype(float), rows[:, 3].astype(float))
    ratio = np.divide(exact, found, out=np.ones(FACTORS), where=found > 1e-6)
    return np.clip(ratio, LEAST, MOST).astype(np.float32)


def _albedo(lobe: Lobe, slopes: Floats, weight: Floats) -> Floats:
    """(FACTORS,) mean of weight f cos_i/pdf over half vectors of `slopes` (n, 2) and over azimuths of the viewer."""
    cos_o = (np.arange(FACTORS) + 0.5) / FACTORS
    round_lobe = lobe.mx == lobe.my and len(slopes) == EXACT_SAMPLES
    azimuths = np.zeros(1) if round_lobe else (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS * np.pi
    total = np.zeros(FACTORS)
    for phi in azimuths:
        cos_d, gain = gains(lobe, slopes, cos_o, phi)
        reflected = mean_reflectance(np.clip(cos_d, 0, 1), lobe)
        total += ((reflected if lobe.side == "reflection" else 1 - reflected) * gain * weight).mean(axis=1)
    return np.asarray(total / len(azimuths))


def roughness_level(lobe: Lobe) -> float:
    """Level of the prefiltered cube for the lobe's mean roughness sqrt(mx my)."""
    return float(min(1.0, math.prod(widths(lobe)) ** 0.25) * (LEVELS - 1))


def albedo_table(lobe: Lobe, samples: int = 1024) -> Floats:
    """Table (TABLE_ROWS, 4) of float32 rows at cos_o = (row + 1/2)/TABLE_ROWS: RGB of the albedo over k, and 0.

    An isotropic lobe of roughness sqrt(mx my) replaces the lobe.
    """
    slopes = np.sqrt(lobe.mx * lobe.my) * lobe_points(samples, lobe)
    cos_d, g = gains(lobe, slopes, (np.arange(TABLE_ROWS) + 0.5) / TABLE_ROWS)
    albedos = [(passed(np.clip(cos_d, 0, 1), lobe, c) * g).mean(axis=1) for c in range(3)]
    return np.column_stack([*albedos, np.zeros(TABLE_ROWS)]).astype(np.float32)
