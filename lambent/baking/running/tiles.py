"""Work divided into independent tiles: the chunks of one array, each with its own seed.

Because the seed belongs to the tile, the result is independent of order and interruptions.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from lambent.baking.running.workers import InProcess, Workers
from lambent.core.progress import Progress
from lambent.store.store import Artefact, Chunk

J = TypeVar("J")
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


def run_tiles(writer: TileWriter, tile: Tile, *, seed: int, progress: Progress, what: str) -> None:
    """Compute the missing chunks of an array in this process, in order; `tile` is the content of a region."""
    run_jobs(writer, lambda job: tile(*job), lambda *job: job, InProcess(), seed=seed, progress=progress, what=what)


def run_jobs(
    writer: TileWriter,
    work: Callable[[J], NDArray[Any]],
    job: Callable[[tuple[slice, ...], int], J],
    workers: Workers,
    *,
    seed: int,
    progress: Progress,
    what: str,
    cost: Callable[[tuple[slice, ...]], float] = lambda region: 1.0,
    wrote: Callable[[], None] = lambda: None,
) -> None:
    """Compute the missing chunks of an array and write each as soon as it is done, the most expensive first.

    Parameters
    ----------
    work : callable
        Content of a region, from its job.
    job : callable
        From the region and the tile's seed.
    workers : Workers
        Run the jobs; work and jobs must be picklable for others than this process.
    cost : callable
        Expected work of a region in any unit, so that progress moves evenly, and no worker waits for a large tile.
    wrote : callable
        Called after each chunk.
    """
    name, region = writer.artefact.name, writer.artefact.region
    costs: dict[Chunk, float] = {chunk: cost(region(chunk)) for chunk in writer.artefact.chunk_grid}
    total = sum(costs.values())
    missing = sorted(writer.missing, key=lambda chunk: -costs[chunk])
    done = total - sum(costs[chunk] for chunk in missing)
    progress(done, total, what)
    pieces = ((chunk, job(region(chunk), seed_of(seed, name, chunk))) for chunk in missing)
    for (chunk, _), found in workers.each(_OfPiece(work), pieces):
        writer.write(chunk, np.asarray(found))
        done += costs[chunk]
        progress(done, total, what)
        wrote()


@dataclass(frozen=True)
class _OfPiece(Generic[J]):
    """Work on jobs that have their chunks with them."""

    work: Callable[[J], NDArray[Any]]

    def __call__(self, piece: tuple[Chunk, J]) -> NDArray[Any]:
        return self.work(piece[1])
