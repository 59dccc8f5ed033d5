"""The files of one array: one per chunk, and a journal of the writes since the last manifest.

The array is in zarr format 3, so that other programs can read it: `zarr.json`, and the chunk (0, 1) in `c/0/1`, as one
zstd frame of little-endian values, padded with zeros beyond the array. Shape and checksums come from the manifest;
`zarr.json` is never read here. A rewritten chunk is a new file, `c/0/1.1`, then `c/0/1.2`..., which other programs do
not find; if the process dies, the old file is still whole.

The journal has one line per event: "0.1 GENERATION CRC;" for a written chunk, "length N 0;" for a longer first axis.
A line begins with its newline and ends with its semicolon, so a partial line, left by a dead process or a full disk, is
ignored and does not corrupt the next. Replaying a line changes nothing.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import zlib
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numcodecs import Zstd

from lambent.core.errors import UserError
from lambent.core.files import inside, naming, write_bytes
from lambent.core.inputs import read_bytes
from lambent.store.artefact import Array, Artefact, Chunk, Region, Version, chunk_id

LENGTH = "length"
LIMIT_JOURNAL_BYTES = 1 << 28
_LINE = re.compile(rb"^([\d.]*|length) (\d+) (\d+);$", re.MULTILINE)
_ZSTD = Zstd(level=0)


class ChunkFiles:
    """Reads and writes the chunks of one artefact in its store's folder."""

    def __init__(self, store_folder: Path, artefact: Artefact) -> None:
        self.artefact, self._store_folder = artefact, store_folder
        self._folder = inside(store_folder, artefact.name)
        if not {".", ".."}.isdisjoint(artefact.name.split("/")) or self._folder == store_folder.resolve():
            raise UserError("is not the name of an array", file=store_folder, got=artefact.name)
        self._dtype = np.dtype(artefact.dtype).newbyteorder("<")
        self.journal = inside(self._folder, "journal")

    def create(self) -> None:
        """Create the array's folder afresh, without chunks."""
        self.remove()
        self.describe()

    def remove(self) -> None:
        """Delete the array's folder."""
        if self._folder.exists():
            shutil.rmtree(self._folder)

    def describe(self) -> None:
        """Write `zarr.json`."""
        from zarr import create_array  # imported here: readers do without zarr
        from zarr.codecs import ZstdCodec
        from zarr.storage import MemoryStore

        files: dict[str, Any] = {}
        a, codec = self.artefact, ZstdCodec(level=_ZSTD.level)
        create_array(MemoryStore(files), shape=a.shape, chunks=a.chunks, dtype=a.dtype, compressors=codec)
        write_bytes(inside(self._folder, "zarr.json"), files["zarr.json"].to_bytes())

    def write(self, chunk: Chunk, data: Array) -> None:
        """Write a chunk to disk, then record it in the journal, then delete the replaced file."""
        old = self.artefact.version(chunk)
        encoded = self._encoded(chunk, data)
        version = Version(zlib.crc32(encoded), 0 if old is None else old.generation + 1)
        path = self._path(chunk, version)
        if encoded:
            write_bytes(path, encoded)
        else:
            path.unlink(missing_ok=True)  # left by a process that died before recording it
        self._note(chunk_id(chunk), version.generation, version.crc)
        self.artefact.done[chunk_id(chunk)] = version
        if old is not None:
            _remove(self._path(chunk, old))

    def read(self, chunk: Chunk, version: Version) -> Array | None:
        """One version of a chunk, clipped to the array; None if its file is missing or fails its checksum."""
        size = math.prod(self.artefact.chunks) * self._dtype.itemsize
        encoded = _content(self._path(chunk, version), size + size // 128 + 1024)  # zstd's upper bound
        if zlib.crc32(encoded) != version.crc:
            return None
        if not encoded:
            return np.zeros([part.stop for part in self._inner(chunk)], self._dtype)
        try:
            if content_size(encoded) != size:
                raise ValueError(f"it holds {content_size(encoded)} bytes, not {size}")
            whole = np.frombuffer(_ZSTD.decode(encoded), self._dtype).reshape(self.artefact.chunks)
        except (RuntimeError, ValueError) as error:
            where, name = self._store_folder, f"{self.artefact.name} {chunk_id(chunk)}"
            raise UserError(f"chunk cannot be read ({error})", file=where, field=name, hint="bake again") from error
        return whole[self._inner(chunk)]

    def lengthen(self, length: int) -> None:
        """Make the first axis `length` long; the array is then incomplete."""
        longer = replace(self.artefact, shape=(length, *self.artefact.shape[1:]))
        longer.check(self._store_folder)
        ChunkFiles(self._store_folder, longer).describe()
        self._note(LENGTH, length, 0)
        self.artefact.shape, self.artefact.complete = longer.shape, False

    def read_journal(self) -> None:
        """Apply the journal to the artefact."""
        a = self.artefact
        for name, number, crc in ((w.decode(), int(n), int(c)) for w, n, c in self._lines()):
            if name == LENGTH:
                if number > a.shape[0]:
                    a.shape, a.complete = (number, *a.shape[1:]), False
                continue
            if a.has(name):
                a.done[name] = Version(crc, number)
            elif len(name.split(".") if name else ()) != len(a.shape):
                raise ValueError(f"{a.name}: the journal names an unknown chunk {name}")

    def _lines(self) -> list[tuple[bytes, bytes, bytes]]:
        """Name, number and checksum of every complete line of the journal."""
        return _LINE.findall(_content(self.journal, LIMIT_JOURNAL_BYTES))

    def size_bytes(self, chunk: Chunk) -> int:
        """Size of a chunk's file; 0 without one."""
        version = self.artefact.version(chunk)
        path = None if version is None else self._path(chunk, version)
        return path.stat().st_size if path is not None and path.exists() else 0

    def settle(self) -> None:
        """Once the manifest includes the journal: delete the journal and all unreferenced files."""
        a = self.artefact
        named = {self._path(chunk, version) for chunk in a.chunk_grid if (version := a.version(chunk)) is not None}
        for path in (self._folder / "c").rglob("*"):
            if path not in named and path.is_file():
                _remove(path)
        self.journal.unlink(missing_ok=True)

    def _note(self, name: str, number: int, crc: int) -> None:
        """Append a line to the journal and flush it to disk."""
        with naming(self.journal), self.journal.open("ab") as file:
            file.write(f"\n{name} {number} {crc};".encode("ascii"))
            file.flush()
            os.fsync(file.fileno())

    def _path(self, chunk: Chunk, version: Version) -> Path:
        name = "/".join(["c", *map(str, chunk)])
        return inside(self._folder, f"{name}.{version.generation}" if version.generation else name)

    def _encoded(self, chunk: Chunk, data: Array) -> bytes:
        """Bytes of a chunk's file; empty for a chunk of zeros, which has no file."""
        whole = np.zeros(self.artefact.chunks, self._dtype)
        whole[self._inner(chunk)] = data
        return bytes(_ZSTD.encode(whole)) if whole.reshape(-1).view(np.uint8).any() else b""

    def _inner(self, chunk: Chunk) -> Region:
        """Index of a chunk's values that lie within the array."""
        return tuple(slice(0, part.stop - part.start) for part in self.artefact.region(chunk))


def _content(path: Path, limit_bytes: int) -> bytes:
    """Content of a file; empty if it is missing."""
    try:
        return read_bytes(path, limit_bytes)
    except UserError as error:
        if isinstance(error.__cause__, FileNotFoundError):  # asked later, it may be there: writers make journals anew
            return b""
        raise


def content_size(frame: bytes) -> int:
    """Decompressed size stated by a zstd frame (RFC 8878, 3.1.1.1); -1 if it is not a frame or states none."""
    if frame[:4] != b"\x28\xb5\x2f\xfd" or len(frame) < 5:
        return -1
    kind, is_single, dictionary = frame[4] >> 6, frame[4] >> 5 & 1, frame[4] & 3
    at, length = 6 - is_single + (0, 1, 2, 4)[dictionary], (is_single, 2, 4, 8)[kind]
    return int.from_bytes(frame[at : at + length], "little") + 256 * (kind == 1) if length else -1


def _remove(path: Path) -> None:
    with suppress(PermissionError):  # on Windows, while another process reads it; `settle` deletes it later
        path.unlink(missing_ok=True)
