"""Indirect light after edits of materials: radiosity between patches, gathered at points of the light map.

    B = F (a (D + B) + t (D + B) on the other side)                                          (solve, patches)
    E(edited) = D + (E - D) ratio                                                            (points, texels)
    I = mean over rays of weight (a E + t E on the other side) at the point near their end   (gather, points)
    ratio = B(edited) / B(as baked) of the patch, then I(edited) / I(as baked)

B (P, 3) is the indirect and D (P, 3) the direct irradiance of patches, a and t are their diffuse albedos of reflection
and transmission, and F (P, P) is the share of a patch's irradiance that comes from each other patch. Patches carry most
bounces. The last bounces are gathered among some thirty times as many points, each with its own direct light, along few
rays until the last pass: in gaps, which patches do not resolve, light is reflected many times. Near contacts, where
light changes from texel to texel, more points gather in the last pass and send nothing. What the last pass gathers is
averaged over points around that see the same (`answer_smoothing`): noise of few rays would show as mottle. Light is
linear, so D, E and I have a leading axis of light groups. The baked light is multiplied by a ratio, not corrected by a
difference: it keeps its detail, the error is relative, and baked albedos give the ratio 1 exactly.

Weights of rays include textures and chains of specular lobes. Points send the mean light around them: when the weights
held the pattern of the baked light, indirect light from a sunlit spot grew as if it were the sun's.

Rays read light as (K, G, 4): `side_by_side`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from lambent.baked.answering import loops
from lambent.baked.answering.rays import Rays, gathered
from lambent.core.arrays import Floats

STEPS = (1.0, 3.0, 1.0, 1.0)  # of passes by few rays, over the change of exitance: one long step replaces four passes
FEW_RAYS = 32  # per point, in all passes but the last
TOLERANCE = 1e-3  # relative change of a patch in one sweep, below which the solution has converged
SWEEPS = 400  # at most: with albedos up to MOST_ALBEDO even a closed box converges sooner
MOST_ALBEDO = 0.99  # of an edited surface
MOST_RATIO = 64.0  # the light after an edit over the light before it
MOST_EXCESS = 1.25  # baked over gathered indirect light: the most that an edit may brighten
MOST_SHARES = 1.3  # sum of a row of F: the light that reaches a patch from all others; weights can make it more than 1
DARK = 1e-6  # of the mean indirect light: below it the ratio is 1


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
        Direct irradiance by light group, W/m^2, the sun's included.
    transfer : (P, P) float32
        F, one row per receiving patch.
    """

    material: NDArray[np.integer]
    paired: NDArray[np.integer]
    direct: NDArray[np.float32]
    transfer: NDArray[np.float32]

    @cached_property
    def rows(self) -> SparseRows:
        """F as sparse rows, each scaled to a sum of at most MOST_SHARES; four of five entries are 0."""
        return self._rows(MOST_SHARES)

    @cached_property
    def passive_rows(self) -> SparseRows:
        """F with rows scaled to a sum of at most 1: light then decays, whatever the albedos."""
        return self._rows(1.0)

    def _rows(self, most: float) -> SparseRows:
        sums = self.transfer.sum(axis=1, keepdims=True)
        rows = scipy.sparse.csr_matrix(self.transfer * np.minimum(1, most / np.maximum(sums, most)))
        return SparseRows(rows.indptr[:-1], rows.indptr[1:], rows.indices, rows.data)


class SparseRows(NamedTuple):
    """Sparse rows: entries `senders`, `shares` (n,); a row's run from `starts` to `ends` (P,)."""

    starts: NDArray[np.int32]
    ends: NDArray[np.int32]
    senders: NDArray[np.int32]
    shares: NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Albedos:
    """Diffuse albedos (M, 3) of materials: reflected, and transmitted to the other side."""

    reflected: Floats
    transmitted: Floats

    def same_as(self, other: Albedos) -> bool:
        """Whether both are equal, bit for bit."""
        mine, others = (self.reflected, self.transmitted), (other.reflected, other.transmitted)
        return all(np.array_equal(a, b) for a, b in zip(mine, others, strict=True))


@dataclass(frozen=True)
class Solution:
    """Irradiance (G, P, 3) of patches, W/m^2, the number of sweeps, and whether it converged."""

    irradiance: NDArray[np.float32]
    sweeps: int
    converged: bool


def solved(patches: Patches, albedos: Albedos, tolerance: float = TOLERANCE, direct: Floats | None = None) -> Solution:
    """Solve for the light between patches by Gauss-Seidel sweeps, of their own or this `direct` light (G, P, 3).

    The sweeps end when no patch of any group changes by more than `tolerance` of its own light; a bound relative to the
    brightest patch would leave dark corners unsolved. If they diverge, `passive_rows` replace the rows.
    """
    direct = patches.direct if direct is None else direct
    crossing = (patches.paired != np.arange(patches.direct.shape[1]))[:, None]
    reflected = albedos.reflected[patches.material].astype(np.float32)
    transmitted = (albedos.transmitted[patches.material] * crossing).astype(np.float32)
    direct, paired = np.ascontiguousarray(direct, np.float32), np.asarray(patches.paired, np.int64)

    def by(rows: SparseRows) -> Solution:
        light, step = direct.copy(), np.float32(tolerance)
        sweeps, stopped = loops.solve(*rows, direct, reflected, transmitted, paired, step, SWEEPS, light)
        return Solution(light, int(sweeps.max(initial=0)), bool(stopped.all()))

    found = by(patches.rows)
    return found if found.converged else by(patches.passive_rows)


