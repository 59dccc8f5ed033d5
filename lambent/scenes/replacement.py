"""Meshes from files that replace a scene's objects (thesis R, "Object Replacement")."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.scenes.geometry import merge, transformed
from lambent.scenes.scene import Mesh, Scene

FIELD = "--replace"
FORM = "OBJECT=FILE or OBJECT=FILE,MATERIAL"


@dataclass(frozen=True)
class Replacement:
    """A mesh that replaces an object, with its material or another one of the scene."""

    object: str
    mesh: Mesh
    material: str | None = None


def parse_replacements(texts: Sequence[str]) -> tuple[Replacement, ...]:
    """Parse replacements from texts OBJECT=FILE or OBJECT=FILE,MATERIAL; all objects of a file become one mesh.

    Raises
    ------
    UserError
        If a text is malformed, an object is named twice, or a file is unreadable or has no triangles.
    """
    found: list[Replacement] = []
    for text in texts:
        name, _, rest = (part.strip() for part in text.partition("="))
        file, material = rest, None
        if "," in rest and not Path(rest).is_file():
            file, material = (part.strip() for part in rest.rsplit(",", 1))
        if not name or not file or material == "":
            raise UserError("cannot be read as a replacement", field=FIELD, got=text, expected=FORM)
        if any(one.object == name for one in found):
            raise UserError("names an object twice", field=FIELD, got=name)
        found.append(Replacement(name, mesh_of(file), material))
    return tuple(found)


def mesh_of(file: str) -> Mesh:
    """All objects of a geometry file as one mesh."""
    from lambent.scenes.loaders.load import load_scene

    objects = load_scene(file).objects
    mesh = merge(o.mesh for o in objects) if objects else None
    if mesh is None or not len(mesh.faces):
        raise UserError("holds no triangles", file=file, field=FIELD)
    return mesh


def fitted(mesh: Mesh, low: Floats, high: Floats) -> Mesh:
    """The mesh scaled to fit a box, centred and standing on its floor (+y is up)."""
    from_low, from_high = (side.astype(float) for side in mesh.bounds)
    size = from_high - from_low
    used = size > 1e-9 * max(float(size.max()), 1e-30)
    scale = float(((high - low)[used] / size[used]).min()) if used.any() else 1.0
    matrix = np.eye(4)
    matrix[:3, :3] *= scale
    matrix[:3, 3] = (low + high) / 2 - scale * (from_low + from_high) / 2
    matrix[1, 3] = low[1] - scale * from_low[1]
    return transformed(mesh, matrix)


def with_replacements(scene: Scene, replacements: Sequence[Replacement]) -> Scene:
    """The scene with meshes replaced within the boxes of objects, as the path tracer needs it."""
    objects = {o.name: o for o in scene.objects}
    for one in replacements:
        o = objects[known("object", one.object, objects, field=FIELD)]
        if one.material is not None:
            known("material", one.material, scene.materials, field=FIELD)
        low, high = (side.astype(float) for side in o.mesh.bounds)
        objects[one.object] = replace(o, mesh=fitted(one.mesh, low, high), material=one.material or o.material)
    return replace(scene, objects=tuple(objects.values()))
