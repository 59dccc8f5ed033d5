"""Where the points of a light field stand: off the surface, in the open.

A point is dropped where its place on the surface lies within a solid, or where nearly all it sees is the inner side of
something, as of a vessel that is not closed. Where something stands close above the surface, a point stands half way
to it, and is dropped in gaps too narrow for that.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.light_fields.sampling import CANDIDATES, SurfacePoints, densities, spread_evenly, thinned
from lambent.baking.running.tiles import slices
from lambent.baking.tracing.rays import distances, leaving, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.baking.tracing.solids import SolidTest
from lambent.core.arrays import Flags, Floats
from lambent.core.errors import UserError
from lambent.core.geometry.sequences import cosine_hemisphere, hammersley
from lambent.core.geometry.triangles import triangle_areas
from lambent.scenes.scene import Mesh

SPACINGS, DIAGONALS = 1 / 2, 1 / 16  # the usual offset is the lesser of these shares of the points' spacing and size
NARROW = 1 / 8  # of the offset: less is left out in gaps
INNER_SHARE = 0.75  # of a point's rays that meet inner sides of opaque things: then it is within one
RAYS = 16  # from each candidate, for how near other things are
POINTS_AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Placed(SurfacePoints):
    """Points off a surface, with the normals below them, and how far off they are, less in gaps."""

    offset_m: float = 0.0


class Placing:
    """Places points over objects of a scene."""

    def __init__(self, builder: SceneBuilder, scene: Any) -> None:
        self._scene = scene
        self._solids, self._sheets = SolidTest(builder, scene), SolidTest(builder, scene, sheets=True)

    def points(self, mesh: Mesh, count: int, seed: int, offset_m: float | None = None) -> Placed:
        """`count` points over a mesh, or less where little of it is in the open.

        Raises
        ------
        UserError
            Where nothing of it is.
        """
        rng = np.random.default_rng(seed)
        area_m2 = float(triangle_areas(mesh.corners).sum())
        offset = usual_offset_m(mesh, count) if offset_m is None else offset_m
        places = spread_evenly(mesh, CANDIDATES * count, rng)
        places, heights = self.in_the_open(places, offset)
        if not len(places):
            raise UserError("its surface is hidden everywhere", hint="leave out its light field")
        density = densities(places, area_m2, count, self.free_m(places))
        kept = thinned(places, density, count, rng)
        chosen = places[kept]
        return Placed(chosen.positions + heights[kept, None] * chosen.normals, chosen.normals, offset_m=offset)

    def in_the_open(self, places: SurfacePoints, offset_m: float) -> tuple[SurfacePoints, Floats]:
        """The places above which there is room, and how far off the surface (n,) points may stand."""
        if not len(places):
            return places, np.zeros(0)
        above = distances(self._scene, leaving(self._scene, places.positions, places.normals, places.normals))
        heights = np.minimum(offset_m, above / 2)
        open_ = (heights >= NARROW * offset_m) & ~self.is_within(places)
        return places[open_], heights[open_]

    def is_within(self, places: SurfacePoints) -> Flags:
        """(n,) whether surface points are within something."""
        solid = self._solids.embedded(places.positions, places.normals)
        return np.asarray(solid | (self._sheets.inner_share(places.positions, places.normals) > INNER_SHARE))

    def free_m(self, places: SurfacePoints) -> Floats:
        """(n, RAYS) how far cosine distributed rays travel from surface points, metres; infinite into the open."""
        local = vectors(mi.Vector3f, cosine_hemisphere(hammersley(RAYS)))
        found = np.zeros((len(places), RAYS))
        for mine in slices(len(places), POINTS_AT_ONCE):
            some = places[mine]
            thread = dr.arange(mi.UInt32, len(some) * RAYS)
            p = dr.gather(mi.Point3f, vectors(mi.Point3f, some.positions), thread // RAYS)
            n = dr.gather(mi.Vector3f, vectors(mi.Vector3f, some.normals), thread // RAYS)
            w = mi.Frame3f(n).to_world(dr.gather(mi.Vector3f, local, thread % RAYS))
            found[mine] = distances(self._scene, leaving(self._scene, p, n, w)).reshape(-1, RAYS)
        return found


def usual_offset_m(mesh: Mesh, count: int) -> float:
    """How far off a mesh `count` points stand where nobody says it."""
    spacing = float(np.sqrt(triangle_areas(mesh.corners).sum() / count))
    return min(SPACINGS * spacing, DIAGONALS * float(np.linalg.norm(np.ptp(mesh.positions, axis=0))))
