"""glTF on disk: the container, its buffers and accessors. Every length is checked before it is used for reading."""

from __future__ import annotations

import base64
import binascii
import struct
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import unquote

import numpy as np
from pydantic import ValidationError

from lambent.core.ceilings import ELEMENTS_READ, GLTF_BYTES, GLTF_JSON_BYTES, ZEROS, Ceiling
from lambent.core.errors import UserError, invalid
from lambent.core.geometry.directions import Floats
from lambent.core.inputs import parse_json, read_bytes
from lambent.scenes.loaders.gltf.schema import READ_EXTENSIONS, GltfDocument
from lambent.scenes.loaders.scene_files import SceneFiles

MAGIC, JSON_CHUNK, BIN_CHUNK = 0x46546C67, 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
T = TypeVar("T")


@dataclass(frozen=True)
class Gltf:
    """A document with its buffers in memory; `files` are its source files."""

    path: Path
    document: GltfDocument
    buffers: tuple[bytes, ...]
    files: SceneFiles
    asked: Counter[str] = field(default_factory=Counter)  # numbers in accessors so far, and zeros among them

    def error(self, message: str, field: str, got: object, expected: object) -> UserError:
        return UserError(message, file=self.path, field=field, got=got, expected=expected)

    def pick(self, items: Sequence[T], index: int, field: str) -> T:
        """`items[index]`; raises `UserError` that names the field if the index is invalid."""
        if index >= len(items):
            raise self.error("index out of range", field, index, f"below {len(items)}")
        return items[index]

    def view(self, index: int) -> tuple[bytes, int, int, int | None]:
        """Buffer, first byte, length and stride of a buffer view."""
        view = self.pick(self.document.bufferViews, index, "bufferViews")
        buffer = self.pick(self.buffers, view.buffer, f"bufferViews.{index}.buffer")
        end = view.byteOffset + view.byteLength
        if end > len(buffer):
            raise self.error(
                "buffer view ends beyond its buffer", f"bufferViews.{index}", f"{end} bytes", f"at most {len(buffer)}"
            )
        return buffer, view.byteOffset, view.byteLength, view.byteStride

    def accessor(self, index: int) -> np.ndarray[Any, Any]:
        """Array (count, width) of an accessor, as stored; a copy."""
        field = f"accessors.{index}"
        a = self.pick(self.document.accessors, index, "accessors")
        dtype, width = np.dtype(COMPONENTS[a.componentType]), WIDTHS[a.type]
        if a.bufferView is None:
            self._ask("zeros", ZEROS, a.count * width, field)
            array = np.zeros((a.count, width), dtype)
        else:
            array = self._elements(a.bufferView, a.byteOffset, dtype, (a.count, width), field)
        self._ask("read", ELEMENTS_READ, a.count * width, field)
        s, field = a.sparse, f"{field}.sparse"
        if s is not None and s.count > a.count:
            raise self.error("has more values than its accessor", field, s.count, f"at most {a.count}")
        if s is not None and s.count:
            kind = np.dtype(COMPONENTS[s.index_type])
            places = self._elements(s.index_view, s.index_offset, kind, (s.count, 1), f"{field}.indices")
            if int(places.max()) >= a.count:
                raise self.error("index out of range", field, int(places.max()), f"below {a.count}")
            values = self._elements(s.value_view, s.value_offset, dtype, (s.count, width), f"{field}.values")
            array[places[:, 0]] = values
        return array

    def is_stored(self, index: int) -> bool:
        """Whether an accessor's numbers are in the file, uncompressed."""
        a = self.pick(self.document.accessors, index, "accessors")
        return a.bufferView is not None or a.sparse is not None

    def _ask(self, what: str, ceiling: Ceiling, count: int, field: str) -> None:
        self.asked[what] += count
        ceiling.check(self.asked[what], file=self.path, field=field)

    def _elements(
        self, view: int, offset: int, dtype: np.dtype[Any], shape: tuple[int, int], field: str
    ) -> np.ndarray[Any, Any]:
        """Elements (count, width) of a buffer view; a copy."""
        count, width = shape
        buffer, start, length, stride = self.view(view)
        step = stride or dtype.itemsize * width
        need = offset + step * (count - 1) + dtype.itemsize * width if count else 0
        if need > length:
            raise self.error("accessor ends beyond its buffer view", field, f"{need} bytes", f"at most {length}")
        if count == 0:
            return np.zeros((0, width), dtype)
        return np.ndarray(shape, dtype, buffer, start + offset, (step, dtype.itemsize)).copy()

    def floats(self, index: int, width: int, field: str) -> Floats:
        """Accessor as float64 (count, width); normalised integers become [0, 1] or [-1, 1]."""
        array = self.accessor(index)
        if array.shape[1] != width:
            raise self.error("wrong accessor type", field, f"{array.shape[1]} components", width)
        values = array.astype(float)
        if self.document.accessors[index].normalized and array.dtype.kind in "iu":
            values = np.maximum(values / np.iinfo(array.dtype).max, -1.0)
        return values

    def is_missing(self, uri: str, field: str) -> bool:
        """Whether a uri names a missing file."""
        return not uri.startswith("data:") and not is_remote(uri) and not self._file(uri, field).exists()

    def resource(self, uri: str, field: str) -> bytes:
        """Bytes of a uri: embedded data, or a file in the scene's folder or below."""
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except binascii.Error as error:
                raise UserError(f"base64 data is damaged ({error})", file=self.path, field=field) from error
        if is_remote(uri):
            hint = "put the file beside the scene"
            raise UserError("is on the network", file=self.path, field=field, got=uri, hint=hint)
        return self.files.read(self._file(uri, field), GLTF_BYTES)

    def _file(self, uri: str, field: str) -> Path:
        return self.files.path(unquote(uri), self.path, field)


