"""Probes: what an object would mirror, as cube maps of radiance and distance from one point.

Rays from the centre pass the object; what they meet is lit by and mirrors the whole scene. With the light map as
radiance cache a diffuse surface shows its baked light, a glossy one is traced on through its lobes, so that mirrors in
mirrors are right; without, everything is path traced, with more noise.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.bake import paths
from lambent.bake.material_plugin import DIFFUSE_ATTRIBUTE
from lambent.bake.mitsuba_scene import UV2_ATTRIBUTE, SceneBuilder
from lambent.bake.vectors import array_of, vectors
from lambent.core.colour import HALF_MAX, luminance
from lambent.core.cubemap import face_directions
from lambent.core.directions import normalize
from lambent.materials.bsdf import under_fresnel
from lambent.materials.document import Material
from lambent.store.contract import FAR

Array = NDArray[np.floating]
Indices = NDArray[np.integer]
PATHS_AT_ONCE = 1 << 22
BLOCKS = (16, 4, 1)  # paths through a texel that are stratified among themselves: the largest that fits is taken
# Noise of a texel is judged as if its paths were independent. Stratified, they have about .65 of it.
NOISE, MOST = 0.14, 16  # relative standard error that ends a texel, and times `samples` that end it at the latest
MIRROR_DEPTH = 6  # glossy surfaces in a row
CLOSE = 1e-4  # metres, and share of the distance, by which a ray begins before a surface


class LightMapCache:
    """Diffuse radiance of surfaces, from baked irradiance: kd/pi E of this side plus kt_d/pi E of the other.

    A coupled kd falls with the viewer's cosine, t(cos_o); that of the light is in its mean: exact under uniform light.
    """

    def __init__(self, builder: SceneBuilder, irradiance: Array, irradiance_back: Array | None) -> None:
        # A measured table is traced whole: its object has no diffuse term of its own.
        looks = dict(builder.scene.materials) | dict.fromkeys(builder.measured, Material())
        materials = [looks[o.material] for o in builder.scene.objects]
        self._numbers = builder.object_numbers()
        self._reflected = mi.Color3f(np.array([m.kd for m in materials], np.float32).T / np.float32(np.pi))
        self._coupled = mi.Bool(np.array([m.kd_coupled for m in materials], bool))
        self._transmitted = mi.Color3f(np.array([m.kt_d for m in materials], np.float32).T / np.float32(np.pi))
        self._textured = any(t.diffuse for t in builder.scene.textures.values())
        self._front = _texture(irradiance)
        self._back = _texture(irradiance_back) if irradiance_back is not None else None

    def __call__(self, si: Any, active: Any) -> Any:
        number = dr.gather(mi.UInt32, self._numbers, dr.reinterpret_array(mi.UInt32, si.shape), active)
        uv2 = si.shape.eval_attribute_3(UV2_ATTRIBUTE, si, active)
        uv2 = mi.Point2f(uv2.x, uv2.y)
        front = mi.Color3f(self._front.eval(uv2, active))
        back = mi.Color3f(self._back.eval(uv2, active)) if self._back is not None else mi.Color3f(0.0)
        outside = mi.Frame3f.cos_theta(si.wi) > 0
        reflected = dr.gather(mi.Color3f, self._reflected, number, active)
        transmitted = dr.gather(mi.Color3f, self._transmitted, number, active)
        coupled = dr.gather(mi.Bool, self._coupled, number, active)
        reflected *= dr.select(coupled, under_fresnel(dr.abs(mi.Frame3f.cos_theta(si.wi)), dr), 1.0)
        this_side, other_side = dr.select(outside, front, back), dr.select(outside, back, front)
        light = reflected * this_side + transmitted * other_side
        return light * si.bsdf().eval_attribute_3(DIFFUSE_ATTRIBUTE, si, active) if self._textured else light

    def irradiance(self, si: Any, active: Any) -> Any:
        """Irradiance of the light map on the normal's side."""
        uv2 = si.shape.eval_attribute_3(UV2_ATTRIBUTE, si, active)
        return mi.Color3f(self._front.eval(mi.Point2f(uv2.x, uv2.y), active))


def _texture(image: Array) -> Any:
    return mi.Texture2f(mi.TensorXf(image.astype(np.float32)), wrap_mode=dr.WrapMode.Clamp)


@dataclass(frozen=True)
class Probe:
    """radiance (6, N, N, 3) float16, distance (6, N, N) float32, normals (6, N, N, 3) float32 on the probe's side."""

    radiance: NDArray[np.float16]
    distance: NDArray[np.float32]
    normals: NDArray[np.float32]


@dataclass(frozen=True)
class Surroundings:
    """What a probe is traced in.

    `whole` is the scene, `first` that without the probe's object: it is left out for what the probe sees itself, and
    is there for what that mirrors and is lit by. With a `cache` the scenes are without diffuse terms, as their builder
    was told; without, paths are traced whole. `depth` is how many surfaces a path meets.
    """

    first: Any
    whole: Any
    cache: LightMapCache | None = None
    depth: int = MIRROR_DEPTH


