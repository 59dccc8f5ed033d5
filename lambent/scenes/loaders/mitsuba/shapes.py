"""Mitsuba's shapes as meshes in world space, with Mitsuba's texture coordinates (v flipped to point up)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from lambent.core.geometry.directions import Floats, basis, normalize
from lambent.scenes.geometry import grid, merge, placed, sphere, transformed
from lambent.scenes.loaders import ply
from lambent.scenes.loaders.meshes.repair import MeshArrays, mesh_of
from lambent.scenes.loaders.mitsuba import serialized
from lambent.scenes.loaders.mitsuba.values import Plugin
from lambent.scenes.loaders.obj import objects as obj
from lambent.scenes.loaders.obj import text as obj_text
from lambent.scenes.scene import Mesh

AROUND, ROWS = 80, 40  # quads of a sphere
POLES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # turns the axis of our spheres to z
UNSCALED = 1e-18  # smallest determinant of a transform that is not degenerate


class MissingFile(Exception):
    """The file of a shape is missing; carries its name as written."""


Made = tuple[Mesh | None, list[str], bool]  # the mesh, notes of repairs, whether its normals come from its faces


def mesh_of_shape(plugin: Plugin, name: str, world: Floats, known: dict[int, Made]) -> tuple[Mesh | None, list[str]]:
    """Mesh of a shape under `world` (4, 4), None if nothing is left, and notes of repairs.

    `known` caches the shapes of instances before they are transformed.
    """
    make = KINDS.get(plugin.type)
    if make is None:
        return None, [f"{plugin.label}: left out, unknown kind of shape"]
    to_world = world @ plugin.transform()
    key = id(plugin.element)
    if key in known:
        local, notes, from_faces = known[key]
        plugin.ignore("center", "radius", "p0", "p1", "filename", "shape_index", "face_normals", "flip_tex_coords")
        notes = []
    else:
        try:
            made: Made = make(plugin, name)
        except MissingFile as missing:
            made = None, [f"{name}: left out, its file {missing} is missing"], False
        local, notes, from_faces = known[key] = made
    if local is None:
        return None, notes
    if abs(np.linalg.det(to_world[:3, :3])) < UNSCALED:
        return None, [*notes, f"{name}: left out, its transform is singular"]
    if not len(local.faces):
        return None, [*notes, f"{name}: left out, no triangle has an area"]
    mesh = transformed(local, to_world)
    # Mitsuba recomputes missing normals after a mirroring transform; given normals are transformed as ours are.
    turned = from_faces and np.linalg.det(to_world[:3, :3]) < 0
    return (flipped(mesh) if plugin.flag("flip_normals", False) != turned else mesh), notes


def flipped(mesh: Mesh) -> Mesh:
    """`mesh` turned inside out."""
    return replace(mesh, normals=-mesh.normals, faces=mesh.faces[:, ::-1].copy())


def stem_of(plugin: Plugin) -> str:
    """The name of a shape: its id, its file's name, or its kind."""
    written = plugin.text("filename").replace("\\", "/")
    return plugin.element.id or Path(written).stem or plugin.type


def _obj(plugin: Plugin, name: str) -> Made:
    path = _file(plugin)
    text = obj_text.read(path)
    if not plugin.flag("flip_tex_coords", True):
        text = replace(text, vt=_turned(text.vt))
    faceted = plugin.flag("face_normals", False)
    plugin.ignore("collapse", "load_materials", "shape_index")
    triangles = obj.triangles_of(text, path)
    mesh, notes = obj.mesh_of_triangles(text, triangles, name, path, faceted=faceted)
    return mesh, notes, faceted or not len(text.vn)


def _ply(plugin: Plugin, name: str) -> Made:
    path = _file(plugin)
    plugin.ignore("srgb")
    return _from_arrays(plugin, name, path, ply.read(path))


def _serialized(plugin: Plugin, name: str) -> Made:
    path = _file(plugin)
    return _from_arrays(plugin, name, path, serialized.read(path, int(plugin.number("shape_index", 0))))


def _from_arrays(plugin: Plugin, name: str, path: Path, arrays: MeshArrays) -> Made:
    """A mesh whose v points down, unless flip_tex_coords is set."""
    if arrays.uv is not None and not plugin.flag("flip_tex_coords", False):
        arrays = replace(arrays, uv=_turned(arrays.uv))
    plugin.ignore("flip_tex_coords")
    faceted = plugin.flag("face_normals", False)
    from_faces = arrays.normals is None or faceted
    mesh, notes = mesh_of(replace(arrays, normals=None) if faceted else arrays.smooth(), name=name, file=path)
    return mesh, notes, from_faces


