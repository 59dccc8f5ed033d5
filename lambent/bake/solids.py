"""What lies within solid matter: there is no light, and nothing to bake."""

from __future__ import annotations

import copy
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake.mitsuba_scene import SceneBuilder
from lambent.bake.vectors import vectors
from lambent.core.sequences import cosine_hemisphere, hammersley
from lambent.scenes.scene import Mesh, Scene, SceneObject

Array = NDArray[np.floating]
RAYS = 16
EMBEDDED_SHARE = 0.25  # of a point's rays that end on the inner side of a solid
POINTS_AT_ONCE = 1 << 16


def is_closed(mesh: Mesh) -> bool:
    """Whether every edge joins exactly two faces of opposite direction, once coincident vertices are one."""
    _, vertex = np.unique(mesh.positions, axis=0, return_inverse=True)
    corners = vertex.reshape(-1)[mesh.faces.astype(np.int64)]
    edges = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    edges = edges[edges[:, 0] != edges[:, 1]]
    code = edges[:, 0] * (len(vertex) + 1) + edges[:, 1]
    back = edges[:, 1] * (len(vertex) + 1) + edges[:, 0]
    return len(np.unique(code)) == len(code) and bool(np.array_equal(np.sort(code), np.sort(back)))


def _closed(scene: Scene) -> set[str]:
    """Names of closed objects; parts are closed where their whole is."""
    wholes: dict[str, list[SceneObject]] = {}
    for o in scene.objects:
        wholes.setdefault(scene.parts.get(o.name, o.name), []).append(o)
    return {o.name for parts in wholes.values() if is_closed(_joined(parts)) for o in parts}


def _joined(parts: list[SceneObject]) -> Mesh:
    meshes = [o.mesh for o in parts]
    if len(meshes) == 1:
        return meshes[0]
    first = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])[:-1]
    faces = np.concatenate([mesh.faces + f for mesh, f in zip(meshes, first, strict=True)]).astype(np.uint32)
    arrays = (np.concatenate([getattr(m, n) for m in meshes]) for n in ("positions", "normals", "tangents", "uv"))
    return Mesh(*arrays, faces)


class SolidTest:
    """Tells points within closed, opaque objects, by the inner sides their rays meet."""

    def __init__(self, builder: SceneBuilder, scene: Any) -> None:
        materials, textures = builder.scene.materials, builder.scene.textures
        open_ = {n for n, m in materials.items() if m.transmits} | {n for n, t in textures.items() if t.opacity}
        closed = _closed(builder.scene)
        solid = [o.name in closed and o.material not in open_ for o in builder.scene.objects]
        self._scene, self._numbers = scene, builder.object_numbers()
        self._solid = mi.UInt32(np.array(solid, np.uint32))

    def within(self, scene: Any) -> SolidTest:
        """The same test in another Mitsuba scene of the same builder; what is closed is not asked again."""
        other = copy.copy(self)
        other._scene = scene
        return other

    def embedded(self, positions: Array, normals: Array) -> NDArray[np.bool_]:
        """For points (n, 3) on surfaces of normals (n, 3): whether they lie within a solid. (n,) bool."""
        return np.concatenate(
            [np.zeros(0, bool)]
            + [
                self._share_of_inner_sides(positions[i : i + POINTS_AT_ONCE], normals[i : i + POINTS_AT_ONCE])
                > EMBEDDED_SHARE
                for i in range(0, len(positions), POINTS_AT_ONCE)
            ]
        )

    def _share_of_inner_sides(self, positions: Array, normals: Array) -> Array:
        n = len(positions)
        thread = dr.arange(mi.UInt32, n * RAYS)
        at, k = thread // RAYS, thread % RAYS
        si = dr.zeros(mi.SurfaceInteraction3f, n * RAYS)
        si.p = dr.gather(mi.Point3f, vectors(mi.Point3f, positions), at)
        si.n = mi.Normal3f(dr.gather(mi.Vector3f, vectors(mi.Vector3f, normals), at))
        local = vectors(mi.Vector3f, cosine_hemisphere(hammersley(RAYS)))
        direction = mi.Frame3f(si.n).to_world(dr.gather(mi.Vector3f, local, k))
        hit = self._scene.ray_intersect(si.spawn_ray(direction), mi.RayFlags.Minimal, True)
        number = dr.gather(mi.UInt32, self._numbers, dr.reinterpret_array(mi.UInt32, hit.shape), hit.is_valid())
        solid = dr.gather(mi.UInt32, self._solid, number, hit.is_valid()) > 0
        inner = hit.is_valid() & solid & (dr.dot(hit.n, direction) > 0)
        return np.array(dr.block_sum(dr.select(inner, 1.0, 0.0), RAYS)) / RAYS
