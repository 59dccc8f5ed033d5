"""Points within closed, opaque objects: light does not reach them, and nothing is baked there."""

from __future__ import annotations

import copy
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.bake.tiles import slices
from lambent.bake.tracing.rays import leaving, vectors
from lambent.bake.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry import triangle_normals
from lambent.core.sequences import cosine_hemisphere, hammersley
from lambent.scenes.geometry import merge
from lambent.scenes.scene import Mesh, Scene, SceneObject

RAYS = 16
EMBEDDED_SHARE = 0.25  # share of a point's rays that hit the inner side of a solid
POINTS_AT_ONCE = 1 << 16


def is_closed(mesh: Mesh) -> bool:
    """Whether every edge joins exactly two faces of opposite direction, after merging coincident vertices."""
    _, vertex = np.unique(mesh.positions, axis=0, return_inverse=True)
    corners = vertex.reshape(-1)[mesh.faces.astype(np.int64)]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    code = edges[:, 0] * (len(vertex) + 1) + edges[:, 1]
    back = edges[:, 1] * (len(vertex) + 1) + edges[:, 0]
    return len(np.unique(code)) == len(code) and bool(np.array_equal(np.sort(code), np.sort(back)))


def _closed(scene: Scene) -> set[str]:
    """Names of closed objects; parts count as closed if their whole is."""
    wholes: dict[str, list[SceneObject]] = {}
    for o in scene.objects:
        wholes.setdefault(scene.parts.get(o.name, o.name), []).append(o)
    return {o.name for parts in wholes.values() if is_closed(merge(o.mesh for o in parts)) for o in parts}


class SolidTest:
    """Tests points for lying within closed, opaque objects, by the inner sides that their rays hit.

    With `sheets`, open objects have inner sides too: those that their normals point away from.
    """

    def __init__(self, builder: SceneBuilder, scene: Any, *, sheets: bool = False) -> None:
        materials, textures = builder.scene.materials, builder.scene.textures
        open_ = {n for n, m in materials.items() if m.transmits} | {n for n, t in textures.items() if t.opacity}
        closed = {o.name for o in builder.scene.objects} if sheets else _closed(builder.scene)
        solid = [o.name in closed and o.material not in open_ for o in builder.scene.objects]
        self._scene, self._numbers = scene, builder.object_numbers()
        self._solid = mi.UInt32(np.array(solid, np.uint32))
        # Normals by triangle, because an interaction would be compiled for each mesh of the scene.
        counts = [len(o.mesh.faces) for o in builder.scene.objects]
        self._first_face = mi.UInt32(np.cumsum([0, *counts])[:-1].astype(np.uint32))
        self._flat = vectors(mi.Vector3f, triangle_normals(builder.scene.corners))

    def within(self, scene: Any) -> SolidTest:
        """The same test, with the same closed objects, in another Mitsuba scene of the same builder."""
        other = copy.copy(self)
        other._scene = scene
        return other

    def embedded(self, positions: Floats, normals: Floats) -> Flags:
        """(n,) whether points (n, 3) on surfaces of normals (n, 3) lie within a solid."""
        found = np.zeros(len(positions), bool)
        for mine in slices(len(positions), POINTS_AT_ONCE):
            found[mine] = self.inner_share(positions[mine], normals[mine]) > EMBEDDED_SHARE
        return found

    def inner_share(self, positions: Floats, normals: Floats) -> Floats:
        """Share (n,) of rays, spread about the normals of a few points, that hit an inner side first."""
        thread = dr.arange(mi.UInt32, len(positions) * RAYS)
        at, k = thread // RAYS, thread % RAYS
        p = dr.gather(mi.Point3f, vectors(mi.Point3f, positions), at)
        n = dr.gather(mi.Vector3f, vectors(mi.Vector3f, normals), at)
        local = vectors(mi.Vector3f, cosine_hemisphere(hammersley(RAYS)))
        direction = mi.Frame3f(n).to_world(dr.gather(mi.Vector3f, local, k))
        hit = self._scene.ray_intersect_preliminary(leaving(self._scene, p, n, direction), True)
        met = hit.is_valid()
        number = dr.gather(mi.UInt32, self._numbers, dr.reinterpret_array(mi.UInt32, hit.shape), met)
        face = dr.gather(mi.UInt32, self._first_face, number, met) + hit.prim_index
        outwards = dr.gather(mi.Vector3f, self._flat, face, met)
        solid = dr.gather(mi.UInt32, self._solid, number, met) > 0
        inner = met & solid & (dr.dot(outwards, direction) > 0)
        return np.array(dr.block_sum(dr.select(inner, 1.0, 0.0), RAYS)) / RAYS