def _turned(uv: Floats) -> Floats:
    return uv * (1, -1) + (0, 1)


def _file(plugin: Plugin) -> Path:
    path = plugin.file()
    if not path.is_file():
        raise MissingFile(plugin.text("filename"))
    return plugin.reading.files.use(path)


def _rectangle(plugin: Plugin, name: str) -> Made:
    return _sheet(np.array([0.0, 0.0, 1.0]), lambda x, y: (x, y, 0 * x)), [], False


def _sheet(normal: Floats, place: Callable[[Floats, Floats], tuple[Floats, Floats, Floats]]) -> Mesh:
    """A square with uv along the parameters x, y in [-1, 1] of `place`."""
    x, y = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
    positions = np.stack(place(x, y), axis=-1)
    along = positions[0, 1] - positions[0, 0]
    uv = np.stack([(x + 1) / 2, 1 - (y + 1) / 2], axis=-1)
    return grid(positions, np.broadcast_to(normal, positions.shape), along, uv)


def _cube(plugin: Plugin, name: str) -> Made:
    """The sides with Mitsuba's directions of u (x here) and v (y here)."""
    one = np.ones((2, 2))
    sides = (
        ((0, 0, 1), lambda x, y: (y, x, one)), ((0, 0, -1), lambda x, y: (y, -x, -one)),
        ((1, 0, 0), lambda x, y: (one, x, -y)), ((-1, 0, 0), lambda x, y: (-one, x, y)),
        ((0, 1, 0), lambda x, y: (-x, one, -y)), ((0, -1, 0), lambda x, y: (y, -one, x)),
    )  # fmt: skip
    return merge([_sheet(np.array(n, float), place) for n, place in sides]), [], False


def _sphere(plugin: Plugin, name: str) -> Made:
    """A sphere whose poles are along z, u = 0 towards x."""
    centre, radius = plugin.vector("center"), plugin.number("radius", 1.0)
    return placed(sphere(abs(radius), AROUND, ROWS), (0, 0, 0) if centre is None else centre, POLES), [], False


def _disk(plugin: Plugin, name: str) -> Made:
    r = np.linspace(0, 1, 2)[:, None]
    phi, cos_phi, sin_phi = _circle(AROUND)
    positions = _stacked(r * cos_phi, r * sin_phi, 0 * r)
    normals = np.broadcast_to([0.0, 0.0, 1.0], positions.shape)
    uv = np.stack(np.broadcast_arrays(r, 1 - phi / (2 * np.pi)), axis=-1)
    return grid(positions, normals, _stacked(cos_phi, sin_phi, 0 * r), uv), [], False


def _cylinder(plugin: Plugin, name: str) -> Made:
    """A cylinder without caps."""
    p0, p1 = plugin.vector("p0"), plugin.vector("p1")
    p0, p1 = np.zeros(3) if p0 is None else p0, np.array([0.0, 0.0, 1.0]) if p1 is None else p1
    radius, length = abs(plugin.number("radius", 1.0)), float(np.linalg.norm(p1 - p0))
    if length == 0:
        return None, [f"{name}: left out, its ends coincide"], False
    z = np.linspace(0, 1, 2)[:, None]
    phi, cos_phi, sin_phi = _circle(AROUND)
    normals = _stacked(cos_phi, sin_phi, 0 * z)
    positions = _stacked(radius * cos_phi, radius * sin_phi, length * z)
    uv = np.stack(np.broadcast_arrays(phi / (2 * np.pi), 1 - z), axis=-1)
    mesh = grid(positions, normals, _stacked(-sin_phi, cos_phi, 0 * z), uv)
    t, b = basis(normalize(p1 - p0))
    matrix = _moved(p0)
    matrix[:3, :3] = np.stack([t, b, normalize(p1 - p0)], axis=-1)
    return transformed(mesh, matrix), [], False


def _circle(around: int) -> tuple[Floats, Floats, Floats]:
    """phi, its cosine and its sine (1, around + 1), closed exactly."""
    phi = np.linspace(0, 2 * np.pi, around + 1)[None, :]
    cos_phi, sin_phi = np.cos(phi), np.sin(phi)
    cos_phi[:, -1], sin_phi[:, -1] = 1.0, 0.0
    return phi, cos_phi, sin_phi


def _stacked(x: Floats, y: Floats, z: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _moved(to: Floats) -> Floats:
    matrix = np.eye(4)
    matrix[:3, 3] = to
    return matrix


KINDS: dict[str, Callable[[Plugin, str], Made]] = {
    "obj": _obj, "ply": _ply, "serialized": _serialized, "rectangle": _rectangle, "cube": _cube, "sphere": _sphere,
    "disk": _disk, "cylinder": _cylinder,
}  # fmt: skip
