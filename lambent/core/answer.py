"""Light that answers when surfaces get other colours: radiosity between patches, gathered at points of the light map.

    B = F (a (D + B) + t (D + B) on the other side)                                          (solve, patches)
    E(edited) = D + (E - D) ratio                                                            (points, texels)
    I = mean over rays of weight (a E + t E on the other side) at the point near their end   (gather, points)
    ratio = B(edited) / B(as baked) of the patch, then I(edited) / I(as baked)

B (P, 3) is the indirect and D (P, 3) the direct irradiance of patches, a and t their diffuse albedos of reflection and
transmission, F (P, P) the share of what a patch receives that comes from each other one. Patches have most bounces; the
last PASSES are gathered among some thirty times as many points, each with its own direct light. Beside contacts, where
light changes from texel to texel, more points gather in the last pass, and send nothing. Light is linear, so D,
E and I have a leading axis of light groups, and so has F: each group's light lies elsewhere within a patch. A ratio,
and not a difference, is applied to the baked light, so that it keeps its detail and the error is relative; with albedos
as baked the ratio is 1 and nothing changes.

Rays that lobes have sent on, and textures, are in the weights. Weights also follow the light around a point: a ray that
ends where it is twice as bright as at the point counts twice.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from lambent.core import answer_loops as loops
from lambent.core.arrays import Floats

BYTE = 255
MOST_POINTS = 1 << 16
PASSES = 2
MOST_WEIGHT = 16.0  # of a ray
TOLERANCE = 1e-3  # relative change of every patch in a sweep, below which a solution stands
SWEEPS = 400  # at most: with albedos up to MOST_ALBEDO even a closed box is done before
MOST_ALBEDO = 0.97  # of an edited surface
MOST_RATIO = 64.0  # of the light after an edit, and one over it before
MOST_EXCESS = 1.25  # of the baked indirect light over what is gathered, as far as an edit makes it brighter
MOST_SHARES = 1.3  # of the light of all others that reaches a patch; by weights it can be more than 1
DARK = 1e-6  # of the mean indirect light: below it a ratio is 1


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches of surface, each of one material and on one side.

    Attributes
    ----------
    material : (P,) integers
        Number of each patch's material.
    paired : (P,) integers
        The patch on the other side; its own number on surfaces that no light crosses.
    direct : (G, P, 3) float32
        Direct irradiance by group of lights, W/m^2, the sun's included.
    transfer : (G, P, P) float32
        F by group, rows by the patch that receives; (P, P) is that of all groups.
    """

    material: NDArray[np.integer]
    paired: NDArray[np.integer]
    direct: NDArray[np.float32]
    transfer: NDArray[np.float32]

    @cached_property
    def rows(self) -> SparseRows:
        """F as sparse rows, whose sums are at most MOST_SHARES: four of five entries are 0."""
        return self._rows(MOST_SHARES)

    @cached_property
    def passive_rows(self) -> SparseRows:
        """F whose rows sum to 1 at most: with it no light grows, whatever the albedos."""
        return self._rows(1.0)

    def _rows(self, most: float) -> SparseRows:
        groups = len(self.direct)
        bounded = self.transfer * np.minimum(1, most / np.maximum(self.transfer.sum(axis=-1, keepdims=True), most))
        each = [csr_matrix(one) for one in np.broadcast_to(bounded, (groups, *bounded.shape[-2:]))]
        first = np.cumsum([0, *(one.nnz for one in each[:-1])])
        bounds = np.stack([one.indptr.astype(np.int64) + at for one, at in zip(each, first, strict=True)])
        senders, shares = (np.concatenate([getattr(one, part) for one in each]) for part in ("indices", "data"))
        return SparseRows(bounds[:, :-1], bounds[:, 1:], senders, shares)


class SparseRows(NamedTuple):
    """Entries `senders`, `shares` (n,) of rows that go from `starts` to `ends` (G, P)."""

    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    senders: NDArray[np.int32]
    shares: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Albedos:
    """Diffuse albedos (M, 3) of materials: reflected, and transmitted to the other side."""

    reflected: Floats
    transmitted: Floats

    def same_as(self, other: Albedos) -> bool:
        """Whether they are equal, to the bit."""
        mine, others = (self.reflected, self.transmitted), (other.reflected, other.transmitted)
        return all(np.array_equal(a, b) for a, b in zip(mine, others, strict=True))


