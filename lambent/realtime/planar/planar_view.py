"""The mirrored view of a planar reflector: the scene seen by the camera mirrored at its plane (thesis M, 4.5.1).

Instead of moving the camera the world is mirrored, so that a point of the reflector and what it mirrors lie at the same
place of the frame and of the planar reflection buffer. The buffer is a window of the frame's plane: the part of it that
shows the reflector, and a margin around it for what lobes see beyond.

Depth is reversed. In front of the reflector there is nothing to see: its plane is the near plane (Lengyel 2005, here
for reversed, infinite depth). With w the depth of a point and h its height over the plane,
    z = w - a h,  a = 1/max(n.ray) over the view's rays of depth 1
is 1 (times w) in the plane and falls with the distance along every ray to 1 - a n.ray >= 0 at infinity.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.realtime.gpu.structs import MIRRORED_VIEW_DTYPE, PLAN_DTYPE, Record
from lambent.store.contract import ObjectRecord, PlanRecord, ReflectorRecord

MARGIN_PX = 16  # least margin at each edge
MOST_MARGIN = 0.1  # of the frame's longer side: what a wide lobe sees beyond the frame is left to the probe
STEP_PX = 64  # windows of large frames are multiples of this in place and size: six MIP levels without remainder
STEP_ROWS = 512  # of a large frame; the step of smaller ones halves with each halving, twice at most
CLEARANCE = 1e-5  # over the reflector's highest vertex, of the largest coordinate: what lies below is not mirrored
LEAST_SHARE = 2e-4  # of the frame: a reflector that covers less is left to its probes
MOST_LEVELS = 7
LEAST_WHOLE_PX = 2 << MOST_LEVELS
MOST_REFLECTORS = 4  # of a frame; those that cover less of it are left to their probes


@dataclass(frozen=True)
class PlanarView:
    """One reflector of one frame."""

    reflector: ReflectorRecord
    frame: Record  # record of FRAME_DTYPE that the buffer is drawn with
    uniform: Record  # of MIRRORED_VIEW_DTYPE: how places in the scene find theirs in the buffer
    size: tuple[int, int]  # width and height of the buffer, pixels
    plan: Record | None = None  # of PLAN_DTYPE: how rays find their place in the reflector's plan, if any

    def has(self, record: ObjectRecord) -> bool:
        """Whether an object is a part of the reflector."""
        return any(part.object == record.name for part in self.reflector.parts)


def planar_views(
    frame: Record, reflectors: Sequence[ReflectorRecord], width: int, height: int, most: int,
    widest: Mapping[str, float] | None = None, shares: Floats | None = None,
) -> list[PlanarView]:  # fmt: skip
    """Views of the reflectors that a frame (of FRAME_DTYPE) sees, the largest first, at most `most`.

    `widest` is the largest m of an object's lobes, by its name: wide lobes need a larger buffer. `shares` (R,) of
    the frame are covered by the reflectors, by default as much as by their outlines.
    """
    if shares is None:
        shares = np.array([covered_share(on_screen(frame, np.asarray(r.outline, float))) for r in reflectors])
    seen = []
    for reflector, share in zip(reflectors, shares, strict=True):
        if share < LEAST_SHARE:
            continue
        plane = np.asarray(reflector.plane, float)
        above = float(plane[:3] @ frame["eye"][:3] + plane[3])
        if above < 0 and reflector.two_sided:
            plane, above = -plane, -above
        if above > 2 * clearance_m(reflector, frame["eye"][:3]):
            seen.append((share, reflector, plane))
    seen.sort(key=lambda one: -one[0])
    views = []
    for number, (_, reflector, plane) in enumerate(seen[:most]):
        shown = on_screen(frame, np.asarray(reflector.outline, float))
        if not len(shown):  # its faces may lie beside its plane, within its tolerance
            continue
        m = max((widest or {}).get(part.object, 0.0) for part in reflector.parts)
        place = _window(frame, (width, height), m, shown, step_px(height))
        view = view_through(frame, plane, reflector, (width, height), place, number)
        if view is not None:
            views.append(view)
    return views


def views_of_any_camera(
    frame: Record, reflectors: Sequence[ReflectorRecord], size: tuple[int, int]
) -> list[PlanarView]:
    """Views of all reflectors, with buffers for any window; their records wait for a camera (`lambent.site`)."""
    return [
        PlanarView(
            reflector, frame.copy(), np.zeros((), MIRRORED_VIEW_DTYPE), whole_window(size),
            None if reflector.plan is None else np.zeros((), PLAN_DTYPE),
        )
        for reflector in reflectors
    ]  # fmt: skip


def whole_window(size: tuple[int, int]) -> tuple[int, int]:
    """Size of a buffer that holds any window of a frame of `size`, with MOST_LEVELS MIP levels."""
    margin = max(MARGIN_PX, int(MOST_MARGIN * max(size)))
    width, height = (max(-(-(length + 2 * margin) // STEP_PX) * STEP_PX, LEAST_WHOLE_PX) for length in size)
    return width, height


def clearance_m(reflector: ReflectorRecord, eye: Floats) -> float:
    """How far over a reflector its mirrored view begins, m: some 80 roundings of float32.

    Light from outside comes in through it, below what stands on the reflector.
    """
    return CLEARANCE * max(float(np.abs(reflector.outline).max()), float(np.abs(eye).max()))


def on_screen(frame: Record, outline: Floats) -> Floats:
    """The part (Q, 2) of a convex polygon (P, 3) that a frame shows, in its clip coordinates; (0, 2) out of view."""
    clip_from_world = frame["clip_from_world"].T.astype(float)
    points = np.column_stack([outline, np.ones(len(outline))]) @ clip_from_world[[0, 1, 3]].T
    for sides in ((0, 0, 1), (1, 0, 1), (-1, 0, 1), (0, 1, 1), (0, -1, 1)):
        points = _clipped(points, points @ np.array(sides, float) - (1e-6 if sides == (0, 0, 1) else 0.0))
        if len(points) < 3:
            return np.zeros((0, 2))
    return np.asarray(points[:, :2] / points[:, 2:])


def covered_share(shown: Floats) -> float:
    """Share of the frame that a polygon (Q, 2) of `on_screen` covers."""
    x, y = shown.T
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


def view_through(
    frame: Record, plane: Floats, reflector: ReflectorRecord, size: tuple[int, int],
    place: tuple[Floats, Floats], number: int,
) -> PlanarView | None:  # fmt: skip
    """The view of a reflector in the plane (n, d), n on the viewer's side; None where no ray of the frame meets it."""
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
    uniform = np.zeros((), MIRRORED_VIEW_DTYPE)
    uniform["eye"][:3] = eye
    for row, name in ((0, "row_x"), (1, "row_y"), (3, "row_w")):
        uniform[name][:3] = clip[row, :3]
    uniform["plane"], uniform["size"], uniform["offset"] = plane, wide, offset
    uniform["tolerance"] = reflector.deviation_m + 2 * clearance
    uniform["focal_px"] = wide[1] / 2 / np.linalg.norm(up)
    size_px, plan = (int(wide[0]), int(wide[1])), _plan(reflector.plan, plane, eye) if upright else None
    uniform["levels"], uniform["number"] = levels_of(size_px), number
    return PlanarView(reflector, seen, uniform, size_px, plan)


