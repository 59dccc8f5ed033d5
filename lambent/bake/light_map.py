"""The light map: irradiance at every texel, path traced through the true materials.

A tile is sampled in pairs of passes, traced at once and summed apart, so that half their difference
tells the noise. The raw sums stay in the store (`light_map/traced`): a bake goes on from them after any interruption.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.denoise import denoise_charts, fill
from lambent.bake.quality import Quality
from lambent.bake.seams import blend_seams
from lambent.bake.texels import POINTS, Texels
from lambent.bake.vectors import vectors
from lambent.core.colour import HALF_MAX, luminance
from lambent.core.sequences import hammersley, r2

Array = NDArray[np.floating]
GATHER_PASS = 64  # samples of a texel that are stratified among themselves
SMOOTH = 8  # averaging of what is grown into gutters before denoising: some 4 texels wide


@dataclass(frozen=True)
class Sides:
    """Which of a map's points can be lit, on one side of the surfaces.

    texels as baked; `sign` +1 for the normal's side, -1 for the other; valid (K, POINTS) bool: false for points
    within a solid, and, on the far side, for objects that light does not cross.
    """

    texels: Texels
    sign: float
    valid: NDArray[np.bool_]


Estimate = Callable[..., Any]  # one sample of three numbers at each point, called as `paths.irradiance` is


@dataclass(frozen=True)
class Sampling:
    """How texels are sampled: at least and at most so many times, until the relative noise is reached.

    With a `cache` (see `paths.radiance`) paths end at diffuse surfaces; the scene must be without diffuse terms then.
    """

    samples: tuple[int, int]
    noise: float
    max_depth: int
    per_pass: int
    cache: paths.Cache | None = None
    estimate: Estimate = paths.irradiance


def path_traced(quality: Quality) -> Sampling:
    """All bounces, for the whole scene."""
    per_pass = min(32, max(1, quality.light_map_samples[0] // 2))
    return Sampling(quality.light_map_samples, quality.light_map_noise, quality.max_depth, per_pass)


def gathered(quality: Quality, cache: paths.Cache) -> Sampling:
    """One diffuse bounce onto cached light, mirrors in between followed (final gathering, Reichert 1992)."""
    count = quality.gather_samples
    per_pass = max(1, min(GATHER_PASS, count // 2))
    return Sampling((2 * per_pass, count), quality.gather_noise, quality.max_depth, per_pass, cache)


def tile_samples(scene: Any, sides: Sides, region: tuple[slice, ...], seed: int, how: Sampling) -> Array:
    """Raw content of one tile: (2, h, w, 4) float32, the two halves' sums of irradiance and their sample counts."""
    rows, columns = region[1], region[2]
    height, width = rows.stop - rows.start, columns.stop - columns.start
    row, column = np.divmod(sides.texels.index, sides.texels.width)
    inside = (row >= rows.start) & (row < rows.stop) & (column >= columns.start) & (column < columns.stop)
    mine = np.flatnonzero(inside & sides.valid.any(axis=1))
    raw = np.zeros((2, height * width, 4), np.float32)
    if not len(mine):
        return raw.reshape(2, height, width, 4)
    points = _Points(sides, mine)
    sums = np.zeros((2, len(mine), 3))
    fewest, most = how.samples
    passes = 0
    while passes * how.per_pass < most:
        sums += _sums_of_pass(scene, points, (seed, passes), how)
        passes += 2
        samples = passes * how.per_pass
        if samples >= fewest and relative_noise(sums * 2 / samples) <= how.noise:
            break
    place = (row[mine] - rows.start) * width + column[mine] - columns.start
    raw[:, place, :3] = sums
    raw[:, place, 3] = passes * how.per_pass / 2
    return raw.reshape(2, height, width, 4)


def relative_noise(halves: Array, share: Array | None = None) -> float:
    """Root mean square error of the mean of two estimates (2, ..., 3), over its mean; 0 for black.

    Every one counts the same, or by its share (...), such as its area.
    """
    squares, light = (luminance(halves[0] - halves[1]) / 2) ** 2, luminance(halves)
    if share is not None and share.any():
        mean_square, mean = np.average(squares, weights=share), np.average(light.mean(axis=0), weights=share)
    else:
        mean_square, mean = np.mean(squares), light.mean()
    return float(np.sqrt(mean_square) / mean) if mean > 0 else 0.0


