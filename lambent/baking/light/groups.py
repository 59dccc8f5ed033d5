"""Light maps by group of emitters: their samples, taken with those of the whole, and the finished maps.

Every group is denoised, filled and stitched separately, because light of one lamp is easier to tell from noise than the
sum; the whole is the sum of the finished groups.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import fill
from lambent.baking.light.direct import direct_part
from lambent.baking.light.sampling import SMOOTH, closed, denoised, plus, relative_noise, sampled_halves, variance_of
from lambent.baking.light.stitching import Cuts
from lambent.baking.surfaces.texels import BEYOND, Texels
from lambent.baking.tracing.lights.sun import SunRays
from lambent.baking.tracing.rays import array_of, vectors
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import HALF_MAX, luminance
from lambent.core.progress import Progress
from lambent.store.store import Array, Artefact, Chunk, Writer

DROPPED_BITS = 11  # of the 23 fraction bits of a mean: they are noise, which compresses badly


def rounded(means: NDArray[np.float32]) -> NDArray[np.float32]:
    """Means with 12 fraction bits, within 2^-13 of their value: trailing zeros compress well."""
    half, kept = np.uint32(1 << (DROPPED_BITS - 1)), np.uint32(0xFFFFFFFF << DROPPED_BITS & 0xFFFFFFFF)
    return ((np.ascontiguousarray(means).view(np.uint32) + half) & kept).view(np.float32)


class BothWriters:
    """Writes tiles (2, h, w, 4 + c) of samples to two arrays: (2, H, W, 4), and the means of both halves (1, H, W, c).

    The parts are written first, so that a tile of the whole always has its parts.
    """

    def __init__(self, whole: Writer, parts: Writer) -> None:
        self._whole, self._parts = whole, parts

    @property
    def artefact(self) -> Artefact:
        """Artefact of the whole, whose chunks are also those of the parts."""
        return self._whole.artefact

    @property
    def missing(self) -> Sequence[Chunk]:
        """Chunks that are missing from either array."""
        lacking = {*self._whole.missing, *self._parts.missing}
        return [chunk for chunk in self.artefact.chunk_grid if chunk in lacking]

    def write(self, chunk: Chunk, data: Array) -> None:
        """Write the missing arrays of a tile."""
        if chunk in self._parts.missing:
            count = data[..., 3].sum(axis=0)
            means = data[..., 4:].sum(axis=0) / np.maximum(count, 1)[..., None]
            self._parts.write(chunk, rounded(means[None].astype(np.float32)))
        if chunk in self._whole.missing:
            self._whole.write(chunk, np.ascontiguousarray(data[..., :4]))

    def finish(self) -> None:
        """Mark both arrays complete."""
        self._parts.finish()
        self._whole.finish()


@dataclass(frozen=True, eq=False)
class GroupMaps:
    """A side of the light map, float16: `whole` (H, W, 3), `light` and `direct` by group (n, H, W, 3), and its meta.

    Direct light never exceeds all light of its group.
    """

    whole: NDArray[np.float16]
    light: NDArray[np.float16]
    direct: NDArray[np.float16] | None
    notes: dict[str, float]

    def plus(self, direct: Floats) -> GroupMaps:
        """With more direct light (n, H, W, 3)."""
        of_direct = None if self.direct is None else plus(self.direct, direct)
        return GroupMaps(plus(self.whole, direct.sum(axis=0)), plus(self.light, direct), of_direct, self.notes)


def finished_groups(
    raw: Floats, parts: Floats, count: int, texels: Texels, labels: Indices, cuts: Cuts, progress: Progress
) -> GroupMaps:
    """The maps of `count` groups from samples of the whole (2, H, W, 4) and of parts (H, W, 3 count or 6 count).

    Maps without direct light only light the next maps; their seams are not treated.
    """
    halves, known = sampled_halves(raw)
    samples = float(raw[..., 3].sum(axis=0)[known].mean()) if known.any() else 0.0
    by_group = np.moveaxis(parts.reshape(*known.shape, -1, 3), 2, 0)
    variance = variance_of(halves)  # of all groups: of each, it is no more
    clean = by_group[:count].copy()
    for number, one in enumerate(clean):
        progress(number, len(by_group), "denoising by group")
        if known.any() and one.any():
            clean[number] = denoised(one, known, labels, variance)
    light, direct = np.zeros((count, *known.shape, 3), np.float16), None
    lit = np.flatnonzero(clean.any(axis=(1, 2, 3)))
    if len(by_group) == count:
        light[lit] = _filled(clean[lit], known, labels)
    else:
        light[lit] = closed(clean[lit], known, texels, labels, cuts) if len(lit) else 0
        direct = np.zeros_like(light)
        for number in lit.tolist():
            progress(count + number, len(by_group), "denoising by group")
            of_samples = by_group[count + number], by_group[number], variance
            direct[number] = direct_part(*of_samples, light[number], known, labels, SMOOTH)
    whole = np.minimum(light.astype(np.float32).sum(axis=0), HALF_MAX).astype(np.float16)
    return GroupMaps(whole, light, direct, {"noise": relative_noise(halves[:, known]), "samples": samples})


def _filled(clean: Floats, known: Flags, labels: Indices) -> NDArray[np.float16]:
    """Maps (n, H, W, 3) with unknown texels filled."""
    if not len(clean) or not known.any():
        return np.zeros(clean.shape, np.float16)
    filled = fill(np.concatenate(list(clean), axis=-1), known, labels)
    return np.minimum(np.stack(np.split(filled, len(clean), axis=-1)), HALF_MAX).astype(np.float16)


def group_notes(traced: TracedScene, light: Floats) -> list[dict[str, Any]]:
    """LightGroupRecords of the groups as JSON, from their maps `light` (n, H, W, 3).

    Texels that no viewer sees do not count: the underside of furniture on a floor may lie in the full sun beneath it.
    """
    (sides, labels), lights = traced.in_view(1.0), traced.sorted_lights
    index, area = sides.texels.index, sides.texels.spacing**2
    lit = sides.valid.any(axis=1)
    if (seen := lit & (labels.reshape(-1)[index] < BEYOND)).any():
        lit = seen
    shining = [luminance(one.reshape(-1, 3)[index].astype(float)) for one in light]
    if traced.sun is not None and lights.sun is not None:
        shining[lights.sun] = shining[lights.sun] + luminance(_sun_on(traced, sides.texels).astype(float))
    total = [float((one * area)[lit].sum()) for one in shining]
    whole = max(sum(total), 1e-30)
    return [
        {"name": group.name, "members": list(group.members), "share": one / whole}
        for group, one in zip(lights.groups, total, strict=True)
    ]


def _sun_on(traced: TracedScene, texels: Texels) -> Floats:
    """Direct irradiance (K, 3) of the sun at the first point of each texel, on the normal's side."""
    assert traced.sun is not None
    p, n, flat = (vectors(mi.Vector3f, v[:, 0]) for v in (texels.positions, texels.normals, texels.flat))
    return array_of(SunRays(traced.sun, traced.whole(diffuse=False)).on(p, n, flat, mi.Bool(True)))