def is_remote(uri: str) -> bool:
    """Whether a uri refers to the network."""
    return not uri.startswith("data:") and "://" in uri


def read(path: Path, root: Path | None) -> Gltf:
    """A .glb or .gltf file with all its buffers; referenced files must be below `root`, by default its own folder.

    Raises
    ------
    UserError
        If the file is truncated, not glTF 2.0, requires an unsupported extension, or refers to a file elsewhere.
    """
    data = read_bytes(path, GLTF_BYTES)
    text, binary = _chunks(data, path) if path.suffix.lower() == ".glb" else (data, None)
    if len(text) > GLTF_JSON_BYTES:
        expected, hint = f"at most {GLTF_JSON_BYTES}", "save it as .glb, or with its buffers in files"
        raise UserError("JSON is too large", file=path, got=f"{len(text)} bytes", expected=expected, hint=hint)
    raw = parse_json(text, path)
    if not isinstance(raw, dict):
        raise UserError("not a glTF document", file=path, got=type(raw).__name__, expected="an object")
    try:
        document = GltfDocument.model_validate(raw)
    except ValidationError as error:
        raise invalid(error, path) from error
    if not document.version.startswith("2."):
        raise UserError("unknown glTF version", file=path, field="asset.version", got=document.version, expected=2)
    unread = sorted(set(document.extensionsRequired) - READ_EXTENSIONS)
    if unread:
        advice = "export without compression" if any("compression" in name for name in unread) else None
        if any("basisu" in name for name in unread):
            advice = "export its textures as PNG, JPEG or WebP"
        raise UserError("requires an unsupported extension", file=path, got=", ".join(unread), hint=advice)
    gltf = Gltf(path, document, (), SceneFiles(path, root))
    return replace(gltf, buffers=tuple(_buffers(gltf, binary)))


def _buffers(gltf: Gltf, binary: bytes | None) -> Iterator[bytes]:
    """The content of every buffer; `binary` is the first one's if it has no uri. Buffers with equal uri share it."""
    known: dict[str, bytes] = {}
    for i, buffer in enumerate(gltf.document.buffers):
        field = f"buffers.{i}"
        if buffer.uri is None and (i or binary is None):
            raise UserError("has neither a uri nor a binary chunk", file=gltf.path, field=field)
        uri = buffer.uri
        if uri is not None and uri not in known:
            known[uri] = gltf.resource(uri, field)
        content = binary if uri is None else known[uri]
        assert content is not None
        if len(content) < buffer.byteLength:
            raise gltf.error("buffer is truncated", field, f"{len(content)} bytes", buffer.byteLength)
        yield content


def _chunks(data: bytes, path: Path) -> tuple[bytes, bytes | None]:
    """JSON and binary chunk of a GLB container."""
    if len(data) < 20 or struct.unpack_from("<I", data)[0] != MAGIC:
        raise UserError("not a GLB file", file=path, got=repr(data[:4]), expected="glTF at its start")
    _, version, total = struct.unpack_from("<III", data)
    if version != 2:
        raise UserError("unknown GLB version", file=path, got=version, expected=2)
    if total > len(data):
        raise UserError("file is truncated", file=path, got=f"{len(data)} bytes", expected=f"{total} by its header")
    chunks: dict[int, bytes] = {}
    offset = 12
    while offset + 8 <= total:
        length, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + length > total:
            left = f"{total - offset - 8} left"
            raise UserError(
                "a chunk ends beyond the file", file=path, got=f"{length} bytes", expected=f"at most {left}"
            )
        chunks.setdefault(kind, data[offset + 8 : offset + 8 + length])
        offset += 8 + length
    if JSON_CHUNK not in chunks:
        raise UserError("no JSON chunk", file=path)
    return chunks[JSON_CHUNK], chunks.get(BIN_CHUNK)
