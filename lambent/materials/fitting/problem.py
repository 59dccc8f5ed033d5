"""One side of a table, prepared so that evaluating any lobe takes a few multiplications per tuple.

ln f_lobe / k = ln F + base + ln D' - alpha ln(cos_i cos_o)   (3.3-3.5), with base = -ln(4 pi hz^4 cos_d) and
D' = exp(-q) / (mx my) of Beckmann, 1 / (mx my (1 + q)^2) of GGX, q = hx^2/hz^2/mx^2 + hy^2/hz^2/my^2. For retro lobes h
and cos_d are those of the back vector.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.materials.bsdf import coupling
from lambent.materials.document import Distribution, Lobe, Side
from lambent.materials.fitting.parameters import Box, from_search
from lambent.materials.fitting.scale import Channel
from lambent.materials.fresnel import schlick_weight
from lambent.materials.lobes import density_of_slopes, passed
from lambent.materials.measured.inspecting.metrics import BLOCK, Metric
from lambent.materials.measured.protocol import MeasuredSamples

MU, NU, R0, ALPHA = range(4)  # axes of the search coordinates
PER_TUPLE = ("slope_x2", "slope_y2", "base", "cosines", "cos_d", "schlick", "log_cosines", "diffuse", "measured", "c")


@dataclass(frozen=True)
class Candidate:
    """A lobe: its search coordinates (4,), its coefficient per channel (C,), and whether it is retro-reflective."""

    coordinates: Floats
    k: Floats
    retro: bool = False

    @property
    def shape(self) -> Floats:
        """mx, my, r0, alpha."""
        return from_search(self.coordinates)


@dataclass(frozen=True)
class Mixture:
    """The model of one side: a diffuse coefficient per channel (C,) and lobes."""

    diffuse: Floats
    lobes: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Problem:
    """The data that one side's model is fitted to.

    Attributes
    ----------
    slope_x2, slope_y2, base, cos_d, schlick : (1 or 2, N)
        (hx/hz)^2, (hy/hz)^2, -ln(4 pi hz^4 cos_d), cos_d and (1 - cos_d)^5 of every tuple's half vector, then of its
        back vector if retro lobes are allowed.
    cosines, log_cosines : (2, N), (N,)
        cos_i and cos_o, and ln(cos_i cos_o).
    diffuse : (N,)
        f in 1/sr of the diffuse term with coefficient 1.
    measured : (C, N)
        f in 1/sr.
    w, c : (N,)
        The metric's weight and cosine.
    kept : KeptAlbedo, optional
        Albedos that the model must match as well.
    """

    side: Side
    metric: Metric
    distribution: Distribution
    slope_x2: Floats
    slope_y2: Floats
    base: Floats
    cosines: Floats
    log_cosines: Floats
    cos_d: Floats
    schlick: Floats
    diffuse: Floats
    measured: Floats
    w: Floats
    c: Floats
    kept: KeptAlbedo | None = None

    def __len__(self) -> int:
        return len(self.w)

    def fresnel(self, r0: Floats, retro: bool = False) -> Floats:
        """(..., N) F, or 1 - F for transmission, of r0 (...)."""
        f = r0[..., None] + (1 - r0[..., None]) * self.schlick[int(retro)]
        return np.asarray(f if self.side == "reflection" else 1 - f)

    def density(self, mx: float, my: float, retro: bool = False) -> Floats:
        """(N,) factor of a lobe that depends on mx and my."""
        x2, y2, base = (array[int(retro)] for array in (self.slope_x2, self.slope_y2, self.base))
        q = x2 / (mx * mx) + y2 / (my * my)  # squared slope in units of the roughness
        logarithm = -2 * np.log1p(q) if self.distribution == "ggx" else -q
        return np.asarray(np.exp(base - np.log(mx * my) + logarithm))

    def basis(self, shape: Floats, retro: bool = False) -> Floats:
        """(N,) f in 1/sr of the lobe (mx, my, r0, alpha) with coefficient 1."""
        mx, my, r0, alpha = (float(v) for v in shape)
        fresnel = self.fresnel(np.array(r0, dtype=self.schlick.dtype), retro)
        return np.asarray(self.density(mx, my, retro) * fresnel * np.exp(-alpha * self.log_cosines))

    def of(self, lobe: Lobe) -> Floats:
        """(C, N) f in 1/sr of a document's lobe without its coefficient k."""
        which = int(lobe.retro)
        slope2 = self.slope_x2[which] / lobe.mx**2 + self.slope_y2[which] / lobe.my**2
        log_rest = self.base[which] - np.log(lobe.mx * lobe.my) - lobe.alpha * self.log_cosines
        density = density_of_slopes(slope2, lobe) * np.exp(log_rest)
        return np.stack([density * passed(self.cos_d[which], lobe, c) for c in range(len(self.measured))])

    def log_derivatives(self, shape: Floats, tied: bool, retro: bool = False) -> tuple[Floats, Floats, Floats, Floats]:
        """Derivatives (N,) of ln basis by ln mx (with ln my if `tied`), ln my, ln r0 and alpha."""
        mx, my, r0, _ = (float(v) for v in shape)
        x, y = self.slope_x2[int(retro)] * (2 / (mx * mx)), self.slope_y2[int(retro)] * (2 / (my * my))
        if self.distribution == "ggx":
            fall = 2 / (1 + (x + y) / 2)
            x, y = x * fall, y * fall
        sign = 1 if self.side == "reflection" else -1
        fresnel = self.fresnel(np.array(r0, dtype=self.schlick.dtype), retro)
        by_r0 = sign * r0 * (1 - self.schlick[int(retro)]) / np.maximum(fresnel, 1e-30)
        return (x + y - 2 if tied else x - 1), y - 1, by_r0, -self.log_cosines

    def evaluate(self, mixture: Mixture) -> Floats:
        """(C, N) f in 1/sr."""
        k = np.stack([mixture.diffuse, *(lobe.k for lobe in mixture.lobes)], axis=1).astype(self.diffuse.dtype)
        return np.asarray(k @ np.stack([self.diffuse, *(self.basis(lobe.shape, lobe.retro) for lobe in mixture.lobes)]))

    @cached_property
    def blocks(self) -> tuple[Problem, ...]:
        """The tuples in blocks whose intermediate results fit into the processor's cache."""
        return tuple(
            replace(self, kept=None, **{name: getattr(self, name)[..., i : i + BLOCK] for name in (*PER_TUPLE, "w")})
            for i in range(0, len(self), BLOCK)
        )

    @cached_property
    def target(self) -> Floats:
        """(C, N) the transformed measurement."""
        return np.asarray(self.metric.transform(self.c * self.measured))

    def remaining(self, mixture: Mixture) -> float:
        """The metric's sum over all tuples, averaged over channels: E to the metric's power, plus that of `kept`."""
        error = sum(block._remaining(mixture) for block in self.blocks)
        return error if self.kept is None else error + self.kept.remaining(mixture)

    def _remaining(self, mixture: Mixture) -> float:
        difference = self.target - self.metric.transform(self.c * self.evaluate(mixture))
        return float(np.mean((np.abs(difference) if self.metric.power == 1 else difference * difference) @ self.w))

    def channels(self, others: Mixture) -> tuple[Channel, ...]:
        """Data for one more lobe, per channel: the residual, clamped so that the lobe is never negative."""
        diffuse = others.diffuse[:, None].astype(self.diffuse.dtype) * self.diffuse
        rest = np.maximum(self.measured - (self.evaluate(others) - diffuse), diffuse) if others.lobes else self.measured
        return tuple(Channel(m, b, self.w, self.c) for m, b in zip(rest, diffuse, strict=True))

    def take(self, index: NDArray[np.integer], w: Floats, dtype: type = np.float32) -> Problem:
        """The tuples `index`, with new weights."""
        taken = {name: getattr(self, name)[..., index].astype(dtype) for name in PER_TUPLE}
        return replace(self, **taken, w=w.astype(dtype))

    def thinned(self, counts: Sequence[int], seed: int, dtypes: Sequence[type]) -> list[Problem]:
        """For each count, about that many tuples that estimate the metric without bias.

        Systematic sampling in storage order: half of the density is proportional to the metric's weight, half to weight
        times the transformed measurement, so that narrow peaks are sampled; each tuple's weight is divided by its
        density. The same seed gives the same tuples.
        """
        if len(self) > min(counts):
            height = np.abs(self.metric.transform(self.c * self.measured.mean(axis=0))) ** self.metric.power
            salient = self.w * height
            density = 0.5 * self.w / self.w.sum() + 0.5 * salient / max(float(salient.sum()), 1e-300)
            summed = np.cumsum(density)
        parts = []
        for count, dtype in zip(counts, dtypes, strict=True):
            if count >= len(self):
                parts.append(self.take(np.arange(len(self)), self.w, dtype))
                continue
            offset = np.random.default_rng(seed).random()
            drawn = np.searchsorted(summed, (np.arange(count) + offset) / count * summed[-1])
            index, times = np.unique(np.minimum(drawn, len(self) - 1), return_counts=True)
            parts.append(self.take(index, self.w[index] * times * summed[-1] / (count * density[index]), dtype))
        return parts


