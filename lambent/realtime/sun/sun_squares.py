"""Where the shadow map of the sun lies: at most four squares across its light, the smallest first.

The first holds what cameras see, the last the whole scene. A sun wider than WIDE_RAD is cut into four discs, which have
squares of their own: with those of one, blockers at several distances leave wrong penumbras.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import basis, normalize
from lambent.core.geometry.triangles import points_on_triangles, triangle_areas

SIDE, MOST_SQUARES, RATIO = 2048, 4, 4.0  # texels along a square; squares; times as large as the one before, about
POINTS = 1 << 15  # of surfaces, that tell where cameras look
LARGEST, MOST_CUTS = 1.0, 24  # a triangle's radius, by its distance from the nearest eye; how often one is cut
MIDDLE = 0.94  # of what they see lies in the first square, along each axis
RIM_PX = 4  # texels around the scene
WIDE_RAD = 0.0175  # a degree; the sun of the sky has .27
PARTS = 4  # of a wide sun
ASIDE = np.sqrt(3 / 8)  # of the radius, to the middles of discs of half of it: all four have the whole's variance


@dataclass(frozen=True)
class SunSquares:
    """Where a shadow map lies: axes (3, 3) across, down and towards the sun, depths from `low_m` over `span_m`.

    squares (n, 3): corner along across and down, and side, all metres. `tangent` is that of the angular radius of the
    disc that is seen in them.
    """

    axes: Floats
    low_m: float
    span_m: float
    squares: Floats
    tangent: float = 0.0

    def clip_from_world(self, square: Floats) -> Floats:
        """(4, 4) of one square; depth 1 is nearest to the sun."""
        across, down, towards = self.axes
        u, v, side = square
        found = np.zeros((4, 4))
        found[0] = [*(2 / side * across), -2 * u / side - 1]
        found[1] = [*(-2 / side * down), 2 * v / side + 1]
        found[2] = [*(towards / self.span_m), -self.low_m / self.span_m]
        found[3, 3] = 1
        return found


def parts_of(direction: Sequence[float], radius_rad: float, corners: Floats, eyes: Floats) -> tuple[SunSquares, ...]:
    """The squares of each part of a sun's disc: one, or those of a wide sun, equally many for each."""
    towards, tangent = np.asarray(direction, float), float(np.tan(radius_rad))
    if radius_rad <= WIDE_RAD:
        return (replace(squares_of(towards, corners, eyes), tangent=tangent),)
    axes = np.stack(basis(towards))
    turns = (np.arange(PARTS) + 0.5) * 2 * np.pi / PARTS
    middles = towards + ASIDE * tangent * np.column_stack([np.cos(turns), np.sin(turns)]) @ axes
    found = [squares_of(middle, corners, eyes) for middle in normalize(middles)]
    most = max(len(part.squares) for part in found)
    return tuple(
        replace(
            part, squares=np.pad(part.squares, ((0, most - len(part.squares)), (0, 0)), "edge"), tangent=tangent / 2
        )
        for part in found
    )


def squares_of(direction: Sequence[float] | Floats, corners: Floats, eyes: Floats, side: int = SIDE) -> SunSquares:
    """The squares for triangles (F, 3, 3) and the places of cameras (n, 3), for maps of `side` texels."""
    towards = np.asarray(direction, float)
    across, down = basis(towards)
    axes = np.stack([across, down, towards])
    places = corners.reshape(-1, 3) @ axes.T
    low, high = places.min(axis=0), places.max(axis=0)
    size = float(max(np.max(high[:2] - low[:2]), 1e-3)) * side / (side - 2 * RIM_PX)
    whole = np.array([*((low + high)[:2] / 2 - size / 2), size])
    low_seen, high_seen = _seen(corners, eyes, axes[:2])
    about, width = (low_seen + high_seen) / 2, float(np.max(high_seen - low_seen))
    squares = [whole]
    if 0 < width < size / 1.5:
        count = min(MOST_SQUARES - 1, int(np.ceil(np.log(size / width) / np.log(RATIO) - 0.1)))
        sizes = width * (size / width) ** (np.arange(count) / count)
        squares = [np.array([*(about - one / 2), one]) for one in sizes] + squares
    rim = 1e-4 * float(high[2] - low[2]) + 1e-3
    return SunSquares(axes, float(low[2]) - rim, float(high[2] - low[2]) + 2 * rim, np.array(squares))


def _seen(corners: Floats, eyes: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Low and high corner (2,), along two axes (2, 3), of cameras and the MIDDLE of the surfaces around them.

    Surfaces count by area over the cube of the distance, of which far ones hold a bounded share however large they are;
    nothing counts as nearer than 1 m. Without cameras there is no more than nothing to see.
    """
    if not len(eyes) or not triangle_areas(corners).sum() > 0:
        return np.zeros(2), np.zeros(2)
    cut = _cut_about(eyes, corners)
    area = triangle_areas(cut)
    rng = np.random.default_rng(0)
    share = np.sqrt(area) / _distances(cut.mean(axis=1), eyes)
    share /= share.sum()
    face = rng.choice(len(area), size=POINTS, p=share)
    points = points_on_triangles(cut, face, rng)
    weight = area[face] / share[face] / _distances(points, eyes) ** 3
    ends = (1 - MIDDLE) / 2, (1 + MIDDLE) / 2
    low, high = np.transpose(
        [np.quantile(at, ends, weights=weight, method="inverted_cdf") for at in (points @ axes.T).T]
    )
    own = eyes @ axes.T
    return np.minimum(low, own.min(axis=0)), np.maximum(high, own.max(axis=0))


def _cut_about(eyes: Floats, corners: Floats) -> Floats:
    """Triangles (n, 3, 3), those larger than their distance from the nearest eye cut into four until none is.

    Points drawn on a triangle of kilometres would miss the metres around an eye.
    """
    done = []
    for _ in range(MOST_CUTS):
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=-1).max(axis=1)
        long = radius > LARGEST * np.maximum(_distances(middle, eyes) - radius, 1)
        done.append(corners[~long])
        if not long.any():
            break
        a, b, c = np.moveaxis(corners[long], 1, 0)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        cut = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(quarter, axis=1) for quarter in cut])
    else:
        done.append(corners)
    return np.concatenate(done)


def _distances(points: Floats, eyes: Floats) -> Floats:
    """Distances (n,) of points (n, 3) from the nearest eye, at least 1 m."""
    return np.asarray(np.maximum(scipy.spatial.cKDTree(eyes).query(points)[0], 1.0))
