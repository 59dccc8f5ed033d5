"""Chi-square test of a direction sampler against its density, and the adaptive sphere quadrature behind it.

The sphere is cut into cells of (z, phi), so that the horizon is always a cell border. The cut follows quantiles of
pilot samples: a lobe of slope .005 gets cells of its own size. Expected counts are integrals of the density over the
cells, refined until they converge; rejected samples (density 0) form a cell of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices

Function = Callable[[Floats], Floats]  # (..., 3) directions -> (...) values

CHUNK = 1 << 18
LEAST_EXPECTED = 5.0  # cells with fewer expected samples are pooled: their statistic is not chi-square
HIDDEN_PEAK = 4.0  # a pilot this many times above its cell's mean reveals a peak missed by the nodes
FEW_PILOTS = 32  # cells with fewer pilots also use the samples, so that the edge of a narrow lobe is not missed
STRIPS = 32  # of z, and cells of each
RTOL, LEVELS = 2e-4, 40  # of the quadrature: relative tolerance, and halvings at most
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(4)


@dataclass(frozen=True)
class ChiSquare:
    """Result of a test. `cells` (N, 4) are z and phi ranges; `observed`, `expected` (N + 1) end with the rejected."""

    statistic: float
    degrees: int
    p_value: float
    pdf_integral: float
    samples: int
    cells: Floats
    observed: Floats
    expected: Floats

    @property
    def rejected_share(self) -> float:
        return float(self.observed[-1]) / self.samples


def chi_square(
    sample: Function, density: Function, *, samples: int = 1_000_000, seed: int = 0, cells: Floats | None = None
) -> ChiSquare:
    """Test that `sample`, from u (n, 3) uniform in [0, 1), draws directions (n, 3) of `density` (n) in 1/sr.

    A million samples detect a pdf that is 2 % wrong; a hundred thousand do not. A discontinuous density needs `cells`
    along its steps: (N, 4) as from `adapted_cells`, sorted by z0, then phi0.
    """
    from scipy.stats import chi2

    rng = np.random.default_rng(seed)
    pilot = sample(rng.random((samples // 16, 3)))
    cells = adapted_cells(pilot) if cells is None else cells
    observed = np.zeros(len(cells) + 1)
    few_pilots = np.bincount(_cell_of(pilot, cells), minlength=len(cells) + 1) < FEW_PILOTS
    steering, left = [pilot], samples
    while left:
        w = sample(rng.random((min(left, CHUNK), 3)))
        left -= len(w)
        index = np.where((density(w) > 0) & (w[:, 2] != 0), _cell_of(w, cells), len(cells))
        observed += np.bincount(index, minlength=len(observed))
        steering.append(w[few_pilots[index] & (index < len(cells))])
    shares = integrate_cells(density, cells, np.concatenate(steering))
    integral = float(shares.sum())
    expected = samples * np.append(shares, max(1 - integral, 0.0))

    rare = expected < LEAST_EXPECTED
    o, e = np.append(observed[~rare], observed[rare].sum()), np.append(expected[~rare], expected[rare].sum())
    if e[-1] < LEAST_EXPECTED:  # still too few expected: only samples where none are expected count
        e[-1] = max(e[-1], 1.0)
    statistic = float(((o - e) ** 2 / e).sum())
    degrees = len(o) - 1
    p_value = float(chi2.sf(statistic, degrees))
    return ChiSquare(statistic, degrees, p_value, integral, samples, cells, observed, expected)


def combined(tests: Sequence[ChiSquare]) -> ChiSquare:
    """Combine tests of the parts of a mixture, weighted by their share of the samples; empty parts are ignored."""
    from scipy.stats import chi2

    tests = [test for test in tests if test.samples]
    samples, cells = sum(test.samples for test in tests), np.concatenate([test.cells for test in tests])
    statistic, degrees = sum(test.statistic for test in tests), sum(test.degrees for test in tests)
    integral = sum(test.pdf_integral * test.samples for test in tests) / samples
    counts = [[getattr(test, name) for test in tests] for name in ("observed", "expected")]
    observed, expected = (
        np.concatenate([*(part[:-1] for part in parts), [sum(part[-1] for part in parts)]]) for parts in counts
    )
    p_value = float(chi2.sf(statistic, degrees))
    return ChiSquare(statistic, degrees, p_value, integral, samples, cells, observed, expected)


def adapted_cells(pilot: Floats) -> Floats:
    """Cells (N, 4) [z0, z1, phi0, phi1] that cover the sphere and hold about equal shares of `pilot` (n, 3).

    z = -1, 0, 1 and phi = 0, 2 pi are always borders.
    """
    z, phi = _z_phi(pilot[pilot[:, 2] != 0])
    shares = np.linspace(0, 1, STRIPS + 1)
    z_edges = np.unique([-1.0, 0.0, 1.0, *np.quantile(z, shares)]) if z.size else np.array([-1.0, 0.0, 1.0])
    rows = []
    for low, high in pairwise(z_edges):
        inside = phi[(z >= low) & (z < high)]
        quantiles = np.quantile(inside, shares[1:-1]) if inside.size >= 4 * STRIPS else np.linspace(0, 2 * np.pi, 9)
        edges = np.unique([0.0, 2 * np.pi, *quantiles])
        rows += [(low, high, a, b) for a, b in pairwise(edges)]
    return np.array(rows)


def integrate_cells(function: Function, cells: Floats, pilot: Floats) -> Floats:
    """Integral (N) over solid angle of `function` on each cell (N, 4).

    Gauss-Legendre 4 x 4. A cell is halved across its longer side, up to LEVELS times, while its halves disagree with it
    or it hides a peak: a value at a `pilot` direction (n, 3) far above the mean of the nodes. Pilots steer the
    subdivision but add nothing to the sum. A discontinuity away from the horizon costs about 1e-3.
    """
    probe = _rule(function, cells)
    total, floor = np.zeros_like(probe), 0.02 * RTOL * np.abs(probe).sum() / len(cells)
    owner, rects, coarse = np.arange(len(cells)), cells, probe
    where, points, heights = _cell_of(pilot, cells), np.stack(_z_phi(pilot), axis=-1), np.abs(function(pilot))
    for level in range(LEVELS):
        halves, along_phi = _halved(rects)
        fine = _rule(function, halves)
        together = fine.reshape(len(rects), 2).sum(axis=1)
        peak = np.zeros(len(rects))
        np.maximum.at(peak, where, heights)
        area = (rects[:, 1] - rects[:, 0]) * (rects[:, 3] - rects[:, 2])
        hides = (peak * area > HIDDEN_PEAK * np.abs(together)) & (peak * area > 1e-7)
        rough = hides | (np.abs(together - coarse) > RTOL * np.abs(together) + floor)
        if level == LEVELS - 1:
            rough[:] = False
        np.add.at(total, owner[~rough], together[~rough])
        if not rough.any():
            break
        keep = rough[where]
        where, points, heights = where[keep], points[keep], heights[keep]
        axis = along_phi[where].astype(int)
        upper = points[np.arange(len(points)), axis] >= halves[2 * where + 1, 2 * axis]
        where = (np.cumsum(rough) - 1)[where] * 2 + upper
        again = np.repeat(rough, 2)
        owner, rects, coarse = np.repeat(owner, 2)[again], halves[again], fine[again]
    return total


def _z_phi(w: Floats) -> tuple[Floats, Floats]:
    return w[:, 2], np.arctan2(w[:, 1], w[:, 0]) % (2 * np.pi)


def _cell_of(w: Floats, cells: Floats) -> Indices:
    """Index of the cell of each direction; cells are sorted by strip, then phi."""
    z, phi = _z_phi(w)
    z_low, first = np.unique(cells[:, 0], return_index=True)
    strip = np.clip(np.searchsorted(z_low, z, side="right") - 1, 0, len(z_low) - 1)
    strip_of_cell = np.searchsorted(first, np.arange(len(cells)), side="right") - 1
    turn = 8.0  # above 2 pi, so that one sorted key combines strip and phi
    found = np.searchsorted(strip_of_cell * turn + cells[:, 2], strip * turn + phi, side="right") - 1
    return np.clip(found, 0, len(cells) - 1)


def _rule(function: Function, rects: Floats) -> Floats:
    """Gauss-Legendre 4 x 4 on each rectangle of (z, phi), whose area element is the solid angle."""
    parts = []
    for start in range(0, len(rects), CHUNK // 16):
        z0, z1, p0, p1 = rects[start : start + CHUNK // 16].T
        z = ((z0 + z1) / 2)[:, None] + ((z1 - z0) / 2)[:, None] * _NODES
        phi = ((p0 + p1) / 2)[:, None] + ((p1 - p0) / 2)[:, None] * _NODES
        z, phi = (a.reshape(-1) for a in np.broadcast_arrays(z[:, :, None], phi[:, None, :]))
        r = np.sqrt(np.maximum((1 - z) * (1 + z), 0.0))
        values = function(np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1))
        area = (z1 - z0) * (p1 - p0) / 4
        parts.append(np.einsum("n,i,j,nij->n", area, _WEIGHTS, _WEIGHTS, values.reshape(len(z0), 4, 4)))
    return np.concatenate(parts)


def _halved(rects: Floats) -> tuple[Floats, Flags]:
    """Halve rectangles across their longer side on the sphere: (2N, 4), lower first; flags of cuts along phi."""
    z0, z1, p0, p1 = rects.T
    z, p = (z0 + z1) / 2, (p0 + p1) / 2
    sin_theta = np.sqrt((1 - z) * (1 + z))
    along_phi = (p1 - p0) * sin_theta > (z1 - z0) / sin_theta
    lower = np.stack([z0, np.where(along_phi, z1, z), p0, np.where(along_phi, p, p1)], axis=-1)
    upper = np.stack([np.where(along_phi, z0, z), z1, np.where(along_phi, p, p0), p1], axis=-1)
    return np.stack([lower, upper], axis=1).reshape(-1, 4), along_phi
