"""A bake on disk: one folder with `manifest.json` and chunked, compressed arrays, each with a journal.

Rules: a chunk is on disk before the array's journal records it. The manifest is replaced whole, never edited; it
absorbs a journal when the array is finished or the next writer starts. A rewritten chunk is a new file. Readers verify
the checksum of every chunk. So a store survives kill -9 at any moment and never reads as complete when it is not.

Only one process writes a store at a time; readers never wait. The first writing call of a `Store` takes the lock
(`lambent.store.lock`); `Store.close` or deletion of the object releases it.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError
from lambent.core.files import remove_left_over, write_text
from lambent.core.inputs import read_bytes
from lambent.core.machine import memory_bytes
from lambent.core.outputs import check_new_folder
from lambent.store.artefact import Array, Artefact, Chunk, Region, chunk_id
from lambent.store.chunk_files import ChunkFiles
from lambent.store.lock import WriterLock

FORMAT, VERSIONS = "lambent-store", (1, 2)  # version 2 has rewritten chunks, whose files readers of 1 do not find
MANIFEST = "manifest.json"
__all__ = ["Array", "Artefact", "Chunk", "Store", "Writer"]
LIMIT_BYTES = 1 << 28  # of a manifest
SPARSE_BYTES, DENSEST = 1 << 30, 1 << 16  # larger arrays need files: zstd's highest ratio
_DAMAGE = (OSError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, RecursionError, SyntaxError)


class Store:
    """A folder of named arrays. Obtain one from `create` or `open`, never from the constructor."""

    def __init__(self, folder: Path) -> None:
        self.folder = Path(folder)
        self.inputs: dict[str, str] = {}
        self.documents: dict[str, Any] = {}
        self._artefacts: dict[str, Artefact] = {}
        self._entries: dict[str, _Entry] = {}  # as in the last manifest, less those changed since
        self._texts: dict[str, tuple[Any, str]] = {}  # of documents, likewise
        self._lock: WriterLock | None = None

    @classmethod
    def create(cls, folder: Path, inputs: Mapping[str, str]) -> Store:
        """Open the store in `folder` for writing, and create it if needed. `inputs` maps each input to its hash.

        An existing store keeps its arrays; the bake detects stale ones by their `key`.

        Raises
        ------
        UserError
            If the folder holds something else or is named like a file, or another process is writing the store.
        """
        store = cls(folder)
        check_new_folder(store.folder, "a store")
        if not (store.folder / MANIFEST).exists() and store.folder.exists():
            names = [path.name for path in store.folder.iterdir()]
            if not all(name.startswith(".") for name in names):  # hidden: left by a process that died early
                raise UserError("folder is neither empty nor a store", file=folder, hint="choose another folder")
        store._own()
        store.inputs = dict(inputs)
        store._save()
        return store

    @classmethod
    def open(cls, folder: Path) -> Store:
        """Open the store in `folder`; `UserError` if it is not one, of another version, or damaged."""
        store = cls(folder)
        store._load()
        return store

    def close(self) -> None:
        """Release the lock; reading goes on, and the next writing call takes the lock again."""
        if self._lock is not None:
            self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def refresh(self) -> None:
        """Load the changes of other processes. `Artefact` objects obtained earlier stay unchanged."""
        if not self._writes:
            self._load()

    def artefacts(self, kind: str | None = None) -> list[Artefact]:
        """All arrays, or those of one kind, finished or not."""
        return [a for a in self._artefacts.values() if kind is None or a.kind == kind]

    def __contains__(self, name: str) -> bool:
        """Whether the artefact is there and complete."""
        return name in self._artefacts and self._artefacts[name].complete

    def availability(self, name: str) -> tuple[Literal["absent", "partial", "complete"], float]:
        """State of an artefact, and the fraction of its chunks that is written (0 to 1)."""
        if name not in self._artefacts:
            return "absent", 0.0
        a = self._artefacts[name]
        return ("complete", 1.0) if a.complete else ("partial", len(a.done) / max(1, math.prod(a.chunk_counts)))

    def artefact(self, name: str) -> Artefact:
        """The record of an array; `UserError` if the store has none of this name."""
        if name not in self._artefacts:
            raise self._error("array is not in the store", name, "bake it first")
        return self._artefacts[name]

    def set_document(self, name: str, document: Any) -> None:
        """Keep a small JSON value (scene record, timings) in the manifest."""
        self._own()
        self.documents[name] = document
        self._texts.pop(name, None)
        self._save()

    def forget_all(self) -> None:
        """Drop all arrays, so that a bake starts afresh; their files are deleted when they are rewritten."""
        self._own()
        self._artefacts.clear()
        self._save()

    def forget(self, names: Iterable[str]) -> None:
        """Drop the arrays of these names, if present, and their files."""
        self._own()
        dropped = [self._artefacts.pop(name) for name in list(names) if name in self._artefacts]
        self._save()
        for artefact in dropped:
            ChunkFiles(self.folder, artefact).remove()

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
        growing: bool = False,
    ) -> Writer:
        """Start or resume an array.

        Chunks of the same `key`, shape and chunking are kept, and `Writer.missing` lists the rest; otherwise the array
        starts empty. The first axis of a `growing` array is lengthened by `Writer.extend`; it starts at the longer of
        the stored length and `shape`.
        """
        self._own()
        wanted = Artefact(name, kind, tuple(shape), tuple(chunks), np.dtype(dtype).name, key, dict(meta or {}))
        wanted.check(self.folder)
        found = self._artefacts.get(name)
        if found is None or not found.is_same(wanted, growing=growing):
            files = ChunkFiles(self.folder, wanted)
            if self._artefacts.pop(name, None) is not None:
                self._save()  # forget the old chunks before their files change
            files.create()
            self._artefacts[name] = found = wanted
            self._save()
        writer = Writer(self, found)
        if growing and wanted.shape[0] > found.shape[0]:
            writer.extend(wanted.shape[0] - found.shape[0])
        return writer

    def put(self, name: str, kind: str, array: Array, *, key: str, meta: Mapping[str, Any] | None = None) -> None:
        """Write a whole array as one chunk."""
        shape = tuple(max(1, size) for size in array.shape)
        writer = self.begin(name, kind, array.shape, shape, array.dtype.name, key=key, meta=meta)
        for chunk in writer.missing:
            writer.write(chunk, array)
        writer.finish()

    def read(self, name: str) -> Array:
        """The whole array; `UserError` if it is absent, incomplete or damaged."""
        artefact = self.artefact(name)
        if not artefact.complete:
            raise self._error(f"is {artefact.state}", name, "run `lambent bake` again to finish it")
        return self.read_region(name, ())

    def read_partial(self, name: str) -> tuple[Array, NDArray[np.bool_]]:
        """The array as far as written, zero elsewhere, and flags of written chunks (`Artefact.written`)."""
        artefact = self.artefact(name)
        written = artefact.written
        chunks = [chunk for chunk in artefact.chunk_grid if written[chunk]]
        return self._gathered(artefact, tuple(slice(0, size) for size in artefact.shape), chunks), written

    def read_region(self, name: str, region: Sequence[slice]) -> Array:
        """Part of an array, complete or not; `UserError` if one of its chunks is unwritten or damaged.

        `region` has slices without a step, for the first axes or for all. Only chunks that overlap it are read. For one
        chunk, use `artefact.region(chunk)`.
        """
        artefact = self.artefact(name)
        parts = [*region, *[slice(None)] * (len(artefact.shape) - len(region))]
        plain = tuple(slice(*part.indices(size)[:2]) for part, size in zip(parts, artefact.shape, strict=True))
        return self._gathered(artefact, plain, artefact.chunks_in(plain))

    def _gathered(self, artefact: Artefact, region: Region, chunks: Iterable[Chunk]) -> Array:
        """Values of a region, from the given chunks."""
        files, chunks = ChunkFiles(self.folder, artefact), list(chunks)
        size = math.prod(max(0, part.stop - part.start) for part in region) * np.dtype(artefact.dtype).itemsize
        if size > memory_bytes() // 2:
            raise self._error(f"array of {size} bytes does not fit into memory", artefact.name, "use a larger machine")
        if size > SPARSE_BYTES and size > DENSEST * sum(map(files.size_bytes, chunks)):
            raise self._error(f"array of {size} bytes has almost no data on disk", artefact.name, "bake again")
        gathered = np.zeros([max(0, part.stop - part.start) for part in region], artefact.dtype)
        for chunk in chunks:
            covered = artefact.region(chunk)
            pairs = zip(region, covered, strict=True)
            both = [slice(max(part.start, c.start), min(part.stop, c.stop)) for part, c in pairs]
            gathered[_within(both, region)] = self._piece(files, chunk)[_within(both, covered)]
        return gathered

    def _piece(self, files: ChunkFiles, chunk: Chunk) -> Array:
        """A chunk that passes its checksum; the newer version if another process has rewritten it."""
        artefact, name = files.artefact, files.artefact.name
        field = f"{name} {chunk_id(chunk)}"
        while (version := artefact.version(chunk)) is not None:
            piece = files.read(chunk, version)
            if piece is not None:
                return piece
            self.refresh()
            artefact = self.artefact(name)
            if not artefact.is_same(files.artefact, growing=True):
                raise self._error("was rewritten while it was read", name, "read it again")
            if artefact.version(chunk) == version:
                raise self._error("chunk is damaged", field, "bake again with --anew")
        raise self._error("chunk is not written", field, "bake it first")

    def broken(self, field: str, fault: str = "", got: object = None, expected: object = None) -> UserError:
        """The error for an array or a record that contradicts itself or others."""
        message = f"broken store: {fault}" if fault else "broken store"
        return UserError(message, file=self.folder, field=field, got=got, expected=expected, hint="bake again")

    def _error(self, message: str, field: str, hint: str) -> UserError:
        return UserError(message, file=self.folder, field=field, hint=hint)

    @property
    def _writes(self) -> bool:
        return self._lock is not None and self._lock.held

    def _own(self) -> None:
        """Take the lock, and load what others have written before."""
        if self._writes:
            return
        self._lock = WriterLock(self.folder)
        for folder, _, _ in os.walk(self.folder):
            remove_left_over(Path(folder))
        try:
            if (self.folder / MANIFEST).exists():
                self._load()
                journals = [f for a in self.artefacts() if (f := ChunkFiles(self.folder, a)).journal.exists()]
                if journals:
                    self._save()
                for files in journals:
                    files.settle()
        except BaseException:
            self._lock.release()
            raise

    def _load(self) -> None:
        """Read manifest and journals; retry if a writer replaces the manifest meanwhile."""
        path = self.folder / MANIFEST
        if not path.exists():
            hint = "make one with `lambent bake`"
            raise UserError("not a store", file=self.folder, expected=MANIFEST, hint=hint)
        try:
            text = None
            while text != (
                text := read_bytes(path, LIMIT_BYTES).decode("utf-8")
            ):  # ends once nobody replaces it meanwhile
                manifest = json.loads(text)
                if "\\ud" in text.lower():
                    json.dumps(manifest, ensure_ascii=False).encode("utf-8")  # fails on lone surrogates
                if manifest["format"] != FORMAT or manifest["version"] not in VERSIONS:
                    found, expected = f"{manifest['format']} {manifest['version']}", f"{FORMAT} 1 or 2"
                    raise UserError("unknown store version", file=path, got=found, expected=expected)
                inputs, documents = dict(manifest["inputs"]), dict(manifest["documents"])
                artefacts = {
                    name: Artefact.of_entry(name, entry, path) for name, entry in manifest["artefacts"].items()
                }
                for artefact in artefacts.values():
                    ChunkFiles(self.folder, artefact).read_journal()
                    artefact.check(path)
        except _DAMAGE as error:
            raise UserError(f"manifest is damaged ({error})", file=path, hint="bake again") from error
        self.inputs, self.documents, self._artefacts = inputs, documents, artefacts

    def _save(self) -> None:
        entries = {name: self._entry(artefact) for name, artefact in self._artefacts.items()}
        self._entries = entries
        manifest = {
            "format": FORMAT,
            "version": VERSIONS[any(entry.rewritten for entry in entries.values())],
            "inputs": self.inputs,
        }
        self._texts = {name: self._text(name, document) for name, document in self.documents.items()}
        parts = {key: json.dumps(value) for key, value in manifest.items()}
        parts["documents"] = _object({name: text for name, (_, text) in self._texts.items()})
        parts["artefacts"] = _object({name: entry.text for name, entry in entries.items()})
        write_text(self.folder / MANIFEST, _object(parts))

    def _text(self, name: str, document: Any) -> tuple[Any, str]:
        """A document and its text, which is kept: the scene record of 100,000 objects takes a second to write."""
        known = self._texts.get(name)
        return known if known is not None and known[0] is document else (document, json.dumps(document))

    def _entry(self, artefact: Artefact) -> _Entry:
        """Cached manifest entry: a bake saves thousands of times, and encoding all entries would dominate."""
        known = self._entries.get(artefact.name)
        if known is not None and known.artefact is artefact:
            return known
        rewritten = any(version.generation for version in artefact.done.values())
        return _Entry(artefact, json.dumps(artefact.entry()), rewritten)


class _Entry(NamedTuple):
    artefact: Artefact
    text: str
    rewritten: bool  # whether a chunk was rewritten


class Writer:
    """Writes the chunks of one array; see `Store.begin`. Valid while its store holds the lock."""

    def __init__(self, store: Store, artefact: Artefact) -> None:
        self.artefact = artefact
        self._store, self._lock = store, store._lock
        self._files = ChunkFiles(store.folder, artefact)

    @property
    def missing(self) -> list[Chunk]:
        """Chunks not written yet."""
        return [chunk for chunk in self.artefact.chunk_grid if self.artefact.version(chunk) is None]

    def write(self, chunk: Chunk, data: Array) -> None:
        """Write or replace a chunk; a reader or a crash finds either the old or the new chunk, whole.

        `Artefact.version` counts replacements: after an interruption, a pass that adds samples to finished chunks
        resumes with those that are behind.
        """
        self._check()
        self._files.write(chunk, data)

    def read_chunk(self, chunk: Chunk) -> Array:
        """A chunk written before."""
        return self._store.read_region(self.artefact.name, self.artefact.region(chunk))

    def extend(self, count: int) -> None:
        """Lengthen the first axis by `count`, in whole chunks; the array is partial until finished again."""
        self._check()
        a = self.artefact
        assert count > 0 and not (count % a.chunks[0] or a.shape[0] % a.chunks[0]), "batches are whole chunks"
        self._files.lengthen(a.shape[0] + count)

    def finish(self, **meta: Any) -> None:
        """Mark the array complete; every chunk must have been written."""
        self._check()
        assert not self.missing, f"{self.artefact.name}: {len(self.missing)} chunks missing"
        self.artefact.meta.update(meta)
        self.artefact.complete = True
        self._store._save()
        self._files.settle()

    def _check(self) -> None:
        """Raise `UserError` if the lock went to another `Store`, or the array was begun again."""
        self._store._entries.pop(self.artefact.name, None)
        ours = self._lock is self._store._lock and self._store._writes
        if not ours or self._store._artefacts.get(self.artefact.name) is not self.artefact:
            raise self._store._error("writer was closed or replaced", self.artefact.name, "begin the array again")


def _object(parts: Mapping[str, str]) -> str:
    """JSON object from the JSON of its values, one line each; json.dumps with `indent` takes 20 times as long."""
    return "{" + ",\n".join(f"{json.dumps(key)}: {value}" for key, value in parts.items()) + "}"


def _within(part: Sequence[slice], whole: Sequence[slice]) -> Region:
    """Index of a region relative to an enclosing one."""
    return tuple(slice(p.start - w.start, p.stop - w.start) for p, w in zip(part, whole, strict=True))