@dataclass(frozen=True)
class Solution:
    """Irradiance (G, P, 3) of patches, W/m^2, the sweeps it took, and whether it stands."""

    irradiance: NDArray[np.float32]
    sweeps: int
    converged: bool


def solved(patches: Patches, albedos: Albedos, tolerance: float = TOLERANCE) -> Solution:
    """Solve for the light between patches by the method of Gauss and Seidel.

    It ends when no patch of any group changes by more than `tolerance` of its own light: a bound on the brightest
    change would leave dark corners unsolved. Where light would grow without end, it is solved by `passive_rows`.
    """
    crossing = (patches.paired != np.arange(patches.direct.shape[1]))[:, None]
    reflected = albedos.reflected[patches.material].astype(np.float32)
    transmitted = (albedos.transmitted[patches.material] * crossing).astype(np.float32)
    direct, paired = np.ascontiguousarray(patches.direct, np.float32), np.asarray(patches.paired, np.int64)

    def by(rows: SparseRows) -> Solution:
        light, step = direct.copy(), np.float32(tolerance)
        sweeps, stopped = loops.solve(*rows, direct, reflected, transmitted, paired, step, SWEEPS, light)
        return Solution(light, int(sweeps.max(initial=0)), bool(stopped.all()))

    found = by(patches.rows)
    return found if found.converged else by(patches.passive_rows)


@dataclass(frozen=True, eq=False)
class Points:
    """Points of texels, which send light to rays that end near them, and gather it.

    Attributes
    ----------
    patch, material : (K,) integers
        That each lies in, and that it has.
    other : (K,) integers
        The point on the other side of the surface; its own number where no light crosses it.
    direct, light : (G, K, 3) float32
        Direct and all baked irradiance by group of lights, W/m^2, the sun's included.
    """

    patch: NDArray[np.integer]
    material: NDArray[np.integer]
    other: NDArray[np.integer]
    direct: NDArray[np.float32]
    light: NDArray[np.float32]

    def exitance(self, albedos: Albedos, ratio: Floats, of: NDArray[np.integer] | None = None) -> NDArray[np.float32]:
        """Exitance (K, G, 3), W/m^2, where indirect light is `ratio` (G, n, 3) times as baked.

        The ratio of point k is number `of` (K,) of these, by default number k.
        """
        number = np.arange(len(self.other)) if of is None else of
        reflected, transmitted = (
            np.asarray(one, np.float32)[self.material] for one in (albedos.reflected, albedos.transmitted)
        )
        lights = (np.ascontiguousarray(one, np.float32) for one in (self.direct, self.light, ratio))
        direct, light, now = lights
        return np.asarray(loops.exitance(direct, light, now, number, self.other, reflected, transmitted))


def packed_weights(weights: Floats) -> NDArray[np.uint8]:
    """Weights of rays as bytes, by their roots: steps are fine where weights are small."""
    root = np.sqrt(np.clip(weights, 0, MOST_WEIGHT) / MOST_WEIGHT)
    return np.asarray(root * BYTE + 0.5, np.uint8)


def unpacked_weights(packed: NDArray[np.uint8]) -> NDArray[np.float32]:
    """The weights that bytes stand for."""
    return np.asarray((packed.astype(np.float32) / BYTE) ** 2 * MOST_WEIGHT, np.float32)


def packed_rays(point: NDArray[np.integer], weight: Floats) -> NDArray[np.uint8]:
    """Rays (..., 2 + G) bytes: the point near which each ends, low byte first, and its weights (G, ...) by group.

    Weights are 0 where it met none. Points are below MOST_POINTS. Rays are sorted by these, which files pack well.
    """
    number = np.where((weight > 0).any(axis=0), point, 0).astype(np.uint16)
    weights = (packed_weights(of_group) for of_group in weight)
    rays = np.stack([(number & BYTE).astype(np.uint8), (number >> 8).astype(np.uint8), *weights], axis=-1)
    order = np.argsort(number, axis=-1, kind="stable")
    return np.take_along_axis(rays, order[..., None], axis=-2)


def points_of_rays(rays: NDArray[np.uint8]) -> NDArray[np.uint16]:
    """Numbers (...) of the points near which `packed_rays` end."""
    return np.asarray(rays[..., 0] | rays[..., 1].astype(np.uint16) << 8, np.uint16)


