"""Visibility of distant lights, predicted from nearby pixels, with shadow rays where the prediction is doubtful.

Ben-Artzi 2007, chapter 8 (Ben-Artzi, Ramamoorthi and Agrawala 2006). It traces few rays, but a ray of a modern tracer
costs less than a prediction (docs/performance.md), so `bands.visibility` traces all of them. Lights are at infinity.

The last sweep is not in the thesis. A sliver of light between two shadows, narrower than the coarse grid, lies between
pixels that all report a blocker. A finer pixel, doubted for another reason, finds a part of it after the pixels around
were predicted dark. The sweep extends from this part to the whole sliver.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from lambent.bake.tiles import slices
from lambent.bake.transport.coherence.light_cells import neighbours
from lambent.bake.transport.coherence.order import OUTSIDE, Pass, grid, scanline, side_by_side
from lambent.bake.transport.coherence.shadow_rays import ShadowRays
from lambent.bake.transport.coherence.votes import AT_ONCE, Same, Votes, Warped
from lambent.bake.transport.view_points import ViewPoints
from lambent.core.arrays import Flags, Floats, Indices

FEWEST_INFORMERS = 3  # needed for a prediction


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
    sparing : bool
        Whether tracing spreads only to neighbours predicted otherwise, and not at all on the finest grid. A last sweep
        then traces predictions that contradict a neighbouring pixel.
    """

    grid: bool
    warp: bool
    boundary: bool
    sparing: bool = False


VARIANTS = {
    "SWB": Variant(grid=False, warp=True, boundary=True),
    "GWB": Variant(grid=True, warp=True, boundary=True),
    "GNB": Variant(grid=True, warp=False, boundary=True),
    "GWU": Variant(grid=True, warp=True, boundary=False),
    "GNU": Variant(grid=True, warp=False, boundary=False),
    "OPT": Variant(grid=True, warp=False, boundary=False, sparing=True),
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
    if variant.sparing:
        run.sweep(side_by_side(width, height))
    return Predicted(run.seen, run.rays.facing, run.rays.count, run.rays.seconds)


class _Run:
    def __init__(self, scene: Any, points: ViewPoints, directions: Floats, pixels: int, variant: Variant) -> None:
        self.rays = ShadowRays(scene, points, directions)
        self.seen, self._traced = np.zeros((2, *self.rays.facing.shape), bool)
        self._variant, self._object, self._neighbours = variant, points.object, neighbours(directions)
        self._point = np.full(pixels + 1, OUTSIDE)  # the last entry serves pixels outside the picture
        self._point[points.pixel] = np.arange(len(points))
        self._votes: Votes = Warped(points.p, directions) if variant.warp else Same()

    def evaluate(self, step: Pass) -> None:
        """Determine the visibility of the pixels of a pass."""
        shown = self._point[step.pixels] != OUTSIDE
        point, informers = self._point[step.pixels[shown]], self._point[step.informers[shown]]
        alike = (step.informers[shown] == OUTSIDE) | self._on_one_object(point, informers)
        informed = alike.all(axis=1) & ((informers != OUTSIDE).sum(axis=1) >= FEWEST_INFORMERS)
        self._trace_all(point[~informed])
        if informed.any():
            self._predict(point[informed], informers[informed], floods=not (self._variant.sparing and step.finest))

    def sweep(self, step: Pass) -> None:
        """Trace predictions that contradict a neighbouring pixel, and spread from every wrong one to the neighbours.

        `step` has all pixels, each informed by its neighbours.
        """
        shown = self._point[step.pixels] != OUTSIDE
        point, informers = self._point[step.pixels[shown]], self._point[step.informers[shown]]
        beside = np.full((len(self.seen), informers.shape[1]), OUTSIDE)
        beside[point] = np.where(self._on_one_object(point, informers), informers, OUTSIDE)
        every = [self._contradicted(beside, some) for some in slices(len(beside), AT_ONCE)]
        row, light = (np.concatenate(found) for found in zip(*every, strict=True))
        while len(row):
            predicted = self.seen[row, light]
            wrong = self._trace(row, light) != predicted
            others, lights = beside[row[wrong]], light[wrong][:, None]
            at, k = np.nonzero(
                (others != OUTSIDE)
                & self.rays.facing[others, lights]
                & ~self._traced[others, lights]
                & (self.seen[others, lights] == predicted[wrong][:, None])
            )
            keys = np.unique(others[at, k] * self.seen.shape[1] + lights[at, 0])
            row, light = np.divmod(keys, self.seen.shape[1])

    def _contradicted(self, beside: Indices, some: slice) -> tuple[Indices, Indices]:
        """Predicted pairs of point and light that a neighbouring point contradicts."""
        found = np.zeros_like(self.seen[some])
        for other in beside[some].T:
            tells = self.rays.facing[other] & (other != OUTSIDE)[:, None]
            found |= tells & (self.seen[other] != self.seen[some])
        row, light = np.nonzero(found & self.rays.facing[some] & ~self._traced[some])
        return row + some.start, light

    def _on_one_object(self, point: Indices, informers: Indices) -> Flags:
        return np.asarray((informers != OUTSIDE) & (self._object[informers] == self._object[point][:, None]))

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
        self.seen[point, light], self._traced[point, light] = ~blocked, True
        return ~blocked

    def _predict(self, point: Indices, informers: Indices, floods: bool) -> None:
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
        self._correct(point, facing, estimate, uncertain, doubted, floods)

    def _at_boundary(self, estimate: Flags, facing: Flags) -> Flags:
        """Lights next to one of other visibility; in scanlines also next to one behind the surface (8.7.4)."""
        found = np.zeros_like(estimate)
        for beside in self._neighbours.T:
            if self._variant.grid:
                found |= (estimate != estimate[:, beside]) & facing[:, beside]
            else:
                found |= (estimate != estimate[:, beside]) | ~facing[:, beside]
        return found

    def _correct(
        self, point: Indices, facing: Flags, estimate: Flags, uncertain: Flags, doubted: Flags, floods: bool
    ) -> None:
        """Trace doubted lights, and spread from each one estimated wrongly, or not at all, to its neighbours."""
        left = facing.copy()
        row, light = np.nonzero(doubted)
        while len(row):
            left[row, light] = False
            seen = self._trace(point[row], light)
            if not floods:
                return
            wrong = uncertain[row, light] | (seen != estimate[row, light])
            row, light, seen = row[wrong], light[wrong], seen[wrong]
            beside = self._neighbours[light]
            next_to = left[row[:, None], beside]
            if self._variant.sparing:
                next_to &= estimate[row[:, None], beside] != seen[:, None]
            at, k = np.nonzero(next_to)
            keys = np.unique(row[at] * estimate.shape[1] + beside[at, k])
            row, light = np.divmod(keys, estimate.shape[1])
