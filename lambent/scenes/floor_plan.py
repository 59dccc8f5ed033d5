"""Floor plans of planar reflectors: which points of the plane lie beyond a wall on the reflector's edge.

A mirrored eye below a floor sees the room only up to the foot of its walls; beyond them it looks outside, where there
is nothing for the floor to mirror. Beyond the edge of a table it sees what the table mirrors. A plan distinguishes both
kinds of edge along the true outline, bays included: a grid of signed distances, positive on the reflector and beyond
its open edges, negative beyond a wall. A point off the reflector is beyond a wall if something stands at the nearest
point of the edge. Floors extend under skirtings and into walls: a strip along the edge that the foot of an object cuts
off is not part of the reflector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, ranges
from lambent.core.geometry.directions import basis
from lambent.core.geometry.triangles import cross_2d

CELLS = 600  # at most, per size of the reflector, the square root of its area
FEWEST_CELLS = 32  # for a scene with very many reflectors
CELLS_OF_ALL = 6 * CELLS**2  # limit for all plans of one scene together: about 2 s
MOST_CELLS = 2048  # along one side
SPREAD = 4.0  # ratio of the bounding rectangle's area to the reflector's above which cells are coarser
HEIGHTS = (0.01, 0.03)  # of the cuts that look for walls, above the reflector, relative to its size
FOOT = 0.0005  # of the cut that looks for the feet of objects
SHARE = 0.6  # of a stretch of edge, and of the heights, at which a wall must stand
BORDER = 4  # cells around the reflector; beyond, the plan is clamped
NEAR = 0.02  # relative to the size: largest distance from an edge to a wall on it
WINDOW = 0.05  # relative to the size: the stretch of edge for SHARE
STEPS = 16  # resolution of distances: steps per cell
FINE = 4  # subcells along each axis of a cell, for the share covered by the reflector
AROUND = 0.25  # relative to a reflector's longer side: more than NEAR, and than BORDER of FEWEST_CELLS
MARGIN = 0.25  # cells before a wall that count as beyond it: light from outside may be a thousand times as bright


@dataclass(frozen=True)
class FloorPlan:
    """Signed distances (rows, columns) int8 in cells / STEPS at corner + (column across + row along) cell_m.

    `across` and `along` (3,) are unit vectors in the plane.
    """

    corner: Floats
    across: Floats
    along: Floats
    cell_m: float
    distance: NDArray[np.int8]


def shared_cells(areas_m2: Sequence[float]) -> list[float]:
    """Cells per size for the plan of every reflector of a scene, limited to CELLS_OF_ALL in total.

    Each reflector has CELLS if that suffices; otherwise the large ones keep them, and all others have cells of one size
    in metres.
    """
    areas = np.asarray(areas_m2, float)

    def cells(per_m2: float) -> Floats:
        return np.sqrt(np.clip(areas * per_m2, FEWEST_CELLS**2, CELLS**2))

    low, high = 0.0, CELLS**2 / max(float(areas.min(initial=1.0)), 1e-12)
    for _ in range(60):
        middle = high if (cells(high) ** 2).sum() <= CELLS_OF_ALL else (low + high) / 2
        low, high = (middle, high) if (cells(middle) ** 2).sum() <= CELLS_OF_ALL else (low, middle)
    return [float(count) for count in cells(low)]


class Surroundings:
    """All triangles (F, 3, 3) of a scene, searched by bounding spheres: a reflector meets few of them."""

    def __init__(self, corners: Floats) -> None:
        self._corners = corners
        self._middles = corners.mean(axis=1)
        self._radii = np.sqrt(((corners - self._middles[:, None]) ** 2).sum(axis=2)).max(axis=1, initial=0)

    def over(self, faces: Floats, normal: Floats) -> Floats:
        """(N, 3, 3) triangles that may affect the plan of a reflector of triangles (K, 3, 3), and few others."""
        flat = faces @ np.stack(basis(normal), axis=1)
        low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
        height = self._middles @ normal - float((faces @ normal).mean())
        found = np.flatnonzero((height + self._radii > 0) & (height - self._radii < max(HEIGHTS) * _size(flat)))
        at, reach = self._middles[found] @ np.stack(basis(normal), axis=1), self._radii[found, None]
        margin = AROUND * (high - low).max()
        found = found[((at + reach > low - margin) & (at - reach < high + margin)).all(axis=1)]
        return np.asarray(self._corners[found])


def may_have_walls(faces: Floats, normal: Floats, corners: Floats) -> bool:
    """Whether a triangle crosses or nearly crosses a plane at one of HEIGHTS above a reflector's bounding box."""
    axes = np.stack(basis(normal), axis=1)
    flat = faces @ axes
    size = _size(flat)
    low, high = flat.reshape(-1, 2).min(axis=0) - NEAR * size, flat.reshape(-1, 2).max(axis=0) + NEAR * size
    height = corners @ normal - float((faces @ normal).mean())
    for over in HEIGHTS:
        cut = _cut(height - over * size, corners) @ axes
        if ((cut.max(axis=1) >= low) & (cut.min(axis=1) <= high)).all(axis=1).any():
            return True
    return False


def _size(flat: Floats) -> float:
    """Root of the area of triangles (K, 3, 2)."""
    return float(np.sqrt(np.abs(cross_2d(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])).sum() / 2))