class _Points:
    """The sample points of some texels on the device: invalid points are replaced by valid ones of the same texel."""

    def __init__(self, sides: Sides, mine: NDArray[np.integer]) -> None:
        valid = sides.valid[mine]
        ranked = np.argsort(~valid, axis=1, kind="stable")  # those that are valid first, taken in turn
        turn = np.arange(POINTS) % valid.sum(axis=1)[:, None]
        choice = np.where(valid, np.arange(POINTS), np.take_along_axis(ranked, turn, axis=1))[..., None]
        t, take = sides.texels, np.take_along_axis
        self.count = len(mine)
        self.position = vectors(mi.Vector3f, take(t.positions[mine], choice, axis=1))
        self.normal = vectors(mi.Vector3f, take(t.normals[mine], choice, axis=1) * sides.sign)
        self.flat = vectors(mi.Vector3f, take(t.flat[mine], choice, axis=1) * sides.sign)


def _sums_of_pass(scene: Any, points: _Points, seed: tuple[int, int], how: Sampling) -> Array:
    """Sums (2, n, 3) of a pair of passes' samples of irradiance per texel.

    Every texel sees the same two stratified point sets in both, each shifted by an offset of its own (Cranley &
    Patterson 1976).
    """
    n, samples = 2 * points.count, how.per_pass
    rng = np.random.default_rng(seed)
    shifts = rng.random((4, n), dtype=np.float32)
    thread = dr.arange(mi.UInt32, n * samples)
    texel, k = thread // samples, thread % samples  # texels of the first pass, then of the second
    first = dr.gather(mi.UInt32, mi.UInt32(rng.integers(POINTS, size=n, dtype=np.uint32)), texel)
    # the low bit already steers the azimuth of Hammersley points; a constant count would compile every tile anew
    point = texel % dr.opaque(mi.UInt32, points.count) * POINTS + (k // 2 + first) % POINTS
    at = paths.Points(*(dr.gather(mi.Vector3f, v, point) for v in (points.position, points.normal, points.flat)))
    u_bsdf = _shifted(hammersley(samples), shifts[:2], k, texel)
    u_emitter = _shifted(r2(samples), shifts[2:], k, texel)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(int(rng.integers(1 << 32)), n * samples)
    e = how.estimate(scene, sampler, at, u_bsdf, u_emitter, how.max_depth, how.cache)
    e = dr.select(dr.all(dr.isfinite(e)), e, 0.0)
    dr.eval(e)
    sums = [np.array(dr.block_sum(channel, samples)) for channel in (e.x, e.y, e.z)]
    return np.stack(sums, axis=-1).reshape(2, points.count, 3)


def _shifted(points: Array, shifts: Array, k: Any, texel: Any) -> Any:
    u = [
        dr.gather(mi.Float, mi.Float(points[:, axis].astype(np.float32)), k)
        + dr.gather(mi.Float, mi.Float(shifts[axis]), texel)
        for axis in (0, 1)
    ]
    return mi.Point2f(u[0] - dr.floor(u[0]), u[1] - dr.floor(u[1]))


def finished(raw: Array, texels: Texels, labels: NDArray[np.integer]) -> tuple[Array, dict[str, float]]:
    """The light map (H, W, 3) float16 from its raw sums (2, H, W, 4), and what to note: noise and samples."""
    count = raw[..., 3]
    known = count[0] > 0
    if not known.any():
        return np.zeros((*known.shape, 3), np.float16), {"noise": 0.0, "samples": 0.0}
    halves = raw[..., :3] / np.maximum(count, 1)[..., None]
    noise = relative_noise(halves[:, known])
    meta = {"noise": noise, "samples": float(count.sum(axis=0)[known].mean())}
    return cleaned(halves.mean(axis=0), known, texels, labels), meta


def cleaned(
    irradiance: Array, known: NDArray[np.bool_], texels: Texels, labels: NDArray[np.integer]
) -> NDArray[np.float16]:
    """A noisy light map (H, W, 3), denoised, filled where nothing is known, its seams blended."""
    clean = denoise_charts(irradiance, known, labels, smooth=SMOOTH)
    clean = fill(blend_seams(clean, known, texels, labels), known, labels)
    return np.minimum(clean, HALF_MAX).astype(np.float16)
