"""One array of a store as recorded in manifest and journal: shape, chunks, key, and finished chunks."""

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

LIMIT_BYTES = 1 << 34  # limit for one array or chunk; a manifest that states more is rejected
LIMIT_CHUNKS, LIMIT_AXES = 1 << 20, 8
Array = NDArray[Any]
Chunk = tuple[int, ...]
Region = tuple[slice, ...]


class Version(NamedTuple):
    """One written version of a chunk."""

    crc: int  # crc32 of the chunk's file; 0 for a chunk of zeros, which has no file
    generation: int = 0  # how often the chunk was rewritten


@dataclass
class Artefact:
    """One array of a store. `key` changes whenever an input of the array changes."""

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
        """All chunks, written or not, in row-major order."""
        return list(product(*map(range, self.chunk_counts)))

    @property
    def written(self) -> NDArray[np.bool_]:
        """Flags of written chunks, of shape `chunk_counts`."""
        return np.array([chunk_id(chunk) in self.done for chunk in self.chunk_grid], bool).reshape(self.chunk_counts)

    @property
    def state(self) -> str:
        """State in words: complete, or the share that is done."""
        return "complete" if self.complete else f"partial ({len(self.done)} of {math.prod(self.chunk_counts)} chunks)"

    def version(self, chunk: Chunk) -> Version | None:
        """The current version of a chunk; None if not written yet."""
        return self.done.get(chunk_id(chunk))

    def has(self, chunk: str) -> bool:
        """Whether a chunk of this id is part of the array."""
        numbers = chunk.split(".") if chunk else []
        inside = [n.isdecimal() and int(n) < count for n, count in zip(numbers, self.chunk_counts, strict=False)]
        return len(numbers) == len(self.shape) and all(inside) and chunk == chunk_id(tuple(map(int, numbers)))

    def region(self, chunk: Chunk) -> Region:
        """Index of the region that a chunk covers, clipped to the array."""
        parts = zip(chunk, self.chunks, self.shape, strict=True)
        return tuple(slice(i * step, min((i + 1) * step, size)) for i, step, size in parts)

    def chunks_in(self, region: Sequence[slice]) -> list[Chunk]:
        """The chunks that overlap a region."""
        bounds = ((r.start // step, -(-r.stop // step)) for r, step in zip(region, self.chunks, strict=True))
        return list(product(*(range(*b) for b in bounds))) if all(r.start < r.stop for r in region) else []

    def is_same(self, other: Artefact, *, growing: bool) -> bool:
        """Whether key, dtype, chunks and shape agree; `growing` ignores the length of the first axis."""
        mine, theirs = (a.shape[1:] if growing else a.shape for a in (self, other))
        return mine == theirs and (self.key, self.chunks, self.dtype) == (other.key, other.chunks, other.dtype)

    def check(self, store: Path) -> None:
        """Raise `UserError` if the shape is invalid or above LIMIT_BYTES."""
        itemsize = np.dtype(self.dtype).itemsize
        for what, sizes in (("shape", self.shape), ("chunks", self.chunks)):
            if min(sizes, default=1) < (what == "chunks") or math.prod(sizes) * itemsize > LIMIT_BYTES:
                limit = f"at most {LIMIT_BYTES} bytes"
                raise UserError(f"impossible {what}", file=store, field=self.name, got=sizes, expected=limit)
        if len(self.shape) > LIMIT_AXES or math.prod(self.chunk_counts) > LIMIT_CHUNKS:
            got, limit = f"{self.shape} in {self.chunks}", f"at most {LIMIT_AXES} axes and {LIMIT_CHUNKS} chunks"
            raise UserError("too many chunks", file=store, field=self.name, got=got, expected=limit)

    def entry(self) -> dict[str, Any]:
        """The manifest's entry: a chunk is its crc, or (crc, generation) if it was rewritten."""
        done = {chunk: version if version.generation else version.crc for chunk, version in self.done.items()}
        return {name: value for name, value in vars(self).items() if name != "name"} | {"done": done}

    @classmethod
    def of_entry(cls, name: str, e: Mapping[str, Any], store: Path) -> Artefact:
        """Parse a manifest entry; errors become "manifest is damaged" in `Store.open`."""
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
    """A non-negative integer, or `ValueError`."""
    if not isinstance(value, int) or isinstance(value, bool) or value < 0:
        raise ValueError(f"not a count: {str(value)[:40]}")
    return value


def chunk_id(chunk: Chunk) -> str:
    """Name of a chunk in manifest and journal: "0.1" for (0, 1)."""
    return ".".join(map(str, chunk))
