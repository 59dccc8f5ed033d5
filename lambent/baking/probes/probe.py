"""Probes: the surroundings of an object as cube maps of radiance and distance from one point.

Rays from the centre pass through the object; the surfaces they hit are lit by, and mirror, the whole scene. With the
light map as radiance cache, a diffuse surface shows its baked light and a glossy one is traced on through its lobes, so
that mirrors in mirrors are right. Without it everything is path traced, with more noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.cache import LightMapCache
from lambent.baking.running.tiles import slices
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.rays import array_of, block_sums, vectors
from lambent.core.arrays import Floats, Indices, sums_of
from lambent.core.geometry.cubemap import face_directions, faces_at
from lambent.core.geometry.directions import normalize
from lambent.core.light.colour import in_halves, luminance
from lambent.store.contract import FAR

PATHS_AT_ONCE = 1 << 22
BLOCKS = (16, 4, 1)  # paths through a texel that are stratified together: the largest that fits
# Noise of a texel is estimated as for independent paths; stratified paths have about .65 of it.
NOISE, MOST = 0.14, 16  # relative standard error that ends a texel, and the limit as a multiple of `samples`
MIRROR_DEPTH = 6  # glossy surfaces in a row


@dataclass(frozen=True)
class Probe:
    """radiance (6, N, N, 3) float32, distance (6, N, N) float32, normals (6, N, N, 3) float32 on the probe's side.

    Radiance is rounded as by `in_halves`. `groups` (n, 6, N, N, 3) float32 has it by light group, not rounded.
    """

    radiance: NDArray[np.float32]
    distance: NDArray[np.float32]
    normals: NDArray[np.float32]
    groups: NDArray[np.float32] | None = None


@dataclass(frozen=True)
class Surroundings:
    """Scenes for tracing a probe.

    `first` is the scene that the probe itself sees, usually without its object; `whole` is the scene that lights, and
    is mirrored by, the visible surfaces. With a `cache`, both have no diffuse terms; without, paths are traced whole. A
    path has at most `depth` surfaces. A `tally` separates light by group, together with a suitable cache.
    """

    first: Any
    whole: Any
    cache: LightMapCache | None = None
    depth: int = MIRROR_DEPTH
    tally: path_tracer.Tally | None = None


def bake_probe(scene: Surroundings, centre: Floats, n: int, samples: int, seed: int, noise: float = NOISE) -> Probe:
    """Trace a probe at `centre` (3,), of cube maps with `n` texels a side.

    Every texel gets `samples` paths. Texels that are still noisy, mostly of glossy surfaces, get as many more as they
    need to reach the relative standard error `noise`, at most MOST times `samples` in total. The same seed gives the
    same probe.
    """
    rng = np.random.default_rng(seed)
    block = _block(samples)
    base = -(-samples // block)
    texels = np.arange(6 * n * n)
    total, squares = _sums(scene, centre[None], n, np.repeat(texels, base), block, rng)
    first = total.reshape(len(texels), base, -1).sum(axis=1)
    needed = _blocks_needed(first[:, :3], squares.reshape(-1, base, 3).sum(axis=1), base * block, noise) * base
    more = np.repeat(texels, np.ceil(needed).astype(int) - base)
    extra = _sums(scene, centre[None], n, more, block, rng)[0]
    first += sums_of(extra, more, len(texels))
    count = (base + np.bincount(more, minlength=len(texels))) * block
    means = (first / count[:, None]).reshape(6, n, n, -1, 3)
    rounded, unit = in_halves(means[..., 0, :])
    groups = None if scene.tally is None else np.moveaxis(means[..., 1:, :], -2, 0).astype(np.float32)
    distance, normals = _geometry(scene.first, centre[None], n)
    return Probe(rounded.astype(np.float32) * np.float32(unit), distance[0], normals[0], groups)


def bake_small(scene: Surroundings, centres: Floats, n: int, samples: int, seed: int) -> list[Probe]:
    """Probes at all `centres` (k, 3), with `samples` paths per texel.

    They are traced together, since a launch costs as much as its paths. They have no light by group, and no additional
    paths for noisy texels.
    """
    block = _block(samples)
    texels, base = np.arange(len(centres) * 6 * n * n), -(-samples // block)
    total, _ = _sums(scene, centres, n, np.repeat(texels, base), block, np.random.default_rng(seed))
    means = total[:, :3].reshape(len(centres), 6, n, n, base, 3).mean(axis=-2) / block
    return [
        Probe(mean.astype(np.float32), distance, normals)
        for mean, distance, normals in zip(means, *_geometry(scene.first, centres, n), strict=True)
    ]


def _block(samples: int) -> int:
    return next(size for size in BLOCKS if size <= samples)


def _blocks_needed(total: Floats, squares: Floats, samples: int, noise: float) -> Floats:
    """Factor on the number of paths for a relative standard error of `noise` per texel; in [1, MOST].

    The error is relative to the texel, or to the median of all if that is brighter: dark texels need less accuracy.
    """
    mean = luminance(total / samples)
    variance = np.maximum(luminance(squares / samples) - mean**2, 0) / samples
    allowed = noise * np.maximum(mean, max(float(np.median(mean)), 1e-12))  # handles black texels and infinite noise
    return np.asarray(np.clip(variance / allowed**2, 1, MOST))


def _sums(
    scene: Surroundings, centres: Floats, n: int, texels: Indices, samples: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Sums over `samples` paths through each of the texels, of radiance and of its squares (k, 3).

    Texels are numbered consecutively over the probes at all `centres` (m, 3).

    Radiance is (k, 3 + 3 n), the whole and each of n groups.
    """
    groups = 0 if scene.tally is None else scene.tally.count
    total, squares = np.zeros((len(texels), 3 + 3 * groups)), np.zeros((len(texels), 3))
    at_once = max(1, PATHS_AT_ONCE // samples)
    for mine in slices(len(texels), at_once):
        total[mine], squares[mine] = _pass(scene, centres, n, texels[mine], samples, int(rng.integers(1 << 32)))
    return total, squares


def _pass(
    scene: Surroundings, centres: Floats, n: int, texels: Indices, samples: int, seed: int
) -> tuple[Floats, Floats]:
    sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    width = len(texels) * samples
    sampler.seed(seed, width)
    texel = dr.gather(mi.UInt32, mi.UInt32(texels.astype(np.uint32)), dr.arange(mi.UInt32, width) // samples)
    column, row, face = texel % n, texel // n % n, texel // (n * n) % 6
    jitter = sampler.next_2d()
    s, t = (column + jitter.x) / n * 2 - 1, (row + jitter.y) / n * 2 - 1
    ray = mi.Ray3f(_origins(centres, texel // (6 * n * n)), dr.normalize(_direction(face, s, t)))
    reach = _distance(scene.first, ray)[0]  # paths begin just before the surface that the probe itself sees
    near = mi.Ray3f(ray(dr.maximum(reach * (1 - rays.APPROACH) - rays.APPROACH, 0.0)), ray.d)
    tally, start = scene.tally or path_tracer.AllLight(), path_tracer.camera_start(near)
    sums = path_tracer.radiance_sums(scene.whole, sampler, start, scene.depth, scene.cache, tally)
    value = mi.Color3f(sum(sums))
    usable = dr.all(dr.isfinite(value))
    values = [dr.select(usable, one, 0.0) for one in (value, *(sums if scene.tally else ()))]
    square = values[0] * values[0]
    dr.eval(values, square)
    return np.concatenate([block_sums(one, samples) for one in values], axis=-1), block_sums(square, samples)


def _origins(centres: Floats, number: Any) -> Any:
    """The centres (m, 3) of these numbers, passed as data, not constants, so that all probes share their kernels."""
    return dr.gather(mi.Point3f, vectors(mi.Point3f, np.asarray(centres, float)), number)


def _distance(scene: Any, ray: Any) -> tuple[Any, Any]:
    """Metres to the first surface behind all holes, FAR without one, and the interaction."""
    si = rays.intersect(scene, ray, mi.Bool(True), rays.has_holes(scene))
    return dr.select(si.is_valid(), dr.minimum(dr.norm(si.p - ray.o), FAR), FAR), si


def _direction(face: Any, s: Any, t: Any) -> Any:
    """Directions (mi.Vector3f) of `faces_at` on numbered faces."""
    w = mi.Vector3f(0.0)
    for number, components in enumerate(faces_at(s, t)):
        w = dr.select(face == number, mi.Vector3f(*components), w)
    return w


def _geometry(scene: Any, centres: Floats, n: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Distances (m, 6, n, n) and normals (m, 6, n, n, 3) at the texels' centres, for probes at `centres` (m, 3)."""
    count = 6 * n * n
    thread = dr.arange(mi.UInt32, count * len(centres))
    directions = vectors(mi.Vector3f, normalize(face_directions(n)))
    direction = dr.gather(mi.Vector3f, directions, thread % count)
    distance, si = _distance(scene, mi.Ray3f(_origins(centres, thread // count), direction))
    normal = dr.select(dr.dot(si.n, direction) > 0, -si.n, si.n)
    normal = dr.select(si.is_valid(), normal, -direction)
    dr.eval(distance, normal)
    shape = (len(centres), 6, n, n)
    return np.array(distance).reshape(shape), array_of(normal).reshape(*shape, 3)
