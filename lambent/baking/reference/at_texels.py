"""Irradiance at some texels of a light map, path traced with other materials: the reference for edited light."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.sampling import Sampling, TexelJob, tile_samples
from lambent.baking.surfaces.texels import Sides, Texels
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats, Indices
from lambent.core.progress import Progress
from lambent.materials.document import Material

DEPTH = 24
AT_ONCE = 1024  # texels traced together


def retraced(
    traced: TracedScene, sides: Sides, chosen: Indices, materials: dict[str, Material], paths: int, seed: int,
    progress: Progress,
) -> Floats:  # fmt: skip
    """Irradiance, W/m^2 without direct sun, at texels `chosen` (n,) of a side, by halves of the paths (2, n, 3).

    `materials` replace the scene's of the same names. `paths` must be a multiple of 128. Points within texels are those
    of the light map's samples.
    """
    edited = _with_materials(traced, materials)
    scene, unseen = edited.whole(diffuse=True), edited.unseen(diffuse=True, lamps=False)
    per_pass = 64
    how = Sampling((paths, paths), 0.0, DEPTH, per_pass, unseen=unseen)
    parts: list[NDArray[np.float32]] = []
    for first in range(0, len(chosen), AT_ONCE):
        progress(first, len(chosen), "path tracing the reference")
        mine = chosen[first : first + AT_ONCE]
        line = _in_a_line(sides, mine)
        region = tuple(slice(0, size) for size in (2, 1, len(mine), 4))
        parts.append(tile_samples(scene, TexelJob.of(line, region, seed + first), how)[:, 0])
    raw = np.concatenate(parts, axis=1)
    return np.asarray(raw[..., :3] / np.maximum(raw[..., 3:], 1), float)


def _with_materials(traced: TracedScene, materials: dict[str, Material]) -> TracedScene:
    """The same texels, with other materials in the scene."""
    if not materials:
        return traced
    scene = replace(traced.scene, materials={**traced.scene.materials, **materials})
    return TracedScene(replace(traced.atlas, scene=scene), traced.merged, traced.two_sided, traced.progress)


def _in_a_line(sides: Sides, chosen: Indices) -> Sides:
    """Some texels as a map with one row."""
    t = sides.texels
    line = Texels(
        len(chosen), 1, np.arange(len(chosen)), t.face[chosen], t.positions[chosen], t.normals[chosen], t.flat[chosen],
        t.spacing[chosen], t.area_m2[chosen],
    )  # fmt: skip
    return Sides(line, sides.sign, sides.valid[chosen])
