"""What a planar reflector shows: the scene seen by the camera mirrored at its plane (thesis M, 4.5.1).

Instead of moving the camera the world is mirrored, so that a point of the reflector and what it mirrors lie at the same
place of both pictures. The mirror picture is larger than the frame by a margin, for what lobes see beyond its edges.

Depth is reversed. In front of the reflector there is nothing to see: its plane is the near plane (Lengyel 2005, here
for reversed, infinite depth). With w the depth of a point and h its height over the plane,
    z = w - a h,  a = 1/max(n.ray) over the picture's rays of depth 1
is 1 (times w) in the plane and falls with the distance along every ray to 1 - a n.ray >= 0 at infinity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.store.contract import PlanRecord, ReflectorRecord

Floats = NDArray[np.floating]
MARGIN_PX = 16  # least margin at each edge
MOST_MARGIN = 0.1  # of the picture's longer side: what a wide lobe sees beyond is left to the probe
STEP_PX = 64  # sizes are multiples of this: six MIP levels without remainder
CLEARANCE = 1e-5  # over the reflector's highest vertex, of the largest coordinate: what lies below is not mirrored
LEAST_SHARE = 2e-4  # of the picture: a reflector that covers less is left to its probes
MOST_LEVELS = 7

MIRROR_DTYPE = np.dtype(  # Mirror in shaders/planar_mirror.wgsl
    [
        ("eye", "f4", 4), ("row_x", "f4", 4), ("row_y", "f4", 4), ("row_w", "f4", 4), ("plane", "f4", 4),
        ("across", "f4", 4), ("up", "f4", 4), ("forward", "f4", 4),
        ("size", "f4", 2), ("offset", "f4", 2), ("tolerance", "f4"), ("focal_px", "f4"), ("levels", "f4"),
        ("number", "f4"),
    ]
)  # fmt: skip
PLAN_DTYPE = np.dtype([("to_u", "f4", 4), ("to_v", "f4", 4), ("below", "f4", 4)])  # Plan in shaders/mirror_walls.wgsl


@dataclass(frozen=True)
class MirrorView:
    """One reflector of one frame.

    Attributes
    ----------
    reflector : ReflectorRecord
    plane : (4,)
        (n, d), n on the viewer's side.
    frame : NDArray of FRAME_DTYPE
        The mirrored frame: what the mirror rendering is drawn with.
    uniform : NDArray of MIRROR_DTYPE
        How places in the scene find theirs in the mirror picture.
    size : tuple of int
        Width and height of the mirror picture, pixels.
    share : float
        Of the frame that the reflector's outline covers.
    plan : NDArray of PLAN_DTYPE or None
        How rays of the mirrored frame find their place in the reflector's plan; None where no walls stand on it.
    """

    reflector: ReflectorRecord
    plane: Floats
    frame: NDArray[np.void]
    uniform: NDArray[np.void]
    size: tuple[int, int]
    share: float
    plan: NDArray[np.void] | None = None


def mirror_views(
    frame: NDArray[np.void], reflectors: Sequence[ReflectorRecord], width: int, height: int, most: int,
    widest: Mapping[str, float] | None = None,
) -> list[MirrorView]:  # fmt: skip
    """Views of the reflectors that a frame (of FRAME_DTYPE) sees, the largest first, at most `most`.

    `widest` is the largest m of an object's lobes, by its name: wide lobes need a larger mirror picture. All pictures
    of a frame have one size.
    """
    seen = []
    for reflector in reflectors:
        plane = np.asarray(reflector.plane, float)
        above = float(plane[:3] @ frame["eye"][:3] + plane[3])
        if above < 0 and reflector.two_sided:
            plane, above = -plane, -above
        in_front = above > 2 * clearance_m(reflector, frame["eye"][:3])
        share = covered_share(frame, np.asarray(reflector.outline, float)) if in_front else 0.0
        if share >= LEAST_SHARE:
            seen.append((share, reflector, plane))
    seen.sort(key=lambda one: -one[0])
    m = max((widest or {}).get(part.object, 0.0) for _, r, _ in seen[:most] for part in r.parts) if seen else 0.0
    place = _padded(frame, (width, height), m)
    views = (
        _view(frame, plane, r, share, (width, height), place, i) for i, (share, r, plane) in enumerate(seen[:most])
    )
    return [view for view in views if view is not None]


def clearance_m(reflector: ReflectorRecord, eye: Floats) -> float:
    """How far over a reflector its mirror picture begins, m: some 80 roundings of float32.

    Light from outside comes in through it, below what stands on the reflector.
    """
    return CLEARANCE * max(float(np.abs(reflector.outline).max()), float(np.abs(eye).max()))


def covered_share(frame: NDArray[np.void], outline: Floats) -> float:
    """Share of the picture that a convex polygon (P, 3) covers, 0 where it is out of view."""
    clip_from_world = frame["clip_from_world"].T.astype(float)
    points = np.column_stack([outline, np.ones(len(outline))]) @ clip_from_world[[0, 1, 3]].T
    for sides in ((0, 0, 1), (1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)):
        points = _clipped(points, points @ np.array(sides, float) - (1e-6 if sides == (0, 0, 1) else 0.0))
        if len(points) < 3:
            return 0.0
    x, y = (points[:, :2] / points[:, 2:]).T
    return float(abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 8)  # of the 2 x 2 square


def _clipped(points: Floats, height: Floats) -> Floats:
    """Part of a polygon where `height` (P,), linear over it, is positive (Sutherland & Hodgman 1974)."""
    kept = []
    for i in range(len(points)):
        j = (i + 1) % len(points)
        if height[i] > 0:
            kept.append(points[i])
        if (height[i] > 0) != (height[j] > 0):
            s = height[i] / (height[i] - height[j])
            kept.append(points[i] + s * (points[j] - points[i]))
    return np.array(kept).reshape(-1, points.shape[1])


def _view(
    frame: NDArray[np.void],
    plane: Floats,
    reflector: ReflectorRecord,
    share: float,
    size: tuple[int, int],
    place: tuple[Floats, Floats],
    number: int,
) -> MirrorView | None:
    n, d = plane[:3], float(plane[3])
    turn = np.eye(3) - 2 * np.outer(n, n)
    mirrored = np.eye(4)
    mirrored[:3, :3], mirrored[:3, 3] = turn, -2 * d * n
    wide, offset = place
    scale, shift = np.array(size) / wide, (np.array(size) + 2 * offset - wide) / wide
    clip = frame["clip_from_world"].T.astype(float) @ mirrored
    clip[0] = scale[0] * clip[0] + shift[0] * clip[3]
    clip[1] = scale[1] * clip[1] - shift[1] * clip[3]  # rows of pixels run down

    eye = turn @ frame["eye"][:3] - 2 * d * n
    across, up = turn @ frame["across"][:3] / scale[0], turn @ frame["up"][:3] / scale[1]
    forward = turn @ frame["forward"][:3] - shift[0] * across + shift[1] * up
    corners = [forward + x * across + y * up for x in (-1, 1) for y in (-1, 1)]
    steepest = max(float(corner @ n) for corner in corners)
    if steepest <= 0:
        return None
    clearance = clearance_m(reflector, frame["eye"][:3])
    near = np.array([*n, d - reflector.deviation_m - clearance])
    clip[2] = clip[3] - 0.999 / steepest * near

    seen = frame.copy()
    seen["clip_from_world"] = clip.T
    for name, vector in (("eye", eye), ("across", across), ("up", up), ("forward", forward)):
        seen[name][:3] = vector
    seen["across"][3], seen["up"][3], seen["forward"][3] = n
    seen["show"] = (1, 1, 1, 0)
    upright = n @ reflector.plane[:3] > 0  # walls stand on the side that the reflector faces
    uniform = np.zeros((), MIRROR_DTYPE)
    uniform["eye"][:3] = eye
    for row, name in ((0, "row_x"), (1, "row_y"), (3, "row_w")):
        uniform[name][:3] = clip[row, :3]
    for name in ("across", "up", "forward"):
        uniform[name][:3] = seen[name][:3]
    uniform["plane"], uniform["size"], uniform["offset"] = plane, wide, offset
    uniform["tolerance"] = reflector.deviation_m + 2 * clearance
    uniform["focal_px"] = wide[1] / 2 / np.linalg.norm(up)
    uniform["levels"], uniform["number"] = levels_of((int(wide[0]), int(wide[1]))), number
    size_px, plan = (int(wide[0]), int(wide[1])), _plan(reflector.plan, plane, eye) if upright else None
    return MirrorView(reflector, plane, seen, uniform, size_px, share, plan)


def _plan(record: PlanRecord | None, plane: Floats, eye: Floats) -> NDArray[np.void] | None:
    if record is None:
        return None
    uniform = np.zeros((), PLAN_DTYPE)
    offset = eye - np.asarray(record.corner)
    axes = (("to_u", record.across, record.columns), ("to_v", record.along, record.rows))
    for name, axis, cells in axes:
        uniform[name][:3] = np.asarray(axis) / (record.cell_m * cells)
        uniform[name][3] = (offset @ np.asarray(axis) / record.cell_m + 0.5) / cells
    uniform["below"] = -(plane[:3] @ eye + plane[3])
    return uniform


def _padded(frame: NDArray[np.void], size: tuple[int, int], m: float) -> tuple[Floats, Floats]:
    """Size of the mirror picture of a frame of `size`, and where the frame's first pixel lies in it.

    The margin holds the half-width 2 m of the widest lobe about the rays at the edges.
    """
    focal_px = size[1] / 2 / float(np.linalg.norm(frame["up"][:3]))
    margin = max(MARGIN_PX, int(min(MOST_MARGIN * max(size), 2 * m * focal_px)))
    wide = np.array([-(-(length + 2 * margin) // STEP_PX) * STEP_PX for length in size])
    return wide, (wide - np.array(size)) // 2


def levels_of(size: tuple[int, int]) -> int:
    """MIP levels of a mirror picture."""
    return min(MOST_LEVELS, int(np.log2(min(size))) - 1)
