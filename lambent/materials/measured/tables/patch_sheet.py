"""A measured table as a renderer looks it up and samples it: a sheet of patch matrices, a grid, or two.

In a sheet of patch matrices f is constant over pairs of patches, so nothing is resampled: a direction's patch follows
from the ring bounds of its basis, and f is one entry of the matrix. A sample draws the light's patch from the row's CDF
(mean of the channels times projected solid angle), then a direction in it, uniform in projected solid angle.
f cos(theta_i) / pdf, mean over the channels, is therefore the same for all samples of a row: the albedo.

Roles: the viewer (wo) is given, the light (wi) is sampled. Radiance's matrices need not be reciprocal, so a row has all
incident patches of one outgoing patch; `reverse` swaps the roles, for photons.

Conventions are those of half_vector_grid.py: components, f in 1/sr without the cosine, `ops` is the array library.
Both sin^2 and cos^2 of a patch are stored, so that neither cancels in float32.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from lambent.core.geometry.directions import HALF_TURN, Floats, angles, direction, half_vector, raised, reflect
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components
from lambent.materials.checking.chi_square import ChiSquare, chi_square, combined
from lambent.materials.lobes import COS_MIN, NUMPY, ArrayOps, Vector
from lambent.materials.measured.lbnl_xml import LbnlTable, Use
from lambent.materials.measured.parts.klems import BEYOND, WHOLE_DEG, AngleBasis, PatchMatrix
from lambent.materials.measured.parts.lbnl_parts import Side, Way
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.gonio import GonioTable
from lambent.materials.measured.tables.half_vector_grid import (
    GridShape,
    HalfVectorGrid,
    chosen_side,
    first_above,
    turns,
)
from lambent.materials.measured.tables.half_vector_resampling import (
    RetroGrid,
    Reversed,
    TwoSided,
    grid_of,
    retro_grid_of,
)


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
    """BSDF of a table as the two-sided sheet that the path tracer renders, for `checking.check`.

    `eval` is the table's own; `shape` is that of its grid, if it has no patches.
    """

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


_WAYS: tuple[Way, ...] = ("reflection", "transmission")
_BOUNDS = 6
_SLIVER = 1e-5  # rad; accuracy of phi bounds in float32
_BELOW_ONE = 1 - 2.0**-24


@dataclass(frozen=True)
class PatchSheet:
    """Flat arrays of numpy or of the path tracer. A page is a face of the viewer and a kind of scattering.

    Attributes
    ----------
    faces : int
        1: a two-sided sheet; 2: the back scatters differently from the front.
    kinds : int
        1: reflection only; 2: transmission as well.
    patches : int
        Of the largest basis; the others are padded.
    rings : int
        Of the largest basis, plus one for directions beyond the last ring.
    edges : (faces, kinds, 2, rings) flat float32
        sin^2 of the upper theta of the rings of the viewer's basis, then of the light's.
    counts, starts : like edges
        Patches of a ring, 0 beyond the last, and number of its first.
    signs : (faces, kinds, 2) flat float32
        -1 where headings are opposite to the direction: to the viewer, to the light.
    values : (faces, kinds, patches of the viewer, patches of the light, 3) flat float32
        f in 1/sr, linear RGB; grey is repeated.
    cdf : (faces, kinds, patches of the viewer, patches of the light) flat float32
        Cumulative probability of the light's patches.
    density : like cdf
        Density of the light's direction over its cosine, in 1/sr.
    bounds : (faces, kinds, patches of the light, 6) flat float32
        sin^2 theta, cos^2 theta, each lower and upper, first phi and width, of directions to the light.
    albedo : (faces, kinds, patches of the viewer) flat float32
        Integral of f cos(theta_i) over the side, mean over the channels.
    """

    anisotropic: ClassVar[bool] = True  # patches turn with the sheet
    ARRAYS: ClassVar[tuple[str, ...]] = (
        "edges", "counts", "starts", "signs", "values", "cdf", "density", "bounds", "albedo",
    )  # fmt: skip

    faces: int
    kinds: int
    patches: int
    rings: int
    edges: Any
    counts: Any
    starts: Any
    signs: Any
    values: Any
    cdf: Any
    density: Any
    bounds: Any
    albedo: Any

    @property
    def sizes(self) -> tuple[int, ...]:
        return self.faces, self.kinds, self.patches, self.rings

    @classmethod
    def of_sizes(cls, sizes: tuple[int, ...], arrays: dict[str, Any]) -> PatchSheet:
        """The inverse of `sizes` and `ARRAYS`."""
        return cls(*sizes, **arrays)

    def evaluate(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Vector:
        """f in 1/sr per RGB channel, without the cosine."""
        pair, seen = self._pair(wi, wo, ops)
        red, green, blue = (ops.select(seen, ops.gather(self.values, 3 * pair + c), 0.0) for c in range(3))
        return red, green, blue

    def pdf(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Density of `sample` in 1/sr."""
        pair, seen = self._pair(wi, wo, ops)
        across = self.transmitted_share(wo, ops)
        share = ops.select(wi[2] * wo[2] < 0, across, 1 - across)
        return ops.select(seen, ops.gather(self.density, pair) * ops.abs(wi[2]) * share, 0.0)

    def sample(self, wo: Vector, u_select: Any, u1: Any, u2: Any, ops: ArrayOps = NUMPY) -> Vector:
        """wi; u_* uniform in [0, 1). wi.z = 0 at the horizon, and if nothing is scattered."""
        across, u_select = chosen_side(u_select, self.transmitted_share(wo, ops), ops)
        page = self._page(wo, across, ops)
        row, inside = self._viewer_row(wo, page, ops)
        light = first_above(ops.minimum(u_select, _BELOW_ONE), self.cdf, row * self.patches, self.patches, ops)
        at = _BOUNDS * (page * self.patches + light)
        s0, s1, c0, c1, phi0, width = (ops.gather(self.bounds, at + k) for k in range(_BOUNDS))
        phi = phi0 + u2 * width
        sin_theta, z = ops.sqrt(s0 + u1 * (s1 - s0)), ops.sqrt(c0 + u1 * (c1 - c0))
        z = ops.select(inside & (z > COS_MIN) & (ops.gather(self.albedo, row) > 0), z, 0.0)
        return sin_theta * ops.cos(phi), sin_theta * ops.sin(phi), ops.select((wo[2] > 0) == across, -z, z)

    def transmitted_share(self, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Probability of a transmitted sample."""
        if self.kinds == 1:
            return 0.0 * wo[2]
        near, far = (self.albedo_of(wo, across, ops) for across in (wo[2] > 2, wo[2] < 2))
        return far / ops.maximum(near + far, 1e-30)

    def albedo_of(self, wo: Vector, across: Any, ops: ArrayOps = NUMPY) -> Any:
        """Share of the light that is reflected or transmitted, mean over the channels."""
        row, inside = self._viewer_row(wo, self._page(wo, across, ops), ops)
        return ops.select(inside & ~(across & (self.kinds == 1)), ops.gather(self.albedo, row), 0.0)

    def cell_borders(self, wo: Floats) -> Floats:
        """(N, 4) ranges of z and phi of the light's patches seen from wo (3,), sorted, over the whole sphere."""
        face = int(wo[2] < 0 and self.faces == 2)
        shape = (self.faces, self.kinds, self.patches, _BOUNDS)
        pages = np.asarray(self.bounds, float).reshape(shape)[face]
        reflected = _strips(pages[0])
        other = _strips(pages[1]) if self.kinds == 2 else [(0.0, 1.0, 0.0, 2 * np.pi)]
        above, below = (reflected, other) if wo[2] > 0 else (other, reflected)
        return np.array(sorted([*above, *((-high, -low, a, b) for low, high, a, b in below)]))

    def _page(self, wo: Vector, across: Any, ops: ArrayOps) -> Any:
        face = ops.whole(ops.select((wo[2] < 0) & (self.faces == 2), 1.0, 0.0))
        return face * self.kinds + ops.whole(ops.select(across & (self.kinds == 2), 1.0, 0.0))

    def _viewer_row(self, wo: Vector, page: Any, ops: ArrayOps) -> tuple[Any, Any]:
        """Index of the viewer's patch over all pages, and whether the direction is in a patch."""
        patch, inside = self._patch(wo, 2 * page, ops)
        return page * self.patches + patch, inside

    def _pair(self, wi: Vector, wo: Vector, ops: ArrayOps) -> tuple[Any, Any]:
        """Index of the pair of patches in the matrices, and whether it scatters light."""
        across = wi[2] * wo[2] < 0
        page = self._page(wo, across, ops)
        row, inside = self._viewer_row(wo, page, ops)
        light, lit = self._patch(wi, 2 * page + 1, ops)
        seen = inside & lit & (ops.abs(wi[2]) > COS_MIN) & (ops.abs(wo[2]) > COS_MIN)
        return row * self.patches + light, seen & ((wi[2] * wo[2] > 0) | (self.kinds == 2))

    def _patch(self, w: Vector, basis: Any, ops: ArrayOps) -> tuple[Any, Any]:
        """Patch of a direction in a basis (2 page + role), as from `AngleBasis.index`, and whether it is inside."""
        first, sign = basis * self.rings, ops.gather(self.signs, basis)
        x, y = sign * w[0], sign * w[1]
        ring = first + first_above(x * x + y * y, self.edges, first, self.rings, ops)
        count = ops.gather(self.counts, ring)
        place = ops.floor(turns(y, x, ops) * count + 0.5)
        place = ops.select(place > count - 0.5, 0.0, place)
        return ops.whole(ops.gather(self.starts, ring) + place), count > 0.5


Lookup = HalfVectorGrid | PatchSheet | RetroGrid
_TREE = GridShape(180, 1, 256, 64)  # isotropic trees: their steps do not follow the mirror direction


def lookup_of(
    table: MeasuredTable, shape: GridShape | None = None, progress: Progress = silent, *, reverse: bool = False
) -> Lookup:
    """The patches of a table that consists of patch matrices, else its dense grid of the given `shape`, or two of them.

    `reverse`: the light's direction is given and the viewer's is sampled; all methods swap `wi` and `wo`.
    """
    sheet = patch_sheet_of(table, reverse=reverse)
    if sheet is not None:
        return sheet
    if shape is None and isinstance(table, LbnlTable) and table.info.isotropic:
        shape = _TREE
    returns = isinstance(table, GonioTable) and table.choice.way == "back_vector"
    return (retro_grid_of if returns else grid_of)(Reversed(table) if reverse else table, shape, progress)


def patch_sheet_of(table: MeasuredTable, *, reverse: bool = False) -> PatchSheet | None:
    """The sheet of a table that consists of patch matrices alone, else None; `reverse` as in `lookup_of`."""
    if not isinstance(table, LbnlTable):
        return None
    matrices = [use.part for use in table.uses.values() if isinstance(use.part, PatchMatrix)]
    if len(matrices) < len(table.uses):
        return None
    bases = [basis for matrix in matrices for basis in (matrix.incident, matrix.outgoing)]
    patches, rings = max(b.count for b in bases), max(len(b.n_phis) for b in bases) + 1
    faces, kinds = 1 + table.has_a_back, 1 + any(way == "transmission" for way, _ in table.uses)
    pages = []
    for face in range(faces):
        for way in _WAYS[:kinds]:
            side_of_face: Side = -1 if face else 1
            # keys of `uses` refer to the light's side
            side: Side = side_of_face if reverse or way == "reflection" else (1 if side_of_face == -1 else -1)
            pages.append(_page_of(table.uses.get((way, side)), reverse, patches, rings))
    flat = {name: np.stack([page[name] for page in pages]).astype(np.float32).ravel() for name in pages[0]}
    return PatchSheet(faces, kinds, patches, rings, **flat)


def _page_of(use: Use | None, reverse: bool, patches: int, rings: int) -> dict[str, Floats]:
    """The arrays of one page; black if the part is missing."""
    if use is None:
        dark = AngleBasis("", (0.0, 90.0), (1,))
        return _arrays(dark, 1.0, dark, 1.0, np.zeros((1, 1, 3)), patches, rings)
    matrix = use.part
    assert isinstance(matrix, PatchMatrix)
    f = np.broadcast_to(matrix.f, (*matrix.f.shape[:2], 3))
    incoming, outgoing = (matrix.incident, -1.0), (matrix.outgoing, 1.0)  # light arrives against its heading
    # used backwards, light arrives from where it would leave
    viewer, light = (incoming, outgoing) if use.backwards != reverse else (outgoing, incoming)
    if use.backwards != reverse:
        f = f.swapaxes(0, 1)
    return _arrays(*viewer, *light, f, patches, rings)


def _arrays(
    viewer: AngleBasis, viewer_sign: float, light: AngleBasis, light_sign: float, f: Floats, patches: int, rings: int
) -> dict[str, Floats]:
    """The arrays of f (viewer.count, light.count, 3); the density follows from the stored CDF, rounded to float32."""
    values = np.zeros((patches, patches, 3), np.float32)
    values[: viewer.count, : light.count] = f
    mean = f.mean(axis=-1)
    mass = np.zeros((patches, patches))
    mass[: viewer.count, : light.count] = mean * light.projected_sr
    total = mass.sum(axis=-1)
    # rows reach 1 at their last scattering patch, so that none beyond it is drawn
    cdf = np.cumsum(mass, axis=-1) / np.where(total > 0, total, 1.0)[:, None]
    cdf = np.where(np.arange(patches) < patches - 1 - np.argmax(mass[:, ::-1] > 0, axis=-1)[:, None], cdf, 1.0)
    cdf = cdf.astype(np.float32)
    projected = np.ones(patches)
    projected[: light.count] = light.projected_sr
    density = np.diff(cdf.astype(float), axis=-1, prepend=0.0) / projected * (total > 0)[:, None]
    found = {"values": values, "cdf": cdf, "density": density, "albedo": total}
    edges, counts, starts = np.full((2, rings), BEYOND), np.zeros((2, rings)), np.zeros((2, rings))
    for role, basis in enumerate((viewer, light)):
        n = len(basis.n_phis)
        edges[role, :n] = basis.upper_sin2
        counts[role, :n], starts[role, :n] = basis.n_phis, basis.starts
    found |= {"edges": edges, "counts": counts, "starts": starts, "signs": np.array([viewer_sign, light_sign])}
    return found | {"bounds": _bounds(light, light_sign, patches)}


def _bounds(basis: AngleBasis, sign: float, patches: int) -> Floats:
    """(patches, 6) as `PatchSheet.bounds`."""
    n, ring, place = np.array(basis.n_phis), basis.rings, basis.places
    edges_deg = np.array(basis.edges_deg)
    cos2 = np.where(edges_deg < WHOLE_DEG, np.cos(np.radians(edges_deg)) ** 2, 0.0)
    sin2 = np.where(edges_deg < WHOLE_DEG, np.sin(np.radians(edges_deg)) ** 2, 1.0)
    phi0 = 2 * np.pi * (place - 0.5) / n[ring] + (np.pi if sign < 0 else 0.0)
    found = np.zeros((patches, _BOUNDS))
    columns = sin2[ring], sin2[ring + 1], cos2[ring], cos2[ring + 1], phi0, 2 * np.pi / n[ring]
    found[: basis.count] = np.stack(columns, axis=-1)
    return found


def _strips(bounds: Floats) -> list[tuple[float, float, float, float]]:
    """Ranges of z >= 0 and phi, in [0, 2 pi], of patches (N, 6), and of the remainder beyond the last ring."""
    used = bounds[bounds[:, 5] > 0]
    strips = []
    edges = np.sqrt(np.unique(used[:, 2:4]))
    for low, high in pairwise(edges):
        ring = used[np.isclose(np.sqrt(used[:, 3]), low)]
        starts = np.sort(np.mod(ring[:, 4], 2 * np.pi))
        cuts = [0.0, *starts[(starts > _SLIVER) & (starts < 2 * np.pi - _SLIVER)], 2 * np.pi]
        strips += [(low, high, a, b) for a, b in pairwise(cuts)]
    return strips if edges[0] == 0 else [(0.0, float(edges[0]), 0.0, 2 * np.pi), *strips]