@dataclass(frozen=True)
class KeptAlbedo:
    """Albedos that one side's model must match: the mean square of ln(model / table) is added to the error.

    Attributes
    ----------
    pairs : Problem
        The pairs of directions for integrating a model's albedo.
    solid_angle : (N,)
        Weight of each pair in that integral, cosine included.
    first : (A,)
        Index of the first pair of each incident direction.
    albedo : (C, A)
        Of the table.
    weight : float
        Of the mean square, in units of E to the metric's power.
    dark : float
        Added to both albedos, to keep their logarithm finite when nothing is scattered.
    """

    pairs: Problem
    solid_angle: Floats
    first: NDArray[np.integer]
    albedo: Floats
    weight: float
    dark: float

    def integral(self, f: Floats) -> Floats:
        """(..., A) integrals over wo of f (..., N)."""
        return np.asarray(np.add.reduceat(f * self.solid_angle, self.first, axis=-1))

    def off(self, mixture: Mixture) -> tuple[Floats, Floats]:
        """ln of table over model albedo (C, A), and the derivatives (C, A) of the model's logarithm."""
        model = self.integral(self.pairs.evaluate(mixture)) + self.dark
        return np.log((self.albedo + self.dark) / model), 1 / model

    def remaining(self, mixture: Mixture) -> float:
        return self.weight * float(np.mean(self.off(mixture)[0] ** 2))


