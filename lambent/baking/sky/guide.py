"""Sampling guided by visibility of the sky: rooms lit through windows are sampled through the windows.

A cheap pre-pass groups surfaces by place (a regular grid) and by the side they face (six of them), so that both sides
of a wall are separate; each side of a sheet that light crosses knows the light of both. Rays from points of each group
measure how much light each bin of directions (`sky.bins`) brings, cosine included. The group's table draws bins in
proportion to the root mean square, which minimises variance. Groups that see nearly all of their sky, or none, share
one table: there the environment is sampled by luminance alone.

`guided_sky` replaces the environment that it wraps, so that every sampler of the scene's emitters, and every density of
a direction, is guided.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.engine import once_per_variant
from lambent.baking.running.tiles import seed_of, slices
from lambent.baking.sky.bins import BIN_SR, BINS, COLUMNS, ROWS, SkyBins, middles
from lambent.baking.tracing import rays
from lambent.baking.tracing.rays import independent, leaving, vectors
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas, triangle_normals
from lambent.scenes.scene import Scene

CELL_M, MOST_CELLS, MOST_TABLES = 0.5, 1 << 16, 4096
SURFACE_POINTS = 1 << 18
POINTS = 128  # ray origins per group
FIRST, KEPT = 1, 16  # rays per bin to decide which groups need a table, and which are lit at all
RAYS, LEAST = 4096, 16  # rays for a table: distributed by the light of the bins, and at least this many per bin
OPEN = 0.9  # visible share of its hemisphere's light above which a group needs no table
FEW = 0.2  # of the groups that see any sky: if fewer need a table, there is no guide
DEFENSIVE = 0.15  # of a table's samples, drawn by luminance alone: light missed by the pre-pass is not lost
EVERYWHERE = 0.01  # of these, drawn uniformly: no direction is left out
SPREAD = 0.4  # share of a bin's light taken from its eight neighbours
RAYS_AT_ONCE = 1 << 20


@dataclass(frozen=True)
class Groups:
    """Surfaces by place and side: cells of `size_m` from `low`, `shape` of them along x, y, z, six sides each."""

    low: Floats
    size_m: float
    shape: tuple[int, int, int]

    def of(self, position: Any, normal: Any) -> Any:
        """Group number (mi.UInt32) of points (mi.Point3f) with normals."""
        cell = [
            dr.clip(mi.Int32(dr.floor((p - float(low)) * (1 / self.size_m))), 0, n - 1)
            for p, low, n in zip((position.x, position.y, position.z), self.low, self.shape, strict=True)
        ]
        size = dr.abs(normal)
        axis = dr.select((size.x >= size.y) & (size.x >= size.z), 0, dr.select(size.y >= size.z, 1, 2))
        along = dr.select(axis == 0, normal.x, dr.select(axis == 1, normal.y, normal.z))
        side = 2 * mi.UInt32(axis) + dr.select(along < 0, mi.UInt32(1), mi.UInt32(0))
        place = mi.UInt32((cell[0] * self.shape[1] + cell[1]) * self.shape[2] + cell[2])
        return place * 6 + side

    @property
    def count(self) -> int:
        return int(np.prod(self.shape)) * 6


def groups_of(scene: Scene, size_m: float = CELL_M) -> Groups:
    """The grid over a scene's bounds, with cells of `size_m`, or larger if MOST_CELLS requires it."""
    low, high = (np.asarray(corner, float) for corner in scene.bounds)
    size_m = max(size_m, float(np.prod(np.maximum(high - low, size_m)) / MOST_CELLS) ** (1 / 3))
    while True:
        shape = np.maximum(np.ceil((high - low) / size_m + 1e-6), 1).astype(int)
        if shape.prod() <= MOST_CELLS:
            return Groups(low, size_m, (int(shape[0]), int(shape[1]), int(shape[2])))
        size_m *= 1.1


@dataclass(frozen=True, eq=False)
class Learnt:
    """A table of bins for each group that needs one; table 0 serves all other groups.

    table (groups,) int: number of a group's table; shares (tables, BINS): of each table's samples; brought (groups,):
    approximate irradiance, W/m^2 of luminance.
    """

    groups: Groups
    table: Indices
    shares: Floats
    brought: Floats


