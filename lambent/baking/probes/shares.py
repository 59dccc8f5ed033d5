"""The share of a probe's light that arrives at each texel of the light map, by direction.

A probe is seen from one place. At a texel, nearby things hide some of its light and show other light instead. Rays from
the texel are path traced, and looked up in the probe as in the renderer. With L the arriving light along w and P the
probe's (luminances), the texel stores the four coefficients of the share

    r(w) = a + b . w

that minimise the sum of g (L - r P)^2 over the rays, g = F / (m + P). Fresnel's term F weights grazing directions as
viewers see them mirrored, and m, the median of L, keeps bright windows from dominating. A small penalty favours equal
shares in all directions. The equations of texels are averaged over their charts before they are solved: averaging
solutions would average their noise.

An object uses its shares only if they lower the error of the rays below that of its probe's specular occlusion
(`selection`). Lobes wider than WIDE blur the rays, so for them squared errors count: among white and black rays, a grey
mean is right for a wide lobe, and wrong for a mirror. For them, L counts up to MOST_LIGHT P: a few rays to a lamp that
the probe misses would tilt the shares of all directions, in each texel otherwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lambent.baking.light.cache import LightMapCache
from lambent.baking.light.denoise import fill
from lambent.baking.light.sampling import points_of
from lambent.baking.probes.device_lookup import DeviceProbe
from lambent.baking.probes.probe import MIRROR_DEPTH
from lambent.baking.probes.selection import Scaling, difference
from lambent.baking.running.tiles import slices
from lambent.baking.surfaces.texels import POINTS, Sides
from lambent.baking.tracing import path_tracer, rays
from lambent.baking.tracing.lights.sun import Unseen
from lambent.baking.tracing.rays import array_of, independent
from lambent.core.arrays import Floats, Indices
from lambent.core.progress import Progress, silent
from lambent.materials.lobes import fresnel
from lambent.store.occlusion import MOST_SHARE

RAYS = 64  # per texel, a multiple of POINTS
SMOOTH = 12  # rounds of averaging the texels' equations over their charts
PENALTY = 0.01  # of a share's dependence on direction, relative to the mean of the equations' diagonal
WIDE = 0.1  # roughness of a lobe
MOST_LIGHT = 5.0  # relative to the probe's
WORTH = 0.95  # factor to which shares must lower the error
JUDGED = 1 << 16  # rays per object that judge its shares
RAYS_AT_ONCE = 1 << 21
GOLDEN = math.pi * (3 - math.sqrt(5))  # radians between consecutive rays
UPPER = np.triu_indices(4)
EQUATIONS = len(UPPER[0]) + 4  # per texel: upper triangle of the matrix, right side


@dataclass(frozen=True)
class Shown:
    """An object, by number, its reflectance at normal incidence, its widest lobe's roughness, and the probe it shows.

    Without shares, `scaling` scales the probe's light by the light map and by the probe's own `irradiance` (9,).
    """

    number: int
    r0: float
    roughness: float
    probe: DeviceProbe
    irradiance: Floats
    scaling: Scaling


@dataclass(frozen=True)
class _Rays:
    """Rays of texels, by row: unit directions w (n, 3), traced and probe light (n,), Fresnel's term (n,)."""

    row: Indices
    w: NDArray[np.float32]
    light: NDArray[np.float32]
    probe: NDArray[np.float32]
    fresnel: NDArray[np.float32]


