"""What a bake is on disk: one folder, `manifest.json` and chunked compressed arrays.

Rules: a chunk is on disk before the manifest names it; the manifest is replaced whole, never edited; readers verify
the checksum of every chunk they read. So a store survives kill -9 at any moment and never reads as complete when it
is not. Only one process writes a store at a time.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import zarr
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.files import inside, write_text

FORMAT, VERSION = "lambent-store", 1
LIMIT_BYTES = 1 << 34  # of one array: a manifest that promises more is not believed
Array = NDArray[Any]
Chunk = tuple[int, ...]


@dataclass
class Artefact:
    """One array of a store, as its manifest tells it. `key` changes whenever anything it was made from changes."""

    name: str
    kind: str
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    key: str
    meta: dict[str, Any] = field(default_factory=dict)
    done: dict[str, int] = field(default_factory=dict)  # chunk id "0.1" -> crc32 of its file
    complete: bool = False

    @property
    def chunk_counts(self) -> tuple[int, ...]:
        return tuple(-(-size // step) for size, step in zip(self.shape, self.chunks, strict=True))

    @property
    def chunk_grid(self) -> list[Chunk]:
        return list(product(*(range(count) for count in self.chunk_counts)))

    @property
    def state(self) -> str:
        return "complete" if self.complete else f"partial ({len(self.done)} of {math.prod(self.chunk_counts)} chunks)"


class Store:
    """A folder of named arrays. Make one with `create` or `open`; never construct it by hand."""

    def __init__(self, folder: Path, manifest: dict[str, Any]) -> None:
        self.folder = folder
        self.inputs: dict[str, str] = manifest["inputs"]
        self.documents: dict[str, Any] = manifest["documents"]
        self._artefacts = {name: _artefact(name, entry) for name, entry in manifest["artefacts"].items()}

    @classmethod
    def create(cls, folder: Path, inputs: Mapping[str, str]) -> Store:
        """The store in `folder`, made where there is none. `inputs` maps the name of each input to its hash.

        An existing store keeps its arrays; the bake finds out by their `key` which of them are stale.
        """
        folder = Path(folder)
        if (folder / "manifest.json").exists():
            store = cls.open(folder)
            store.inputs = dict(inputs)
        elif folder.exists() and any(folder.iterdir()):
            raise UserError("folder is not empty and not a store", file=folder, hint="choose another folder")
        else:
            store = cls(folder, {"inputs": dict(inputs), "documents": {}, "artefacts": {}})
        store._save()
        return store

    @classmethod
    def open(cls, folder: Path) -> Store:
        """The store in `folder`; `UserError` where it is none, of another version, or damaged."""
        path = Path(folder) / "manifest.json"
        if not path.exists():
            raise UserError("not a store", file=folder, expected="manifest.json", hint="make one with `lambent bake`")
        try:
            manifest = json.loads(path.read_text(encoding="utf-8"))
            if manifest["format"] != FORMAT or manifest["version"] != VERSION:
                found = f"{manifest['format']} {manifest['version']}"
                raise UserError("unknown store", file=path, got=found, expected=f"{FORMAT} {VERSION}")
            return cls(Path(folder), manifest)
        except (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError) as error:
            raise UserError(f"manifest is damaged ({error})", file=path, hint="bake again") from error

    def artefacts(self, kind: str | None = None) -> list[Artefact]:
        return [a for a in self._artefacts.values() if kind is None or a.kind == kind]

    def __contains__(self, name: str) -> bool:
        """Whether the artefact is there and complete."""
        return name in self._artefacts and self._artefacts[name].complete

    def artefact(self, name: str) -> Artefact:
        if name not in self._artefacts:
            raise UserError("store does not hold this", file=self.folder, field=name, hint="bake it first")
        return self._artefacts[name]

    def set_document(self, name: str, document: Any) -> None:
        """Keep a small JSON value (the scene record, timings) in the manifest."""
        self.documents[name] = document
        self._save()

    def forget_all(self) -> None:
        """Drop every array, so that a bake starts anew; their files go when they are written again."""
        self._artefacts.clear()
        self._save()

    def begin(
        self,
        name: str,
        kind: str,
        shape: Sequence[int],
        chunks: Sequence[int],
        dtype: str,
        *,
        key: str,
        meta: Mapping[str, Any] | None = None,
    ) -> Writer:
        """Start, or go on with, an array.

        Where the store holds chunks of the same `key`, shape and chunking, they are kept and `Writer.missing` lists
        the rest; otherwise the array starts empty.
        """
        found = self._artefacts.get(name)
        wanted = Artefact(name, kind, tuple(shape), tuple(chunks), np.dtype(dtype).name, key, dict(meta or {}))
        same = found is not None and (found.key, found.shape, found.chunks, found.dtype) == (
            key, wanted.shape, wanted.chunks, wanted.dtype,
        )  # fmt: skip
        if not same or found is None:
            found = self._artefacts[name] = wanted
            self._save()  # forget the old chunks before their files change
            zarr.create_array(
                inside(self.folder, name), shape=wanted.shape, chunks=wanted.chunks, dtype=wanted.dtype, overwrite=True
            )
        return Writer(self, found)

    def put(self, name: str, kind: str, array: Array, *, key: str, meta: Mapping[str, Any] | None = None) -> None:
        """Write a whole array at once, as one chunk."""
        shape = tuple(max(1, size) for size in array.shape)
        writer = self.begin(name, kind, array.shape, shape, array.dtype.name, key=key, meta=meta)
        for chunk in writer.missing:
            writer.write(chunk, array)
        writer.finish()

    def read(self, name: str) -> Array:
        """The whole array; `UserError` where it is absent, incomplete or damaged."""
        artefact = self.artefact(name)
        if not artefact.complete:
            raise UserError(f"is {artefact.state}", file=self.folder, field=name, hint="go on with `bake --resume`")
        for chunk in artefact.chunk_grid:
            if self._crc(name, chunk) != artefact.done[_id(chunk)]:
                raise UserError("chunk is damaged", file=self.folder, field=f"{name} {_id(chunk)}", hint="bake again")
        array: Array = np.asarray(self._open_array(artefact, "r")[...])
        return array

    def _open_array(self, artefact: Artefact, mode: Literal["r", "r+"]) -> zarr.Array[Any]:
        try:
            array = zarr.open_array(inside(self.folder, artefact.name), mode=mode)
            if (array.shape, array.chunks, np.dtype(artefact.dtype)) == (artefact.shape, artefact.chunks, array.dtype):
                return array
            reason = "another shape or type than the manifest says"
        except (OSError, ValueError, KeyError, TypeError) as error:
            reason = str(error)
        raise UserError(f"array is damaged ({reason})", file=self.folder, field=artefact.name, hint="bake again")

    def _crc(self, name: str, chunk: Chunk) -> int:
        path = inside(self.folder, name) / "c" / Path(*map(str, chunk)) if chunk else inside(self.folder, name) / "c"
        # A chunk of zeros is not written at all by zarr: its absence is its content.
        return zlib.crc32(path.read_bytes()) if path.exists() else 0

    def _save(self) -> None:
        manifest = {
            "format": FORMAT,
            "version": VERSION,
            "inputs": self.inputs,
            "documents": self.documents,
            "artefacts": {a.name: _entry(a) for a in self._artefacts.values()},
        }
        write_text(self.folder / "manifest.json", json.dumps(manifest, indent=1))


class Writer:
    """Writes the chunks of one array; see `Store.begin`."""

    def __init__(self, store: Store, artefact: Artefact) -> None:
        self._store, self.artefact = store, artefact
        self._array = store._open_array(artefact, "r+")

    @property
    def missing(self) -> list[Chunk]:
        return [chunk for chunk in self.artefact.chunk_grid if _id(chunk) not in self.artefact.done]

    def region(self, chunk: Chunk) -> tuple[slice, ...]:
        """Index of the array that a chunk covers (cut at the array's end)."""
        a = self.artefact
        return tuple(
            slice(i * step, min((i + 1) * step, size)) for i, step, size in zip(chunk, a.chunks, a.shape, strict=True)
        )

    def write(self, chunk: Chunk, data: Array) -> None:
        """Put a chunk on disk, then name it in the manifest."""
        self._array[self.region(chunk)] = data
        self.artefact.done[_id(chunk)] = self._store._crc(self.artefact.name, chunk)
        self._store._save()

    def read_chunk(self, chunk: Chunk) -> Array:
        """A chunk written before, to build on."""
        data: Array = np.asarray(self._array[self.region(chunk)])
        return data

    def finish(self, **meta: Any) -> None:
        """Mark the array complete; every chunk must have been written."""
        assert not self.missing, f"{self.artefact.name}: {len(self.missing)} chunks missing"
        self.artefact.meta.update(meta)
        self.artefact.complete = True
        self._store._save()


def _id(chunk: Chunk) -> str:
    return ".".join(map(str, chunk))


def _entry(a: Artefact) -> dict[str, Any]:
    return {
        "kind": a.kind, "shape": a.shape, "chunks": a.chunks, "dtype": a.dtype, "key": a.key,
        "meta": a.meta, "done": a.done, "complete": a.complete,
    }  # fmt: skip


def _artefact(name: str, e: dict[str, Any]) -> Artefact:
    """The manifest's entry, or an error that `Store.open` turns into "manifest is damaged"."""
    shape, chunks = tuple(map(int, e["shape"])), tuple(map(int, e["chunks"]))
    a = Artefact(
        name, e["kind"], shape, chunks, e["dtype"], e["key"], dict(e["meta"]), dict(e["done"]), e["complete"] is True
    )
    if min(shape, default=0) < 0 or math.prod(shape) * np.dtype(a.dtype).itemsize > LIMIT_BYTES:
        raise ValueError(f"{name}: impossible shape {shape}")
    if a.complete and len(a.done) != math.prod(a.chunk_counts):
        raise ValueError(f"{name}: complete with {len(a.done)} chunks")
    return a