@dataclass(frozen=True, eq=False)
class Points:
    """Points that send light to the rays that end near them, and gather light; each stands for several texels.

    Attributes
    ----------
    patch, material : (K,) integers
        The patch and the material of each point.
    other : (K,) integers
        The point on the other side of the surface; its own number where no light crosses.
    direct, light : (G, K, 3) float32
        Direct irradiance and all baked irradiance by light group, W/m^2, the sun's included: means over the texels that
        the point stands for.
    """

    patch: NDArray[np.integer]
    material: NDArray[np.integer]
    other: NDArray[np.integer]
    direct: NDArray[np.float32]
    light: NDArray[np.float32]

    def exitance(
        self,
        albedos: Albedos,
        now: NDArray[np.float32],
        inverse: NDArray[np.float32],
        grows: NDArray[np.float32],
        before: NDArray[np.float32] | None = None,
        step: float = 1.0,
    ) -> NDArray[np.float32]:
        """Exitance (K, G, 4), W/m^2, for indirect light that is `now` times `inverse` (K, G, 4) times the baked.

        `inverse` comes from `inverses`. Only the part `grows` (K, G, 4) of the baked light is brightened. From exitance
        `before`, it goes `step` times the way.
        """
        tables = (np.pad(one, ((0, 0), (0, 1))) for one in (albedos.reflected, albedos.transmitted))
        reflected, transmitted = (np.asarray(one, np.float32) for one in tables)
        given = self._direct, self.indirect, grows, now, inverse, np.float32(MOST_RATIO)
        along = (self._direct if before is None else before), np.float32(step)
        return np.asarray(loops.exitance(*given, self.material, self.other, reflected, transmitted, *along))

    @cached_property
    def indirect(self) -> NDArray[np.float32]:
        """Baked indirect light (K, G, 4)."""
        return side_by_side(self.light - self.direct)

    @cached_property
    def _direct(self) -> NDArray[np.float32]:
        return side_by_side(self.direct)


