"""The light map by photons: stored batches of photons, and irradiance from all of them.

Every batch is an independent estimate of the whole map, `light_map/photons[batch]`, in W per texel: a bake resumes
after the finished ones. The difference of two halves of the batches estimates the noise.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.sampling import cleaned, relative_noise
from lambent.baking.light.stitching import Cuts
from lambent.baking.photons.density import Kernel, shares
from lambent.baking.photons.shooting import learnt_sky, shoot
from lambent.baking.running.tiles import run_tiles
from lambent.baking.surfaces.coverage import texel_areas
from lambent.baking.surfaces.texels import Sides, Texels
from lambent.baking.tracing.lights.sun import Sun
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.progress import Progress
from lambent.scenes.scene import Scene
from lambent.store.store import Writer

BATCHES, FEWEST = 16, 4  # FEWEST: least number of batches to estimate the noise from
SMALL = 0.5  # relative to the median size of a texel


class PhotonMap:
    """A light map of one side or both; `geometry` as in `atlas.merged`."""

    def __init__(self, geometry: dict[str, Floats], sides: list[Sides]) -> None:
        self.texels = sides[0].texels
        areas = texel_areas(geometry, self.texels.width, self.texels.height)
        self._kernels = [Kernel(areas, self.texels, side.valid.mean(axis=1)) for side in sides]
        self._shares = shares(areas, self.texels)
        self.chunk = (1, len(sides), self.texels.height, self.texels.width, 3)
        self.shape = (BATCHES, *self.chunk[1:])

    def shoot(
        self, writer: Writer, scene: Scene, whole: Any, progress: Progress, *, per_texel: int, noise: float,
        max_bounces: int, seed: int, unseen: Sun | None = None,
    ) -> None:  # fmt: skip
        """Fill the missing batches, up to `per_texel` photons per texel, until `noise` is reached; others stay black.

        Direct light of the sun `unseen` is not counted.
        """
        photons = -(-per_texel * len(self.texels.index) // BATCHES)
        sky = learnt_sky(scene, whole, _over_area(self.texels), max_bounces)
        halves, reached = np.zeros((2, *self.chunk[1:])), False

        def add(number: int, batch: Floats) -> None:
            nonlocal reached
            halves[number % 2] += batch
            if number % 2 and number + 1 >= FEWEST:
                reached = self._noise(halves / ((number + 1) / 2)) <= noise

        def batch(region: tuple[slice, ...], of_batch: int) -> Floats:
            if reached:
                return np.zeros(self.chunk, np.float32)
            found = shoot(whole, self.chunk[1:4], photons, max_bounces, of_batch, sky, unseen).astype(np.float32)
            add(region[0].start, found)
            return found[None]

        for number in range(BATCHES - len(writer.missing)):
            if not reached:
                add(number, writer.read_chunk((number, 0, 0, 0, 0))[0])
        run_tiles(writer, batch, seed=seed, progress=progress, what="light map, photons")

    def _noise(self, flux: Floats) -> float:
        """The larger relative noise, weighted by area, of the sides, from halves (2, sides, H, W, 3) of the photons."""
        halves = (np.stack([kernel.irradiance(half[i]) for half in flux]) for i, kernel in enumerate(self._kernels))
        known = [kernel.known for kernel in self._kernels]
        return max(relative_noise(both[:, k], self._shares[k]) for both, k in zip(halves, known, strict=True))

    def halves(self, batches: Floats) -> Iterator[tuple[Floats, Flags]]:
        """Per side, irradiance (2, H, W, 3) of both halves of the batches, and flags of known texels (H, W)."""
        shot = shot_of(batches)
        for i, kernel in enumerate(self._kernels):
            yield np.stack([kernel.irradiance(shot[half::2, i].mean(axis=0)) for half in (0, 1)]), kernel.known

    def finished(
        self, batches: Floats, labels: Indices, cuts: Cuts
    ) -> list[tuple[NDArray[np.float16], dict[str, float]]]:
        """Per side, the light map (H, W, 3), and its noise before denoising, both unweighted and weighted by area."""
        maps = []
        for halves, known in self.halves(batches):
            noise = relative_noise(halves[:, known]), relative_noise(halves[:, known], self._shares[known])
            clean = cleaned(halves.mean(axis=0), known, self.texels, labels, cuts)
            maps.append((clean, dict(zip(("noise", "noise_by_area"), noise, strict=True))))
        return maps


def _over_area(texels: Texels) -> Floats:
    """(H, W) 1/area of a texel, m^-2, 0 in gutters; bounded, so that tiny texels do not attract all photons."""
    found = np.zeros(texels.height * texels.width)
    found[texels.index] = 1 / np.maximum(texels.spacing, SMALL * np.median(texels.spacing)) ** 2
    return found.reshape(texels.height, texels.width)


def shot_of(batches: Floats) -> Floats:
    """The batches shot before the noise was reached; the rest are black."""
    last = np.flatnonzero(batches.any(axis=(1, 2, 3, 4)))
    return batches[: last[-1] + 1 + (last[-1] + 1) % 2] if len(last) else batches
