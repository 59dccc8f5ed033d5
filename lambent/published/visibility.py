"""Visibility of distant lights by coherence, predicted from nearby pixels, with shadow rays where that is doubtful.

Ben-Artzi 2007, chapter 8 (Ben-Artzi, Ramamoorthi and Agrawala 2006). It traces few rays, but a ray of a modern tracer
costs less than a prediction (docs/performance.md), so `baking.transport.visibility` traces all of them. Lights are at
infinity; their cells are the directions nearest to each, that is, Voronoi cells on the sphere.

Pixels are evaluated in passes, whose pixels are independent of each other (section 8.6.1 and figure 8.4). Informing
pixels vote: how many of them report a blocker, light by light.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.running.tiles import slices
from lambent.baking.tracing.rays import array_of, has_holes, in_shadow, intersect, leaving, vectors
from lambent.baking.transport.view_points import ViewPoints
from lambent.core.arrays import Flags, Floats, Indices, ranges
from lambent.core.geometry.octahedral import texel_directions, to_square

TABLE = 512  # texels along a side of the octahedral map for looking up cells
SPACING = 16  # pixels of the coarsest grid
OUTSIDE = -1
STRAIGHT, DIAGONAL = ((-1, 0), (0, -1), (0, 1), (1, 0)), ((-1, -1), (-1, 1), (1, -1), (1, 1))
RAYS_AT_ONCE = 1 << 22
Counts = NDArray[np.uint8]
AT_ONCE = 4096  # points
NONE = -1
FEWEST_INFORMERS = 3  # needed for a prediction


def neighbours(directions: Floats) -> NDArray[np.int64]:
    """Lights whose cells are adjacent to each light's, (M, K); unused places hold the light itself.

    Two cells are adjacent if the Delaunay triangulation, for points on a sphere their convex hull, has an edge.

    Parameters
    ----------
    directions : (M, 3)
        Distinct unit directions of the lights; at least four, not all in one plane.
    """
    from scipy.spatial import ConvexHull

    corners = ConvexHull(np.asarray(directions, float)).simplices
    both = np.concatenate([corners[:, [i, j]] for i in range(3) for j in range(3) if i != j])
    edges = np.unique(both, axis=0)
    count = np.bincount(edges[:, 0], minlength=len(directions))
    table = np.repeat(np.arange(len(directions))[:, None], count.max(), axis=1)
    table[edges[:, 0], ranges(count)] = edges[:, 1]
    return table


class CellTable:
    """Looks up the light whose cell contains a direction, by an octahedral map."""

    def __init__(self, directions: Floats) -> None:
        from scipy.spatial import cKDTree

        self._cell = cKDTree(directions).query(texel_directions(TABLE).reshape(-1, 3))[1]

    def at(self, w: Floats) -> Indices:
        """Lights (n,) whose cells contain the directions w (n, 3), of any length."""
        column, row = np.clip((to_square(w) * TABLE).astype(np.int64), 0, TABLE - 1).T
        return np.asarray(self._cell[row * TABLE + column])


@dataclass(frozen=True)
class Pass:
    """Pixels (n,), row * width + column, and the pixels that inform them (n, k), padded with OUTSIDE; k may be 0."""

    pixels: Indices
    informers: Indices


def scanline(width: int, height: int) -> Iterator[Pass]:
    """Each pixel is informed by its left, upper and upper left neighbour; passes are independent diagonals."""
    row, column = np.divmod(np.arange(width * height), width)
    yield _pass(np.flatnonzero((row == 0) | (column == 0)), (), width, height)
    for diagonal in range(2, width + height - 1):
        r = np.arange(max(1, diagonal - width + 1), min(height, diagonal))
        yield _pass(r * width + diagonal - r, ((0, -1), (-1, -1), (-1, 0)), width, height)


def grid(width: int, height: int) -> Iterator[Pass]:
    """Coarse to fine: the centres of squares of evaluated pixels, then the midpoints of their sides."""
    row, column = np.divmod(np.arange(width * height), width)
    yield _pass(np.flatnonzero((row % SPACING == 0) & (column % SPACING == 0)), (), width, height)
    step = SPACING // 2
    while step:
        r, c = row % (2 * step), column % (2 * step)
        yield _pass(np.flatnonzero((r == step) & (c == step)), DIAGONAL, width, height, step)
        sides = np.flatnonzero(((r == 0) & (c == step)) | ((r == step) & (c == 0)))
        yield _pass(sides, STRAIGHT, width, height, step)
        step //= 2


def _pass(pixels: Indices, offsets: tuple[tuple[int, int], ...], width: int, height: int, step: int = 1) -> Pass:
    shift = step * np.array(offsets, np.int64).reshape(-1, 2)
    row, column = pixels[:, None] // width + shift[:, 0], pixels[:, None] % width + shift[:, 1]
    inside = (row >= 0) & (row < height) & (column >= 0) & (column < width)
    return Pass(pixels, np.where(inside, row * width + column, OUTSIDE))


class ShadowRays:
    """Rays from the points of a view to lights in unit `directions` (M, 3).

    Attributes
    ----------
    facing : (P, M) bool
        Whether a light is on the side of a point's surface that the viewer sees; only those count.
    count : int
        Number of rays so far.
    seconds : float
        Time for them.
    """

    def __init__(self, scene: Any, points: ViewPoints, directions: Floats) -> None:
        self._scene, self._holes = scene, has_holes(scene)
        self._p, self._n = vectors(mi.Point3f, points.p), vectors(mi.Vector3f, points.flat)
        self._w = vectors(mi.Vector3f, directions)
        side = np.sign((points.flat * points.n).sum(axis=1, keepdims=True))
        self.facing = np.asarray((points.flat * side) @ np.asarray(directions, np.float32).T > 0)
        self.count, self.seconds = 0, 0.0

    def blocked(self, point: Indices, light: Indices) -> Flags:
        """(n,) bool: whether the light is occluded from the point."""
        found = np.zeros(len(point), bool)
        began = time.perf_counter()
        for some in slices(len(point), RAYS_AT_ONCE):
            found[some] = np.array(
                in_shadow(self._scene, self._rays(point[some], light[some]), mi.Bool(True), self._holes)
            )
        self._note(len(point), began)
        return found

    def blockers(self, point: Indices, light: Indices) -> tuple[Flags, NDArray[np.float32]]:
        """(n,) bool as `blocked`, and the position of the blocker (n, 3), undefined if there is none."""
        found, place = np.zeros(len(point), bool), np.zeros((len(point), 3), np.float32)
        began = time.perf_counter()
        for some in slices(len(point), RAYS_AT_ONCE):
            si = intersect(self._scene, self._rays(point[some], light[some]), mi.Bool(True), self._holes)
            hit = si.is_valid()
            place[some] = array_of(si.p)
            found[some] = np.array(hit)
        self._note(len(point), began)
        return found, place

    def _rays(self, point: Indices, light: Indices) -> Any:
        at, m = mi.UInt32(point.astype(np.uint32)), mi.UInt32(light.astype(np.uint32))
        p, n = dr.gather(mi.Point3f, self._p, at), dr.gather(mi.Vector3f, self._n, at)
        return leaving(self._scene, p, n, dr.gather(mi.Vector3f, self._w, m))

    def _note(self, rays: int, began: float) -> None:
        self.count += rays
        self.seconds += time.perf_counter() - began


class Votes(Protocol):
    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        """Store blockers (n, 3) hit by shadow rays."""

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        """Numbers of blockers, and of informers that can tell, for every light of n points, (n, M).

        An informer cannot tell about a light behind its surface.

        Parameters
        ----------
        seen, facing : (P, M) bool
            Of all points.
        point : (n,)
            Points to predict.
        informers : (n, k)
            The points that inform them, padded with OUTSIDE.
        """


class Same:
    """Blockers stay in the cell of the light that they block."""

    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        """Does nothing: visibility alone is needed."""

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        votes = np.zeros((len(point), seen.shape[1]), np.uint8)
        voters = np.zeros_like(votes)
        for informer in informers.T:
            tells = facing[informer] & (informer != OUTSIDE)[:, None]
            voters += tells
            votes += tells & ~seen[informer]
        return votes, voters


class Warped:
    """Blockers are rotated to the cells that contain them from the next point."""

    def __init__(self, p: Floats, directions: Floats) -> None:
        self._p, self._cells, self._lights = p, CellTable(directions), len(directions)
        self._of = np.full((len(p), len(directions)), NONE, np.int32)  # index of each light's blocker
        self._places = np.zeros((1 << 16, 3), np.float32)  # doubled when full
        self._count = 0

    def keep(self, point: Indices, light: Indices, place: Floats) -> None:
        end = self._count + len(point)
        while end > len(self._places):
            self._places = np.concatenate([self._places, np.zeros_like(self._places)])
        self._places[self._count : end] = place
        self._of[point, light] = np.arange(self._count, end)
        self._count = end

    def count(self, seen: Flags, facing: Flags, point: Indices, informers: Indices) -> tuple[Counts, Counts]:
        votes = np.zeros((len(point), self._lights), np.uint8)
        voters = np.zeros_like(votes)
        for some in slices(len(point), AT_ONCE):
            for informer in informers[some].T:
                voters[some] += facing[informer] & (informer != OUTSIDE)[:, None]
                known = (self._of[informer] != NONE) & ~seen[informer] & (informer != OUTSIDE)[:, None]
                row, light = np.nonzero(known)
                number = self._of[informer[row], light]
                cell = self._cells.at(self._places[number] - self._p[point[some]][row])
                keys = row * self._lights + cell
                found = np.bincount(keys, minlength=votes[some].size).reshape(-1, self._lights)
                votes[some] += np.minimum(found, 50).astype(np.uint8)
                self._of[point[some][row], cell] = number
        return votes, voters


@dataclass(frozen=True)
class Variant:
    """Options of prediction and correction.

    Attributes
    ----------
    grid : bool
        Order of the pixels: coarse to fine, or by scanlines.
    warp : bool
        Whether blockers are rotated to their direction from the next pixel, or stay in the same light's cell.
    boundary : bool
        What is traced first: lights next to one of other visibility, or those on which informing pixels disagree.
    """

    grid: bool
    warp: bool
    boundary: bool


VARIANTS = {
    "SWB": Variant(grid=False, warp=True, boundary=True),
    "GWB": Variant(grid=True, warp=True, boundary=True),
    "GNB": Variant(grid=True, warp=False, boundary=True),
    "GWU": Variant(grid=True, warp=True, boundary=False),
    "GNU": Variant(grid=True, warp=False, boundary=False),
}


@dataclass(frozen=True)
class Predicted:
    """Visibility of M lights from P points.

    Attributes
    ----------
    seen : (P, M) bool
        Also false for a light behind the surface.
    facing : (P, M) bool
        Pairs that count: the light is in front of the surface.
    traced : int
        Number of shadow rays, all for pairs that count.
    ray_seconds : float
        Time for those rays.
    """

    seen: Flags
    facing: Flags
    traced: int
    ray_seconds: float

    @property
    def traced_percent(self) -> float:
        return 100 * self.traced / max(1, int(self.facing.sum()))

    def wrong_percent(self, truth: Flags) -> float:
        """Percentage of the pairs that count whose visibility differs from (P, M) `truth`."""
        return 100 * int((self.facing & (self.seen != truth)).sum()) / max(1, int(self.facing.sum()))


def predicted_visibility(
    scene: Any, points: ViewPoints, directions: Floats, width: int, height: int, variant: Variant
) -> Predicted:
    """Visibility of lights in unit `directions` (M, 3) from the points of a view of `width` x `height` pixels."""
    run = _Run(scene, points, directions, width * height, variant)
    for step in grid(width, height) if variant.grid else scanline(width, height):
        run.evaluate(step)
    return Predicted(run.seen, run.rays.facing, run.rays.count, run.rays.seconds)


class _Run:
    def __init__(self, scene: Any, points: ViewPoints, directions: Floats, pixels: int, variant: Variant) -> None:
        self.rays = ShadowRays(scene, points, directions)
        self.seen = np.zeros_like(self.rays.facing)
        self._variant, self._object, self._neighbours = variant, points.object, neighbours(directions)
        self._point = np.full(pixels + 1, OUTSIDE)  # the last entry serves pixels outside the picture
        self._point[points.pixel] = np.arange(len(points))
        self._votes: Votes = Warped(points.p, directions) if variant.warp else Same()

    def evaluate(self, step: Pass) -> None:
        """Determine the visibility of the pixels of a pass."""
        shown = self._point[step.pixels] != OUTSIDE
        point, informers = self._point[step.pixels[shown]], self._point[step.informers[shown]]
        alike = (step.informers[shown] == OUTSIDE) | (
            (informers != OUTSIDE) & (self._object[informers] == self._object[point][:, None])
        )
        informed = alike.all(axis=1) & ((informers != OUTSIDE).sum(axis=1) >= FEWEST_INFORMERS)
        self._trace_all(point[~informed])
        if informed.any():
            self._predict(point[informed], informers[informed])

    def _trace_all(self, point: Indices) -> None:
        row, light = np.nonzero(self.rays.facing[point])
        self._trace(point[row], light)

    def _trace(self, point: Indices, light: Indices) -> Flags:
        """(n,) whether lights are visible; stored for later pixels."""
        if self._variant.warp:
            blocked, place = self.rays.blockers(point, light)
            self._votes.keep(point[blocked], light[blocked], place[blocked])
        else:
            blocked = self.rays.blocked(point, light)
        self.seen[point, light] = ~blocked
        return ~blocked

    def _predict(self, point: Indices, informers: Indices) -> None:
        facing = self.rays.facing[point]
        votes, voters = self._votes.count(self.seen, self.rays.facing, point, informers)
        if self._variant.boundary:
            estimate = facing & (votes == 0)
            doubted = facing & self._at_boundary(estimate, facing)
            uncertain = np.zeros_like(doubted)
        else:
            estimate = facing & (votes < voters)
            agreed = ((votes == 0) | (votes >= voters)) & (voters >= FEWEST_INFORMERS)
            doubted = uncertain = facing & ~agreed
        self.seen[point] = estimate
        self._correct(point, facing, estimate, uncertain, doubted)

    def _at_boundary(self, estimate: Flags, facing: Flags) -> Flags:
        """Lights next to one of other visibility; in scanlines also next to one behind the surface (8.7.4)."""
        found = np.zeros_like(estimate)
        for beside in self._neighbours.T:
            if self._variant.grid:
                found |= (estimate != estimate[:, beside]) & facing[:, beside]
            else:
                found |= (estimate != estimate[:, beside]) | ~facing[:, beside]
        return found

    def _correct(self, point: Indices, facing: Flags, estimate: Flags, uncertain: Flags, doubted: Flags) -> None:
        """Trace doubted lights, and spread from each one estimated wrongly, or not at all, to its neighbours."""
        left = facing.copy()
        row, light = np.nonzero(doubted)
        while len(row):
            left[row, light] = False
            seen = self._trace(point[row], light)
            wrong = uncertain[row, light] | (seen != estimate[row, light])
            row, light, seen = row[wrong], light[wrong], seen[wrong]
            beside = self._neighbours[light]
            at, k = np.nonzero(left[row[:, None], beside])
            keys = np.unique(row[at] * estimate.shape[1] + beside[at, k])
            row, light = np.divmod(keys, estimate.shape[1])
