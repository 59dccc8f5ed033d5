"""Lamps taken out of a probe's cube map, for lamps.wgsl.

Lamps of similar radius form a group. As a lobe gets wider, groups leave the cube map, the smallest first. There is one
cube map for each number of groups taken out; lobes between two numbers mix both maps (`groups_out`), so that nothing
pops while a roughness is dragged.

The shader's table has the rows
    radii of the groups, a large number for missing groups
    cumulative number of lamps up to each group
and per lamp
    mean position about the probe's centre, m, or direction; w: 1 for a position
    excess flux, W/m^2 on a surface at the probe's centre that faces the lamp; its group
    two principal deviations a, b of its positions or directions; for positions, w are e^3/|n.p| and a.a + b.b
Seen from x, a lamp at p has e^2 = |p - x|^2 + a.a + b.b, which stays finite on contact, and the normal n = a x b: its
flux changes with |n.(p - x)|/e^3, like that of a flat emitter.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from lambent.baked.probe_lamps.find import MOST, Lamp, corners, find_lamps, moments
from lambent.core.arrays import Floats
from lambent.core.geometry.cubemap import texel_solid_angles
from lambent.core.light.colour import luminance
from lambent.materials.document import Lobe, Material
from lambent.materials.lobes import widths
from lambent.realtime.gpu.cube_mips import finite, smooth_chain
from lambent.realtime.incident import LookUp
from lambent.realtime.light.baked import Probe

GROUPS = 4
GROUP_RATIO = 1.25  # least ratio of radii between two groups
FIRST, LAST = 0.47, 0.54  # a group leaves gradually between these widths of a lobe, in radii of the group
NONE = 1e9
FAINT = 0.1  # of the mean radiance of a probe: darker highlights are not discernible
HEAD_ROWS, LAMP_ROWS = 2, 4


class ProbeLamps:
    """The lamps of a probe, their groups, and the cube maps without them."""

    def __init__(self, radiance: Floats) -> None:
        self.radiance = finite(radiance)[0]
        self.lamps = find_lamps(self.radiance)
        self.group = group_of([lamp.radius_rad for lamp in self.lamps])
        self._power = np.array([lamp.power for lamp in self.lamps])
        self._peak = np.array([luminance(lamp.excess).max() for lamp in self.lamps])
        self._highlight = lru_cache(64)(self._brightest_highlight)  # every draw of every frame asks for it

    @property
    def groups(self) -> int:
        return int(self.group.max(initial=-1)) + 1

    @cached_property
    def radii(self) -> Floats:
        """(GROUPS,) largest radius of each group."""
        radii = np.full(GROUPS, NONE)
        for number in range(self.groups):
            radii[number] = max(
                lamp.radius_rad for lamp, of in zip(self.lamps, self.group, strict=True) if of == number
            )
        return radii

    def serve(self, material: Material, textured: bool) -> bool:
        """Whether a lamp leaves the cube map for any lobe of a material; `textured`: textures change lobe widths.

        False if all highlights are faint.
        """
        leave = self.groups > 0 and (textured or any(groups_out(lobe, self.radii) > 0 for lobe in material.lobes))
        return leave and not self.are_faint(material, textured)

    def are_faint(self, material: Material, textured: bool) -> bool:
        """Whether no lamp has a discernible highlight in any lobe of a material.

        Along the normal, a lamp of flux E and radiance L has a highlight of F E / (4 pi mx my), at most F L, in a lobe
        of reflectance F. Textures may narrow a lobe and brighten its highlights.
        """
        return not textured and all(self._highlight(lobe) <= FAINT * self._mean for lobe in material.lobes)

    @cached_property
    def _mean(self) -> float:
        """Luminance of the mean radiance."""
        omega = np.tile(texel_solid_angles(self.radiance.shape[1]).ravel(), 6)
        return float(luminance(self.radiance.reshape(-1, 3)) @ omega) / (4 * np.pi)

    def _brightest_highlight(self, lobe: Lobe) -> float:
        spread = self._power / (4 * np.pi * math.prod(widths(lobe)))
        brightest = float(np.minimum(spread, self._peak).max(initial=self._mean))
        tint = np.array(lobe.k) * (1.0 if lobe.side == "transmission" else np.array(lobe.r0))
        return float(luminance(tint)) * brightest

    def all_out(self, material: Material, textured: bool) -> bool:
        """Whether all lobes read a cube map without lamps."""
        return not textured and all(groups_out(lobe, self.radii) == self.groups for lobe in material.lobes)

    def mixes(self, material: Material, textured: bool) -> bool:
        """Whether a lobe may mix two of the cube maps."""
        return textured or any(groups_out(lobe, self.radii) % 1 > 0 for lobe in material.lobes)

    def chain(self) -> list[Floats]:
        """Levels (6 (groups + 1), n, n, 3): cube maps with 0, 1, ... groups taken out, one after the other."""
        cubes = [self.radiance]
        for number in range(self.groups):
            left = cubes[-1].reshape(-1, 3).copy()
            for lamp, of in zip(self.lamps, self.group, strict=True):
                if of == number:
                    left[lamp.texels] -= lamp.excess
            cubes.append(np.maximum(left, 0).reshape(self.radiance.shape))
        return [np.concatenate(levels) for levels in zip(*map(smooth_chain, cubes), strict=True)]

    def table(self, probe: Probe, look_up: LookUp) -> NDArray[np.float32]:
        """Table (HEAD_ROWS + LAMP_ROWS MOST, 4) as above, with lamps positioned by the look-up."""
        counts = [np.count_nonzero(self.group <= number) for number in range(GROUPS)]
        rows = [np.array([self.radii, counts])]
        n = self.radiance.shape[1]
        rows += [
            placed(lamp, int(group), n, probe, look_up) for lamp, group in zip(self.lamps, self.group, strict=True)
        ]
        table = np.zeros((HEAD_ROWS + LAMP_ROWS * MOST, 4), np.float32)
        filled = np.concatenate(rows)
        table[: len(filled)] = filled
        return table


def group_of(radii: list[float]) -> NDArray[np.intp]:
    """(K,) group of each of the ascending radii, split at the widest gaps."""
    gaps = np.diff(np.log(np.maximum(radii, 1e-6)))
    widest = np.argsort(-gaps, kind="stable")[: GROUPS - 1]
    cut = np.zeros(len(radii), np.intp)
    cut[1 + widest[gaps[widest] > np.log(GROUP_RATIO)]] = 1
    return np.cumsum(cut)


def groups_out(lobe: Lobe, radii: Floats) -> float:
    """Number of groups taken out for a lobe; a fraction is the share of the last group (groups_out of lamps.wgsl)."""
    share = np.clip((math.sqrt(math.prod(widths(lobe))) / radii - FIRST) / (LAST - FIRST), 0, 1)
    return float(np.sum(share * share * (3 - 2 * share)))


def placed(lamp: Lamp, group: int, n: int, probe: Probe, look_up: LookUp) -> Floats:
    """Rows (LAMP_ROWS, 4) of a lamp in a cube map with n x n faces, positioned by the distances of a look-up."""
    w = corners(n)[lamp.texels].reshape(-1, 3)
    weight = np.repeat(luminance(lamp.flux), 4)
    distance = look_up.distances(probe, w)
    near = np.isfinite(distance)
    is_near = bool(weight[near].sum() > 0.5 * weight.sum())
    points = w[near] * distance[near, None] if is_near else w
    mean, covariance = moments(points, weight[near] if is_near else weight)
    value, vector = np.linalg.eigh(covariance)
    axes = (vector * np.sqrt(np.maximum(value, 0))).T[:0:-1]
    scale = extent2 = 0.0
    if is_near:
        length = float(np.linalg.norm(mean))
        facing = np.linalg.norm(np.cross(*axes)) * max(abs(float(mean @ vector[:, 0])), 0.05 * length)
        extent2 = float((axes * axes).sum())
        scale = (length**2 + extent2) ** 1.5 / max(facing, 1e-12)
    else:
        mean = mean / np.linalg.norm(mean)
    flux = lamp.flux.sum(axis=0)
    return np.array([[*mean, is_near], [*flux, group], [*axes[0], scale], [*axes[1], extent2]])
