"""One array of a store as its manifest and its journal describe it: shape, chunks, key, and what is finished."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError

LIMIT_BYTES = 1 << 34  # of one array or chunk: a manifest that promises more is not believed
LIMIT_CHUNKS, LIMIT_AXES = 1 << 20, 8
Array = NDArray[Any]
Chunk = tuple[int, ...]
Region = tuple[slice, ...]


class Version(NamedTuple):
    """One writing of a chunk."""

    crc: int  # crc32 of the chunk's file; 0 without a file, which means zeros
    generation: int = 0  # how often the chunk was rewritten


@dataclass
class Artefact:
    """One array of a store. `key` changes whenever anything it was made from changes."""

    name: str
    kind: str
    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    key: str
    meta: dict[str, Any] = field(default_factory=dict)
    done: dict[str, Version] = field(default_factory=dict)  # by chunk id, "0.1" for the chunk (0, 1)
    complete: bool = False

    @property
    def chunk_counts(self) -> tuple[int, ...]:
        """Number of chunks along each axis."""
        return tuple(-(-size // step) for size, step in zip(self.shape, self.chunks, strict=True))

    @property
    def chunk_grid(self) -> list[Chunk]:
        """Every chunk, written or not, in row-major order."""
        return list(product(*map(range, self.chunk_counts)))

    @property
    def written(self) -> NDArray[np.bool_]:
        """Which chunks are written, with the shape `chunk_counts`."""
        return np.array([chunk_id(chunk) in self.done for chunk in self.chunk_grid], bool).reshape(self.chunk_counts)

    @property
    def state(self) -> str:
        """In words: complete, or how far it is."""
        return "complete" if self.complete else f"partial ({len(self.done)} of {math.prod(self.chunk_counts)} chunks)"

    def version(self, chunk: Chunk) -> Version | None:
        """The writing of a chunk that counts; None where it is not written yet."""
        return self.done.get(chunk_id(chunk))

    def has(self, chunk: str) -> bool:
        """Whether a chunk of this id is part of the array."""
        numbers = chunk.split(".") if chunk else []
        inside = [n.isdecimal() and int(n) < count for n, count in zip(numbers, self.chunk_counts, strict=False)]
        return len(numbers) == len(self.shape) and all(inside) and chunk == chunk_id(tuple(map(int, numbers)))

    def region(self, chunk: Chunk) -> Region:
        """Index of the array that a chunk covers, cut at the array's end."""
        parts = zip(chunk, self.chunks, self.shape, strict=True)
        return tuple(slice(i * step, min((i + 1) * step, size)) for i, step, size in parts)

    def chunks_in(self, region: Sequence[slice]) -> list[Chunk]:
        """The chunks that a region touches."""
        bounds = ((r.start // step, -(-r.stop // step)) for r, step in zip(region, self.chunks, strict=True))
        return list(product(*(range(*b) for b in bounds))) if all(r.start < r.stop for r in region) else []

    def is_same(self, other: Artefact, *, growing: bool) -> bool:
        """Whether both have one key, type, chunking and shape; `growing` leaves the length of the first axis open."""
        mine, theirs = (a.shape[1:] if growing else a.shape for a in (self, other))
        return mine == theirs and (self.key, self.chunks, self.dtype) == (other.key, other.chunks, other.dtype)

    def check(self, store: Path) -> None:
        """`UserError` where the shape is impossible, or larger than any array of a store."""
        itemsize = np.dtype(self.dtype).itemsize
        for what, sizes in (("shape", self.shape), ("chunks", self.chunks)):
            if min(sizes, default=1) < (what == "chunks") or math.prod(sizes) * itemsize > LIMIT_BYTES:
                limit = f"at most {LIMIT_BYTES} bytes"
                raise UserError(f"impossible {what}", file=store, field=self.name, got=sizes, expected=limit)
        if len(self.shape) > LIMIT_AXES or math.prod(self.chunk_counts) > LIMIT_CHUNKS:
            got, limit = f"{self.shape} in {self.chunks}", f"at most {LIMIT_AXES} axes and {LIMIT_CHUNKS} chunks"
            raise UserError("too many chunks", file=store, field=self.name, got=got, expected=limit)

    def entry(self) -> dict[str, Any]:
        """What the manifest says: a chunk is its crc, or (crc, generation) where it was rewritten."""
        done = {chunk: version if version.generation else version.crc for chunk, version in self.done.items()}
        return {name: value for name, value in vars(self).items() if name != "name"} | {"done": done}

    @classmethod
    def of_entry(cls, name: str, e: Mapping[str, Any], store: Path) -> Artefact:
        """The manifest's entry, or an error that `Store.open` turns into "manifest is damaged"."""
        shape, chunks = (tuple(map(_count, e[axes])) for axes in ("shape", "chunks"))
        said = {chunk: v if isinstance(v, list) else [v] for chunk, v in e["done"].items()}
        done = {chunk: Version(*map(_count, v)) for chunk, v in said.items()}
        if not (isinstance(e["dtype"], str) and all(isinstance(e[text], str) for text in ("kind", "key"))):
            raise ValueError(f"{name}: kind, key and dtype must be text")
        if np.dtype(e["dtype"]).kind not in "biuf":
            raise ValueError(f"{name}: unknown dtype {e['dtype']}")
        a = cls(name, e["kind"], shape, chunks, e["dtype"], e["key"], dict(e["meta"]), done, e["complete"] is True)
        a.check(store)
        unknown = next((chunk for chunk in done if not a.has(chunk)), None)
        if unknown is not None:
            raise ValueError(f"{name}: unknown chunk {unknown}")
        if a.complete and len(a.done) != math.prod(a.chunk_counts):
            raise ValueError(f"{name}: complete with {len(a.done)} chunks")
        return a


def _count(value: object) -> int:
    """A whole number that is not negative, or a `ValueError`."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"not a count: {str(value)[:40]}")
    return value


def chunk_id(chunk: Chunk) -> str:
    """Name of a chunk in manifest and journal: "0.1" for (0, 1)."""
    return ".".join(map(str, chunk))
