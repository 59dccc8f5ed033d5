"""Reflections from an offset surface light field: the numpy version of the renderer's look-up.

A `Place` is the object's surface at each pixel; w is the unit direction whose radiance is wanted there, for a mirror
2 (n.wo) n - wo. Directions are in world space. The ray from x meets near surroundings elsewhere than a ray along w from
a point of the light field: in each map, a march finds where the ray from x goes behind the surfaces that the point
sees, and the map is read there. Blends of maps along w itself (thesis R, chapter 4) are in
`published.surface_light_fields`; rays that no point confirms fall back on the one by B_n.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.baked.light_fields.light_field import NO_POINT, LightField, Sky
from lambent.baked.light_fields.maps import (
    WHOLE,
    cover_along,
    focus_along,
    nearest_points,
    nearness_along,
    radiance_along,
    surface_along,
)  # fmt: skip
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.geometry.directions import normalize

POWER = 4  # exponent N of B_n
EDGE_STEEPNESS = 3.0  # of edges before the sky, relative to coverage interpolated between quarters of texels


@dataclass(frozen=True)
class March:
    """Parameters of marching rays through the maps of points.

    The n `steps` grow from `first` times the distance c of x from the point, until the parallax of anything farther is
    `last` texels; one more step is at infinity. A hit is a surface if its distance from the point matches the texel's
    to `tolerance`, relative to that distance and to the ray's length: near x, texels of the object itself match the
    distance without being hit. Points hit the same surface if their ray lengths agree to `alike`.
    """

    candidates: int = 4
    steps: int = 7
    first: float = 0.15
    last: float = 1.0
    secants: int = 3
    tolerance: float = 0.15
    alike: float = 0.15


@dataclass(frozen=True)
class Place:
    """x, n (k, 3): positions and unit shading normals, float64; points (k, 4): nearby points, or NO_POINT."""

    x: Floats
    n: Floats
    points: Indices

    @classmethod
    def at(cls, field: LightField, x: Floats, n: Floats, uv2: Floats) -> Place:
        """Places (k,) of the object, given their light map coordinates uv2 (k, 2)."""
        return cls(np.asarray(x, float), np.asarray(n, float), nearest_points(field, uv2))

    @property
    def known(self) -> Flags:
        """(k, 4): which entries name a point."""
        return np.asarray(self.points != NO_POINT)

    def named(self, count: int = 4) -> Indices:
        """The first `count` points (k, count); 0 where an entry names none."""
        return np.where(self.known, self.points, 0)[:, :count]

    def offsets(self, field: LightField, count: int = 4) -> Floats:
        """(k, count, 3) x - p_j."""
        return np.asarray(self.x[:, None] - field.points[self.named(count)])


@dataclass(frozen=True)
class Marched:
    """radiance (k, 3), and flags (k,): the ray hit a surface; the ray ends in the sky."""

    radiance: Floats
    met: Flags
    sky: Flags
    distance_m: Floats  # (k,) along w; infinite without a hit


def normal_weights(field: LightField, place: Place) -> Floats:
    """(k, 4) weights B_n of the points near a place, by their cosine about the normal (4.11).

    Their sum is 1, or 0 without points. If all points are below the horizon, the weights are equal.
    """
    return cosine_weights(field, place, place.n, POWER)


def cosine_weights(field: LightField, place: Place, axis: Floats, power: int) -> Floats:
    """As `normal_weights`, by powers of the cosine about unit axes (k, 3) (4.10)."""
    known = place.known
    towards = normalize(-place.offsets(field))
    cosine = np.where(known, np.maximum(np.einsum("kjc,kc->kj", towards, axis), 0), 0.0)
    largest = cosine.max(axis=1, keepdims=True)  # normalize first: powers of small cosines would underflow
    weight = np.where(known, np.where(largest > 0, (cosine / np.maximum(largest, 1e-30)) ** power, known), 0.0)
    return np.asarray(weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-30))


def blended(field: LightField, place: Place, w: Floats, weight: Floats, sky: Sky | None = None) -> Floats:
    """(k, 3) radiance sum_j B_j L(p_j, w) (4.7) by weights (k, 4) of points.

    A given `sky` also fills its share of texels that show surfaces.
    """
    seen = radiance_along(field, place.named(), np.broadcast_to(w[:, None], (*place.points.shape, 3)), sky)
    return np.asarray(np.einsum("kj,kjc->kc", weight, seen))


def marched(
    field: LightField, place: Place, w: Floats, rule: March | None = None, sky: Sky | None = None,
    edges: Sky | None = None,
) -> Marched:  # fmt: skip
    """Radiance of the first surface that rays from x along w (k, 3) hit, as seen by the points near x.

    A surface confirmed by any point exists, so the nearest hit of all points counts, and agreeing points are blended.
    If no point confirms one, the ray ends in the sky if a point sees sky there; otherwise the result is B_n of the
    maps. `sky` gives the radiance of the sky; without it, the maps do, with the share of `edges` in texels that show
    both. With either, edges of surfaces before the sky lie where the points see them in the mean.
    """
    rule = rule or March()
    q, t, open_sky = _searched(field, place, w, rule)
    return combined(field, place, w, rule, q, t, open_sky, sky, edges or sky)


def _searched(field: LightField, place: Place, w: Floats, rule: March) -> tuple[Floats, Floats, Flags]:
    """Per point: vector from p_j to the surface (k, j, 3), distance along the ray (infinite: no hit), and sky flag.

    The ray is in front of the surfaces that the point sees where 1/|q| exceeds the map's inverse distance. For planes,
    the difference is linear in 1/t, so the secant method works in 1/t.
    """
    count = rule.candidates
    offset, point, known = place.offsets(field, count), place.named(count), place.known[:, :count]
    direction = np.broadcast_to(w[:, None], offset.shape)

    def behind(s: Floats) -> Floats:
        q = s[..., None] * offset + direction  # q/t: the same direction, and finite at infinity
        return np.asarray(nearness_along(field, point, q) - s / np.linalg.norm(q, axis=-1))

    c = np.maximum(np.linalg.norm(offset, axis=-1), 1e-9)
    texel = 4 / field.inverse_distance.shape[1]  # rad, about
    share = np.linspace(0, 1, rule.steps)
    inverse = [1 / (c * rule.first ** (1 - k) * (rule.last / texel) ** k) for k in share] + [np.zeros_like(c)]
    near, far = np.zeros_like(c), np.zeros_like(c)
    g_near, g_far, found = np.full(c.shape, -1.0), np.ones(c.shape), np.zeros(c.shape, bool)
    before, g_before = inverse[0], behind(inverse[0])
    for s in inverse[1:]:
        g = behind(s)
        last = s[0, 0] == 0
        here = ~found & (g_before < 0) & ((g > 0) if last else (g >= 0))
        near, far = np.where(here, before, near), np.where(here, s, far)
        g_near, g_far = np.where(here, g_before, g_near), np.where(here, g, g_far)
        found |= here
        before, g_before = s, g
    open_sky = known & ~found & (g_before <= 0)
    middle, g = far, g_far
    for _ in range(rule.secants):
        part = (g_near / np.minimum(g_near - g_far, -1e-30)).clip(0.05, 0.95)
        middle = near + part * (far - near)
        g = behind(middle)
        near, g_near = np.where(g < 0, middle, near), np.where(g < 0, g, g_near)
        far, g_far = np.where(g < 0, far, middle), np.where(g < 0, g_far, g)
    q = offset + direction / np.maximum(middle, 1e-9)[..., None]
    t, length = 1 / np.maximum(middle, 1e-9), np.linalg.norm(q, axis=-1)
    off = np.abs(g) * length  # |q|/d - 1 for the map's last value
    met = known & found & (off * np.maximum(length / t, 1) < rule.tolerance)
    return q, np.where(met, t, np.inf), open_sky


def combined(
    field: LightField, place: Place, w: Floats, rule: March, q: Floats, t: Floats, open_sky: Flags, sky: Sky | None,
    edges: Sky | None,
) -> Marched:  # fmt: skip
    """The answer of all points, from what `_searched` gives of each; sky and edges as for `marched`."""
    count = t.shape[1]
    known = place.known[:, :count]
    first = t.min(axis=1)
    met = np.isfinite(first)
    agree = t <= first[:, None] * (1 + rule.alike)
    basis = normal_weights(field, place)
    near = np.maximum(basis[:, :count], 1e-6)
    weight = np.where(agree & met[:, None], near * focus_along(field, q), 0.0)
    weight /= np.maximum(weight.sum(axis=1, keepdims=True), 1e-30)
    seen = np.einsum("kj,kjc->kc", weight, _without_lone_lights(radiance_along(field, place.named(count), q), weight))
    in_sky = np.asarray(~met & (open_sky & known).any(axis=1))
    at = np.zeros(0, np.int64)
    if edges is not None and field.cover is not None:
        point = place.named(count)
        at_edge = known & (open_sky | (np.isfinite(t) & (cover_along(field, point, q) != WHOLE)))
        at = np.flatnonzero(met & at_edge.any(axis=1))
    beyond = in_sky.copy()  # where light from behind the hit, or without one, is the sky's
    beyond[at] = True
    other, blends = np.zeros_like(seen), ~met & ~in_sky if sky is not None else ~met | beyond
    if sky is not None and beyond.any():
        other[beyond] = sky(w[beyond])
    if blends.any():
        some = Place(place.x[blends], place.n[blends], place.points[blends])
        other[blends] = blended(field, some, w[blends], basis[blends], edges)
    radiance = np.where(met[:, None], seen, other)
    if len(at):
        hit = place.x[at] + first[at, None] * w[at]
        shown, share = _edge(field, hit, point[at], weight[at], known[at])
        radiance[at] = share[:, None] * shown + (1 - share[:, None]) * other[at]
    return Marched(radiance, met, in_sky, first)


def _without_lone_lights(light: Floats, weight: Floats) -> Floats:
    """Radiance (k, j, 3) of points, limited to the second largest of those with a weight (k, j), by channel.

    Light that one point alone sees on a surface is a highlight in its direction, or noise.
    """
    if light.shape[1] < 2:
        return light
    second = np.sort(np.where(weight[..., None] > 0, light, -1.0), axis=1)[:, -2]
    return np.where(second[:, None] < 0, light, np.minimum(light, second[:, None]))


def _edge(field: LightField, hit: Floats, point: Indices, weight: Floats, known: Flags) -> tuple[Floats, Floats]:
    """Radiance of the surface at hits (k, 3), as points (k, j) with weights see it, and its share before the sky.

    A hit counts if one of four points sees it, so that edges spread. Here the points' mean coverage, between quarters
    of texels, places the edge; made steeper, it is as sharp as a quarter.
    """
    light, shows, share = surface_along(field, point, hit[:, None] - field.points[point])
    mean = (share * known).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    total = np.maximum(np.einsum("kj,kj->k", weight, shows), 1e-20)[:, None]
    return np.einsum("kj,kjc->kc", weight, light) / total, np.clip((mean - 0.5) * EDGE_STEEPNESS + 0.5, 0, 1)
