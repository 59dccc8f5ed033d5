"""Mitsuba's shapes of a scene's objects.

Mitsuba spends time on every shape of a scene, whenever it builds it and at each call through a shape. Hence, in scenes
of more than MOST_ALONE objects, objects of one BSDF become one shape, unless they emit light; otherwise every object is
a shape, with its name as id.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.bsdfs.material_plugin import TANGENT_ATTRIBUTE
from lambent.baking.tracing.lights.luminaire_emitters import opening_emitter
from lambent.core.arrays import Flags, Floats, Indices, ranges
from lambent.scenes.geometry import merge, transformed
from lambent.scenes.scene import IesLight, Scene, SceneObject

UV2_ATTRIBUTE = "vertex_uv2"
MOST_ALONE = 1000  # objects


class Shapes:
    """The shapes of a scene's objects with BSDFs (mi.BSDF by object), and light map coordinates `uv2` by object name.

    Attributes
    ----------
    meshes : dict of mi.Mesh
        The shape of each object, by name.
    numbers : ObjectNumbers
    """

    def __init__(self, scene: Scene, bsdfs: Sequence[Any], uv2: Mapping[str, Floats]) -> None:
        objects = scene.objects
        self._objects, self._lights, self._bsdfs, self._uv2 = objects, scene.lights, bsdfs, uv2
        alone, groups = len(objects) <= MOST_ALONE, dict[object, list[int]]()
        for i, (o, bsdf) in enumerate(zip(objects, bsdfs, strict=True)):
            groups.setdefault(
                i if alone or any(o.emission) or o.luminaire is not None else (id(bsdf), o.name in uv2), []
            ).append(i)
        self._groups = [np.array(group) for group in groups.values()]
        self._shapes = [self._shape(group) for group in self._groups]
        of_object = {i: mesh for mesh, group in zip(self._shapes, self._groups, strict=True) for i in group.tolist()}
        self.meshes = {o.name: of_object[i] for i, o in enumerate(objects)}
        counts = np.array([len(o.mesh.faces) for o in objects])
        sizes = [int(counts[group].sum()) for group in self._groups]
        begins = np.cumsum([0, *sizes])[:-1].tolist()
        self._values = list(range(len(objects))) if len(self._groups) == len(objects) else begins
        self.numbers = ObjectNumbers(counts, self._groups)
        self.numbers.add(self._shapes, self._values)

    def set_bsdfs(self, bsdfs: Sequence[Any]) -> bool:
        """Give objects these BSDFs (mi.BSDF by object); False, and no change, if objects of one shape would differ."""
        if any(len({id(bsdfs[i]) for i in group}) > 1 for group in self._groups):
            return False
        self._bsdfs = bsdfs
        for shape, group in zip(self._shapes, self._groups, strict=True):
            shape.set_bsdf(bsdfs[group[0]])
        return True

    def without(self, names: Collection[str]) -> list[Any]:
        """mi.Mesh of all objects but the named ones."""
        found, parted = [], []
        for i, group in enumerate(self._groups):
            kept = np.array([not names or self._objects[number].name not in names for number in group])
            if kept.any():
                found.append(self._shapes[i] if kept.all() else self._shape(group, kept))
                parted += [] if kept.all() else [(found[-1], self._values[i])]
        if parted:
            self.numbers.add(*zip(*parted, strict=True))
        return found

    def _shape(self, group: Indices, kept: Flags | None = None) -> Any:
        """One mi.Mesh of a group of objects. Triangles of objects that are not `kept` (G,) shrink to points."""
        objects = [self._objects[i] for i in group]
        first, bsdf = objects[0], self._bsdfs[group[0]]
        if len(objects) == 1:
            return mesh_of(first, bsdf, self._uv2.get(first.name), self._luminaire(first))
        mesh = merge(o.mesh for o in objects)
        if kept is not None:
            stays = np.repeat(kept, [len(o.mesh.faces) for o in objects])
            mesh = replace(mesh, faces=np.where(stays[:, None], mesh.faces, mesh.faces[:, :1]))
        uv2 = np.concatenate([self._uv2[o.name] for o in objects]) if first.name in self._uv2 else None
        return mesh_of(replace(first, mesh=mesh), bsdf, uv2)

    def _luminaire(self, o: SceneObject) -> IesLight | None:
        light = None if o.luminaire is None else self._lights[o.luminaire]
        return light if isinstance(light, IesLight) else None


class ObjectNumbers:
    """Finds the object that a ray has hit, and the triangle, as indices in the scene.

    Parameters
    ----------
    counts : (N,) int
        Triangles of each object.
    groups : list of (G,) int
        The objects of each shape, in the order of its triangles.
    """

    def __init__(self, counts: Indices, groups: Sequence[Indices]) -> None:
        first_face = np.cumsum(counts) - counts
        self._alone = all(len(group) == 1 for group in groups)
        self._first_face = mi.UInt32(first_face.astype(np.uint32))
        if not self._alone:
            order = np.concatenate(groups)
            face = np.repeat(first_face[order], counts[order]) + ranges(counts[order])
            self._object = mi.UInt32(np.repeat(order, counts[order]).astype(np.uint32))
            self._face = mi.UInt32(face.astype(np.uint32))
        self._by_shape: Any = np.zeros(0, np.uint32)

    def add(self, meshes: Sequence[Any], values: Sequence[int]) -> None:
        """Add shapes (mi.Mesh), with their object, or, if there are groups, their first triangle in that order."""
        shapes = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(mesh))[0]) for mesh in meshes]
        table = np.zeros(max([len(self._by_shape), *(shape + 1 for shape in shapes)]), np.uint32)
        table[: len(self._by_shape)] = np.array(self._by_shape)
        table[shapes] = values
        self._by_shape = mi.UInt32(table)

    def at(self, hit: Any, active: Any) -> Any:
        """Objects (mi.UInt32) of interactions, preliminary or not."""
        found = self._of_shape(hit, active)
        return found if self._alone else dr.gather(mi.UInt32, self._object, found + hit.prim_index, active)

    def faces(self, hit: Any, active: Any) -> Any:
        """Triangles (mi.UInt32) of interactions, preliminary or not."""
        found = self._of_shape(hit, active)
        if self._alone:
            return dr.gather(mi.UInt32, self._first_face, found, active) + hit.prim_index
        return dr.gather(mi.UInt32, self._face, found + hit.prim_index, active)

    def _of_shape(self, hit: Any, active: Any) -> Any:
        return dr.gather(mi.UInt32, self._by_shape, dr.reinterpret_array(mi.UInt32, hit.shape), active)


def mesh_of(o: SceneObject, bsdf: Any, uv2: Floats | None = None, luminaire: IesLight | None = None) -> Any:
    """mi.Mesh of an object with a BSDF, its brushing direction and, if given, its light map coordinates.

    It emits the light of a `luminaire`, or its own.
    """
    props = mi.Properties()
    props["mesh_bsdf"] = bsdf
    if luminaire is not None:
        props["mesh_emitter"] = opening_emitter(luminaire)
    elif any(o.emission):
        radiance = {"type": "rgb", "value": list(o.emission)}
        props["mesh_emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    vertices, faces = len(o.mesh.positions), len(o.mesh.faces)
    mesh = mi.Mesh(o.name, vertices, faces, props=props, has_vertex_normals=True, has_vertex_texcoords=True)
    parameters, shape = mi.traverse(mesh), o.mesh if o.moved is None else transformed(o.mesh, np.array(o.moved))
    for name, values in (("positions", shape.positions), ("normals", shape.normals), ("texcoords", shape.uv)):
        parameters[f"vertex_{name}"] = mi.Float(values.astype(np.float32).ravel())
    parameters["faces"] = mi.UInt32(o.mesh.faces.astype(np.uint32).ravel())
    parameters.update()
    mesh.add_attribute(TANGENT_ATTRIBUTE, 3, o.mesh.tangents.astype(np.float32).ravel())
    if uv2 is not None:
        padded = np.concatenate([uv2, np.zeros((vertices, 1))], axis=1)
        mesh.add_attribute(UV2_ATTRIBUTE, 3, padded.astype(np.float32).ravel())
    return mesh