@dataclass(frozen=True)
class Found:
    """The finished models of one side with one lobe, two, ..., and the boxes of their lobes, a retro lobe first."""

    problem: Problem
    boxes: tuple[Box, ...]
    models: list[Mixture]

    @property
    def mirroring(self) -> int:
        """Number of lobes of the last model, without retro-reflective ones."""
        return sum(not lobe.retro for lobe in self.models[-1].lobes) if self.models else 0

    @property
    def error(self) -> float:
        """E of the last model, on this side alone."""
        return float(self.problem.remaining(self.models[-1]) ** (1 / self.problem.metric.power))


def problem_of(
    samples: MeasuredSamples, side: Side, metric: Metric, distribution: Distribution, coupled: bool, retro: bool = False
) -> Problem:
    """The tuples of one side; `coupled` selects the diffuse term of `bsdf.coupling`, `retro` allows retro lobes."""
    here = np.flatnonzero(samples.on(side))
    wi, wo = (w[here].T.astype(np.float64) for w in (samples.wi, samples.wo))
    cos_i, cos_o = np.abs(wi[2]), np.abs(wo[2])
    kinds = [_half_vector_terms(sign * wi[:2], wo[:2], cos_i, cos_o) for sign in ((1.0, -1.0) if retro else (1.0,))]
    slope_x2, slope_y2, base, cos_d = (np.stack(arrays) for arrays in zip(*kinds, strict=True))
    w, c = metric.terms(samples)
    return Problem(
        side,
        metric,
        distribution,
        slope_x2,
        slope_y2,
        base,
        np.stack([cos_i, cos_o]),
        np.log(np.maximum(cos_i * cos_o, 1e-12)),
        cos_d,
        schlick_weight(cos_d),
        np.full_like(cos_o, 1 / np.pi) * (coupling(cos_i, cos_o) if coupled and side == "reflection" else 1.0),
        np.ascontiguousarray(samples.f[here].T.astype(np.float64)),
        w[here],
        c[here],
    )


def _half_vector_terms(wi: Floats, wo: Floats, cos_i: Floats, cos_o: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """slope_x2, slope_y2, base and cos_d (N,) of `Problem`, from tangential components (2, N) and cosines (N,)."""
    hx, hy, hz = wi[0] + wo[0], wi[1] + wo[1], cos_i + cos_o
    length2 = hx * hx + hy * hy + hz * hz
    cos_d = np.clip((hx * wo[0] + hy * wo[1] + hz * cos_o) / np.sqrt(length2), 1e-6, 1)
    hz2 = np.maximum(hz * hz, 1e-12)
    base = -np.log(4 * np.pi * (hz2 / length2) ** 2 * cos_d)
    return hx * hx / hz2, hy * hy / hz2, base, cos_d


def replace_metric(problem: Problem, samples: MeasuredSamples, metric: Metric) -> Problem:
    """The same tuples under another metric."""
    here = samples.on(problem.side)
    w, c = metric.terms(samples)
    return replace(problem, metric=metric, w=w[here], c=c[here])