class ShareTracer:
    """Traces rays of texels in a scene without diffuse terms, whose surfaces show the light map (`cache`).

    `owner` (K,) is the number of the object on each row of the texels, `luminous` (K,) the light map's luminance there.
    The sun `unseen` is left out, as the renderer leaves it out of probes.
    """

    def __init__(
        self, scene: Any, cache: LightMapCache, sides: Sides, owner: Indices, luminous: Floats, unseen: Unseen | None
    ) -> None:
        self._scene, self._cache, self._sides, self._owner, self._unseen = scene, cache, sides, owner, unseen
        self._luminous = luminous
        self._lit = sides.valid.any(axis=1)

    def shares(
        self, shown: list[Shown], labels: Indices, seed: int, progress: Progress = silent
    ) -> tuple[NDArray[np.float16], list[int]]:
        """Shares (H, W, 4), a before b, and the numbers of the objects that should use them."""
        texels = self._sides.texels
        sums = np.zeros((texels.height * texels.width, EQUATIONS), np.float32)
        kept: list[_Rays] = []
        for i, one in enumerate(shown):
            progress(i, len(shown), "shares of probes' light")
            rows = np.flatnonzero((self._owner == one.number) & self._lit)
            traced = [self._traced(one, rows[mine], seed + i) for mine in slices(len(rows), RAYS_AT_ONCE // RAYS)]
            m = max(float(np.median(np.concatenate([part.light for part in traced]))), 1e-6) if traced else 1.0
            for part in traced:
                first = part.row.reshape(-1, RAYS)[:, 0]
                most = MOST_LIGHT if one.roughness > WIDE else None
                sums[texels.index[first]] = _equations(part, m, most)
            kept.append(_some(traced, np.random.default_rng(seed + i)))
        known = sums.any(axis=1).reshape(texels.height, texels.width)
        whole = fill(sums.reshape(texels.height, texels.width, -1), known, labels, smooth=SMOOTH)
        found = solved(whole)
        flat = found.reshape(-1, 4)
        progress(1, 1, "shares of probes' light")
        worth = [one.number for one, some in zip(shown, kept, strict=True) if self._pays(one, some, flat)]
        return found.astype(np.float16), worth

    def _traced(self, one: Shown, rows: Indices, seed: int) -> _Rays:
        points, count = points_of(self._sides, rows), len(rows) * RAYS
        thread = dr.arange(mi.UInt32, count)
        at = thread // RAYS * POINTS + thread % POINTS
        p, n, flat = (dr.gather(mi.Vector3f, v, at) for v in (points.position, points.normal, points.flat))
        sampler = independent(seed & 0xFFFFFFFF, count)
        k = mi.Float(thread % RAYS)  # one spiral for all texels: different rays in neighbours would show as mottle
        cosine, phi = (k + 0.5) / RAYS, GOLDEN * k
        sine, (sin_phi, cos_phi) = dr.safe_sqrt(1 - cosine * cosine), dr.sincos(phi)
        w = mi.Frame3f(n).to_world(mi.Vector3f(sine * cos_phi, sine * sin_phi, cosine))
        ray = rays.leaving(self._scene, p, flat, w)
        origin = dr.zeros(mi.SurfaceInteraction3f, count)
        start = path_tracer.Start(ray, origin, mi.Float(1.0), True, self._unseen)
        value = path_tracer.radiance(self._scene, sampler, start, MIRROR_DEPTH, self._cache)
        seen = dr.dot(w, flat) > 0
        light = dr.select(seen & dr.all(dr.isfinite(value)), mi.luminance(value), 0.0)
        probe = dr.select(seen, one.probe.luminance(p, w), 0.0)
        weight = dr.select(seen, fresnel(cosine, dr.opaque(mi.Float, one.r0), dr), 0.0)
        dr.eval(light, probe, weight, w)
        return _Rays(np.repeat(rows, RAYS), array_of(w), *(np.array(v) for v in (light, probe, weight)))

    def _pays(self, one: Shown, some: _Rays, found: Floats) -> bool:
        if not len(some.row):
            return False
        texels = self._sides.texels
        r = share_along(found[texels.index[some.row]], some.w)
        normals = self._sides.sign * texels.normals[some.row, 0]
        plain = one.scaling.shown(some.probe, self._luminous[some.row], normals, one.irradiance)
        power = 2 if one.roughness > WIDE else 1
        by_shares, without = (
            float((some.fresnel * difference(light, some.light) ** power).sum()) for light in (some.probe * r, plain)
        )
        return by_shares < WORTH * without


def share_along(shares: Floats, w: Floats) -> Floats:
    """Shares (n,) of a probe's light along unit w (n, 3), from coefficients (n, 4), as in the renderer."""
    return np.asarray((shares[:, 0] + (shares[:, 1:] * w).sum(axis=1)).clip(0, MOST_SHARE))


def solved(sums: Floats) -> Floats:
    """(..., 4) coefficients of shares from the sums (..., EQUATIONS) of their equations; 1 and 0 without equations."""
    matrix = np.zeros((*sums.shape[:-1], 4, 4))
    matrix[..., UPPER[0], UPPER[1]] = matrix[..., UPPER[1], UPPER[0]] = sums[..., : len(UPPER[0])]
    right = sums[..., len(UPPER[0]) :].astype(float)
    even = np.divide(right[..., 0], matrix[..., 0, 0], out=np.ones(sums.shape[:-1]), where=matrix[..., 0, 0] > 0)
    even = even.clip(0, MOST_SHARE)
    weight = PENALTY * np.trace(matrix, axis1=-2, axis2=-1) / 4
    right[..., 0] += weight * even
    weight = np.where(weight > 0, weight, 1.0)
    matrix += weight[..., None, None] * np.eye(4)
    right[..., 0] = np.where(sums[..., 0] > 0, right[..., 0], 1.0)
    found = np.linalg.solve(matrix, right[..., None])[..., 0]
    return np.asarray(found.clip(-2 * MOST_SHARE, 2 * MOST_SHARE))  # for a black probe, the share is arbitrary


def _equations(traced: _Rays, m: float, most: float | None) -> NDArray[np.float32]:
    """Equations (k, EQUATIONS) of texels from consecutive blocks of RAYS rays; `most` bounds light by the probe's."""
    light = traced.light if most is None else np.minimum(traced.light, most * traced.probe)
    basis = np.concatenate([np.ones((len(traced.w), 1), np.float32), traced.w], axis=1) * traced.probe[:, None]
    g = (traced.fresnel / (m + traced.probe))[:, None]
    matrix = basis[:, UPPER[0]] * basis[:, UPPER[1]] * g
    right = basis * (g * light[:, None])
    rows = np.concatenate([matrix, right], axis=1) / (m * RAYS)  # numbers about 1, in any unit of light
    return np.asarray(rows.reshape(-1, RAYS, EQUATIONS).sum(axis=1), np.float32)


def _some(traced: list[_Rays], rng: np.random.Generator) -> _Rays:
    """At most JUDGED random rays."""
    if not traced:
        empty = np.zeros(0, np.float32)
        return _Rays(np.zeros(0, np.int64), np.zeros((0, 3), np.float32), empty, empty, empty)
    whole = _Rays(*(np.concatenate(parts) for parts in zip(*map(_fields, traced), strict=True)))
    chosen = rng.permutation(len(whole.row))[:JUDGED]
    return _Rays(*(values[chosen] for values in _fields(whole)))


def _fields(traced: _Rays) -> tuple[Any, ...]:
    return traced.row, traced.w, traced.light, traced.probe, traced.fresnel
