"""Work divided into independent tiles: the chunks of one array, each with its own seed.

Because the seed belongs to the tile, the result is independent of order and interruptions.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress
from lambent.store.store import Artefact, Chunk

Tile = Callable[[tuple[slice, ...], int], NDArray[Any]]  # (region of the array, seed) -> its content


def seed_of(seed: int, *place: object) -> int:
    """32-bit seed of a piece of work, from the user's seed and an identifier of the piece."""
    text = "/".join(map(str, (seed, *place)))
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "little")


def slices(count: int, at_once: int) -> list[slice]:
    """Slices that cover `count` items, `at_once` at a time."""
    return [slice(first, min(first + at_once, count)) for first in range(0, count, at_once)]


class TileWriter(Protocol):
    """Output of `run_tiles`: a `Writer`, or several combined."""

    @property
    def artefact(self) -> Artefact: ...
    @property
    def missing(self) -> Sequence[Chunk]: ...
    def write(self, chunk: Chunk, data: NDArray[Any]) -> None: ...


def run_tiles(
    writer: TileWriter,
    tile: Tile,
    *,
    seed: int,
    progress: Progress,
    what: str,
    cost: Callable[[tuple[slice, ...]], float] = lambda region: 1.0,
    wrote: Callable[[], None] = lambda: None,
) -> None:
    """Compute the missing chunks of an array and write each as soon as it is done.

    Parameters
    ----------
    tile : callable
        Content of a region, from the region and the tile's seed.
    cost : callable
        Expected work of a region in any unit, so that progress moves evenly.
    wrote : callable
        Called after each chunk.
    """
    name, region = writer.artefact.name, writer.artefact.region
    costs: dict[Chunk, float] = {chunk: cost(region(chunk)) for chunk in writer.artefact.chunk_grid}
    total = sum(costs.values())
    done = total - sum(costs[chunk] for chunk in writer.missing)
    progress(done, total, what)
    for chunk in writer.missing:
        writer.write(chunk, np.asarray(tile(region(chunk), seed_of(seed, name, chunk))))
        done += costs[chunk]
        progress(done, total, what)
        wrote()
