"""A measured table as a BSDF with eval, pdf and sample, for `materials.checking.check` and path tracers.

It is the two-sided sheet that the path tracer renders. `eval` is the table's own; directions are drawn from the CDF of
its dense grid (half_vector_grid.py), or exactly from that of its patches (patch_sheet.py).
"""

from __future__ import annotations

import numpy as np

from lambent.core.geometry.directions import HALF_TURN, Floats, angles, direction, half_vector, raised, reflect
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components
from lambent.materials.checking.chi_square import ChiSquare, chi_square, combined
from lambent.materials.lobes import COS_MIN
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.half_vector_grid import GridShape, HalfVectorGrid
from lambent.materials.measured.tables.half_vector_resampling import RetroGrid, TwoSided
from lambent.materials.measured.tables.patch_sheet import Lookup, lookup_of, patch_sheet_of


class _Part:
    """The sampler and the density of one look-up, on arrays."""

    def __init__(self, lookup: Lookup) -> None:
        self.lookup = lookup

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density (...) in 1/sr of `sample` given wo."""
        return np.asarray(self.lookup.pdf(components(wi), components(wo)))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        """wi (..., 3) from wo (..., 3) and u (..., 3) uniform in [0, 1)."""
        return np.stack(self.lookup.sample(components(wo), *components(u)), axis=-1)


class TableBSDF(_Part):
    """BSDF of a table; `shape` is that of its grid, if it has no patches."""

    def __init__(self, table: MeasuredTable, shape: GridShape | None = None, progress: Progress = silent) -> None:
        super().__init__(lookup_of(table, shape, progress))
        self.sheet = TwoSided(table)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr, without the cosine; grey is repeated."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        seen = (np.abs(wi[..., 2:]) > COS_MIN) & (np.abs(wo[..., 2:]) > COS_MIN)
        f = np.broadcast_to(self.sheet.eval(wi, wo), (*wi.shape[:-1], 3))
        return np.asarray(np.where(seen, f, 0.0))

    def looked_up(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr as looked up by the path tracer; on a grid it deviates slightly from `eval`."""
        return np.stack(self.lookup.evaluate(components(wi), components(wo)), axis=-1)

    def steps(self, w: Floats, reverse: bool = False) -> Floats | None:
        """(N, 4) cells of z and phi within which f is constant; None for tables without patches.

        The cells are of the light's directions, given the viewer's w (3,); with `reverse`, of the viewer's, given the
        light's.
        """
        sheet = patch_sheet_of(self.sheet.table, reverse=reverse)
        return None if sheet is None else sheet.cell_borders(w)

    def chi_square(self, wo: Floats, *, samples: int = 1_000_000, seed: int = 0) -> ChiSquare:
        """Test `sample` against `pdf` for one wo (3,), in cells along the steps of the density."""
        lookup = self.lookup
        if isinstance(lookup, HalfVectorGrid):
            return _chi_square_in_half_vectors(self, lookup, wo, samples, seed)
        if isinstance(lookup, RetroGrid):
            share = float(lookup.returned_share(components(wo)))
            parts = ((lookup.mirror, 1 - share), (lookup.light, share))
            return combined(
                [_chi_square_in_half_vectors(_Part(grid), grid, wo, round(samples * p), seed) for grid, p in parts]
            )
        return chi_square(
            lambda u: self.sample(np.broadcast_to(wo, u.shape), u),
            lambda wi: self.pdf(wi, np.broadcast_to(wo, wi.shape)),
            samples=samples,
            seed=seed,
            cells=lookup.cell_borders(wo),
        )


def _chi_square_in_half_vectors(bsdf: _Part, grid: HalfVectorGrid, wo: Floats, samples: int, seed: int) -> ChiSquare:
    """Test a grid's sampler against its density for one wo (3,), in the cells of half or back vectors.

    A transmitted direction counts as its mirror image, below the surface.
    """
    theta, phi = (float(a) for a in angles(wo))
    wo = direction(theta, phi if grid.anisotropic else 0.0)
    up, side, turn = raised(wo), np.sign(wo[2]), HALF_TURN if grid.about_light else 1.0

    def half_vectors(u: Floats) -> Floats:
        wi = bsdf.sample(np.broadcast_to(wo, u.shape), u)
        h = half_vector(raised(wi) * turn, up)
        h[:, 2] *= np.sign(wi[:, 2] * side)
        return h

    def density(h: Floats) -> Floats:
        cos_d = raised(h) @ up
        wi = reflect(up, raised(h)) * turn
        possible = (wi[:, 2] > 0) & (cos_d > 0)
        wi[:, 2] *= side * np.sign(h[:, 2])
        return np.where(possible, bsdf.pdf(wi, np.broadcast_to(wo, wi.shape)) * 4 * cos_d, 0.0)

    return chi_square(half_vectors, density, samples=samples, seed=seed, cells=grid.cell_borders())