@dataclass(frozen=True, eq=False)
class Rays:
    """Where the rays of K points end: those of a point that end near the same one are one.

    Attributes
    ----------
    starts : (K + 1,) int64
        The rays of point k go from starts[k] on to starts[k + 1].
    points : (N,) uint16
        The point near which each ends.
    weights : (N, G) uint8
        By light group: roots over that of `most` (K, G) float32, the largest weight of a point's rays.
    count : int
        Rays of each point, those included that end nowhere.
    """

    starts: NDArray[np.int64]
    points: NDArray[np.uint16]
    weights: NDArray[np.uint8]
    most: NDArray[np.float32]
    count: int

    @classmethod
    def of(cls, packed: NDArray[np.uint8]) -> Rays:
        """Of `packed_rays` (K, R, 2 + G)."""
        size, count, groups = packed.shape[0], packed.shape[1], packed.shape[2] - 2
        first = np.arange(size, dtype=np.int64) * count
        ends, points = np.zeros_like(first), np.zeros(size * count, np.uint16)
        weights, most = np.zeros((size * count, groups), np.uint8), np.zeros((size, groups), np.float32)
        table = unpacked_weights(np.arange(BYTE + 1, dtype=np.uint8))
        loops.merge(np.ascontiguousarray(packed), first, ends, points, weights, most, table)
        kept = (np.arange(count) < (ends - first)[:, None]).reshape(-1)
        starts = np.append(0, np.cumsum(ends - first)).astype(np.int64)
        return cls(starts, points[kept], weights[kept], most, count)

    def followed_by(self, other: Rays) -> Rays:
        """These rays, and those of other points after them."""
        starts = np.concatenate([self.starts, other.starts[1:] + self.starts[-1]])
        most = np.concatenate([self.most, other.most * np.float32(self.count / max(other.count, 1))])
        points = np.concatenate([self.points, other.points])
        weights = np.concatenate([self.weights, other.weights])
        return Rays(starts, points, weights, most, self.count)

    def of_first(self, count: int) -> Rays:
        """The rays of the first `count` points."""
        return Rays(self.starts[: count + 1], self.points, self.weights, self.most[:count], self.count)


