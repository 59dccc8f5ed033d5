"""Irradiance at every texel of the light map, path traced with the actual materials.

A tile is sampled in pairs of passes, traced together but summed separately: half their difference estimates the noise.
The raw sums stay in the store, and a bake resumes from them after any interruption.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.denoise import denoise_charts, fill
from lambent.baking.light.detail import with_detail
from lambent.baking.light.level import with_level
from lambent.baking.light.stitching import Cuts, stitched
from lambent.baking.surfaces.texels import POINTS, Sides, Texels, area_of_texels, covered_share
from lambent.baking.tracing import path_tracer
from lambent.baking.tracing.lights.lit_texels import EVERY, LitTexels
from lambent.baking.tracing.lights.sun import Unseen
from lambent.baking.tracing.rays import block_sums, independent, vectors
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.sequences import hammersley, r2
from lambent.core.light.colour import HALF_MAX, luminance

SMOOTH = 8  # rounds of averaging before texels grow into gutters: about 4 texels wide


Estimate = Callable[..., Any]  # one sample of three numbers per point, like `path_tracer.irradiance`


@dataclass(frozen=True)
class Sampling:
    """How to sample texels: `samples` (least, most) times, until the relative noise is reached.

    With a `cache` (`path_tracer.radiance`), paths end at diffuse surfaces, and the scene must have no diffuse terms.
    Direct light of the sun `unseen` is left out. A `tally` sums parts of the light, the last `parts` of which are
    stored in addition to the whole; the cache must then suit the tally. With `lit`, which takes EVERY samples or more
    per pass, further paths begin at lit texels.
    """

    samples: tuple[int, int]
    noise: float
    max_depth: int
    per_pass: int
    cache: Any = None
    estimate: Estimate = path_tracer.irradiance
    unseen: Unseen | None = None
    tally: path_tracer.Tally | None = None
    parts: int = 0
    lit: LitTexels | None = None


@dataclass(frozen=True, eq=False)
class TexelJob:
    """The n texels of a tile that are sampled, of those of its `size` (h, w).

    place (n,) is row * w + column in the tile; points are the positions, normals and flat normals (n * POINTS, 3) of
    their `path_tracer.Points`. Noise is relative to the light with that of lamps (n, 3), which samples do not have.
    """

    size: tuple[int, int]
    place: Indices
    points: tuple[Floats, ...]
    lamps: Floats | None
    seed: int

    @classmethod
    def of(cls, sides: Sides, region: tuple[slice, ...], seed: int, lamps: Floats | None = None) -> TexelJob:
        """Those of a region of a map of samples (2, H, W, ...); `lamps` (H, W, 3)."""
        rows, columns = region[1], region[2]
        height, width = rows.stop - rows.start, columns.stop - columns.start
        row, column = np.divmod(sides.texels.index, sides.texels.width)
        inside = (row >= rows.start) & (row < rows.stop) & (column >= columns.start) & (column < columns.stop)
        mine = np.flatnonzero(inside & sides.valid.any(axis=1))
        place = (row[mine] - rows.start) * width + column[mine] - columns.start
        of_lamps = None if lamps is None else lamps.reshape(-1, 3)[sides.texels.index[mine]]
        return cls((height, width), place, chosen_points(sides, mine), of_lamps, seed)


def tile_samples(scene: Any, job: TexelJob, how: Sampling) -> NDArray[np.float32]:
    """Raw content of a tile: (2, h, w, 4 + 3 parts) float32, the sums of both halves, of the whole and of each part.

    The fourth channel has the sample counts.
    """
    height, width = job.size
    count, channels = len(job.place), 4 + 3 * how.parts
    raw = np.zeros((2, height * width, channels), np.float32)
    if not count:
        return raw.reshape(2, height, width, channels)
    points = on_device(job.points)
    sums = np.zeros((2, count, 3 + 3 * how.parts))
    fewest, most = how.samples
    of_lamps = 0.0 if job.lamps is None else job.lamps.astype(float)
    passes = 0
    while passes * how.per_pass < most:
        sums += _sums_of_pass(scene, points, count, (job.seed, passes), how)
        passes += 2
        samples = passes * how.per_pass
        if samples >= fewest and relative_noise(sums[..., :3] * 2 / samples + of_lamps) <= how.noise:
            break
    raw[:, job.place, :3], raw[:, job.place, 4:] = sums[..., :3], sums[..., 3:]
    raw[:, job.place, 3] = passes * how.per_pass / 2
    return raw.reshape(2, height, width, channels)


def relative_noise(halves: Floats, share: Floats | None = None) -> float:
    """Root mean square error of the mean of two estimates (2, ..., 3), relative to its mean; 0 if black or empty.

    Estimates are weighted equally, or by `share` (...), for example by area.
    """
    if not halves.size:
        return 0.0
    squares, light = (luminance(halves[0] - halves[1]) / 2) ** 2, luminance(halves)
    if share is not None and share.any():
        mean_square, mean = np.average(squares, weights=share), np.average(light.mean(axis=0), weights=share)
        return float(np.sqrt(mean_square) / mean) if mean > 0 else 0.0
    mean = light.mean()
    return float(np.sqrt(np.mean(squares)) / mean) if mean > 0 else 0.0


def points_of(sides: Sides, mine: Indices) -> path_tracer.Points:
    """`chosen_points` on the device."""
    return on_device(chosen_points(sides, mine))


def chosen_points(sides: Sides, mine: Indices) -> tuple[Floats, ...]:
    """Positions, normals and flat normals (n * POINTS, 3) of texels; invalid points are replaced by valid ones."""
    valid = sides.valid[mine]
    ranked = np.argsort(~valid, axis=1, kind="stable")  # valid points first, used in turn
    turn = np.arange(POINTS) % valid.sum(axis=1)[:, None]
    choice = np.where(valid, np.arange(POINTS), np.take_along_axis(ranked, turn, axis=1))[..., None]
    t = sides.texels
    chosen = (np.take_along_axis(values[mine], choice, axis=1) for values in (t.positions, t.normals, t.flat))
    return tuple((v * s).reshape(-1, 3) for v, s in zip(chosen, (1, sides.sign, sides.sign), strict=True))


def on_device(points: tuple[Floats, ...]) -> path_tracer.Points:
    return path_tracer.Points(*(vectors(mi.Vector3f, v) for v in points))


def _sums_of_pass(scene: Any, points: path_tracer.Points, count: int, seed: tuple[int, int], how: Sampling) -> Floats:
    """Sums (2, n, 3 + 3 parts) of a pair of passes' irradiance samples per texel, of the whole and of each part.

    In both passes every texel uses the same two stratified point sets, shifted by its own random offsets (Cranley &
    Patterson 1976).
    """
    n, samples = 2 * count, how.per_pass
    rng = np.random.default_rng(seed)
    shifts = rng.random((4, n), dtype=np.float32)
    thread = dr.arange(mi.UInt32, n * samples)
    texel, k = thread // samples, thread % samples  # texels of the first pass, then of the second
    first = dr.gather(mi.UInt32, mi.UInt32(rng.integers(POINTS, size=n, dtype=np.uint32)), texel)
    # the low bit already determines the azimuth of Hammersley points; a constant count would recompile for every tile
    point = texel % dr.opaque(mi.UInt32, count) * POINTS + (k // 2 + first) % POINTS
    at = _chosen(points, point)
    u_bsdf = _shifted(hammersley(samples), shifts[:2], k, texel)
    u_emitter = _shifted(r2(samples), shifts[2:], k, texel)
    sampler = independent(int(rng.integers(1 << 32)), n * samples)
    sums = _summed(_estimates(scene, sampler, at, u_bsdf, u_emitter, how), samples)
    if how.lit is not None:
        sums += _summed(_of_lit(scene, points, count, how, how.lit, rng), samples // EVERY)
    return sums.reshape(2, count, -1)


def _summed(found: list[Any], samples: int) -> Floats:
    """(n, 3 + 3 parts) sums of so many consecutive samples; those that are not finite count as 0."""
    usable = dr.all(dr.isfinite(found[0]))
    found = [dr.select(usable, e, 0.0) for e in found]
    dr.eval(found)
    return np.concatenate([block_sums(e, samples) for e in found], axis=-1)


def _estimates(
    scene: Any, sampler: Any, at: path_tracer.Points, u_bsdf: Any, u_emitter: Any, how: Sampling
) -> list[Any]:
    """A sample (mi.Color3f) of each point: the whole, then the stored parts."""
    if how.tally is None and how.lit is None:
        return [how.estimate(scene, sampler, at, u_bsdf, u_emitter, how.max_depth, how.cache, how.unseen)]
    tally = how.tally or path_tracer.AllLight()
    sums = path_tracer.irradiance_sums(
        scene, sampler, at, u_bsdf, u_emitter, how.max_depth, how.cache, tally, how.unseen, how.lit
    )
    return _whole_and_parts(sums, tally.count, how.parts)


def _of_lit(
    scene: Any, points: path_tracer.Points, count: int, how: Sampling, lit: LitTexels, rng: np.random.Generator
) -> list[Any]:
    """Likewise of each point, what paths by way of lit texels add."""
    n, samples = 2 * count, how.per_pass // EVERY
    shifts = rng.random((2, n), dtype=np.float32)
    thread = dr.arange(mi.UInt32, n * samples)
    texel, k = thread // samples, thread % samples
    point = texel % dr.opaque(mi.UInt32, count) * POINTS + k % POINTS
    u, tally = _shifted(r2(samples), shifts, k, texel), how.tally or path_tracer.AllLight()
    sampler = independent(int(rng.integers(1 << 32)), n * samples)
    sums = path_tracer.of_lit(
        scene, sampler, _chosen(points, point), u, how.max_depth, how.cache, tally, how.unseen, lit
    )
    return _whole_and_parts(sums, tally.count, how.parts)


def _chosen(points: path_tracer.Points, number: Any) -> path_tracer.Points:
    """Those points of the numbers (mi.UInt32)."""
    of = points.position, points.normal, points.flat
    return path_tracer.Points(*(dr.gather(mi.Vector3f, values, number) for values in of))


def _whole_and_parts(sums: list[Any], count: int, parts: int) -> list[Any]:
    return [mi.Color3f(sum(sums[:count])), *sums[len(sums) - parts :]]


def _shifted(points: Floats, shifts: Floats, k: Any, texel: Any) -> Any:
    both = zip(points.T.astype(np.float32), shifts, strict=True)
    u = [dr.gather(mi.Float, mi.Float(p), k) + dr.gather(mi.Float, mi.Float(shift), texel) for p, shift in both]
    return mi.Point2f(u[0] - dr.floor(u[0]), u[1] - dr.floor(u[1]))


def finished(raw: Floats, texels: Texels, labels: Indices, cuts: Cuts) -> tuple[Floats, dict[str, float]]:
    """The light map (H, W, 3) float16 from its raw sums (2, H, W, 4), and its noise and samples as meta."""
    halves, known = sampled_halves(raw)
    samples = float(raw[..., 3].sum(axis=0)[known].mean()) if known.any() else 0.0
    meta = {"noise": relative_noise(halves[:, known]), "samples": samples}
    return cleaned(halves.mean(axis=0), known, texels, labels, cuts, variance_of(halves)), meta


def plus(light: Floats, direct: Floats) -> NDArray[np.float16]:
    """Sum of a light map and direct light that its samples do not have."""
    return np.minimum(np.add(light, direct, dtype=np.float32), HALF_MAX).astype(np.float16)


def variance_of(halves: Floats) -> Floats:
    """Squared standard error (H, W) of the luminance of the mean of two halves (2, H, W, 3), from one difference."""
    return np.asarray(luminance(np.asarray(halves[0] - halves[1], np.float32) / 2) ** 2)


def sampled_halves(raw: Floats) -> tuple[Floats, Flags]:
    """Irradiance (2, H, W, 3) of both halves of path traced sums (2, H, W, 4), and flags of sampled texels (H, W)."""
    count = raw[..., 3:]
    return raw[..., :3] / np.maximum(count, 1), count[0, ..., 0] > 0


def cleaned(
    irradiance: Floats, known: Flags, texels: Texels, labels: Indices, cuts: Cuts, variance: Floats | None = None
) -> NDArray[np.float16]:
    """Denoise a light map (H, W, 3), fill unknown texels and close its seams; `variance` as in `denoised`."""
    if not known.any():
        return np.zeros(irradiance.shape, np.float16)
    clean = denoised(irradiance, known, labels, variance)
    return np.asarray(closed(clean[None], known, texels, labels, cuts)[0], np.float16)


def denoised(irradiance: Floats, known: Flags, labels: Indices, variance: Floats | None = None) -> Floats:
    """Denoise a light map (H, W, 3) at the level of its samples.

    With the `variance` (H, W) of its luminance, detail that the filter loses is kept.
    """
    clean = with_level(denoise_charts(irradiance, known, labels, smooth=SMOOTH), irradiance, known, labels, variance)
    return clean if variance is None else with_detail(clean, irradiance, variance, known, labels)


def closed(clean: Floats, known: Flags, texels: Texels, labels: Indices, cuts: Cuts) -> NDArray[np.float16]:
    """Fill unknown texels of denoised light maps (n, H, W, 3), and close their seams."""
    together = np.concatenate(list(clean), axis=-1)
    together = fill(together, known, labels)
    each = np.split(together, len(clean), axis=-1)
    areas = area_of_texels(texels), covered_share(texels)
    return np.array([np.minimum(stitched(one, cuts, labels, *areas), HALF_MAX) for one in each], np.float16)