def side_by_side(light: Floats) -> NDArray[np.float32]:
    """Light (G, K, 3) as (K, G, 4): groups side by side, plus a padding channel."""
    found = np.zeros((light.shape[1], light.shape[0], 4), np.float32)
    found[..., :3] = np.moveaxis(light, 0, 1)
    return found


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Points (T, 8) uint32 near each texel, and their weights (T, 8) uint8, normalized by their sum, at least 1."""

    points: NDArray[np.uint32]
    shares: NDArray[np.uint8]

    def __getitem__(self, some: NDArray[np.integer]) -> Neighbours:
        return Neighbours(self.points[some], self.shares[some])

    @property
    def closest(self) -> NDArray[np.int64]:
        """(T,) the point of the largest weight for each texel."""
        most = self.shares.argmax(axis=1)[:, None]
        return np.take_along_axis(self.points, most, axis=1)[:, 0].astype(np.int64)


def smoothed(light: NDArray[np.float32], around: Neighbours) -> NDArray[np.float32]:
    """Weighted means (K, G, 4), over the points around each point, of light (K, G, 4)."""
    return np.asarray(loops.smoothed(light, around.points, around.shares))


def upsampled(light: NDArray[np.float32], near: Neighbours) -> NDArray[np.float32]:
    """Weighted means (G, T, 3), over the points near each texel, of light (K, G, 4)."""
    return np.asarray(loops.upsampled(light, near.points, near.shares))


def ratios(edited: Floats, reference: Floats) -> NDArray[np.float32]:
    """I(edited) / I(reference) of light (G, ..., 3), within [0, MOST_RATIO]; 1 where the reference is nearly black."""
    ratio = np.divide(edited, reference, out=np.ones_like(reference), where=reference > least_light(reference))
    return np.clip(ratio, 0, MOST_RATIO)


def inverses(baked: NDArray[np.float32]) -> NDArray[np.float32]:
    """One over the baked light (K, G, 4); 0 where it is nearly black, which makes the ratio 1."""
    known = baked > np.moveaxis(least_light(np.moveaxis(baked, 1, 0)[..., :3]), 0, 1)
    return np.divide(1, baked, out=np.zeros_like(baked), where=known)


def least_light(reference: Floats) -> Floats:
    """Light (G, 1, ...) of each group below which a ratio is meaningless."""
    axes = tuple(range(1, reference.ndim))
    return np.asarray(DARK * np.maximum(reference.mean(axis=axes, keepdims=True), 1e-30))


@dataclass(frozen=True, eq=False)
class Answer:
    """Everything needed to update the light of a scene's texels after an edit of materials.

    Attributes
    ----------
    points : Points
        K points that send and gather light.
    rays : Rays
        Of K + F points: those K, then F points that only gather.
    around : Neighbours
        Points that each of the K + F points is averaged with, by decreasing weight.
    near : Neighbours
        Of T texels, among all K + F points.
    direct, baked : (G, T, 3) float32
        Direct and total irradiance of the texels as in the light map, W/m^2, direct sun left out.
    albedos : Albedos
        As baked.
    """

    patches: Patches
    points: Points
    rays: Rays
    around: Neighbours
    near: Neighbours
    direct: NDArray[np.float32]
    baked: NDArray[np.float32]
    albedos: Albedos

    def indirect(self, albedos: Albedos, solution: Solution | None = None) -> NDArray[np.float32]:
        """Indirect irradiance (K + F, G, 4) at the points, as far as their rays see it.

        `solution` is the solution of the patches, if already known.
        """
        if albedos.same_as(self.albedos):
            return self._shown_as_baked
        patch, grows = self.points.patch, self._grows
        now = side_by_side((solution or solved(self.patches, albedos)).irradiance - self.patches.direct)
        sent = self.points.exitance(albedos, now[patch], self._inverse_of_patches[patch], grows)
        for step in STEPS:
            sent = self.points.exitance(albedos, gathered(self.few_rays, sent), self._inverse_of_few, grows, sent, step)
        return smoothed(gathered(self.rays, sent), self.around)

    @cached_property
    def sender(self) -> NDArray[np.int64]:
        """(T,) the sending point that counts most for each texel, -1 without one."""
        shares = np.where(self.near.points < len(self.points.other), self.near.shares, 0)
        most = shares.argmax(axis=1)[:, None]
        best, share = (np.take_along_axis(of, most, axis=1)[:, 0] for of in (self.near.points, shares))
        return np.where(share > 0, best.astype(np.int64), -1)

    @cached_property
    def few_rays(self) -> Rays:
        """A sample of the sending points' rays, for all passes but the last."""
        return self.rays.of_first(len(self.points.other)).thinned(FEW_RAYS, self._sent_as_baked.mean(axis=(1, 2)))

    @cached_property
    def few_as_baked(self) -> NDArray[np.float32]:
        """Indirect irradiance (K, G, 4) gathered along `few_rays` for the baked materials."""
        return gathered(self.few_rays, self._sent_as_baked)

    @cached_property
    def _inverse_of_few(self) -> NDArray[np.float32]:
        return inverses(self.few_as_baked)

    @cached_property
    def _inverse_of_patches(self) -> NDArray[np.float32]:
        return inverses(side_by_side(solved(self.patches, self.albedos).irradiance - self.patches.direct))

    @cached_property
    def _grows(self) -> NDArray[np.float32]:
        return np.asarray(
            np.minimum(self.points.indirect, MOST_EXCESS * self.gathered_as_baked[: len(self.points.other)])
        )

    @cached_property
    def _sent_as_baked(self) -> NDArray[np.float32]:
        same = np.ones_like(self.points.indirect)
        return self.points.exitance(self.albedos, same, same, self.points.indirect)

    @cached_property
    def gathered_as_baked(self) -> NDArray[np.float32]:
        """Indirect irradiance (K + F, G, 4) gathered along `rays` for the baked materials."""
        return gathered(self.rays, self._sent_as_baked)

    @cached_property
    def _shown_as_baked(self) -> NDArray[np.float32]:
        return smoothed(self.gathered_as_baked, self.around)

    def reference(self) -> NDArray[np.float32]:
        """Indirect irradiance (G, T, 3) at the texels, computed the same way for the baked materials."""
        return upsampled(self._shown_as_baked, self.near)

    def irradiance(self, albedos: Albedos, reference: Floats) -> NDArray[np.float32]:
        """Irradiance (G, T, 3) of the texels with other albedos; `baked` itself if the albedos are unchanged."""
        if albedos.same_as(self.albedos):
            return self.baked
        return self.at_texels(self.indirect(albedos), reference)

    def at_texels(self, indirect: NDArray[np.float32], reference: Floats) -> NDArray[np.float32]:
        """Irradiance (G, T, 3) of the texels, `answered` from indirect light (K + F, G, 4) of the points."""
        least = np.array([least_light(one[None])[0, 0, 0] for one in reference], np.float32)
        return np.asarray(loops.texel_light(
            self.near.points, self.near.shares, indirect, reference, self.direct, self.baked, least,
            np.float32(MOST_RATIO), np.float32(MOST_EXCESS),
        ))  # fmt: skip


def answered(direct: Floats, baked: Floats, edited: Floats, reference: Floats) -> NDArray[np.float32]:
    """D + (E - D) times the ratio of the gathered light `edited` over `reference`, all (G, ..., 3).

    Indirect light above MOST_EXCESS times the gathered light does not brighten with edits: lobes focused it, or it
    comes from a surface too near for the points to see.
    """
    ratio, indirect = ratios(edited, reference), baked - direct
    excess = np.maximum(indirect - MOST_EXCESS * reference, 0)
    return np.asarray(direct + indirect * ratio - excess * np.maximum(ratio - 1, 0), np.float32)
