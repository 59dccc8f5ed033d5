"""The light map by photons, the second integrator: batches of photons in the store, irradiance from all of them.

Every batch is an estimate of the whole map with a seed of its own, `light_map/photons[batch]`, in W per texel: a bake
goes on from the finished ones after any interruption. Their halves tell the noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.coverage import texel_areas
from lambent.bake.light_map import Sides, cleaned, relative_noise
from lambent.bake.photon_density import Kernel, shares
from lambent.bake.photons import Bins, learnt_sky, shoot
from lambent.bake.texels import Texels
from lambent.bake.work import run_tiles
from lambent.core.progress import Progress
from lambent.scenes.scene import Scene
from lambent.store.store import Writer

Array = NDArray[np.floating]
BATCHES, FEWEST = 16, 4  # FEWEST: batches, of which the noise is believed
SMALL = 0.5  # of the median size of a texel


def shape_of(texels: Texels, sides: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Shape and chunks of the batches: (BATCHES, sides, H, W, 3)."""
    one = (1, sides, texels.height, texels.width, 3)
    return (BATCHES, *one[1:]), one


def _over_area(texels: Texels) -> Array:
    """(H, W) 1 over the area of a texel, m^-2, 0 in the gutters; the smallest ones do not decide where photons go."""
    found = np.zeros(texels.height * texels.width)
    found[texels.index] = 1 / np.maximum(texels.spacing, SMALL * np.median(texels.spacing)) ** 2
    return found.reshape(texels.height, texels.width)


@dataclass(frozen=True)
class Shots:
    """How a light map is shot: at most so many photons per texel, until the relative noise is reached."""

    per_texel: int
    noise: float
    max_bounces: int
    seed: int


def shoot_batches(
    writer: Writer,
    scene: Scene,
    whole: Any,
    geometry: Mapping[str, Array],
    sides: list[Sides],
    how: Shots,
    progress: Progress,
) -> None:
    """Fill the batches that are missing, until the noise is reached; those that are not needed stay black."""
    count, _, height, width, _ = writer.artefact.shape
    texels = sides[0].texels
    photons = -(-how.per_texel * len(texels.index) // BATCHES)
    bins = Bins(width, height, len(sides))
    sky = learnt_sky(scene, whole, _over_area(texels), how.max_bounces)
    gauge = _Gauge(geometry, sides, how.noise)
    for number in range(count - len(writer.missing)):
        gauge.add(writer.read_chunk((number, 0, 0, 0, 0))[0])

    def batch(region: tuple[slice, ...], seed: int) -> Array:
        if gauge.reached:
            return np.zeros((1, *writer.artefact.shape[1:]), np.float32)
        found = shoot(whole, bins, photons, how.max_bounces, seed, sky).astype(np.float32)
        gauge.add(found)
        return found[None]

    run_tiles(writer, batch, seed=how.seed, progress=progress, what="light map, photons")


class _Gauge:
    """The noise of the batches so far by area (`shares`), taken in order, in both halves of equal number."""

    def __init__(self, geometry: Mapping[str, Array], sides: list[Sides], noise: float) -> None:
        texels = sides[0].texels
        areas = texel_areas(dict(geometry), texels.width, texels.height)
        self._kernels = [Kernel(areas, texels, side.valid.mean(axis=1)) for side in sides]
        self._shares = shares(areas, texels)
        self._noise, self._count, self.reached = noise, 0, False
        self._sums = np.zeros((2, len(sides), texels.height, texels.width, 3))

    def add(self, batch: Array) -> None:
        """One batch (sides, H, W, 3) more."""
        if self.reached:
            return
        self._sums[self._count % 2] += batch
        self._count += 1
        if self._count >= FEWEST and self._count % 2 == 0:
            halves = self._sums / (self._count / 2)
            found = []
            for number, kernel in enumerate(self._kernels):
                if kernel.known.any():
                    irradiance = np.stack([kernel.irradiance(half[number]) for half in halves])
                    found.append(relative_noise(irradiance[:, kernel.known], self._shares[kernel.known]))
            self.reached = max(found, default=0.0) <= self._noise


def finished(
    batches: Array, geometry: Mapping[str, Array], sides: list[Sides], labels: NDArray[np.integer]
) -> list[tuple[NDArray[np.float16], dict[str, float]]]:
    """Per side the light map (H, W, 3) and what to note: the noise before denoising, all texels alike and by area."""
    texels = sides[0].texels
    share = shares(texel_areas(dict(geometry), texels.width, texels.height), texels)
    maps = []
    for halves, known in halves_of(batches, geometry, sides):
        noise = relative_noise(halves[:, known]) if known.any() else 0.0
        by_area = relative_noise(halves[:, known], share[known]) if known.any() else 0.0
        clean = cleaned(halves.mean(axis=0), known, texels, labels) if known.any() else _black(texels)
        maps.append((clean, {"noise": noise, "noise_by_area": by_area}))
    return maps


def halves_of(
    batches: Array, geometry: Mapping[str, Array], sides: list[Sides]
) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """Per side irradiance (2, H, W, 3) of both halves of the batches, and where there is any (H, W)."""
    texels = sides[0].texels
    areas = texel_areas(dict(geometry), texels.width, texels.height)
    shot = shot_of(batches)
    for number, side in enumerate(sides):
        kernel = Kernel(areas, texels, side.valid.mean(axis=1))
        yield np.stack([kernel.irradiance(shot[half::2, number].mean(axis=0)) for half in (0, 1)]), kernel.known


def shot_of(batches: Array) -> Array:
    """The batches that were shot before the noise was reached; the others are black."""
    last = np.flatnonzero(batches.any(axis=(1, 2, 3, 4)))
    return batches[: last[-1] + 1 + (last[-1] + 1) % 2] if len(last) else batches


def _black(texels: Texels) -> NDArray[np.float16]:
    return np.zeros((texels.height, texels.width, 3), np.float16)
