"""Wavefront OBJ: groups and materials as objects, polygons as triangles."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.scenes.loaders import mtl, obj_text
from lambent.scenes.loaders.obj_text import Ints, ObjText
from lambent.scenes.loaders.parts import Parts, unique_name
from lambent.scenes.loaders.pictures import Pictures
from lambent.scenes.loaders.polygons import smooth_normals, triangulate
from lambent.scenes.loaders.repair import mesh_of
from lambent.scenes.scene import Mesh, SceneObject

LIMIT_BYTES = 4 << 30
TRIANGLES_MAX = 20_000_000
OBJECTS_MAX = 4096  # more groups than this are not things but an exporter's habit
UNREAD = {"l": "lines", "p": "points", "curv": "curves", "surf": "surfaces", "vp": "curves"}


@dataclass(frozen=True)
class Triangles:
    """Corners (T, 3, 3) as places in v, vt, vn of every triangle, its line's number and its smoothing group (T,)."""

    corners: Ints
    lines: Ints
    smoothing: Ints


def read_obj(path: Path, root: Path | None = None) -> Parts:
    """Parts of an .obj file: an object for each of its objects (or groups) and each material on it.

    Raises
    ------
    UserError
        Where a line cannot be read, or the file holds nothing to see.
    """
    text = obj_text.parse(read_bytes(path, LIMIT_BYTES), path)
    root = path.resolve().parent if root is None else root
    warnings = [f"{what} are not read" for word, what in UNREAD.items() if any(w == word for _, w, _ in text.words)]
    all_triangles = triangles_of(text, path)
    names, material_names, owner = _owners(text, all_triangles.lines, warnings)
    pictures = Pictures()
    library = mtl.Library(pictures, root)
    for line, word, rest in text.words:
        if word == "mtllib":
            library.add(path, rest, f"line {line}")
    taken: set[str] = set()
    objects = []
    used: dict[str, None] = {}
    parts_of = Counter(name for name, _ in names)
    by_owner = np.argsort(owner, kind="stable")
    ends = np.searchsorted(owner[by_owner], np.arange(len(names) + 1))
    for number, (name, material) in enumerate(names):
        mine = by_owner[ends[number] : ends[number + 1]]
        single = name if parts_of[name] == 1 else f"{name}_{material_names[material]}"
        mesh, said = mesh_of_triangles(text, _picked(all_triangles, mine), single, path)
        warnings += said
        if mesh is None:
            continue
        wanted = library.name_of(material_names[material])
        used[wanted] = None
        objects.append(SceneObject(unique_name(single, taken), mesh, wanted, library.emission(wanted)))
    if not objects:
        raise UserError("holds no triangles", file=path, hint="; ".join(warnings) or None)
    return Parts(
        tuple(objects),
        {n: library.material(n) for n in used},
        sources=(path, *library.sources),
        warnings=(*warnings, *library.warnings(used), *pictures.said),
        textures={n: t for n in used if (t := library.textures(n)) is not None},
    )


def triangles_of(text: ObjText, file: Path) -> Triangles:
    """All faces cut into triangles."""
    places, polygon = triangulate(text.v, text.corners[:, 0], text.sizes)
    if len(places) > TRIANGLES_MAX:
        got, most = f"{len(places)} triangles", f"at most {TRIANGLES_MAX}"
        raise UserError("scene is too large", file=file, got=got, expected=most)
    lines = text.lines[polygon]
    at, groups = [0], [0]
    for line, word, rest in text.words:
        if word == "s":
            at.append(line)
            groups.append(int(rest) if rest.isdecimal() and len(rest) < 10 else 0)
    return Triangles(text.corners[places], lines, np.array(groups)[np.searchsorted(at, lines) - 1])


def _picked(triangles: Triangles, which: Ints) -> Triangles:
    return Triangles(triangles.corners[which], triangles.lines[which], triangles.smoothing[which])


def _owners(text: ObjText, lines: Ints, warnings: list[str]) -> tuple[list[tuple[str, int]], list[str], Ints]:
    """Objects as (name, number of the material), names of the materials, and the object of each triangle."""
    by = "o" if any(word == "o" for _, word, _ in text.words) else "g"
    things, thing_at = _changes(text, by, "object")
    materials, material_at = _changes(text, "usemtl", "")
    thing = thing_at[1][np.searchsorted(thing_at[0], lines, side="right") - 1]
    material = material_at[1][np.searchsorted(material_at[0], lines, side="right") - 1]
    if len(things) > OBJECTS_MAX:
        warnings.append(f"{len(things)} groups are taken as one object per material")
        things, thing = ["object"], np.zeros_like(thing)
    key = thing * len(materials) + material
    kinds, first, owner = np.unique(key, return_index=True, return_inverse=True)
    if len(kinds) > 16 * OBJECTS_MAX:
        raise UserError("too many materials", got=len(kinds))
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    names = [(things[int(kinds[k]) // len(materials)], int(kinds[k]) % len(materials)) for k in order]
    return names, materials, rank[owner.reshape(-1)]


def _changes(text: ObjText, keyword: str, start: str) -> tuple[list[str], tuple[Ints, Ints]]:
    """Names in order of appearance; and the lines from which each holds, with the number of the name."""
    numbers = {start: 0}
    at, which = [0], [0]
    for line, word, rest in text.words:
        if word == keyword:
            at.append(line)
            which.append(numbers.setdefault(rest or start, len(numbers)))
    return list(numbers), (np.array(at), np.array(which))


def mesh_of_triangles(
    text: ObjText, triangles: Triangles, name: str, file: Path, *, faceted: bool | None = None
) -> tuple[Mesh | None, list[str]]:
    """Mesh of some of a file's triangles, and what was repaired.

    Normals that are missing come from the smoothing groups; `faceted` says instead that all normals are flat, or that
    missing ones are smooth everywhere.
    """
    said = []
    corners, normals = triangles.corners.copy(), text.vn
    lacking = (corners[..., 2] < 0).any(axis=1)
    if faceted:
        lacking[:] = True
    if lacking.any() and len(corners):
        smooth = (triangles.smoothing > 0) if faceted is None else np.full(len(corners), not faceted)
        made, numbers = _made_normals(text.v, corners[lacking, :, 0], triangles.smoothing[lacking], smooth[lacking])
        corners[lacking, :, 2] = numbers + len(normals)
        normals = np.concatenate([normals, made])
        if faceted is None:
            how = "from its smoothing groups" if smooth[lacking].any() else "faces are flat"
            said.append(f"{name}: no normals: {how}")
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
    mesh, repaired = mesh_of(
        text.v[vertex[:, 0]],
        index.reshape(-1, 3),
        normals[vertex[:, 2]] if len(vertex) else np.zeros((0, 3)),
        uv,
        None,
        name=name,
        file=file,
    )
    return mesh, said + repaired


def _made_normals(positions: np.ndarray, vertices: Ints, smoothing: Ints, smooth: Ints) -> tuple[np.ndarray, Ints]:
    """Normals, and which of them each corner (T, 3) has: shared within a smoothing group, else the triangle's own."""
    triangle = np.arange(len(vertices))[:, None] + np.zeros((1, 3), int)
    group = np.where(smooth, smoothing, -1)[:, None]
    key = np.where(smooth[:, None], vertices, triangle) * (int(smoothing.max()) + 2) + group + 1
    _, number = np.unique(key, return_inverse=True)
    numbers = number.reshape(-1, 3)
    return smooth_normals(positions, vertices, numbers), numbers
