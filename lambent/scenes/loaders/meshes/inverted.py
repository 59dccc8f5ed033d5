"""Closed solids whose faces look inwards: lamps shine into themselves, and all around counts as within a solid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.triangles import area_vectors
from lambent.core.plain import first_of
from lambent.scenes.mesh import Mesh, boxes_of
from lambent.scenes.scene import DirectionalLight, Scene


def with_solids_outwards(scene: Scene) -> Scene:
    """The scene with such solids turned outwards, and a warning that names them.

    One around another object, a light or a camera is a room, and stays.
    """
    inwards = [i for i, o in enumerate(scene.objects) if looks_inwards(o.mesh)]
    if not inwards:
        return scene
    boxes, within = boxes_of([o.mesh for o in scene.objects]), _places(scene)
    middles = boxes.mean(axis=1)
    turned = [i for i in inwards if not _around(boxes[i], np.concatenate([np.delete(middles, i, 0), within]))]
    if not turned:
        return scene
    objects = list(scene.objects)
    for i in turned:
        objects[i] = replace(objects[i], mesh=_turned(objects[i].mesh))
    names = first_of([objects[i].name for i in turned])
    warning = f"the faces of {names} look inwards: turned outwards"
    return replace(scene, objects=tuple(objects), warnings=(*scene.warnings, warning))


def looks_inwards(mesh: Mesh) -> bool:
    """Whether a mesh is closed, and its normals point into the volume within."""
    corners = mesh.corners
    vectors = area_vectors(corners)
    vectors *= np.sign((vectors * mesh.normals[mesh.faces].sum(axis=1)).sum(axis=1))[:, None]
    middle = corners.mean(axis=1)
    if (vectors * (middle - middle.mean(axis=0))).sum() >= 0:
        return False
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    ends = place.reshape(-1)[mesh.faces].astype(np.int64)
    edges = np.sort(np.concatenate([ends[:, [0, 1]], ends[:, [1, 2]], ends[:, [2, 0]]]), axis=1)
    return bool((np.unique(edges, axis=0, return_counts=True)[1] == 2).all())


def _places(scene: Scene) -> Floats:
    """(N, 3) where cameras and lights are."""
    lights = [light.position for light in scene.lights if not isinstance(light, DirectionalLight)]
    return np.array([*(camera.position for camera in scene.cameras), *lights], float).reshape(-1, 3)


def _around(box: Floats, points: Floats) -> bool:
    inside: Flags = ((points > box[0]) & (points < box[1])).all(axis=1)
    return bool(inside.any())


def _turned(mesh: Mesh) -> Mesh:
    return replace(mesh, normals=-mesh.normals, faces=np.ascontiguousarray(mesh.faces[:, ::-1]))
