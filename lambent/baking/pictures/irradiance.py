"""Illuminance at points of a scene, on surfaces or anywhere else: gathered onto its light map, lamps and sun by rays.

Samples of a point form SERIES independently scrambled Sobol series, which double until the spread of their means says
that the point is known (randomised quasi-Monte Carlo: Owen 1997, SIAM J. Numer. Anal. 34).
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.pictures.gathering import Gathering
from lambent.baking.tracing.path_tracer import Points
from lambent.baking.tracing.rays import block_sums, vectors
from lambent.baking.tracing.sobol import SobolSampler
from lambent.core.arrays import Floats, Indices
from lambent.core.light.photometry import ILLUMINANCE, photometric
from lambent.core.progress import Progress

SERIES = 16
FIRST, MOST = 32, 1 << 14  # samples of a series, at first and at most
DARK = 0.01  # of the mean illuminance: darker points may have the error of a point with that
RAYS_AT_ONCE = 1 << 20
JITTER_M = 1e-4  # by which samples are spread about a point: rays to the sun take their random numbers from it


def illuminance(
    gathering: Gathering, points: Floats, normals: Floats, limit: float, progress: Progress
) -> tuple[Floats, Floats]:
    """Illuminance (n,) at points (n, 3), m, facing unit normals (n, 3), and its standard error (n,), lx.

    The error is at most `limit` times the illuminance, unless SERIES x MOST samples do not suffice.
    """
    sums, lx, error_lx = np.zeros((len(points), SERIES)), np.zeros(len(points)), np.zeros(len(points))
    left, done, count, taken, expected = np.arange(len(points)), 0, FIRST, 0.0, 1.0
    while len(left) and done + count <= MOST:
        for mine in np.array_split(left, -(-len(left) * SERIES * count // RAYS_AT_ONCE)):
            progress(taken, max(expected, taken), "illuminance")
            sums[mine] += _sums(gathering, points[mine], normals[mine], mine, done, count)
            taken += len(mine) * count
        done = count = done + count
        means = sums[left] / done
        lx[left], error_lx[left] = means.mean(axis=1), means.std(axis=1, ddof=1) / np.sqrt(SERIES)
        over = error_lx[left] / np.maximum(limit * np.maximum(lx[left], DARK * lx.mean()), 1e-12)
        left, over = left[over > 1], over[over > 1]
        expected = taken + float((np.minimum(done * over**2, MOST) - done).sum())
    return lx, error_lx


def _sums(gathering: Gathering, points: Floats, normals: Floats, numbers: Indices, first: int, count: int) -> Floats:
    """Sums (n, SERIES) of lx over samples first..first + count - 1 of all series of the points with `numbers` (n,)."""
    dr.detail.new_scope(dr.backend_v(mi.Float))  # otherwise kernels depend on constants in use elsewhere
    thread, each = dr.arange(mi.UInt32, len(points) * SERIES * count), dr.opaque(mi.UInt32, count)
    series = thread // each
    seed = dr.gather(mi.UInt32, mi.UInt32(numbers.astype(np.uint32)), series // SERIES) * SERIES + series % SERIES
    index, seed = thread - series * each + dr.opaque(mi.UInt32, first), mi.sample_tea_32(seed, 0)[0]
    sampler = SobolSampler(index, seed, dr.zeros(mi.UInt32, len(thread)))
    p, n = (dr.gather(mi.Vector3f, vectors(mi.Vector3f, array), series // SERIES) for array in (points, normals))
    jitter = JITTER_M * (mi.Vector3f(sampler.next_1d(), sampler.next_1d(), sampler.next_1d()) - 0.5)
    value = gathering.irradiance(Points(mi.Point3f(p + jitter - n * dr.dot(jitter, n)), n, n), sampler)
    light = block_sums(dr.select(dr.all(dr.isfinite(value)), value, 0.0), count)
    return photometric(light, ILLUMINANCE).reshape(-1, SERIES)
