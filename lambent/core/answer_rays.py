"""Rays from points to points, as stores pack them and as light is gathered along them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core import answer_loops as loops
from lambent.core.arrays import Floats

BYTE = 255
MOST_POINTS = 1 << 16
WEIGHT_STEPS = 4  # of weights in an octave: each byte stands for one
WEIGHT_ONE = 128  # the byte of weight 1


def packed_rays(point: NDArray[np.integer], weight: Floats) -> NDArray[np.uint8]:
    """Rays (K, R, 3) bytes: the point near which each ends, and its weight (K, R).

    Rays that end near the same point are one, in the order of points, each of which is the step from the one before,
    low byte first. Weights are 0 or powers of two by WEIGHT_STEPS. Rows are filled up with 0. Points are less than
    MOST_POINTS.
    """
    rays = np.zeros((*point.shape, 3), np.uint8)
    numbers, weights = np.ascontiguousarray(point, np.int64), np.ascontiguousarray(weight, np.float32)
    loops.pack(numbers, weights, np.float32(WEIGHT_STEPS), np.float32(WEIGHT_ONE), rays)
    return rays


def weights_of_bytes() -> NDArray[np.float32]:
    """(256,) the weights that bytes of `packed_rays` stand for."""
    found = 2.0 ** ((np.arange(BYTE + 1) - WEIGHT_ONE) / WEIGHT_STEPS)
    found[0] = 0
    return np.asarray(found, np.float32)


def last_points(rays: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(K,) the largest number of a point near which the `packed_rays` of each end."""
    return np.asarray((rays[..., 0] + 256 * rays[..., 1].astype(np.int64)).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Rays:
    """Where the rays of K points end: those of a point that end near the same one are one.

    Attributes
    ----------
    starts : (K + 1,) int64
        The rays of point k go from starts[k] on to starts[k + 1].
    points : (N,) uint16
        The point near which each ends.
    weights : (N,) uint8
        `weights_of_bytes`.
    scale : (K,) float32
        One over the number of each point's rays, those included that end nowhere.
    """

    starts: NDArray[np.int64]
    points: NDArray[np.uint16]
    weights: NDArray[np.uint8]
    scale: NDArray[np.float32]

    @classmethod
    def of(cls, packed: NDArray[np.uint8]) -> Rays:
        """Of `packed_rays` (K, R, 3)."""
        size, count = packed.shape[:2]
        starts = np.append(0, np.cumsum(np.count_nonzero(packed[..., 2], axis=1))).astype(np.int64)
        points, weights = np.zeros(starts[-1], np.uint16), np.zeros(starts[-1], np.uint8)
        loops.unpack(np.ascontiguousarray(packed), starts, points, weights)
        return cls(starts, points, weights, np.full(size, 1 / max(count, 1), np.float32))

    def followed_by(self, other: Rays) -> Rays:
        """These rays, and those of other points after them."""
        starts = np.concatenate([self.starts, other.starts[1:] + self.starts[-1]])
        points, weights = (np.concatenate([self.points, other.points]), np.concatenate([self.weights, other.weights]))
        return Rays(starts, points, weights, np.concatenate([self.scale, other.scale]))

    def of_first(self, count: int) -> Rays:
        """The rays of the first `count` points."""
        return Rays(self.starts[: count + 1], self.points, self.weights, self.scale[:count])

    def thinned(self, most: int, light: Floats) -> Rays:
        """At most so many rays of each point, chosen by weight and by the exitance `light` (n,), that stand for all."""
        chosen, weights = np.zeros((len(self.scale), most), np.int64), np.zeros((len(self.scale), most), np.uint8)
        steps, one = np.float32(WEIGHT_STEPS), np.float32(WEIGHT_ONE)
        given = self.starts, self.points, self.weights, weights_of_bytes(), np.asarray(light, np.float32)
        loops.thin(*given, steps, one, chosen, weights)
        kept = weights > 0
        starts = np.append(0, np.cumsum(kept.sum(axis=1))).astype(np.int64)
        return Rays(starts, self.points[chosen[kept]], weights[kept], self.scale)


def gathered(rays: Rays, exitance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Indirect irradiance (K, G, 4) at points with such rays, from exitance (n, G, 4).

    Rays are cosine distributed: it is pi times the mean of the radiance exitance/pi.
    """
    given = rays.starts, rays.points, rays.weights, weights_of_bytes(), rays.scale
    count, groups = exitance.shape[:2]
    if groups == 1:
        return np.asarray(loops.gather_one(*given, exitance))
    padded = np.pad(exitance, ((0, 0), (0, -groups % 4), (0, 0))) if groups % 4 else exitance
    fours = (padded[:, first : first + 4].reshape(count, 16) for first in range(0, groups, 4))
    found = [loops.gather_four(*given, four).reshape(-1, 4, 4) for four in fours]
    return np.ascontiguousarray(found[0] if groups == 4 else np.concatenate(found, axis=1)[:, :groups])
