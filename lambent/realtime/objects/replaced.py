"""Replaces an object that has a light field of its volume by another mesh (thesis R, "Object Replacement").

Points of the volume serve any object in it: the mesh gets a sample map, its diffuse light comes from the irradiance of
the maps, and the sun's shadow map is drawn with it. The old object's baked shadows and reflections on other objects
remain. The mesh neither reflects nor shadows itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.light_field import LightField
from lambent.baked.light_fields.nearest_points import nearest_points
from lambent.baked.probes.irradiance import IrradianceVolume
from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.directions import normalize
from lambent.core.plain import triple
from lambent.realtime.light.baked import BakedScene
from lambent.realtime.objects.triangle_blocks import corners_in_blocks, filled_blocks, places_in_blocks
from lambent.scenes.geometry import subdivided
from lambent.scenes.replacement import FIELD, Replacement, fitted
from lambent.scenes.scene import Mesh
from lambent.store.contract import ObjectRecord, SceneRecord

FINER = 2  # texels of the sample map per texel of the light map
MOST_FACES = 60_000  # after the mesh is cut into smaller triangles


def with_replacements(scene: BakedScene, replacements: Sequence[Replacement]) -> BakedScene:
    """The scene with other meshes in the volumes of light fields.

    Raises
    ------
    UserError
        If an object or material does not exist, an object has no light field of a volume, or a mesh has no triangles.
    """
    for one in replacements:
        scene = _replaced(scene, one)
    return scene


def _replaced(scene: BakedScene, one: Replacement) -> BakedScene:
    record, field = _checked(scene, one)
    low, high = (np.array(side) for side in record.bounds)
    mesh = subdivided(fitted(one.mesh, low, high), _spacing_m(field) / 2, MOST_FACES)
    corners = mesh.faces.reshape(-1)
    positions, normals = mesh.positions[corners], normalize(mesh.normals[corners].astype(float))
    room = _Room.beside(scene, len(mesh.faces))
    lit = IrradianceVolume(field)
    uv2 = room.uv2_of_blocks()
    own = replace(field, **room.sample_map(mesh, field), volume=True)
    first = len(scene.positions)
    bounds = tuple(triple(side) for side in mesh.bounds)
    changes = {"material": one.material or record.material, "bounds": bounds}
    faces, objects = _spliced(scene, record, first + np.arange(len(corners)).reshape(-1, 3), changes)
    uv = None if scene.uv is None else np.concatenate([scene.uv, mesh.uv[corners]])

    def light(side: int) -> Floats:
        return lit.at(positions.astype(float), side * normals).reshape(-1, 3, 3)

    return replace(
        scene,
        record=_without_reflector(scene.record.model_copy(update={"objects": objects}), record.name),
        positions=np.concatenate([scene.positions, positions]),
        normals=np.concatenate([scene.normals, normals.astype(np.float32)]),
        tangents=np.concatenate([scene.tangents, mesh.tangents[corners]]),
        uv2=np.concatenate([room.moved(scene.uv2), uv2]),
        uv=uv,
        faces=faces,
        irradiance=room.joined(scene.irradiance, light(1)),
        irradiance_back=room.joined(scene.irradiance_back, light(-1)),
        noise=room.joined(scene.noise),
        noise_back=room.joined(scene.noise_back),
        dominant_direction=room.joined(scene.dominant_direction),
        probe_share=room.joined(scene.probe_share),
        light_fields={name: room.moved_field(f) for name, f in scene.light_fields.items()} | {record.name: own},
        sunlit=None,
        lamps=None,
        groups=None,
        replaced=True,
    )


def _checked(scene: BakedScene, one: Replacement) -> tuple[ObjectRecord, LightField]:
    objects = {o.name: o for o in scene.record.objects}
    record = objects[known("object", one.object, objects, field=FIELD)]
    if one.material is not None:
        known("material", one.material, scene.record.materials, field=FIELD)
    field = scene.light_fields.get(one.object)
    if field is None or not field.volume:
        hint = "give it `light_field = { volume = true }` in the scene, and bake"
        raise UserError("the object has no light field of a volume", field=FIELD, got=one.object, hint=hint)
    if not len(one.mesh.faces):
        raise UserError("the mesh has no triangles", field=FIELD, got=one.object)
    return record, field


def _spacing_m(field: LightField) -> float:
    """Median distance of points from their nearest neighbours."""
    if len(field.points) < 2:
        return 1.0
    from scipy.spatial import cKDTree

    return float(np.median(cKDTree(field.points).query(field.points, 2)[0][:, 1]))


def _spliced(
    scene: BakedScene, record: ObjectRecord, faces: NDArray[np.integer], changes: dict[str, Any]
) -> tuple[NDArray[np.uint32], tuple[ObjectRecord, ...]]:
    """The scene's faces with an object's faces replaced, and all objects with their new ranges."""
    end = record.first_face + record.face_count
    parts = scene.faces[: record.first_face], faces.astype(np.uint32), scene.faces[end:]
    more = len(faces) - record.face_count
    objects = []
    for o in scene.record.objects:
        if o.name == record.name:
            objects.append(o.model_copy(update={**changes, "face_count": len(faces)}))
        else:
            objects.append(o.model_copy(update={"first_face": o.first_face + more * (o.first_face >= end)}))
    return np.concatenate(parts), tuple(objects)


def _without_reflector(record: SceneRecord, name: str) -> SceneRecord:
    """The record without the planar reflectors that contain the object."""
    kept = tuple(r for r in record.reflectors if all(part.object != name for part in r.parts))
    return record.model_copy(update={"reflectors": kept})


@dataclass(frozen=True)
class _Room:
    """Room for blocks of `count` triangles below a light map of `old` (rows, columns), in a new one of `size`."""

    old: tuple[int, int]
    size: tuple[int, int]
    count: int

    @classmethod
    def beside(cls, scene: BakedScene, count: int) -> _Room:
        old = (1, 1) if scene.irradiance is None else (scene.irradiance.shape[0], scene.irradiance.shape[1])
        across = max(-(-old[1] // 2), int(np.ceil(np.sqrt(count))))
        return cls(old, (old[0] + 2 * -(-count // across), 2 * across), count)

    @property
    def _across(self) -> int:
        return self.size[1] // 2

    def moved(self, uv2: Floats) -> NDArray[np.float32]:
        """Coordinates (V, 2) of the old light map, moved to the new one."""
        share = np.array([self.old[1] / self.size[1], self.old[0] / self.size[0]])
        return np.asarray(uv2 * share, np.float32)

    def uv2_of_blocks(self) -> NDArray[np.float32]:
        """Light-map coordinates (3 count, 2) of the triangles' corners."""
        texels = corners_in_blocks(self.count, self._across) + np.array([0, self.old[0]])
        return np.asarray(texels.reshape(-1, 2) / self.size[::-1], np.float32)

    def joined(self, old: Floats | None, corners: Floats | None = None) -> Floats | None:
        """A light map (H, W, ...) enlarged by the blocks, filled from the triangles' values at `corners`."""
        if old is None:
            return None
        whole = np.zeros((*self.size, *old.shape[2:]), old.dtype)
        whole[: old.shape[0], : old.shape[1]] = old
        if corners is not None:
            whole[self.old[0] :] = filled_blocks(corners, self._across)
        return whole

    def moved_field(self, field: LightField) -> LightField:
        """A light field with its sample map moved from the old light map."""
        rows, columns = (round(g * new / old) for g, new, old in zip(field.grid, self.size, self.old, strict=True))
        return replace(field, grid=(rows, columns))

    def sample_map(self, mesh: Mesh, field: LightField) -> dict[str, Any]:
        """Fields of a `LightField` for the sample map of the mesh."""
        weights = places_in_blocks(FINER)
        texels = weights.shape[0]
        x, n = (
            np.einsum("rck,fkx->frcx", weights, values[mesh.faces].astype(float), optimize=True)
            for values in (mesh.positions, mesh.normals)
        )
        near = nearest_points(x.reshape(-1, 3), normalize(n.reshape(-1, 3)), field.points)
        rows = (self.size[0] - self.old[0]) // 2
        blocks = np.full((rows * self._across, texels, texels, 4), near[0], np.uint16)
        blocks[: self.count] = near.reshape(-1, texels, texels, 4)
        grid = FINER * self.size[0], FINER * self.size[1]
        shape = rows * texels, self._across * texels, 4
        entries = blocks.reshape(rows, self._across, texels, texels, 4).transpose(0, 2, 1, 3, 4).reshape(shape)
        return {"sample_map": entries, "corner": (FINER * self.old[0], 0), "grid": grid}
