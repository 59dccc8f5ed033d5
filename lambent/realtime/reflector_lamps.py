"""Lamps of planar reflectors on the GPU, for shaders/planar_lamps.wgsl."""

from __future__ import annotations

import time
from collections.abc import Iterable
from functools import cached_property
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.document import Lobe
from lambent.realtime.lamp_maps import PlaneFrame, lamp_map_steps
from lambent.realtime.layouts import Layouts
from lambent.realtime.planar_view import PlanarView
from lambent.realtime.plane_lamps import PlaneLamp, lamps_of, over
from lambent.realtime.slices import SLICE_S
from lambent.realtime.structs import PLANE_LAMPS_DTYPE, Record

OUT_FROM = 0.5  # of a lamp's radius, as in shaders/planar_lamps.wgsl: narrower lobes leave all lamps in the buffer
FADE_PX = 24.0  # as in shaders/planar.wgsl
GRID = 5  # viewpoints along each side of a reflector for the shapes of lamps


class ReflectorLamps:
    """One or more lamps over one side of a reflector. `draw_map` draws their map, which takes seconds."""

    def __init__(
        self, layouts: Layouts, resources: Any, lamps: list[PlaneLamp], outline: Floats, plane: Floats,
        clearance_m: float,
    ) -> None:  # fmt: skip
        self.lamps = lamps
        self.objects = list(dict.fromkeys(lamp.object for lamp in lamps))  # in the order of their channels
        self._layouts, self._resources = layouts, resources
        self._frame = PlaneFrame.about(outline, plane[:3])
        self.map: Any = None  # buffer of the solid angles visible from the reflector's points
        self._drawing = lamp_map_steps(layouts, resources, lamps, self._frame, plane, clearance_m)
        width, height = self._frame.size
        columns, rows = np.meshgrid(np.linspace(0, width, GRID), np.linspace(0, height, GRID))
        grid = self._frame.points(columns, rows).reshape(-1, 3)
        self._spreads = [lamp.spread_from(grid) for lamp in lamps]
        self._radii_m = [float(np.sqrt(2 * np.linalg.eigvalsh(spread)[-1])) for spread in self._spreads]
        far_m = [float(np.linalg.norm(grid - lamp.centre, axis=1).max()) for lamp in lamps]
        self._least_radius_rad = min(radius / far for radius, far in zip(self._radii_m, far_m, strict=True))

    def serve(self, lobes: Iterable[Lobe], widest_factor: float = 1.0) -> bool:
        """Whether a lamp may leave the buffer for one of the lobes, widened by at most `widest_factor`."""
        widest = max((float(np.sqrt(lobe.mx * lobe.my)) for lobe in lobes), default=0.0) * widest_factor
        return widest > OUT_FROM * self._least_radius_rad

    def are_within(self, view: PlanarView) -> bool:
        """Whether any lamp is within a mirrored view, hidden or not."""
        return any(inside_share(view, lamp.middles) > 0 for lamp in self.lamps)

    def draw_map(self, seconds: float = float("inf")) -> bool:
        """Continue the map for about `seconds`; returns whether it is complete."""
        end = time.perf_counter() + seconds
        while self.map is None and time.perf_counter() < end:
            try:
                next(self._drawing)
            except StopIteration as done:
                self.map = self._layouts.buffer("STORAGE", done.value)
        return self.map is not None

    def record(self, view: PlanarView) -> Record:
        """Record of PLANE_LAMPS_DTYPE for one frame."""
        data = np.zeros((), PLANE_LAMPS_DTYPE)
        data["to_column"], data["to_row"] = self._frame.texel_rows()
        data["size"][:2] = self._frame.size
        shown = {item.record.name: item.emission for item in self._resources.objects}  # in the current mix of light
        for k, (lamp, spread, radius_m) in enumerate(zip(self.lamps, self._spreads, self._radii_m, strict=True)):
            data["centres"][k] = *lamp.centre, inside_share(view, lamp.middles)
            data["spreads"][3 * k : 3 * k + 3, :3] = spread
            data["emissions"][k] = *np.array(shown[lamp.object]) / self._resources.scene.unit, radius_m
            data["channels"][k, self.objects.index(lamp.object)] = 1
        return data


class LampsOverReflectors:
    """The lamps over each side of every reflector of a scene, found when a frame first shows the reflector."""

    def __init__(self, layouts: Layouts, resources: Any) -> None:
        """`resources` is a `SceneResources`."""
        self._layouts, self._resources = layouts, resources
        self._found: dict[Any, ReflectorLamps | None] = {}
        self._under_way: list[ReflectorLamps] = []  # maps requested by frames that do not wait

    @cached_property
    def _lamps(self) -> list[PlaneLamp]:
        return lamps_of(self._resources.scene)

    def of(self, view: PlanarView) -> ReflectorLamps | None:
        """The lamps of a view's reflector, None without any."""
        plane = np.asarray(view.uniform["plane"], float)
        key = view.reflector.outline, bool(plane[:3] @ np.asarray(view.reflector.plane[:3]) > 0)
        if key not in self._found:
            clearance_m = float(view.uniform["tolerance"])
            lamps = over(self._lamps, view.reflector, plane, clearance_m)
            outline = np.asarray(view.reflector.outline, float)
            given = self._layouts, self._resources, lamps, outline, plane, clearance_m
            self._found[key] = ReflectorLamps(*given) if lamps else None
        return self._found[key]

    def have_map(self, lamps: ReflectorLamps, *, waits: bool) -> bool:
        """Whether the lamps' map is complete; with `waits`, draw it now, else `follow` draws it between frames."""
        if lamps.draw_map(float("inf") if waits else 0.0):
            return True
        if lamps not in self._under_way:
            self._under_way.append(lamps)
        return False

    def follow(self) -> None:
        """Continue the requested maps for a time slice; the picture changes when one is complete."""
        if self._under_way and self._under_way[0].draw_map(SLICE_S):
            self._under_way.pop(0)
            self._resources.light_version += 1


def inside_share(view: PlanarView, places: Floats) -> float:
    """Share, 0 to 1, of positions (K, 3) within a mirrored view, faded out beyond its edges (planar.wgsl)."""
    uniform = view.uniform
    q = places - uniform["eye"][:3]
    x, y, depth = (q @ uniform[name][:3].astype(float) for name in ("row_x", "row_y", "row_w"))
    clip = np.stack([x, -y], axis=-1) / np.maximum(depth, 1e-6)[:, None]
    texel = (clip + 1) / 2 * uniform["size"]
    beyond = np.maximum(np.maximum(-texel, texel - uniform["size"]), 0).max(axis=-1)
    share = np.clip(1 - beyond / FADE_PX, 0, 1)
    return float(np.mean(np.where(depth > 1e-6, share * share * (3 - 2 * share), 0)))
