"""Photons of an environment, drawn by their first landing place.

Rays from the sky correspond one to one to pairs of a surface point and a direction in which it sees the sky. A photon
can therefore be drawn by the place of its first landing, and none misses the scene or the window. The power from dw
onto dA is L cos dA dw, whatever the density: the weight is exact, and a pair in shadow carries nothing.

Directions come from the tables of `sky.guide`, with tables for open surfaces too. Places are patches of all surfaces,
on both sides, drawn in proportion to area x E x sqrt(I): E is the sky's irradiance from the guide's pre-pass, I the sum
over all later landings of (share of the power / area of the texel)^2, from a pre-pass of photons. This density
minimises the sum of the texels' variances: the outer walls, with large texels, give way to the floor behind the window.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.sky.guide import CELL_M, SkyGuide
from lambent.baking.tracing import rays
from lambent.baking.tracing.rays import vectors
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.triangles import triangle_areas, triangle_normals
from lambent.scenes.scene import Scene

MOST_PATCHES = 1 << 18
BLOCK = 4  # groups along each axis that share an estimate of I if their own photons are too few
PRIOR, OWN = 0.5, 64.0  # prior weights in photons: of the mean of all in a block's I, and of the block's in a group's
LEAST = 0.2  # of the photons land independently of E: the pre-pass may have missed some sky


class SkyPhotons:
    """Draws photons of a scene's environment (mi.Emitter), by a guide for it with tables for open surfaces."""

    def __init__(self, scene: Scene, whole: Any, sky: Any, guide: SkyGuide) -> None:
        self._whole, self._holes = whole, rays.has_holes(whole)
        self._sky, self.guide = sky, guide
        corners = _patches(scene, max(CELL_M, guide.groups.size_m))
        area = triangle_areas(corners)
        corners, area = corners[area > 0], area[area > 0]
        self._corners = [vectors(mi.Point3f, corners[:, k]) for k in range(3)]
        self._normal = vectors(mi.Vector3f, triangle_normals(corners))
        self._area = np.concatenate([area, area])
        middle = vectors(mi.Point3f, corners.mean(axis=1))
        self._group = np.concatenate([guide.groups.of(middle, sign * self._normal) for sign in (1.0, -1.0)])
        self.importance = np.ones(guide.groups.count)
        self._draw_by_importance()

    def _draw_by_importance(self) -> None:
        wanted = self._area * self.guide.brought[self._group] * np.sqrt(self.importance[self._group])
        anyhow = self._area * np.sqrt(self.importance[self._group])
        share = (1 - LEAST) * wanted / wanted.sum() + LEAST * anyhow / anyhow.sum()
        self._places = mi.DiscreteDistribution(mi.Float(share.astype(np.float32)))
        self._over_density = mi.Float((self._area / share).astype(np.float32))

    def weigh(self, sums: Floats, counts: Floats) -> None:
        """Set sums of I and numbers of photons by group, which determine how further photons are drawn."""
        mean = sums.sum() / max(counts.sum(), 1)
        if mean > 0:
            block = self._blocks()
            of_block = np.bincount(block, sums) + PRIOR * mean
            of_block /= np.bincount(block, counts) + PRIOR
            self.importance = (sums + OWN * of_block[block]) / (counts + OWN)
            self._draw_by_importance()

    def _blocks(self) -> Indices:
        """(groups,) block number, by cells and side, of each group."""
        *cell, side = np.unravel_index(np.arange(self.guide.groups.count), (*self.guide.groups.shape, 6))
        across = [-(-n // BLOCK) for n in self.guide.groups.shape]
        place = ((cell[0] // BLOCK * across[1]) + cell[1] // BLOCK) * across[2] + cell[2] // BLOCK
        return np.asarray(place * 6 + side)

    def emit(self, u: Any, place: Any, direction: Any) -> tuple[Any, Any, Any]:
        """Rays towards the first surface, power (mi.Color3f) in W times the number of photons, groups they land in."""
        number = self._places.sample(u)
        patches = dr.width(self._normal)
        second = number >= patches
        patch = dr.select(second, number - patches, number)
        a, b, c = (dr.gather(mi.Point3f, corner, patch) for corner in self._corners)
        weights = mi.warp.square_to_uniform_triangle(place)
        p = a + (b - a) * weights.x + (c - a) * weights.y
        n = dr.gather(mi.Vector3f, self._normal, patch)
        n = dr.select(second, -n, n)
        group = self.guide.groups.of(p, n)
        table = self.guide.table_at(p, n)
        w = self.guide.sample(table, direction)
        cosine = dr.dot(w, n)
        lit = cosine > 0
        lit &= ~rays.in_shadow(self._whole, rays.leaving(self._whole, p, n, w), lit, self._holes)
        si = dr.zeros(mi.SurfaceInteraction3f, dr.width(u))
        si.p, si.n, si.wi = p, mi.Normal3f(n), -w
        density = self.guide.pdf(table, w)
        power = self._sky.eval(si) * (cosine / density * dr.gather(mi.Float, self._over_density, number))
        reach = rays.APPROACH * (1 + dr.max(dr.abs(p)))
        ray = mi.Ray3f(p + w * reach, -w)
        if self._holes:  # a photon through a hole at p belongs to the place where it lands
            met = rays.intersect(self._whole, ray, lit, True)
            lit &= met.is_valid() & (dr.norm(met.p - p) < reach)
        return ray, dr.select(lit, power, 0.0), group


def find_importance(photons: SkyPhotons, trace: Any, over_area: Floats, sampler: Any) -> None:
    """Estimate I by a pre-pass of photons; `over_area` (H, W) is 1/area of the light map's texels, m^-2, or 0.

    trace(ray, power, count) follows photons and calls count(si, power, far_side, active) at each landing.
    """
    height, width = over_area.shape
    table = mi.Float(over_area.astype(np.float32).ravel())
    ray, power, group = photons.emit(sampler.next_1d(), sampler.next_2d(), sampler.next_2d())
    started = dr.mean(power)
    sums = dr.zeros(mi.Float64, photons.guide.groups.count)
    counts = dr.zeros(mi.Float64, photons.guide.groups.count)

    def count(si: Any, arriving: Any, far_side: Any, active: Any) -> None:
        density = dr.gather(mi.Float, table, light_map_texel(si, width, height, active), active)
        density *= dr.mean(arriving) / dr.maximum(started, 1e-30)
        dr.scatter_add(sums, mi.Float64(density * density), group, active & (started > 0))

    trace(ray, power, count)
    dr.scatter_add(counts, mi.Float64(1.0), group, started > 0)
    dr.eval(sums, counts)
    photons.weigh(np.array(sums), np.array(counts))


def _patches(scene: Scene, size_m: float) -> Floats:
    """Triangles (P, 3, 3) of all surfaces, halved along their longest edges to at most `size_m`."""
    corners = scene.corners
    while True:
        edges = np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2)  # of corners k and k + 1
        long = edges.max(axis=1) > size_m
        if not long.any() or len(corners) + long.sum() > MOST_PATCHES:
            return corners
        t = corners[long]
        turn = (edges[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        t = np.take_along_axis(t, turn[..., None], axis=1)  # the longest edge first
        middle = (t[:, 0] + t[:, 1]) / 2
        halves = [np.stack([t[:, 0], middle, t[:, 2]], axis=1), np.stack([middle, t[:, 1], t[:, 2]], axis=1)]
        corners = np.concatenate([corners[~long], *halves])
