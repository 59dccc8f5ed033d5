"""PLY meshes, text and binary of either byte order. Sizes are checked against the file before anything is allocated."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats, Indices, numbers_in, ranges
from lambent.core.ceilings import FACE_CORNERS, PLY_BYTES, TRIANGLES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes
from lambent.scenes.loaders.contents import DEFAULTS, Contents, LoadOptions, grey_thing
from lambent.scenes.loaders.meshes.repair import MeshArrays, mesh_of, triangulate

NAME, ENDINGS = "PLY", (".ply",)
HEADER_MAX = 1 << 16
TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
ORDERS = {"ascii": "ascii", "binary_little_endian": "<", "binary_big_endian": ">"}
UV_NAMES = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))


@dataclass
class _Element:
    name: str
    count: int
    properties: list[tuple[str, str, str | None]]  # name, type, type of the count if it is a list

    @property
    def lists(self) -> int:
        return sum(count is not None for _, _, count in self.properties)

    def row(self, corners: int) -> np.dtype[Any]:
        """The dtype of a row whose list, if it has one, has `corners` entries."""
        fields: list[tuple[Any, ...]] = []
        for i, (_, kind, count) in enumerate(self.properties):
            fields += [(f"{i}", kind)] if count is None else [("size", count), ("list", kind, (corners,))]
        return np.dtype(fields)


def load(path: Path, options: LoadOptions = DEFAULTS) -> Contents:
    """A file as one grey object; v points up, missing normals are smooth."""
    ignored: list[str] = []
    mesh, notes = mesh_of(read(path, ignored).smooth(), name=path.stem, file=path)
    notes += ignored
    if mesh is None:
        raise UserError("holds no triangles", file=path, hint="; ".join(notes) or None)
    return grey_thing(path, mesh, notes)


def read(path: Path, notes: list[str] | None = None) -> MeshArrays:
    """Read the arrays of a file; `notes` gets a line about everything in it that is ignored.

    Raises
    ------
    UserError
        If it is not PLY, damaged or truncated, or a face refers to a missing vertex.
    """
    data = read_bytes(path, PLY_BYTES)
    order, elements, start = _header(data, path)
    rows = _Rows(_doubles(data[start:], path) if order == "ascii" else memoryview(data)[start:], path)
    vertex: dict[str, Floats] = {}
    corners, sizes = np.zeros(0, np.int64), np.zeros(0, np.int64)
    for element in elements:
        if element.name not in ("vertex", "face") or not element.properties:
            break  # what follows the faces is invisible; of rows without properties a header may name any number
        if element.name == "vertex" and not element.lists:
            table = rows.take(element.row(0), element.count)
            vertex = {p[0]: table[f"{i}"].astype(float) for i, p in enumerate(element.properties)}
        elif element.name == "face" and element.lists == 1:
            corners, sizes = rows.faces(element)
        else:
            raise UserError("has unsupported lists", file=path, field=f"element {element.name}")
    if notes is not None:
        notes += ["vertex colours are ignored"] if "red" in vertex or "diffuse_red" in vertex else []
        notes += ["triangle strips are ignored"] if any(e.name == "tristrips" for e in elements) else []
    positions = _columns(vertex, ("x", "y", "z"))
    if positions is None:
        raise UserError("has no vertices", file=path, expected="properties x, y, z")
    outside = corners[(corners < 0) | (corners >= len(positions))]
    if len(outside):
        got, expected = int(outside.max()), f"below {len(positions)}"
        raise UserError("face index out of range", file=path, got=got, expected=expected)
    places, _ = triangulate(positions, corners, sizes)
    TRIANGLES.check(len(places), file=path)
    return MeshArrays(positions, corners[places], _columns(vertex, ("nx", "ny", "nz")), _columns(vertex, *UV_NAMES))


def _header(data: bytes, path: Path) -> tuple[str, list[_Element], int]:
    """Byte order (a value of `ORDERS`), elements, and the start of the data."""
    end = data.find(b"end_header", 0, HEADER_MAX)
    if not data.startswith(b"ply") or end < 0:
        raise UserError("not a PLY file", file=path, got=repr(data[:4]), expected="ply ... end_header")
    order, elements = "", []
    for number, line in enumerate(data[:end].decode("latin-1").splitlines(), 1):
        words = line.split()
        try:
            if words[:1] == ["format"]:
                order = ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(_Element(words[1], int(words[2]), []))
                if elements[-1].count < 0:
                    raise ValueError
            elif words[:2] == ["property", "list"]:
                elements[-1].properties.append((words[4], _type(words[3], order), _type(words[2], order)))
            elif words[:1] == ["property"]:
                elements[-1].properties.append((words[2], _type(words[1], order), None))
        except (KeyError, IndexError, ValueError) as error:
            raise UserError("header cannot be read", file=path, field=f"line {number}", got=line) from error
    line_end = data.find(b"\n", end)
    if not order or line_end < 0:
        raise UserError("header cannot be read", file=path, expected="a format")
    return order, elements, line_end + 1


def _type(word: str, order: str) -> str:
    """numpy's name of a type; text is read as doubles."""
    if not order:
        raise ValueError
    kind = TYPES[word]
    return "f8" if order == "ascii" else order + kind


