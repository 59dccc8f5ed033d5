"""Mitsuba 0.6's binary meshes (.serialized): deflated, several in a file. Sizes are checked before unpacking.

Source: Mitsuba 0.6's manual, "Serialized mesh loader".
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.scenes.loaders.polygons import Arrays

LIMIT_BYTES = 2 << 30
MAGIC = 0x041C
NORMALS, UV, COLOURS, SINGLE, DOUBLE = 0x0001, 0x0002, 0x0008, 0x1000, 0x2000
VERTICES_MAX, TRIANGLES_MAX = 60_000_000, 20_000_000
NAME_MAX = 1 << 16


def read(path: Path, index: int) -> Arrays:
    """The mesh of a number in a file.

    Raises
    ------
    UserError
        Where the file is damaged, cut off, or promises more than it holds.
    """
    data = read_bytes(path, LIMIT_BYTES)
    start, version = _offset(data, index, path)
    stream = _Stream(data, start + 4, path)
    flags = struct.unpack("<I", stream.take(4))[0]
    if version == 4:
        for _ in range(NAME_MAX):
            if stream.take(1) == b"\0":
                break
        else:
            raise UserError("name does not end", file=path)
    vertices, triangles = struct.unpack("<QQ", stream.take(16))
    if vertices > VERTICES_MAX or triangles > TRIANGLES_MAX:
        got, most = f"{vertices} vertices, {triangles} triangles", f"at most {VERTICES_MAX} and {TRIANGLES_MAX}"
        raise UserError("mesh is too large", file=path, got=got, expected=most)
    kind = np.dtype("<f8" if flags & DOUBLE else "<f4")

    def array(count: int, width: int, dtype: np.dtype) -> np.ndarray:  # type: ignore[type-arg]
        return np.frombuffer(stream.take(count * width * dtype.itemsize), dtype).reshape(count, width)

    positions = array(vertices, 3, kind).astype(float)
    normals = array(vertices, 3, kind).astype(float) if flags & NORMALS else None
    uv = array(vertices, 2, kind).astype(float) if flags & UV else None
    if flags & COLOURS:
        stream.take(vertices * 3 * kind.itemsize)
    index_kind = np.dtype("<u8" if vertices > 0xFFFFFFFF else "<u4")
    return Arrays(positions, normals, uv, array(triangles, 3, index_kind).astype(np.int64))


def _offset(data: bytes, index: int, path: Path) -> tuple[int, int]:
    """Where a mesh begins, and the file's version."""
    if len(data) < 8 or struct.unpack_from("<H", data)[0] != MAGIC:
        raise UserError("not a serialized mesh", file=path, got=repr(data[:2]))
    version = struct.unpack_from("<H", data, 2)[0]
    if version not in (3, 4):
        raise UserError("unknown version of serialized meshes", file=path, got=version, expected="3 or 4")
    count = struct.unpack_from("<I", data, len(data) - 4)[0]
    width = 8 if version == 4 else 4
    if not 0 <= index < count or 4 + count * width > len(data):
        raise UserError("file has no such mesh", file=path, field="shape_index", got=index, expected=f"below {count}")
    place = len(data) - 4 - (count - index) * width
    start = struct.unpack_from("<Q" if version == 4 else "<I", data, place)[0]
    if start + 4 > len(data) or struct.unpack_from("<H", data, start)[0] != MAGIC:
        raise UserError("dictionary is damaged", file=path, field="shape_index", got=index)
    return start, version


class _Stream:
    """Deflated data, unpacked no further than it is asked for."""

    def __init__(self, data: bytes, start: int, path: Path) -> None:
        self._packed: bytes | memoryview = memoryview(data)[start:]
        self._inflate, self._path = zlib.decompressobj(), path
        self._ready = b""

    def take(self, count: int) -> bytes:
        parts, have = [self._ready], len(self._ready)
        while have < count:
            try:
                piece = self._inflate.decompress(self._packed, max(count - have, 4096))
            except zlib.error as error:
                raise UserError(f"packed data is damaged ({error})", file=self._path) from error
            self._packed = self._inflate.unconsumed_tail
            if not piece:
                raise UserError("mesh is cut off", file=self._path, got=f"{have} bytes", expected=count)
            parts.append(piece)
            have += len(piece)
        whole = b"".join(parts)
        self._ready = whole[count:]
        return whole[:count]