def floor_plan(faces: Floats, normal: Floats, corners: Floats, cells: float = CELLS) -> FloorPlan | None:
    """Plan of a reflector of the triangles `faces` (K, 3, 3), in a plane of unit normal (3,); None without walls.

    `corners` (F, 3, 3) are the triangles of the scene, `cells` the number of cells per size of the reflector. A wall
    stands on an edge where triangles cross the planes at both HEIGHTS above the reflector, within NEAR of the edge.
    """
    from lambent.core.geometry.plan_cells import filled  # compiled, and needed only for scenes with reflectors

    across, along = basis(normal)
    axes = np.stack([across, along], axis=1)
    flat = faces @ axes
    size = _size(flat)
    low, high = flat.reshape(-1, 2).min(axis=0), flat.reshape(-1, 2).max(axis=0)
    sides = high - low
    cell = max(size, float(np.sqrt(sides.prod() / SPREAD))) / cells
    cell = max(cell, float(sides.max()) / MOST_CELLS)
    corner = low - BORDER * cell
    columns, rows = (np.ceil(sides / cell).astype(int) + 2 * BORDER).tolist()
    level = float((faces @ normal).mean())
    height = corners @ normal - level
    around = (height.max(axis=1) > FOOT * size) & (height.min(axis=1) < max(HEIGHTS) * size)
    height, corners = height[around], corners[around]
    share = np.zeros((rows, columns))
    for over in HEIGHTS:
        standing = _drawn((_cut(height - over * size, corners) @ axes - corner) / cell, (rows, columns))
        if standing.any():
            share += (scipy.ndimage.distance_transform_edt(~standing) <= NEAR * size / cell) / len(HEIGHTS)
    if not share.any():
        return None
    fine = filled(((flat - corner) / cell + 0.5) * FINE - 0.5, rows * FINE, columns * FINE)
    foot = _cut(height - FOOT * size, corners)
    standing = _drawn(((foot @ axes - corner) / cell + 0.5) * FINE - 0.5, fine.shape)
    fine = _without_strips(fine, standing, NEAR * size / cell * FINE)
    share_of = fine.reshape(rows, FINE, columns, FINE).mean(axis=(1, 3))
    covered = share_of >= 0.5
    edge = covered & ~_inner(covered)
    window = 2 * round(WINDOW * size / cell) + 1
    along_edge = scipy.ndimage.uniform_filter(edge.astype(float), window, mode="constant")
    walled = scipy.ndimage.uniform_filter(share * edge, window, mode="constant") >= SHARE * np.maximum(along_edge, 1e-9)
    if not (walled & edge).any():
        return None
    beyond, nearest = scipy.ndimage.distance_transform_edt(~covered, return_indices=True)
    past = ~covered & walled[tuple(nearest)]
    before, wall = scipy.ndimage.distance_transform_edt(~past, return_indices=True)
    outwards, inwards = _edge_from(share_of, covered), _edge_from(1 - share_of, ~covered)
    signed = np.where(past, outwards[tuple(nearest)] - beyond, before - inwards[tuple(wall)])
    steps = np.clip(np.floor((signed - MARGIN) * STEPS), -127, 127).astype(np.int8)
    return FloorPlan(corner @ axes.T + level * normal, across, along, cell, steps)


def _without_strips(covered: Flags, standing: Flags, width: float) -> Flags:
    """`covered` without strips along its edge, up to `width` cells wide on average, that `standing` cuts off.

    A strip has at most width/2 cells per cell of its border.
    """
    if not (covered & standing).any():
        return covered
    left = covered & ~standing
    pieces, count = scipy.ndimage.label(left)
    cells, border, at_edge = (
        np.bincount(pieces[some], minlength=count + 1) for some in (left, left & ~_inner(left), left & ~_inner(covered))
    )
    strips = (at_edge > 0) & (2 * cells <= width * border)
    return np.asarray(covered & ~strips[pieces])


def _inner(cells: Flags) -> Flags:
    """Filled cells whose four neighbours are filled too; `binary_erosion` takes ten times as long."""
    found = np.zeros_like(cells)
    found[1:-1, 1:-1] = cells[1:-1, 1:-1] & cells[:-2, 1:-1] & cells[2:, 1:-1] & cells[1:-1, :-2] & cells[1:-1, 2:]
    return found


def _edge_from(share: Floats, covered: Flags) -> Floats:
    """Cells from the centre of a covered cell to the edge, by its covered share and its neighbours'."""
    around = scipy.ndimage.maximum_filter(
        np.where(covered, 0.0, share), footprint=np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]])
    )
    return np.asarray(np.where(covered, share - 0.5 + around, 0.0))


def _cut(height: Floats, corners: Floats) -> Floats:
    """Segments (S, 2, 3) where triangles cross the plane of height 0; `height` (F, 3) is that of their corners."""
    above = height > 0
    crossing = above.any(axis=1) & ~above.all(axis=1)
    height, corners, above = height[crossing], corners[crossing], above[crossing]
    odd = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))  # alone on its side
    rows = np.arange(len(odd))
    ends = []
    for other in ((odd + 1) % 3, (odd + 2) % 3):
        share = height[rows, odd] / (height[rows, odd] - height[rows, other])
        ends.append(corners[rows, odd] + share[:, None] * (corners[rows, other] - corners[rows, odd]))
    return np.stack(ends, axis=1)


def _drawn(segments: Floats, shape: tuple[int, int]) -> Flags:
    """Cells that segments (S, 2, 2) of (column, row) pass, in steps of half a cell."""
    standing = np.zeros(shape, bool)
    last = np.array(shape[::-1]) - 1
    near = ((segments.max(axis=1) >= 0) & (segments.min(axis=1) <= last)).all(axis=1)
    segments = segments[near]
    count = np.ceil(2 * np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)).astype(int).clip(0, 8 * max(shape)) + 1
    number = np.repeat(np.arange(len(count)), count)
    share = ranges(count) / np.maximum(count[number] - 1, 1)
    at = np.round(segments[number, 0] + share[:, None] * (segments[number, 1] - segments[number, 0])).astype(int)
    at = at[((at >= 0) & (at <= last)).all(axis=1)]
    standing[at[:, 1], at[:, 0]] = True
    return standing
