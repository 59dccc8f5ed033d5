"""Mitsuba 0.6's binary meshes (.serialized): deflated, several per file. Sizes are checked before unpacking.

Source: Mitsuba 0.6's manual, "Serialized mesh loader".
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np

from lambent.core.ceilings import SERIALIZED_BYTES, SERIALIZED_VERTICES, TRIANGLES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes
from lambent.scenes.loaders.meshes.repair import MeshArrays

MAGIC = 0x041C
DOUBLE = 0x2000
OPTIONAL = ((0x0001, "normals", 3), (0x0002, "uv", 2), (0x0008, "colours", 3))
HEAD_BYTES = 1 << 16  # of a mesh: contains its flags, name and counts


def read(path: Path, index: int) -> MeshArrays:
    """Read mesh number `index` of a file.

    Raises
    ------
    UserError
        If the file is damaged, truncated, or promises more than it holds.
    """
    data = read_bytes(path, SERIALIZED_BYTES)
    start, version = _offset(data, index, path)
    inflate = zlib.decompressobj()

    def unpacked(packed: bytes | memoryview, limit_bytes: int) -> bytes:
        try:
            return inflate.decompress(packed, limit_bytes)
        except zlib.error as error:
            raise UserError(f"packed data is damaged ({error})", file=path) from error

    head = unpacked(memoryview(data)[start + 4 :], HEAD_BYTES)
    begin = 4 if version == 3 else head.find(b"\0", 4) + 1  # after the name, which exists in version 4
    if not 4 <= begin <= len(head) - 16:
        raise UserError("mesh is truncated, or its name does not end", file=path, got=f"{len(head)} bytes")
    flags, (vertices, triangles) = struct.unpack_from("<I", head)[0], struct.unpack_from("<QQ", head, begin)
    SERIALIZED_VERTICES.check(vertices, file=path)
    TRIANGLES.check(triangles, file=path)
    real = np.dtype("<f8" if flags & DOUBLE else "<f4")
    widths = {"positions": 3, **{name: width for bit, name, width in OPTIONAL if flags & bit}}
    size = 12 * triangles + vertices * real.itemsize * sum(widths.values())
    body = head[begin + 16 :] + unpacked(inflate.unconsumed_tail, max(size - len(head) + begin + 16, 1))
    if len(body) < size:
        raise UserError("mesh is truncated", file=path, got=f"{len(body)} bytes", expected=size)
    arrays, at = {}, 0
    for name, width in widths.items():
        values = np.frombuffer(body, real, vertices * width, at)
        arrays[name], at = values.reshape(vertices, width).astype(float), at + values.nbytes
    faces = np.frombuffer(body, "<u4", triangles * 3, at).reshape(triangles, 3)
    return MeshArrays(arrays["positions"], faces.astype(np.int64), arrays.get("normals"), arrays.get("uv"))


def _offset(data: bytes, index: int, path: Path) -> tuple[int, int]:
    """First byte of a mesh, and the file's version."""
    if len(data) < 8 or struct.unpack_from("<H", data)[0] != MAGIC:
        raise UserError("not a serialized mesh", file=path, got=repr(data[:2]))
    version = struct.unpack_from("<H", data, 2)[0]
    if version not in (3, 4):
        raise UserError("unknown version of serialized meshes", file=path, got=version, expected="3 or 4")
    count = struct.unpack_from("<I", data, len(data) - 4)[0]
    width = 8 if version == 4 else 4
    if not 0 <= index < count or 4 + count * width > len(data):
        raise UserError("mesh index out of range", file=path, field="shape_index", got=index, expected=f"below {count}")
    place = len(data) - 4 - (count - index) * width
    start = struct.unpack_from("<Q" if version == 4 else "<I", data, place)[0]
    if start + 4 > len(data) or struct.unpack_from("<H", data, start)[0] != MAGIC:
        raise UserError("dictionary is damaged", file=path, field="shape_index", got=index)
    return start, version
