"""Rays from points to points: packed bytes in stores, and the light gathered along rays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering import loops
from lambent.core.arrays import Floats

BYTE = 255
MOST_POINTS = 1 << 16
WEIGHT_STEPS = 4  # per octave of weights: each byte stands for one step
WEIGHT_ONE = 128  # the byte of weight 1


def packed_rays(point: NDArray[np.integer], weight: Floats) -> NDArray[np.uint8]:
    """Rays (K, R, 3) bytes: the point near each ray's end, and its weight (K, R).

    Rays that end near the same point are merged and sorted by point. Each ray stores the difference from the previous
    point in two bytes, low byte first, and its weight in one. Weights are 0 or powers of two in WEIGHT_STEPS per
    octave. Rows are padded with 0. Point numbers stay below MOST_POINTS.
    """
    rays = np.zeros((*point.shape, 3), np.uint8)
    numbers, weights = np.ascontiguousarray(point, np.int64), np.ascontiguousarray(weight, np.float32)
    loops.pack(numbers, weights, np.float32(WEIGHT_STEPS), np.float32(WEIGHT_ONE), rays)
    return rays


def weights_of_bytes() -> NDArray[np.float32]:
    """(256,) weights that the bytes of `packed_rays` stand for."""
    found = 2.0 ** ((np.arange(BYTE + 1) - WEIGHT_ONE) / WEIGHT_STEPS)
    found[0] = 0
    return np.asarray(found, np.float32)


def last_points(rays: NDArray[np.uint8]) -> NDArray[np.int64]:
    """(K,) largest point number among the `packed_rays` of each point."""
    return np.asarray((rays[..., 0] + 256 * rays[..., 1].astype(np.int64)).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Rays:
    """Where the rays of K points end; rays of one point that end near the same point are merged.

    Attributes
    ----------
    starts : (K + 1,) int64
        The rays of point k are those from starts[k] up to starts[k + 1].
    points : (N,) uint16
        The point near the end of each ray.
    weights : (N,) uint8
        Bytes, decoded by `weights_of_bytes`.
    scale : (K,) float32
        One over the number of rays of each point, rays that hit nothing included.
    """

    starts: NDArray[np.int64]
    points: NDArray[np.uint16]
    weights: NDArray[np.uint8]
    scale: NDArray[np.float32]

    @classmethod
    def of(cls, packed: NDArray[np.uint8]) -> Rays:
        """Unpack `packed_rays` (K, R, 3)."""
        size, count = packed.shape[:2]
        starts = np.append(0, np.cumsum(np.count_nonzero(packed[..., 2], axis=1))).astype(np.int64)
        points, weights = np.zeros(starts[-1], np.uint16), np.zeros(starts[-1], np.uint8)
        loops.unpack(np.ascontiguousarray(packed), starts, points, weights)
        return cls(starts, points, weights, np.full(size, 1 / max(count, 1), np.float32))

    def followed_by(self, other: Rays) -> Rays:
        """These rays, followed by those of other points."""
        starts = np.concatenate([self.starts, other.starts[1:] + self.starts[-1]])
        points, weights = (np.concatenate([self.points, other.points]), np.concatenate([self.weights, other.weights]))
        return Rays(starts, points, weights, np.concatenate([self.scale, other.scale]))

    def of_first(self, count: int) -> Rays:
        """The rays of the first `count` points."""
        return Rays(self.starts[: count + 1], self.points, self.weights, self.scale[:count])

    def thinned(self, most: int, light: Floats) -> Rays:
        """A sample of at most `most` rays per point, drawn by weight and by exitance `light` (n,), and reweighted."""
        chosen, weights = np.zeros((len(self.scale), most), np.int64), np.zeros((len(self.scale), most), np.uint8)
        steps, one = np.float32(WEIGHT_STEPS), np.float32(WEIGHT_ONE)
        given = self.starts, self.points, self.weights, weights_of_bytes(), np.asarray(light, np.float32)
        loops.thin(*given, steps, one, chosen, weights)
        kept = weights > 0
        starts = np.append(0, np.cumsum(kept.sum(axis=1))).astype(np.int64)
        return Rays(starts, self.points[chosen[kept]], weights[kept], self.scale)


def gathered(rays: Rays, exitance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Indirect irradiance (K, G, 4) at points with `rays`, from exitance (n, G, 4).

    Rays are cosine-distributed, so irradiance is pi times the mean radiance, exitance/pi.
    """
    given = rays.starts, rays.points, rays.weights, weights_of_bytes(), rays.scale
    count, groups = exitance.shape[:2]
    if groups == 1:
        return np.asarray(loops.gather_one(*given, exitance))
    padded = np.pad(exitance, ((0, 0), (0, -groups % 4), (0, 0))) if groups % 4 else exitance
    fours = (padded[:, first : first + 4].reshape(count, 16) for first in range(0, groups, 4))
    found = [loops.gather_four(*given, four).reshape(-1, 4, 4) for four in fours]
    return np.ascontiguousarray(found[0] if groups == 4 else np.concatenate(found, axis=1)[:, :groups])