def bake_probe(scene: Surroundings, centre: Array, n: int, samples: int, seed: int, noise: float = NOISE) -> Probe:
    """Trace a probe.

    Every texel gets `samples` paths; those that are still noisy, mostly glossy surfaces seen in the probe, get as many
    more as they need to come down to `noise`, at most MOST times as many in all.
    """
    rng = np.random.default_rng(seed)
    block = next(size for size in BLOCKS if size <= samples)
    base = -(-samples // block)
    texels = np.arange(6 * n * n)
    total, squares = _sums(scene, centre, n, np.repeat(texels, base), block, rng)
    first = total.reshape(-1, base, 3).sum(axis=1)
    needed = _blocks_needed(first, squares.reshape(-1, base, 3).sum(axis=1), base * block, noise) * base
    more = np.repeat(texels, np.ceil(needed).astype(int) - base)
    extra = _sums(scene, centre, n, more, block, rng)[0]
    for channel in range(3):
        first[:, channel] += np.bincount(more, extra[:, channel], minlength=len(texels))
    count = (base + np.bincount(more, minlength=len(texels))) * block
    radiance = np.minimum(first / count[:, None], HALF_MAX).reshape(6, n, n, 3).astype(np.float16)
    return Probe(radiance, *_geometry(scene.first, centre, n))


def _blocks_needed(total: Array, squares: Array, samples: int, noise: float) -> Array:
    """Times as many paths as texels have had, for their relative standard error to be `noise`; in [1, MOST].

    Relative to the texel, or to the median of all where that is brighter: in the dark less accuracy will do.
    """
    mean = luminance(total / samples)
    variance = np.maximum(luminance(squares / samples) - mean**2, 0) / samples
    allowed = np.maximum(noise * np.maximum(mean, np.median(mean)), 1e-12)
    return np.asarray(np.clip(variance / allowed**2, 1, MOST))


def _sums(
    scene: Surroundings, centre: Array, n: int, texels: Indices, samples: int, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Sums (k, 3) of radiance and of its squares over `samples` paths through each of the texels."""
    total, squares = np.zeros((2, len(texels), 3))
    at_once = max(1, PATHS_AT_ONCE // samples)
    for start in range(0, len(texels), at_once):
        mine = slice(start, start + at_once)
        total[mine], squares[mine] = _pass(scene, centre, n, texels[mine], samples, int(rng.integers(1 << 32)))
    return total, squares


def _pass(scene: Surroundings, centre: Array, n: int, texels: Indices, samples: int, seed: int) -> tuple[Array, Array]:
    sampler = mi.load_dict({"type": "multijitter", "sample_count": samples})
    sampler.set_samples_per_wavefront(samples)
    width = len(texels) * samples
    sampler.seed(seed, width)
    texel = dr.gather(mi.UInt32, mi.UInt32(texels.astype(np.uint32)), dr.arange(mi.UInt32, width) // samples)
    column, row, face = texel % n, texel // n % n, texel // (n * n)
    jitter = sampler.next_2d()
    s, t = (column + jitter.x) / n * 2 - 1, (row + jitter.y) / n * 2 - 1
    ray = mi.Ray3f(_origin(centre) + dr.zeros(mi.Point3f, width), dr.normalize(_direction(face, s, t)))
    start = paths.camera_start(_up_to_first(scene.first, ray))
    value = paths.radiance(scene.whole, sampler, start, scene.depth, scene.cache)
    value = dr.select(dr.all(dr.isfinite(value)), value, 0.0)
    square = value * value
    dr.eval(value, square)
    return _block_sums(value, samples), _block_sums(square, samples)


def _origin(centre: Array) -> Any:
    """The centre as data, not as constants: all probes share their kernels then."""
    return mi.Point3f(*(dr.opaque(mi.Float, float(x)) for x in centre))


def _up_to_first(scene: Any, ray: Any) -> Any:
    """Rays that begin right before what the given ones meet first in `scene`, whatever else stands in their way."""
    distance = _distance(scene, ray)[0]
    return mi.Ray3f(ray(dr.maximum(distance * (1 - CLOSE) - CLOSE, 0.0)), ray.d)


def _distance(scene: Any, ray: Any) -> tuple[Any, Any]:
    """Metres to the first surface behind all holes, FAR where there is none, and what is met there."""
    si = paths.intersect(scene, ray, mi.Bool(True), paths.has_holes(scene))
    return dr.select(si.is_valid(), dr.minimum(dr.norm(si.p - ray.o), FAR), FAR), si


def _block_sums(value: Any, samples: int) -> Array:
    return np.stack([np.array(dr.block_sum(channel, samples)) for channel in (value.x, value.y, value.z)], axis=-1)


def _direction(face: Any, s: Any, t: Any) -> Any:
    """core.cubemap.directions_at, for the path tracer."""
    directions = [(1, -t, -s), (-1, -t, s), (s, 1, t), (s, -1, -t), (s, -t, 1), (-s, -t, -1)]
    w = mi.Vector3f(0.0)
    for number, components in enumerate(directions):
        w = dr.select(face == number, mi.Vector3f(*components), w)
    return w


def _geometry(scene: Any, centre: Array, n: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Distance and normal at the texels' centres."""
    direction = vectors(mi.Vector3f, normalize(face_directions(n)))
    distance, si = _distance(scene, mi.Ray3f(_origin(centre), direction))
    normal = dr.select(dr.dot(si.n, direction) > 0, -si.n, si.n)
    normal = dr.select(si.is_valid(), normal, -direction)
    dr.eval(distance, normal)
    return np.array(distance).reshape(6, n, n), array_of(normal).reshape(6, n, n, 3)