def _plan(record: PlanRecord | None, plane: Floats, eye: Floats) -> Record | None:
    if record is None:
        return None
    uniform = np.zeros((), PLAN_DTYPE)
    offset = eye - np.asarray(record.corner)
    for name, axis, cells in (("to_u", record.across, record.columns), ("to_v", record.along, record.rows)):
        uniform[name][:3] = np.asarray(axis) / (record.cell_m * cells)
        uniform[name][3] = (offset @ np.asarray(axis) / record.cell_m + 0.5) / cells
    uniform["below"] = -(plane[:3] @ eye + plane[3])
    return uniform


def _window(frame: Record, size: tuple[int, int], m: float, shown: Floats, step: int) -> tuple[Floats, Floats]:
    """Size of the buffer of a frame of `size`, and where the frame's first pixel lies in it.

    It holds the polygon `shown` (Q, 2), in clip coordinates, and around it the half-width 2 m of the widest lobe. A
    camera that moves moves it in steps of so many pixels, so that MIP levels do not swim.
    """
    focal_px = size[1] / 2 / float(np.linalg.norm(frame["up"][:3]))
    reach = max(MARGIN_PX, int(2 * m * focal_px))
    margin = min(reach, max(MARGIN_PX, int(MOST_MARGIN * max(size))))
    wide = np.array([-(-(length + 2 * margin) // step) * step for length in size])
    offset = (wide - np.array(size)) // 2
    places = (shown * [1, -1] + 1) / 2 * size + offset
    low = np.clip((places.min(axis=0) - reach) // step * step, 0, wide).astype(int)
    high = np.clip(-(-(places.max(axis=0) + reach) // step) * step, 0, wide).astype(int)
    return high - low, offset - low


def step_px(rows: int) -> int:
    """Pixels by which windows move and grow, for frames of so many rows. Lobes cover fewer pixels of a small frame."""
    return STEP_PX >> sum(rows < least for least in (STEP_ROWS, STEP_ROWS // 2))


def levels_of(size: tuple[int, int]) -> int:
    """MIP levels of a planar reflection buffer, all without remainder."""
    halvings = ((size[0] | size[1]) & -(size[0] | size[1])).bit_length() - 1
    return min(MOST_LEVELS, int(np.log2(min(size))) - 1, halvings + 1)
