"""Wavefront OBJ: groups and materials as objects, polygons as triangles."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.ceilings import MATERIALS, TRIANGLES
from lambent.core.errors import UserError
from lambent.core.plain import UniqueNames
from lambent.scenes.loaders.contents import DEFAULTS, Contents, LoadOptions
from lambent.scenes.loaders.meshes.repair import DEVIATION_DEG, MeshArrays, mesh_of, smooth_normals, triangulate
from lambent.scenes.loaders.obj.mtl import Library
from lambent.scenes.loaders.obj.text import ObjText, read
from lambent.scenes.loaders.scene_files import SceneFiles
from lambent.scenes.scene import Mesh, SceneObject

OBJECTS_MAX = 4096  # more groups than this are an artefact of the exporter, not objects
UNSTATED = -1
UNREAD = {"l": "lines", "p": "points", "curv": "curves", "surf": "surfaces", "vp": "curves"}


@dataclass(frozen=True)
class Triangles:
    """Corners (T, 3, 3) as indices into v, vt, vn of every triangle, its line number and its smoothing group (T,).

    Group 0 is flat, UNSTATED comes before the first statement.
    """

    corners: Indices
    lines: Indices
    smoothing: Indices

    def of(self, which: Indices) -> Triangles:
        return Triangles(self.corners[which], self.lines[which], self.smoothing[which])


def load(path: Path, options: LoadOptions = DEFAULTS) -> Contents:
    """Contents of an .obj file: an object for each of its objects (or groups) and each material on it.

    Raises
    ------
    UserError
        If a line is invalid, or the file has no triangles.
    """
    files = SceneFiles(path, options.root)
    text = read(path)
    warnings = [f"{what} are ignored" for word, what in UNREAD.items() if any(w == word for _, w, _ in text.words)]
    warnings += ["vertex colours are ignored"] if text.coloured else []
    triangles = triangles_of(text, path)
    names, material_names, owner = _owners(text, triangles.lines, warnings, path)
    library = Library(files)
    for line, word, rest in text.words:
        if word == "mtllib":
            library.add(path, rest, line)
    names_given = UniqueNames()
    objects = []
    materials_of = Counter(name for name, _ in names)
    by_owner = np.argsort(owner, kind="stable")
    ends = np.searchsorted(owner[by_owner], np.arange(len(names) + 1))
    for number, (name, material) in enumerate(names):
        mine = by_owner[ends[number] : ends[number + 1]]
        single = name if materials_of[name] == 1 else f"{name}_{material_names[material]}"
        mesh, notes = mesh_of_triangles(text, triangles.of(mine), single, path, crease_deg=options.crease_deg)
        warnings += notes
        if mesh is not None:
            used = library.use(material_names[material])
            objects.append(SceneObject(names_given.unique(single), mesh, used, library.made.emission[used]))
    if not objects:
        raise UserError("holds no triangles", file=path, hint="; ".join(warnings) or None)
    return Contents(
        tuple(objects),
        library.made.materials,
        sources=tuple(files.sources),
        warnings=(*warnings, *library.warnings),
        textures=library.made.textures,
    )


def triangles_of(text: ObjText, file: Path) -> Triangles:
    """All faces, triangulated."""
    places, polygon = triangulate(text.v, text.corners[:, 0], text.sizes)
    TRIANGLES.check(len(places), file=file)
    lines = text.lines[polygon]
    at, groups = [0], [UNSTATED]
    for line, word, rest in text.words:
        if word == "s":
            at.append(line)
            groups.append(int(rest) if rest.isdecimal() and len(rest) < 10 else 0)
    return Triangles(text.corners[places], lines, np.array(groups)[np.searchsorted(at, lines) - 1])


def _owners(
    text: ObjText, lines: Indices, warnings: list[str], file: Path
) -> tuple[list[tuple[str, int]], list[str], Indices]:
    """Objects as (name, number of the material), names of the materials, and the object of each triangle."""
    by = "o" if any(word == "o" for _, word, _ in text.words) else "g"
    things, thing_at = _changes(text, by, "object")
    materials, material_at = _changes(text, "usemtl", "")
    thing = thing_at[1][np.searchsorted(thing_at[0], lines, side="right") - 1]
    material = material_at[1][np.searchsorted(material_at[0], lines, side="right") - 1]
    if len(things) > OBJECTS_MAX:
        warnings.append(f"{len(things)} groups are merged to one object per material")
        things, thing = ["object"], np.zeros_like(thing)
    key = thing * len(materials) + material
    kinds, first, owner = np.unique(key, return_index=True, return_inverse=True)
    MATERIALS.check(len(kinds), file=file)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    names = [(things[int(kinds[k]) // len(materials)], int(kinds[k]) % len(materials)) for k in order]
    return names, materials, rank[owner.reshape(-1)]


def _changes(text: ObjText, keyword: str, start: str) -> tuple[list[str], tuple[Indices, Indices]]:
    """Names in order of first use; and the lines that switch to one, with its index."""
    numbers = {start: 0}
    at, which = [0], [0]
    for line, word, rest in text.words:
        if word == keyword:
            at.append(line)
            which.append(numbers.setdefault(rest or start, len(numbers)))
    return list(numbers), (np.array(at), np.array(which))


def mesh_of_triangles(
    text: ObjText,
    triangles: Triangles,
    name: str,
    file: Path,
    *,
    faceted: bool | None = None,
    crease_deg: float | None = None,
) -> tuple[Mesh | None, list[str]]:
    """Mesh of some of a file's triangles, None if nothing is left, and notes of repairs.

    Missing normals follow the smoothing groups; if there is neither a normal nor a group, they are as of `mesh_of`,
    with DEVIATION_DEG if nothing says that faces are flat. If `faceted` is True all normals are flat; if False, missing
    ones are smooth everywhere.
    """
    notes = []
    corners, normals = triangles.corners.copy(), text.vn
    lacking = np.asarray((corners[..., 2] < 0).any(axis=1))
    if faceted:
        lacking[:] = True
    smooth = (triangles.smoothing > 0) if faceted is None else np.full(len(corners), not faceted)
    if crease_deg is None and (triangles.smoothing == UNSTATED).all():
        crease_deg = DEVIATION_DEG
    bare = crease_deg is not None and faceted is None and bool(lacking.all()) and not smooth.any()
    if lacking.any() and not bare:
        made, numbers = _made_normals(text.v, corners[lacking, :, 0], triangles.smoothing[lacking], smooth[lacking])
        corners[lacking, :, 2] = numbers + len(normals)
        normals = np.concatenate([normals, made])
        if faceted is None:
            how = "from its smoothing groups" if smooth[lacking].any() else "faces are flat"
            notes.append(f"{name}: no normals: {how}")
    flat = corners.reshape(-1, 3)
    sizes = (len(text.vt) + 1, len(normals) + 1)
    if len(text.v) * sizes[0] * sizes[1] < 1 << 62:
        key = (flat[:, 0] * sizes[0] + flat[:, 1] + 1) * sizes[1] + flat[:, 2] + 1
        _, first, index = np.unique(key, return_index=True, return_inverse=True)
    else:
        _, first, index = np.unique(flat, axis=0, return_index=True, return_inverse=True)
    vertex = flat[first]
    uv = None
    if len(text.vt) and (vertex[:, 1] >= 0).any():
        uv = np.where(vertex[:, 1:2] >= 0, text.vt[np.maximum(vertex[:, 1], 0)], np.nan)
    own = None if bare else normals[vertex[:, 2]] if len(vertex) else np.zeros((0, 3))
    arrays = MeshArrays(text.v[vertex[:, 0]], index.reshape(-1, 3), own, uv)
    mesh, repaired = mesh_of(arrays, name=name, file=file, crease_deg=crease_deg)
    return mesh, notes + repaired


def _made_normals(positions: Floats, vertices: Indices, smoothing: Indices, smooth: Flags) -> tuple[Floats, Indices]:
    """Normals, and the index of each corner's (T, 3): shared within a smoothing group, else the triangle's own."""
    triangle = np.arange(len(vertices))[:, None] + np.zeros((1, 3), int)
    group = np.where(smooth, smoothing, -1)[:, None]
    key = np.where(smooth[:, None], vertices, triangle) * (int(smoothing.max()) + 2) + group + 1
    _, number = np.unique(key, return_inverse=True)
    numbers = number.reshape(-1, 3)
    return smooth_normals(positions, vertices, numbers), numbers
