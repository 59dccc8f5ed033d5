"""Points within closed, opaque objects: light does not reach them, and nothing is baked there."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.running.tiles import slices
from lambent.baking.tracing.rays import leaving, vectors
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.sequences import cosine_hemisphere, hammersley
from lambent.core.geometry.triangles import triangle_normals
from lambent.scenes.geometry import merge
from lambent.scenes.mesh import Mesh, batches_of
from lambent.scenes.scene import Scene, SceneObject

RAYS = 16
EMBEDDED_SHARE = 0.25  # share of a point's rays that hit the inner side of a solid
POINTS_AT_ONCE = 1 << 16


def closed(meshes: Sequence[Mesh]) -> Flags:
    """(N,) whether every edge joins exactly two faces of opposite direction, after merging coincident vertices."""
    return np.concatenate([np.zeros(0, bool), *(_closed_at_once(meshes[some]) for some in batches_of(meshes))])


def _closed_at_once(meshes: Sequence[Mesh]) -> Flags:
    counts = [len(mesh.positions) for mesh in meshes]
    positions = np.concatenate([mesh.positions for mesh in meshes]) + np.float32(0)  # -0 is 0
    rows = np.column_stack([np.repeat(np.arange(len(meshes)), counts).astype(np.float64), positions])
    order = np.lexsort(rows.T[::-1])
    is_new = np.append(True, (rows[order[1:]] != rows[order[:-1]]).any(axis=1))
    vertex = np.empty(len(order), np.int64)
    vertex[order] = np.cumsum(is_new)
    faces = np.concatenate([mesh.faces + first for mesh, first in zip(meshes, np.cumsum(counts) - counts, strict=True)])
    corners = vertex[faces.astype(np.int64)]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    owner = np.tile(np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes]), 3)
    has_length = edges[:, 0] != edges[:, 1]
    edges, owner = edges[has_length], owner[has_length]
    code, back = (edges @ weights for weights in ((len(order) + 1, 1), (1, len(order) + 1)))
    order = np.argsort(code, kind="stable")
    twice = order[1:][code[order[1:]] == code[order[:-1]]]
    found = np.ones(len(meshes), bool)
    found[owner[twice]] = False
    found[owner[~np.isin(back, code)]] = False
    return found


def _closed(scene: Scene) -> set[str]:
    """Names of closed objects; parts count as closed if their whole is."""
    wholes: dict[str, list[SceneObject]] = {}
    for o in scene.objects:
        wholes.setdefault(scene.parts.get(o.name, o.name), []).append(o)
    meshes = [parts[0].mesh if len(parts) == 1 else merge(o.mesh for o in parts) for parts in wholes.values()]
    return {o.name for parts, one in zip(wholes.values(), closed(meshes), strict=True) if one for o in parts}


class SolidTest:
    """Tests points for lying within closed, opaque objects, by the inner sides that their rays hit.

    With `sheets`, open objects have inner sides too: those that their normals point away from.
    """

    def __init__(self, builder: SceneBuilder, scene: Any, *, sheets: bool = False) -> None:
        materials, textures = builder.scene.materials, builder.scene.textures
        open_ = {n for n, m in materials.items() if m.transmits} | {n for n, t in textures.items() if t.opacity}
        closed = {o.name for o in builder.scene.objects} if sheets else _closed(builder.scene)
        solid = [o.name in closed and o.material not in open_ for o in builder.scene.objects]
        self._scene, self._numbers = scene, builder.numbers
        self._solid = mi.UInt32(np.array(solid, np.uint32))
        # Normals by triangle, because an interaction would be compiled for each mesh of the scene.
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
        number = self._numbers.at(hit, met)
        face = self._numbers.faces(hit, met)
        outwards = dr.gather(mi.Vector3f, self._flat, face, met)
        solid = dr.gather(mi.UInt32, self._solid, number, met) > 0
        inner = met & solid & (dr.dot(outwards, direction) > 0)
        return np.array(dr.block_sum(dr.select(inner, 1.0, 0.0), RAYS)) / RAYS