class _Rows:
    """Elements taken one after the other, each checked against the remaining bytes of the file."""

    def __init__(self, data: memoryview, path: Path) -> None:
        self._data, self._at, self._path = data, 0, path

    def take(self, kind: np.dtype[Any], count: int) -> np.ndarray[Any, Any]:
        """The next `count` rows."""
        self._check(self._at + kind.itemsize * count)
        array = np.frombuffer(self._data, kind, count, self._at)
        self._at += array.nbytes
        return array

    def faces(self, element: _Element) -> tuple[Indices, Indices]:
        """Corners of all faces, face after face, and their numbers (F,)."""
        if element.count == 0:
            return np.zeros(0, np.int64), np.zeros(0, np.int64)
        head, item = element.row(0), np.dtype(next(kind for _, kind, count in element.properties if count))
        count, size_at = head.fields["size"]  # type: ignore[index, misc]
        size_of = struct.Struct(count.str[0].replace("|", "<") + count.char)
        end, sizes = self._at, []
        for _ in range(element.count):
            self._check(end + head.itemsize)
            (size,) = size_of.unpack_from(self._data, end + size_at)
            if not 0 <= size < np.inf:
                raise UserError("face cannot be read", file=self._path, got=size)
            FACE_CORNERS.check(int(size), file=self._path)
            sizes.append(int(size))
            end += head.itemsize + sizes[-1] * item.itemsize
            if len(sizes) == 1 and (rows := self._alike(element.row(sizes[0]), element.count)) is not None:
                return _integers(rows["list"].reshape(-1)), np.full(len(rows), sizes[0])
        self._check(end)
        counts = np.array(sizes)
        before = np.arange(len(counts)) * head.itemsize + (np.cumsum(counts) - counts) * item.itemsize
        first = np.repeat(self._at + before + size_at + count.itemsize, counts) + ranges(counts) * item.itemsize
        self._at = end
        corners = np.frombuffer(self._data, np.uint8)[first[:, None] + np.arange(item.itemsize)].view(item)
        return _integers(corners.reshape(-1)), counts

    def _alike(self, kind: np.dtype[Any], count: int) -> np.ndarray[Any, Any] | None:
        """The next rows if all lists are as long as the first, as in most files; else None."""
        if self._at + kind.itemsize * count > len(self._data):
            return None
        rows = np.frombuffer(self._data, kind, count, self._at)
        if not (rows["size"] == rows["size"][0]).all():
            return None
        self._at += rows.nbytes
        return rows

    def _check(self, end: int) -> None:
        if end > len(self._data):
            raise UserError("file is truncated", file=self._path, hint="copy or download it again")


def _doubles(text: bytes, path: Path) -> memoryview:
    """The numbers of a text as bytes of doubles."""
    values = numbers_in(text)
    if values is None:
        raise UserError("has a word that is not a number", file=path)
    return values.view(np.uint8).data


def _columns(vertex: dict[str, Floats], *choices: tuple[str, ...]) -> Floats | None:
    """The first available one of several groups of properties, (V, n)."""
    names = next((group for group in choices if all(n in vertex for n in group)), None)
    return None if names is None else np.stack([vertex[n] for n in names], axis=-1)


def _integers(values: np.ndarray[Any, Any]) -> Indices:
    return np.nan_to_num(values, nan=-1).astype(np.int64) if values.dtype.kind == "f" else values.astype(np.int64)
