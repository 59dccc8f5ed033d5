"""Container of the RGL material database: named tensors in one little-endian file (Dupuy & Jakob 2018).

Layout: "tensor_file" NUL, version uint8 x 2 (1, 0), uint32 number of fields. Per field: uint16 length of the name, the
name, uint16 number of dimensions, uint8 type, uint64 offset of the data from the start of the file, uint64 per size.
"""

from __future__ import annotations

import math
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.ceilings import TENSOR_BYTES
from lambent.core.errors import UserError
from lambent.core.inputs import read_bytes

Tensors = dict[str, NDArray[np.generic]]

MAGIC = b"tensor_file\0"
_TYPES = {1: "u1", 2: "i1", 3: "<u2", 4: "<i2", 5: "<u4", 6: "<i4", 7: "<u8", 8: "<i8", 9: "<f2", 10: "<f4", 11: "<f8"}
_DIMENSIONS_MAX = 16


def read_tensors(path: Path) -> Tensors:
    """All tensors of the file by name, as views of its bytes.

    Raises
    ------
    UserError
        If the header is broken, or a tensor lies outside the file.
    """
    content = read_bytes(path, TENSOR_BYTES)
    try:
        return _parse(content, path)
    except (struct.error, UnicodeDecodeError) as error:
        raise UserError("header of the tensor file is truncated or malformed", file=path) from error


def _parse(content: bytes, path: Path) -> Tensors:
    version = struct.unpack_from("<2B", content, len(MAGIC))
    if version != (1, 0):
        raise UserError("unknown version of the tensor file", file=path, got=version, expected="(1, 0)")
    (count,) = struct.unpack_from("<I", content, len(MAGIC) + 2)
    at, tensors = len(MAGIC) + 6, {}
    for _ in range(count):
        (length,) = struct.unpack_from("<H", content, at)
        name = struct.unpack_from(f"<{length}s", content, at + 2)[0].decode("utf-8")
        at += 2 + length
        dimensions, kind, offset = struct.unpack_from("<HBQ", content, at)
        if kind not in _TYPES or dimensions > _DIMENSIONS_MAX:
            got = f"type {kind}, {dimensions} dimensions"
            raise UserError("unknown tensor type", file=path, field=name, got=got)
        shape = struct.unpack_from(f"<{dimensions}Q", content, at + 11)
        at += 11 + 8 * dimensions
        dtype = np.dtype(_TYPES[kind])
        end = offset + math.prod(shape) * dtype.itemsize
        # A size of 0 makes the product 0, so the other sizes are checked too.
        if end > len(content) or max(shape, default=0) > len(content):
            got, expected = f"shape {shape} at byte {offset}", f"to end by byte {len(content)}"
            raise UserError("tensor lies outside the file", file=path, field=name, got=got, expected=expected)
        tensors[name] = np.frombuffer(content, dtype, math.prod(shape), offset).reshape(shape)
    return tensors


def tensor_bytes(tensors: Tensors) -> bytes:
    """Bytes of a file with these tensors in order, readable by `read_tensors`; each starts at a multiple of 8 bytes."""
    kinds = {np.dtype(name): kind for kind, name in _TYPES.items()}
    names = {name: name.encode("utf-8") for name in tensors}
    offset = len(MAGIC) + 6 + sum(13 + len(names[name]) + 8 * tensor.ndim for name, tensor in tensors.items())
    head = [MAGIC, bytes((1, 0)), struct.pack("<I", len(tensors))]
    body: list[bytes] = []
    for name, tensor in tensors.items():
        padding = -offset % 8
        body.append(bytes(padding) + np.ascontiguousarray(tensor).tobytes())
        shape = struct.pack(f"<{tensor.ndim}Q", *tensor.shape)
        kind = struct.pack("<HBQ", tensor.ndim, kinds[tensor.dtype], offset + padding)
        head.append(struct.pack("<H", len(names[name])) + names[name] + kind + shape)
        offset += padding + tensor.nbytes
    return b"".join(head + body)
