"""Warnings about a scene; none of them stops a bake."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.core.geometry.directions import Floats
from lambent.core.geometry.triangles import area_vectors, cross_2d, triangle_areas
from lambent.scenes.first_view import content_bounds
from lambent.scenes.mesh import boxes_of
from lambent.scenes.scene import Mesh, Scene

LARGE, SMALL = 500.0, 0.05  # metres
ALL_LIGHT = 1.001  # diffuse reflectance; fits and conversions round
# Of the light in a closed room of this reflectance, 27 % pass more surfaces than a path. A white room lost 9 % of its
# light although its furniture absorbed the rest. Paint reflects .9, white plastic in glTF .96.
WHITE = 0.98
# Half of the objects of rooms in metres are smaller than 2 m, of rooms in centimetres than 200.
THING_M, THINGS = 20.0, 3


def validate(scene: Scene) -> list[str]:
    """Warnings about a scene: its unit, faults of its meshes, missing light or cameras."""
    notes = size_warnings(scene)
    for o in scene.objects:
        notes += [f"{o.name}: {what}" for what in mesh_faults(o.mesh)]
        if o.material not in scene.materials:
            notes.append(f"{o.name}: its material {o.material} is not defined")
        textures = scene.textures.get(o.material)
        if textures is not None and (textures.normal is not None or textures.direction is not None):
            mirrored = mirrored_share(o.mesh)
            if mirrored > 0.01:
                notes.append(
                    f"{o.name}: uv are mirrored on {mirrored:.0%} of its area: its normal map is flipped there"
                )
    if scene.environment is None and not scene.lights and not any(any(o.emission) for o in scene.objects):
        notes.append("no light")
    if not scene.cameras:
        notes.append("no camera")
    return notes


def size_warnings(scene: Scene) -> list[str]:
    """A warning if the extent of what stands in the scene, or of most objects, suggests another unit than the metre.

    Grounds and skies that dwarf all else may be as large as they like.
    """
    low, high = scene.bounds
    if (high - low).max() > LARGE:
        low, high = content_bounds(scene.objects)
    extent = float((high - low).max())
    thing = float(np.median(np.ptp(boxes_of([o.mesh for o in scene.objects]), axis=1).max(axis=1)))
    question = "is its unit the metre? (scene.toml can scale a geometry file)"
    if not SMALL <= extent <= LARGE:
        return [f"the scene is {_metres(extent)} m large: {question}"]
    if thing > THING_M and len(scene.objects) >= THINGS:
        return [f"half of the objects are larger than {_metres(thing)} m: {question}"]
    return []


def reflectance_warnings(scene: Scene) -> list[str]:
    """A warning for each material of an object whose diffuse terms reflect almost all light, or more than arrives."""
    used = dict.fromkeys(o.material for o in scene.objects)
    shares = {name: float(np.max(np.add(m.kd, m.kt_d))) for name in used if (m := scene.materials.get(name))}
    white = "closed rooms of it become too dark, because paths end before their light does"
    return [
        f"material {name}: reflects more light than arrives ({share:.3g}): light grows from surface to surface"
        if share > ALL_LIGHT
        else f"material {name}: reflects almost all light ({share:.3g}): {white}"
        for name, share in shares.items()
        if share >= WHITE
    ]


def _metres(extent: float) -> str:
    """Three digits, without powers of ten below a million metres."""
    return f"{extent:.3g}" if not 1000 <= extent < 1e6 else f"{float(f'{extent:.3g}'):.0f}"


def mesh_faults(mesh: Mesh) -> list[str]:
    """Faults of one mesh: nonfinite, degenerate, not unit, wound against its normals, non-manifold, without uv."""
    arrays = (mesh.positions, mesh.normals, mesh.tangents, mesh.uv)
    if not all(np.isfinite(a).all() for a in arrays):
        return ["holds values that are not finite"]
    notes = []
    area = triangle_areas(mesh.corners)
    if not (area > 0).all():
        notes.append(f"{int((area <= 0).sum())} triangles have no area")
    n, t = mesh.normals.astype(float), mesh.tangents.astype(float)
    if np.abs(np.linalg.norm(n, axis=-1) - 1).max() > 1e-3:
        notes.append("normals do not have unit length")
    if np.abs(np.linalg.norm(t, axis=-1) - 1).max() > 1e-3 or np.abs(np.sum(n * t, axis=-1)).max() > 1e-3:
        notes.append("tangents do not have unit length or are not perpendicular to the normals")
    flipped = float(area[_facing(mesh) < 0].sum() / max(area.sum(), 1e-30))
    if flipped > 0.01:
        notes.append(f"{flipped:.0%} of its area faces away from its normals")
    shared = int((_edge_uses(mesh) > 2).sum())
    if shared:
        notes.append(f"non-manifold: {shared} edges belong to more than two triangles")
    if np.ptp(mesh.uv, axis=0).max() == 0:
        notes.append("has no uv")
    return notes


def mirrored_share(mesh: Mesh) -> float:
    """Share of the area on which v runs against n x t, as on halves that share one texture."""
    a, b, c = (mesh.uv[mesh.faces[:, i]].astype(float) for i in range(3))
    turn, area = cross_2d(b - a, c - a), triangle_areas(mesh.corners)
    return float(area[turn < 0].sum() / max(area.sum(), 1e-30))


def _facing(mesh: Mesh) -> Floats:
    """Per triangle, positive if its winding agrees with its normals."""
    return np.asarray(np.sum(area_vectors(mesh.corners) * mesh.normals[mesh.faces].sum(axis=1), axis=-1))


def _edge_uses(mesh: Mesh) -> NDArray[np.integer]:
    """Number of triangles at each edge; vertices at the same position count as one."""
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    corners = place.reshape(-1)[mesh.faces]
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=-1)
    return np.unique(edges, axis=0, return_counts=True)[1]
