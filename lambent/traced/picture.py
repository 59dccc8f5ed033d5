"""A picture that converges: samples that end on baked light first, gathered ones from then on.

Samples that end at the first diffuse surface have little noise and the light map's error; gathered ones have more noise
and hardly any error. The shown mean contains both, until the first are outnumbered and leave it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.light.colour import luminance
from lambent.core.views.camera import Camera

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import Kind, Tracer

Image = NDArray[np.float32]
ENDED = 16  # samples of the first kind
LEAVE = 128  # gathered samples at which the first kind has left the mean
PIXELS_AT_ONCE = 1 << 20
MEAN_TO_DEVIATION = math.sqrt(math.pi / 2)  # of normally distributed errors
DARK = 0.1  # of the mean luminance: darker pixels count as if they had it
GUIDING = 2  # samples of albedo and normals: 8 lower FLIP by less than .001
TILE_PX, TILES = 96, 12  # parts of the picture whose noise stands for the whole


@dataclass
class _Sums:
    """Sums (2, H, W, 3) of two halves of samples, and their counts (2,)."""

    light: NDArray[np.float64]
    count: NDArray[np.int64]

    @classmethod
    def empty(cls, size: tuple[int, int]) -> _Sums:
        return cls(np.zeros((2, size[1], size[0], 3)), np.zeros(2, int))


class TracedPicture:
    """The running mean of a view of `size` (width, height), in pixels.

    With `path`, all samples are whole paths. `part` of the light: full, or of the first surface diffuse or specular.
    """

    def __init__(
        self, tracer: Tracer, camera: Camera, size: tuple[int, int], *, seed: int = 0, path: bool = False,
        part: str = "full",
    ) -> None:  # fmt: skip
        from lambent.baking.pictures.tracer import Kind, Part  # imports Mitsuba, whose variant `engine` has set

        self._tracer, self._camera, self.size, self._seed, self.path = tracer, camera, size, seed, path
        self._part = Part(part)
        self._first, self._then = (Kind.path, Kind.path) if path else (Kind.ended, Kind.gathered)
        self._sums = {kind: _Sums.empty(size) for kind in {self._first, self._then}}
        self._guides: tuple[Image, Image] | None = None

    @property
    def samples(self) -> int:
        """Samples of each pixel so far."""
        return int(sum(sums.count.sum() for sums in self._sums.values()))

    @property
    def at_once(self) -> int:
        """Most samples of each pixel that are traced together."""
        return max(1, PIXELS_AT_ONCE // (self.size[0] * self.size[1]))

    def sample(self, most: int = 1 << 30) -> int:
        """Add samples, at most `most` and as many as are traced together; returns their number."""
        kind, done = self._next()
        left = ENDED - done if kind is not self._then else most
        count = max(1, min(most, left, self.at_once, max(done, min(most, ENDED) // 2)))
        sums = self._sums[kind]
        half = int(np.argmin(sums.count))
        # each half is a series of its own
        first, seed = int(sums.count[half]), 2 * self._seed + half
        sums.light[half] += self._tracer.radiance(kind, self._camera, self.size, first, count, seed, self._part)
        sums.count[half] += count
        return count

    def _next(self) -> tuple[Kind, int]:
        """Kind of the next samples, and the number of this kind so far."""
        first = int(self._sums[self._first].count.sum())
        if self._first is not self._then and first >= ENDED:
            return self._then, int(self._sums[self._then].count.sum())
        return self._first, first

    def mean(self, halves: Sequence[int] = (0, 1)) -> Image:
        """Mean radiance (H, W, 3) of all samples, or of those in one of the two halves."""
        chosen = list(halves)
        first, then = self._sums[self._first], self._sums[self._then]
        light, count = then.light[chosen].sum(axis=0), float(then.count[chosen].sum())
        if first is not then:
            stays = max(0.0, 1 - float(then.count.sum()) / LEAVE)
            light, count = light + stays * first.light[chosen].sum(axis=0), count + stays * first.count[chosen].sum()
        return np.asarray(light / max(count, 1e-9), np.float32)

    def denoised(self, *, fast: bool = False) -> Image:
        """The mean, denoised by Open Image Denoise with albedo and normals."""
        from lambent.baking.light.denoise import denoise_image

        return np.asarray(denoise_image(self.mean(), *self.guides(), fast=fast), np.float32)

    def guides(self) -> tuple[Image, Image]:
        """Albedo and normals (H, W, 3)."""
        if self._guides is None:
            self._guides = self._tracer.guides(self._camera, self.size, min(GUIDING, self.at_once), self._seed)
        return self._guides

    def noise(self, *, denoised: bool) -> float:
        """Relative standard error of a pixel, averaged over the picture, from the difference of two halves.

        Pixels darker than DARK times the picture's mean count as if they had that luminance. If `denoised`, the error
        is that of parts of the picture after denoising. Errors that both halves share are not included.
        """
        if not all(sums.count.all() for sums in self._sums.values() if sums.count.any()) or not self.samples:
            return np.inf
        halves = [self.mean((half,)) for half in (0, 1)]
        floor = DARK * float(luminance(np.mean(halves, axis=0)).mean())
        if floor <= 0:
            return 0.0
        if denoised:
            from lambent.baking.light.denoise import denoise_image

            guides = [self._parts(guide) for guide in self.guides()]
            halves = [denoise_image(self._parts(half), *guides, fast=True) for half in halves]
        one, other = (luminance(half) for half in halves)
        return float(np.mean(np.abs(one - other) / np.maximum(one + other, 2 * floor)) * MEAN_TO_DEVIATION)

    def _parts(self, image: Floats) -> Image:
        """Square parts (TILES * TILE_PX, TILE_PX, 3) of a picture, one below the other; all of a small one."""
        height, width = image.shape[:2]
        if height * width <= TILES * TILE_PX**2:
            return np.asarray(image, np.float32)
        rng = np.random.default_rng(self._seed)
        at = rng.integers((max(1, height - TILE_PX), max(1, width - TILE_PX)), size=(TILES, 2))
        return np.concatenate([image[y : y + TILE_PX, x : x + TILE_PX] for y, x in at.tolist()], dtype=np.float32)
