"""The light map by photons, the second integrator: batches of photons in the store, irradiance from all of them.

Every batch is an estimate of the whole map with a seed of its own, `light_map/photons[batch]`, in W per texel: a bake
goes on from the finished ones after any interruption. Their halves tell the noise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.bake.light_map import Sides, cleaned, relative_noise
from lambent.bake.photon_density import Kernel, texel_areas
from lambent.bake.photons import Bins, shoot
from lambent.bake.texels import Texels
from lambent.bake.work import run_tiles
from lambent.core.progress import Progress
from lambent.store.store import Writer

Array = NDArray[np.floating]
BATCHES = 16


def shape_of(texels: Texels, sides: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Shape and chunks of the batches: (BATCHES, sides, H, W, 3)."""
    one = (1, sides, texels.height, texels.width, 3)
    return (BATCHES, *one[1:]), one


def shoot_batches(
    writer: Writer, scene: Any, per_texel: int, max_bounces: int, seed: int, covered: int, progress: Progress
) -> None:
    """Fill the batches that are missing: `per_texel` photons for each of the `covered` texels, over all batches."""
    _, sides, height, width, _ = writer.artefact.shape
    photons = -(-per_texel * covered // BATCHES)
    bins = Bins(width, height, sides)
    run_tiles(
        writer,
        lambda region, batch_seed: shoot(scene, bins, photons, max_bounces, batch_seed)[None].astype(np.float32),
        seed=seed,
        progress=progress,
        what="light map, photons",
    )


def finished(
    batches: Array, geometry: Mapping[str, Array], sides: list[Sides], labels: NDArray[np.integer]
) -> list[tuple[NDArray[np.float16], dict[str, float]]]:
    """Per side the light map (H, W, 3) and what to note: the noise before denoising."""
    texels = sides[0].texels
    maps = []
    for halves, known in halves_of(batches, geometry, sides):
        noise = relative_noise(halves[:, known]) if known.any() else 0.0
        clean = cleaned(halves.mean(axis=0), known, texels, labels) if known.any() else _black(texels)
        maps.append((clean, {"noise": noise}))
    return maps


def halves_of(
    batches: Array, geometry: Mapping[str, Array], sides: list[Sides]
) -> Iterator[tuple[Array, NDArray[np.bool_]]]:
    """Per side irradiance (2, H, W, 3) of both halves of the batches, and where there is any (H, W)."""
    texels = sides[0].texels
    areas = texel_areas(dict(geometry), texels.width, texels.height)
    for number, side in enumerate(sides):
        kernel = Kernel(areas, texels, side.valid.mean(axis=1))
        yield np.stack([kernel.irradiance(batches[half::2, number].mean(axis=0)) for half in (0, 1)]), kernel.known


def _black(texels: Texels) -> NDArray[np.float16]:
    return np.zeros((texels.height, texels.width, 3), np.float16)
