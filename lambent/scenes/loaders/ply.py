"""PLY meshes, text and binary of either byte order. Sizes are checked against the file before anything is allocated."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.materials.document import Material
from lambent.scenes.loaders.parts import Parts
from lambent.scenes.loaders.polygons import Arrays, Ints, smooth_normals, triangulate
from lambent.scenes.loaders.repair import mesh_of
from lambent.scenes.scene import SceneObject

LIMIT_BYTES = 4 << 30
HEADER_MAX = 1 << 16
TRIANGLES_MAX = 20_000_000
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
UV_NAMES = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str, str | None]]  # name, type, type of the count where it is a list


def read(path: Path) -> Arrays:
    """Arrays of a file.

    Raises
    ------
    UserError
        Where it is not PLY, damaged, cut off, or a face names a vertex that is not there.
    """
    data = read_bytes(path, LIMIT_BYTES)
    order, elements, start = _header(data, path)
    body = _Text(data, start, path) if order == "ascii" else _Binary(data, start, order, path)
    vertex: dict[str, Floats] = {}
    corners, sizes = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for element in elements:
        lists = [p for p in element.properties if p[2] is not None]
        if element.name == "vertex" and not lists:
            vertex = body.table(element)
        elif element.name == "face" and len(lists) == 1:
            corners, sizes = body.faces(element)
        elif element.name in ("vertex", "face"):
            raise UserError("holds lists that are not read", file=path, field=f"element {element.name}")
        else:
            break  # what comes after the faces is nothing to see
    if not all(c in vertex for c in "xyz"):
        raise UserError("has no vertices", file=path, expected="properties x, y, z")
    count = len(vertex["x"])
    if corners.size and (int(corners.max()) >= count or int(corners.min()) < 0):
        bad = int(corners.max()) if int(corners.max()) >= count else int(corners.min())
        raise UserError("face index out of range", file=path, got=bad, expected=f"below {count}")
    positions = np.stack([vertex[c] for c in "xyz"], axis=-1)
    places, _ = triangulate(positions, corners, sizes)
    if len(places) > TRIANGLES_MAX:
        raise UserError("mesh is too large", file=path, got=f"{len(places)} triangles", expected=TRIANGLES_MAX)
    normals = np.stack([vertex[f"n{c}"] for c in "xyz"], axis=-1) if all(f"n{c}" in vertex for c in "xyz") else None
    named = next((pair for pair in UV_NAMES if all(n in vertex for n in pair)), None)
    uv = np.stack([vertex[n] for n in named], axis=-1) if named else None
    return Arrays(positions, normals, uv, corners[places])


def read_ply(path: Path, root: Path | None = None) -> Parts:
    """A file as one grey object; v points up, missing normals are smooth."""
    arrays = read(path)
    normals = arrays.normals
    if normals is None and len(arrays.triangles):
        normals = np.zeros_like(arrays.positions)
        made = smooth_normals(arrays.positions, arrays.triangles, arrays.triangles)
        normals[: len(made)] = made
    mesh, said = mesh_of(arrays.positions, arrays.triangles, normals, arrays.uv, None, name=path.stem, file=path)
    if mesh is None:
        raise UserError("holds no triangles", file=path, hint="; ".join(said) or None)
    grey = Material(name="default", kd=(0.5, 0.5, 0.5))
    return Parts((SceneObject(path.stem, mesh, grey.name),), {grey.name: grey}, sources=(path,), warnings=tuple(said))


def _header(data: bytes, path: Path) -> tuple[str, list[_Element], int]:
    """Byte order ("ascii", "<" or ">"), elements, and where the data begin."""
    end = data.find(b"end_header", 0, HEADER_MAX)
    if not data.startswith(b"ply") or end < 0:
        raise UserError("not a PLY file", file=path, got=repr(data[:4]), expected="it to begin with ply")
    order, elements = "", []
    for number, line in enumerate(data[:end].decode("latin-1").splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), []))
                if elements[-1].count < 0:
                    raise ValueError
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], TYPES[words[3]], TYPES[words[2]]))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], TYPES[words[1]], None))
        except (KeyError, IndexError, ValueError) as error:
            raise UserError("header cannot be read", file=path, field=f"line {number}", got=line) from error
    line_end = data.find(b"\n", end)
    if not order or line_end < 0:
        raise UserError("header cannot be read", file=path, expected="a format")
    return order, elements, line_end + 1


class _Text:
    """Numbers of an ASCII file, taken one element after the other."""

    def __init__(self, data: bytes, start: int, path: Path) -> None:
        self._path = path
        try:
            self._values = np.fromstring(data[start:], sep=" ")  # type: ignore[call-overload]
        except ValueError as error:
            raise UserError("holds something that is no number", file=path) from error
        self._at = 0

    def table(self, element: _Element) -> dict[str, Floats]:
        width = len(element.properties)
        values = self._take(element.count * width).reshape(-1, max(width, 1))
        return {name: values[:, i] for i, (name, _, _) in enumerate(element.properties)}

    def faces(self, element: _Element) -> tuple[Ints, Ints]:
        before, after = _around_list(element)
        rest = self._values[self._at :]
        if element.count == 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        if before >= len(rest):
            raise _cut_off(self._path)
        size = rest[before]
        step = before + 1 + (int(size) if 0 <= size < 1 << 20 else 0) + after
        if step * element.count <= len(rest):
            rows = rest[: step * element.count].reshape(-1, step)
            if (rows[:, before] == size).all():
                self._at += rows.size
                return _integers(rows[:, before + 1 : step - after]).reshape(-1), np.full(len(rows), int(size))
        corners, sizes = [], []
        for _ in range(element.count):
            row = self._take(before + 1)
            size = row[before]
            if not 0 <= size < 1 << 20:
                raise UserError("face that cannot be read", file=self._path, got=size)
            corners.append(_integers(self._take(int(size))))
            sizes.append(int(size))
            self._take(after)
        return np.concatenate(corners), np.array(sizes)

    def _take(self, count: int) -> Floats:
        if self._at + count > len(self._values):
            raise _cut_off(self._path)
        self._at += count
        taken: Floats = self._values[self._at - count : self._at]
        return taken


class _Binary:
    """Elements of a binary file, taken one after the other."""

    def __init__(self, data: bytes, start: int, order: str, path: Path) -> None:
        self._data, self._at, self._order, self._path = data, start, order, path

    def table(self, element: _Element) -> dict[str, Floats]:
        names = [f"{i}" for i in range(len(element.properties))]
        kind = np.dtype([(n, self._order + p[1]) for n, p in zip(names, element.properties, strict=True)])
        rows = self._array(kind, element.count)
        return {p[0]: rows[n].astype(float) for n, p in zip(names, element.properties, strict=True)}

    def faces(self, element: _Element) -> tuple[Ints, Ints]:
        """Lists of one length are one array; others are walked through."""
        if element.count == 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        head = self._row(element, 0)
        if self._at + head.itemsize > len(self._data):
            raise _cut_off(self._path)
        size = int(np.frombuffer(self._data, head, 1, self._at)["size"][0])
        if 0 <= size < 1 << 20:
            kind = self._row(element, size)
            if self._at + kind.itemsize * element.count <= len(self._data):
                rows = np.frombuffer(self._data, kind, element.count, self._at)
                if (rows["size"] == size).all():
                    self._at += rows.nbytes
                    return _integers(rows["list"].reshape(-1)), np.full(len(rows), size)
        corners, sizes = [], []
        for _ in range(element.count):
            if self._at + head.itemsize > len(self._data):
                raise _cut_off(self._path)
            size = int(np.frombuffer(self._data, head, 1, self._at)["size"][0])
            if not 0 <= size < 1 << 20:
                raise UserError("face that cannot be read", file=self._path, got=size)
            row = self._array(self._row(element, size), 1)
            corners.append(_integers(row["list"].reshape(-1)))
            sizes.append(size)
        return np.concatenate(corners), np.array(sizes)

    def _row(self, element: _Element, size: int) -> np.dtype:  # type: ignore[type-arg]
        fields: list[tuple] = []  # type: ignore[type-arg]
        for i, (_, kind, count) in enumerate(element.properties):
            if count is None:
                fields.append((f"{i}", self._order + kind))
            else:
                fields += [("size", self._order + count), ("list", self._order + kind, (size,))]
        return np.dtype(fields)

    def _array(self, kind: np.dtype, count: int) -> np.ndarray:  # type: ignore[type-arg]
        if self._at + kind.itemsize * count > len(self._data):
            raise _cut_off(self._path)
        array = np.frombuffer(self._data, kind, count, self._at)
        self._at += array.nbytes
        return array


def _around_list(element: _Element) -> tuple[int, int]:
    """Plain properties before and after the list."""
    at = next(i for i, p in enumerate(element.properties) if p[2] is not None)
    return at, len(element.properties) - at - 1


def _integers(values: Floats) -> Ints:
    return np.nan_to_num(values, nan=-1).astype(np.int64) if values.dtype.kind == "f" else values.astype(np.int64)


def _cut_off(path: Path) -> UserError:
    return UserError("file is truncated", file=path, hint="copy or download it again")