class SkyGuide:
    """The tables on the device, for the bins of their sky."""

    def __init__(self, bins: SkyBins, learnt: Learnt) -> None:
        self.bins, self.learnt, self.groups, self.brought = bins, learnt, learnt.groups, learnt.brought
        self.shares = learnt.shares
        self._table = mi.UInt32(learnt.table.astype(np.uint32))
        cumulative = np.cumsum(self.shares, axis=1)
        cumulative[:, -1] = 2  # rounding must not lead past the end
        self._cumulative = mi.Float(cumulative.astype(np.float32).ravel())
        self._share = mi.Float(self.shares.astype(np.float32).ravel())

    def table_at(self, position: Any, normal: Any, active: Any = True) -> Any:
        """Number of the table (mi.UInt32) at points of surfaces."""
        return dr.gather(mi.UInt32, self._table, self.groups.of(position, normal), active)

    def sample(self, table: Any, u: Any, active: Any = True) -> Any:
        """Draw unit directions from tables."""
        first = table * BINS
        number = dr.binary_search(
            0, BINS - 1, lambda i: dr.gather(mi.Float, self._cumulative, first + mi.UInt32(i), active) <= u.x
        )
        number = mi.UInt32(number)
        share = dr.gather(mi.Float, self._share, first + number, active)
        below = dr.gather(mi.Float, self._cumulative, first + dr.maximum(number, 1) - 1, active & (number > 0))
        rest = dr.clip((u.x - below) / dr.maximum(share, 1e-12), 0, dr.one_minus_epsilon(mi.Float))
        return self.bins.direction(number, mi.Point2f(rest, u.y))

    def pdf(self, table: Any, w: Any, active: Any = True) -> Any:
        """Density of `sample`, sr^-1."""
        number, density = self.bins.find(w)
        return dr.gather(mi.Float, self._share, table * BINS + number, active) * density


def learn(
    scene: Scene, whole: Any, sky: Any, *, keep_open: bool = False, panes: bool = False, effort: float = 1.0
) -> SkyGuide | None:
    """Learn the guide of a scene; None if no group needs a table. Deterministic.

    `whole` is the traced scene (mi.Scene), `sky` its environment (mi.Emitter). With `keep_open`, groups that see most
    of their sky have tables too; with `panes`, clear glass transmits the sky undeviated. `effort` scales RAYS and
    LEAST.
    """
    bins = SkyBins(sky)
    if not bins.luminance.any():
        return None
    position, normal, crossed = _both_sides(whole, *_points_and_normals(scene, SURFACE_POINTS))
    at, facing, groups = vectors(mi.Point3f, position), vectors(mi.Vector3f, normal), groups_of(scene)
    while len(np.unique(number := np.array(groups.of(at, facing)))) > 4 * MOST_TABLES:
        groups = groups_of(scene, groups.size_m * 1.5)
    pre_pass = _PrePass(whole, bins, (position, normal, crossed), number, panes)
    first = pre_pass.brought(np.arange(len(pre_pass.group)), np.full(BINS, KEPT if keep_open else FIRST), "first")
    lit = (first[0] > 0).any(axis=1)
    wanted = np.flatnonzero(lit & (keep_open | ~pre_pass.sees_most(first[0])))[:MOST_TABLES]
    if len(wanted) <= FEW * lit.sum():
        return None
    light = bins.luminance / bins.luminance.sum()
    counts = np.ceil(effort * np.maximum(LEAST, RAYS * light)).astype(int)
    more = pre_pass.brought(wanted, counts, "more")
    squares = np.where(more[1] > 0, more[1], first[1][wanted] * FIRST / RAYS)
    shares = _spread(np.sqrt(squares)) * bins.luminance
    plain = light * (1 - EVERYWHERE) + EVERYWHERE / BINS
    shares = DEFENSIVE * plain + (1 - DEFENSIVE) * shares / shares.sum(axis=1, keepdims=True)
    table = np.zeros(groups.count, int)
    table[pre_pass.group[wanted]] = 1 + np.arange(len(wanted))
    brought = np.zeros(groups.count)
    brought[pre_pass.group] = first[0] @ bins.luminance * BIN_SR
    brought[pre_pass.group[wanted]] = more[0] @ bins.luminance * BIN_SR
    return SkyGuide(bins, Learnt(groups, table, np.concatenate([plain[None], shares]), brought))