def gathered(rays: Rays, exitance: NDArray[np.float32]) -> NDArray[np.float32]:
    """Indirect irradiance (G, K, 3) at points with such rays, from exitance (n, G, 3).

    Rays are cosine distributed: it is pi times the mean of the radiance exitance/pi.
    """
    table = ((np.arange(BYTE + 1) / BYTE) ** 2 / rays.count).astype(np.float32)
    given = rays.starts, rays.points, rays.weights, rays.most, table, exitance
    groups = exitance.shape[1]
    if groups == 1:
        return np.asarray(loops.gather_one(*given))
    found = np.empty((groups, len(rays.most), 3), np.float32)
    for first in range(0, groups, 4):
        loops.gather_four(*given, first, found)
    return found


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Points (T, 8) uint32 near each texel, and their shares (T, 8) uint8, which count by their sum, at least 1."""

    points: NDArray[np.uint32]
    shares: NDArray[np.uint8]

    def __getitem__(self, some: NDArray[np.integer]) -> Neighbours:
        return Neighbours(self.points[some], self.shares[some])

    @property
    def closest(self) -> NDArray[np.int64]:
        """(T,) the point that counts most for each texel."""
        most = self.shares.argmax(axis=1)[:, None]
        return np.take_along_axis(self.points, most, axis=1)[:, 0].astype(np.int64)


def upsampled(light: Floats, near: Neighbours) -> NDArray[np.float32]:
    """Means (G, T, 3) over the points near each texel of light (G, K, 3)."""
    return np.stack([_upsampled(np.ascontiguousarray(of_group, np.float32), near.points, near.shares)
                     for of_group in light])  # fmt: skip


@numba.njit(parallel=True, cache=True, nogil=True)
def _upsampled(light, points, shares):  # type: ignore[no-untyped-def]
    found = np.zeros((points.shape[0], 3), np.float32)
    for t in numba.prange(points.shape[0]):
        total = np.float32(0)
        red = green = blue = np.float32(0)
        for n in range(points.shape[1]):
            share = np.float32(shares[t, n])
            at = points[t, n]
            total += share
            red += share * light[at, 0]
            green += share * light[at, 1]
            blue += share * light[at, 2]
        found[t, 0], found[t, 1], found[t, 2] = red / total, green / total, blue / total
    return found


def ratios(edited: Floats, reference: Floats) -> NDArray[np.float32]:
    """I(edited) / I(reference) of light (G, ..., 3), within [0, MOST_RATIO]; 1 where there was next to none."""
    ratio = np.divide(edited, reference, out=np.ones_like(reference), where=reference > least_light(reference))
    return np.clip(ratio, 0, MOST_RATIO)


def least_light(reference: Floats) -> Floats:
    """Light (G, 1, ...) of each group below which a ratio says nothing."""
    axes = tuple(range(1, reference.ndim))
    return np.asarray(DARK * np.maximum(reference.mean(axis=axes, keepdims=True), 1e-30))


@dataclass(frozen=True, eq=False)
class Answer:
    """Everything that the light of a scene's texels answers with.

    Attributes
    ----------
    points : Points
        K points that send and gather light.
    rays : Rays
        Theirs, then those of F points that gather alone: of K + F.
    near : Neighbours
        Of the T texels, among all of these.
    direct, baked : (G, T, 3) float32
        Direct irradiance of the texels, and all of it, as the light map has them: W/m^2, direct sun left out.
    albedos : Albedos
        As they were baked.
    """

    patches: Patches
    points: Points
    rays: Rays
    near: Neighbours
    direct: NDArray[np.float32]
    baked: NDArray[np.float32]
    albedos: Albedos

    def indirect(self, albedos: Albedos, solution: Solution | None = None) -> NDArray[np.float32]:
        """Indirect irradiance (G, K + F, 3) at the points, as far as their rays see it.

        `solution` is that of the patches, if there is one already.
        """
        found = self._gathered_as_baked
        if albedos.same_as(self.albedos):
            return found
        now = (solution or solved(self.patches, albedos)).irradiance - self.patches.direct
        ratio, of = ratios(now, self._patches_as_baked), self.points.patch
        for step in range(PASSES - 1):
            among = gathered(self._senders_rays, self.points.exitance(albedos, ratio, of if step == 0 else None))
            ratio = ratios(among, self._gathered_as_baked[:, : among.shape[1]])
        return gathered(self.rays, self.points.exitance(albedos, ratio))

    @cached_property
    def _senders_rays(self) -> Rays:
        return self.rays.of_first(len(self.points.other))

    @cached_property
    def _patches_as_baked(self) -> Floats:
        return np.asarray(solved(self.patches, self.albedos).irradiance - self.patches.direct)

    @cached_property
    def _gathered_as_baked(self) -> NDArray[np.float32]:
        shape = len(self.points.direct), 1, 3
        none = np.zeros(len(self.points.other), np.int64)
        return gathered(self.rays, self.points.exitance(self.albedos, np.ones(shape, np.float32), none))

    def reference(self) -> NDArray[np.float32]:
        """Indirect irradiance (G, T, 3) at the texels as this computes it for the baked materials."""
        return upsampled(self._gathered_as_baked, self.near)

    def irradiance(self, albedos: Albedos, reference: Floats) -> NDArray[np.float32]:
        """Irradiance (G, T, 3) of the texels with other albedos; `baked` itself where they are as baked."""
        if albedos.same_as(self.albedos):
            return self.baked
        return self.at_texels(self.indirect(albedos), reference)

    def at_texels(self, indirect: NDArray[np.float32], reference: Floats) -> NDArray[np.float32]:
        """Irradiance (G, T, 3) of the texels, `answered` from indirect light (G, K + F, 3) of the points."""
        least = np.array([least_light(one[None])[0, 0, 0] for one in reference], np.float32)
        return np.asarray(loops.texel_light(
            self.near.points, self.near.shares, indirect, reference, self.direct, self.baked, least,
            np.float32(MOST_RATIO), np.float32(MOST_EXCESS),
        ))  # fmt: skip


def answered(direct: Floats, baked: Floats, edited: Floats, reference: Floats) -> NDArray[np.float32]:
    """D + (E - D) times the ratio of the gathered light `edited` over `reference`, all (G, ..., 3).

    Of indirect light that is more than MOST_EXCESS times what was gathered, the rest grows with no edit: lobes have
    focused it, or it comes from something so near that the points that gather do not see it.
    """
    ratio, indirect = ratios(edited, reference), baked - direct
    excess = np.maximum(indirect - MOST_EXCESS * reference, 0)
    return np.asarray(direct + indirect * ratio - excess * np.maximum(ratio - 1, 0), np.float32)
