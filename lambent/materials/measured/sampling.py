"""Scatter from a measured table without a model: reflect, transmit or absorb (thesis M, 3.1), then draw a direction.

Two samplers of the direction:

- `Rejection`, the thesis's 3.2: uniform low-discrepancy candidates, accepted with p / (largest p of the row). It
  samples the table itself, whatever its shape, and needs 2 pi p_max / r candidates per sample: 3 for white paper, 20
  for satin, 40 000 for chrome.
- `Tabulated`: the CDF of `half_vector_grid`, one candidate per sample; a weight corrects its small deviation, so that
  estimates follow the table. For patch matrices it is the CDF of `patch_sheet`, which is exact.

`TableBSDF` makes a table a BSDF (eval, pdf, sample), for materials.check and path tracers.

A photon's incident direction is `wi`, its new one `wo`; p(wo|wi) = f |cos theta_o|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.directions import HALF_TURN, Floats, angles, direction, half_vector, raised, reflect
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components
from lambent.materials.chi_square import ChiSquare, chi_square, combined
from lambent.materials.lobes import COS_MIN
from lambent.materials.measured.half_vector_grid import GridShape, HalfVectorGrid
from lambent.materials.measured.patch_sheet import Lookup, lookup_of, patch_sheet_of
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.twin_grid import TwinGrid
from lambent.materials.measured.two_sided import TwoSided

ABSORBED, REFLECTED, TRANSMITTED = 0, 1, 2
CANDIDATES_LIMIT = 200_000  # per sample, before rejection gives up
_STEP = 1.2207440846057596 ** -np.arange(1.0, 4.0)  # of Roberts' additive sequence (2018): the root of x^4 = x + 1


@dataclass(frozen=True)
class Scattered:
    """Photons after scattering.

    Attributes
    ----------
    wo : (N, 3)
        New directions; (0, 0, 0) where absorbed.
    fate : (N,) int8
        ABSORBED, REFLECTED or TRANSMITTED.
    weight : (N, C)
        Weight per channel; 0 where absorbed. For exact samplers the mean over channels is 1 for all others.
    proposals : int
        Number of candidates tried.
    exceeded : int
        Accepted candidates with p above the row's bound; if not 0, such directions are drawn too rarely.
    """

    wo: Floats
    fate: NDArray[np.int8]
    weight: Floats
    proposals: int
    exceeded: int = 0


class TableBSDF:
    """A measured table as a BSDF: `eval` comes from the table, `pdf` and `sample` from its patches or its grid.

    It is the two-sided sheet that the path tracer renders.
    """

    def __init__(self, table: MeasuredTable, shape: GridShape | None = None, progress: Progress = silent) -> None:
        self.sheet = TwoSided(table)
        self.lookup = lookup_of(table, shape, progress)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr, without the cosine; grey is repeated."""
        wi, wo = np.broadcast_arrays(np.asarray(wi, float), np.asarray(wo, float))
        seen = (np.abs(wi[..., 2:]) > COS_MIN) & (np.abs(wo[..., 2:]) > COS_MIN)
        f = np.broadcast_to(self.sheet.eval(wi, wo), (*wi.shape[:-1], 3))
        return np.asarray(np.where(seen, f, 0.0))

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density (...) in 1/sr of `sample` given wo."""
        return _Part(self.lookup).pdf(wi, wo)

    def sample(self, wo: Floats, u: Floats) -> Floats:
        """wi (..., 3) from wo (..., 3) and u (..., 3) uniform in [0, 1)."""
        return _Part(self.lookup).sample(wo, u)

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
        if isinstance(self.lookup, HalfVectorGrid):
            return _chi_square_in_half_vectors(self, self.lookup, wo, samples, seed)
        if isinstance(self.lookup, TwinGrid):
            share = float(self.lookup.share_returned(components(wo)))
            parts = ((self.lookup.mirror, 1 - share), (self.lookup.light, share))
            return combined(
                [_chi_square_in_half_vectors(_Part(grid), grid, wo, round(samples * p), seed) for grid, p in parts]
            )
        return chi_square(
            lambda u: self.sample(np.broadcast_to(wo, u.shape), u),
            lambda wi: self.pdf(wi, np.broadcast_to(wo, wi.shape)),
            samples=samples,
            seed=seed,
            cells=self.lookup.cell_borders(wo),
        )


@dataclass(frozen=True)
class _Part:
    """The sampler and the density of one look-up, on arrays."""

    lookup: Lookup

    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        return np.asarray(self.lookup.pdf(components(wi), components(wo)))

    def sample(self, wo: Floats, u: Floats) -> Floats:
        return np.stack(self.lookup.sample(components(wo), *components(u)), axis=-1)


def _chi_square_in_half_vectors(
    bsdf: TableBSDF | _Part, grid: HalfVectorGrid, wo: Floats, samples: int, seed: int
) -> ChiSquare:
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


class _Photons:
    """Base of both samplers: the fate of photons by r and t, tabulated over the incident directions."""

    def __init__(self, table: MeasuredTable, shape: GridShape | None = None, progress: Progress = silent) -> None:
        self.sheet = TwoSided(table)
        self.lookup = lookup_of(table, shape, progress, reverse=True)

    def albedo(self, wi: Floats) -> tuple[Floats, Floats]:
        """r and t (N,), means over the channels, of wi (N, 3); a grid interpolates between its nodes."""
        r, t = (self.lookup.albedo_of(components(wi), np.full(len(wi), across)) for across in (False, True))
        return r, t

    def _fates(self, wi: Floats, u: Floats) -> tuple[NDArray[np.int8], Floats, Floats]:
        """Fates (3.1) for u (N,) uniform in [0, 1), and the probability of each side; r + t > 1 absorbs nothing."""
        r, t = self.albedo(wi)
        whole = np.maximum(r + t, 1.0)
        r, t = r / whole, t / whole
        return np.where(u < r, REFLECTED, np.where(u < r + t, TRANSMITTED, ABSORBED)).astype(np.int8), r, t


class Rejection(_Photons):
    """Rejection sampling of the table (thesis M, 3.2).

    The candidates of all photons of a call form one low-discrepancy sequence, dealt out in random order: evenly spread
    as a whole, independent for each photon. Consecutive points for one photon would cause bias, because the next point
    depends on the rejected one.
    """

    def scatter(self, wi: Floats, seed: int = 0, progress: Progress = silent) -> Scattered:
        """Fates and directions of photons from wi (N, 3).

        Raises
        ------
        UserError
            A lobe is so narrow that CANDIDATES_LIMIT candidates per photon do not find it.
        """
        rng = np.random.default_rng(seed)
        fate, _, _ = self._fates(wi, rng.random(len(wi)))
        bound = self.lookup.peak_of(components(wi), fate == TRANSMITTED)
        offset = rng.random(3)
        found, weight = np.zeros((len(wi), 3)), np.zeros((len(wi), self.sheet.info.channels))
        waiting = np.flatnonzero((fate != ABSORBED) & (bound > 0))
        count, exceeded, proposals, rounds = len(waiting), 0, 0, 0
        while len(waiting):
            progress(count - len(waiting), count, "rejection sampling")
            if rounds > CANDIDATES_LIMIT:
                hint = "use the tabulated sampler, or fit lobes"
                raise UserError("lobe too narrow for rejection sampling", file=self.sheet.info.file, hint=hint)
            many = max(1, min(64, 4096 // len(waiting)))  # the last photons try several candidates at once
            asked = rng.permutation(np.repeat(waiting, many))
            number = np.arange(proposals + 1, proposals + len(asked) + 1)[:, None]
            u = (offset + number * _STEP) % 1.0
            wo = direction(np.arccos(1 - u[:, 0]), 2 * np.pi * u[:, 1])
            wo[:, 2] *= np.where((wi[asked, 2] > 0) == (fate[asked] == REFLECTED), 1.0, -1.0)
            f = self.sheet.eval(wi[asked], wo)
            p = f.mean(axis=1) * np.abs(wo[:, 2])
            accepted = np.flatnonzero(u[:, 2] * bound[asked] < p)
            photons, first = np.unique(asked[accepted], return_index=True)  # the first accepted one
            chosen = accepted[first]
            found[photons] = wo[chosen]
            weight[photons] = f[chosen] / f[chosen].mean(axis=1, keepdims=True)
            exceeded += int((p[chosen] > bound[photons]).sum())
            proposals += len(asked)
            rounds += many
            waiting = np.setdiff1d(waiting, photons, assume_unique=True)
        progress(count, count, "rejection sampling")
        excess = np.maximum(np.sum(self.albedo(wi), axis=0), 1.0)[:, None]
        return Scattered(found, fate, weight * excess, proposals, exceeded)


class Tabulated(_Photons):
    """Directions by the CDF of the table's patches or grid; the weight corrects a grid's deviation from the table."""

    def scatter(self, wi: Floats, seed: int = 0) -> Scattered:
        """Fates and directions of photons from wi (N, 3)."""
        rng = np.random.default_rng(seed)
        fate, r, t = self._fates(wi, rng.random(len(wi)))
        u_select, u1, u2 = rng.random((3, len(wi)))
        across = self.lookup.share_across(components(wi))
        # the drawn fate replaces the sampler's own choice of side
        u_select = np.where(fate == TRANSMITTED, u_select * across, across + u_select * (1 - across))
        wo = np.stack(self.lookup.sample(components(wi), u_select, u1, u2), axis=-1)
        pdf = self.lookup.pdf(components(wo), components(wi))
        alive = (fate != ABSORBED) & (pdf > 0)
        drawn, wanted = np.where(fate == TRANSMITTED, (across, t), (1 - across, r))
        gain = np.divide(np.abs(wo[:, 2]) * drawn, pdf * wanted, out=np.zeros(len(wi)), where=alive)
        wo[~alive] = 0
        fate = np.where(alive, fate, ABSORBED).astype(np.int8)
        return Scattered(wo, fate, self.sheet.eval(wi, wo) * gain[:, None], len(wi))