class _PrePass:
    """Points by group, whose `number` (n,) is given, and rays from them."""

    def __init__(
        self, whole: Any, bins: SkyBins, points: tuple[Floats, Floats, Flags], number: Indices, panes: bool
    ) -> None:
        self._whole, self._bins, self._holes, self._panes = whole, bins, rays.has_holes(whole), panes
        position, normal, crossed = points
        order = np.argsort(number, kind="stable")
        self.group, start, count = np.unique(number[order], return_index=True, return_counts=True)
        which = start[:, None] + np.arange(POINTS) * count[:, None] // POINTS
        chosen = order[which]  # (groups, POINTS), spread evenly over the group's points
        self._position, self._normal, self._crossed = position[chosen], normal[chosen], crossed[chosen]

    def brought(self, which: Indices, counts: Indices, what: str) -> tuple[Floats, Floats]:
        """Means (n, BINS) over `counts` (BINS,) rays of the cosine where the sky is visible, and of its square."""
        means, squares = np.zeros((2, len(which), BINS))
        number = np.repeat(np.arange(BINS), counts)
        first = np.cumsum(counts) - counts
        turn = np.arange(len(number)) - first[number]  # index of a ray among those of its bin
        point = (turn * POINTS // np.maximum(counts[number], POINTS) + turn + 7 * number) % POINTS
        at_once = max(1, RAYS_AT_ONCE // len(number))
        for mine in slices(len(which), at_once):
            cosine = self._cosines(which[mine], number, point, seed_of(0, "sky guide", what, mine.start))
            means[mine] = np.add.reduceat(cosine, first, axis=1) / counts
            squares[mine] = np.add.reduceat(cosine**2, first, axis=1) / counts
        return means, squares

    def _cosines(self, which: Indices, number: Indices, point: Indices, seed: int) -> Floats:
        """(n, rays) cosines of rays in bins `number` from the groups' `point`s; 0 where the sky is hidden."""
        count, width = len(number), len(which) * len(number)
        sampler = independent(seed, width)
        thread = dr.arange(mi.UInt32, width)
        place = thread // count * POINTS + dr.gather(mi.UInt32, mi.UInt32(point.astype(np.uint32)), thread % count)
        bins = dr.gather(mi.UInt32, mi.UInt32(number.astype(np.uint32)), thread % count)
        w = self._bins.direction(bins, sampler.next_2d())
        p = dr.gather(mi.Point3f, vectors(mi.Point3f, self._position[which]), place)
        n = dr.gather(mi.Vector3f, vectors(mi.Vector3f, self._normal[which]), place)
        crossed = dr.gather(mi.Bool, mi.Bool(self._crossed[which].ravel()), place)
        cosine = dr.dot(w, n)
        cosine = dr.select(crossed, dr.abs(cosine), dr.maximum(cosine, 0.0))
        ray, ahead = rays.leaving(self._whole, p, n, w), cosine > 0
        if self._panes:
            seen = mi.luminance(rays.passed(self._whole, ray, ahead))
        else:
            seen = dr.select(rays.in_shadow(self._whole, ray, ahead, self._holes), 0.0, 1.0)
        return np.array(seen * cosine).reshape(len(which), count)

    def sees_most(self, brought: Floats) -> Flags:
        """Groups that see most of the light of the hemisphere they face."""
        light = self._bins.luminance
        cosine = np.maximum(normalize(self._normal.mean(axis=1)) @ middles().T, 0)
        return np.asarray((np.where(cosine > 0, brought, 0) @ light) >= OPEN * (cosine @ light))


def _points_and_normals(scene: Scene, count: int) -> tuple[Floats, Floats, Flags]:
    """Points (count, 3) on a scene's surfaces, their triangles' normals, and whether light crosses there."""
    rng = np.random.default_rng(0)
    corners = scene.corners
    area = triangle_areas(corners)
    share = np.sqrt(area / area.sum())  # geometric mean of area and uniform: small things are not forgotten
    face = np.sort(rng.choice(len(area), size=count, p=share / share.sum()))
    position, normal = points_on_triangles(corners, face, rng), triangle_normals(corners[face])
    crossed = [o.material in scene.measured or scene.materials[o.material].transmits for o in scene.objects]
    crossed_there = np.repeat(crossed, [len(o.mesh.faces) for o in scene.objects])[face]
    return position, normal, crossed_there


def _both_sides(whole: Any, position: Floats, normal: Floats, crossed: Flags) -> tuple[Floats, Floats, Flags]:
    """The points, followed by all points flipped whose other side is not within a solid."""
    back = whole.ray_intersect(leaving(whole, position, normal, -normal))
    inside = back.is_valid() & (dr.dot(back.n, vectors(mi.Vector3f, normal)) < 0)
    sheet = np.flatnonzero(~np.array(inside))
    both = np.concatenate([np.arange(len(position)), sheet])
    turned = np.concatenate([normal, -normal[sheet]])
    return position[both], turned, crossed[both]


def _spread(brought: Floats) -> Floats:
    grid = np.pad(brought.reshape(-1, ROWS, COLUMNS), ((0, 0), (1, 1), (0, 0)), mode="edge")
    grid = np.concatenate([grid[..., -1:], grid, grid[..., :1]], axis=2)
    around = sum(grid[:, r : r + ROWS, c : c + COLUMNS] for r in range(3) for c in range(3) if (r, c) != (1, 1))
    return (1 - SPREAD) * brought + SPREAD / 8 * np.asarray(around).reshape(len(brought), BINS)


def guided_sky(sky: Any, guide: SkyGuide, bounds: Any) -> Any:
    """mi.Emitter with the radiance of `sky` (mi.Emitter), for a scene within `bounds` (mi.BoundingBox3f)."""
    props = mi.Properties()
    props["sky"] = sky
    return _emitter_class()(props, guide, bounds)


@once_per_variant
def _emitter_class() -> Any:
    class GuidedSky(mi.Emitter):  # type: ignore[misc]
        def __init__(self, props: Any, guide: SkyGuide, bounds: Any) -> None:
            mi.Emitter.__init__(self, props)
            self.sky, self.guide, self.bounds = props["sky"], guide, bounds
            self.m_flags = self.sky.flags()
            sphere = bounds.bounding_sphere()
            self._centre, self._radius = mi.Point3f(sphere.center), mi.Float(sphere.radius)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> tuple[Any, Any]:
            table = self.guide.table_at(it.p, it.n, active)
            w = self.guide.sample(table, sample, active)
            reach = 2 * dr.maximum(self._radius, dr.norm(it.p - self._centre))
            ds = dr.zeros(mi.DirectionSample3f)
            ds.p, ds.d, ds.n, ds.dist = dr.fma(w, reach, it.p), w, -w, reach
            ds.time, ds.delta, ds.emitter = it.time, mi.Bool(False), mi.EmitterPtr(self)
            ds.pdf = self.guide.pdf(table, w, active)
            return ds, dr.select(active & (ds.pdf > 0), self._arriving(it, w, active) / ds.pdf, 0.0)

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self.guide.pdf(self.guide.table_at(it.p, it.n, active), ds.d, active)

        def _arriving(self, it: Any, w: Any, active: Any) -> Any:
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi, si.wavelengths = -w, it.wavelengths
            return self.sky.eval(si, active)

        def eval_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return self._arriving(it, ds.d, active)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.sky.eval(si, active)

        def sample_ray(self, *arguments: Any) -> Any:
            return self.sky.sample_ray(*arguments)

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f()

        def to_string(self) -> str:
            return f"GuidedSky[{len(self.guide.shares)} tables]"

    return GuidedSky
