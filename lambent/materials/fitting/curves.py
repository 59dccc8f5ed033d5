"""Fit one lobe whose density of slopes and Fresnel reflectance are curves, from the best lobe of a given shape.

The unknowns are ln P at the nodes of `slope_curve`, ln of k F at the nodes of cos_d in each channel, alpha, ln(my/mx)
of an anisotropic table, ln of the diffuse coefficients and, if wanted, ln of the nodes of the diffuse curve. In these
the model is smooth and its derivatives are hat functions: damped Gauss-Newton as in `gradient`.

Nodes without tuples, and noise, are held by a penalty on the second differences of a curve between neighbours. Its
strength is the one of STRENGTHS that predicts tuples best which the fit has not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats
from lambent.core.plain import triple
from lambent.core.progress import Progress
from lambent.materials.document import COSINE_NODES, SHAPE_NODES, Lobe, Side
from lambent.materials.fitting.gradient import DAMPING, damped_step, reweighted
from lambent.materials.fitting.parameters import Box
from lambent.materials.fitting.problem import ALPHA, Mixture, Problem
from lambent.materials.fresnel import schlick_weight
from lambent.materials.lobes import NUMPY
from lambent.materials.slope_curve import NODES_COSINE, NODES_LOG, NODES_RHO, ROW, normalised, quantile, slope_table

STRENGTHS = (1e-4, 1e-2, 1.0)  # of the penalty, in units of the start's error
FOLDS = 5  # a fifth of the tuples is held out
CURVE_VALUES = (90_000, 240_000)  # measured values (tuples times channels) of the trials and of the final fit
CURVE_STEPS = (25, 15)
KD_GAIN = 0.02  # share of E that a curve of the diffuse term must remove
DARKEST = -30.0  # least ln of the start's density
DARK = 1e-5  # a smaller diffuse coefficient counts as 0
STRETCH = 5.0  # most of ln(my/mx)


@dataclass(frozen=True)
class CurveModel:
    """A side's model with one curve lobe.

    Attributes
    ----------
    m : float
        Geometric mean of mx and my: the unit of the curve's radius.
    shape : (SHAPE_NODES,)
        ln of the density of slopes, not normalised.
    tint : (C, COSINE_NODES)
        ln of k F (reflection) or k (1 - F) (transmission).
    bent : (2,)
        alpha and ln(my/mx).
    diffuse : (C,)
        ln of kd or kt_d.
    kd_curve : (COSINE_NODES,)
        ln of the diffuse curve.
    """

    m: float
    shape: Floats
    tint: Floats
    bent: Floats
    diffuse: Floats
    kd_curve: Floats

    @property
    def vector(self) -> Floats:
        return np.concatenate([self.shape, self.tint.ravel(), self.bent, self.diffuse, self.kd_curve])

    def at(self, x: Floats) -> CurveModel:
        """The model with these unknowns."""
        ends = np.cumsum([self.shape.size, self.tint.size, self.bent.size, self.diffuse.size])
        shape, tint, bent, diffuse, kd_curve = np.split(x, ends)
        return replace(
            self, shape=shape, tint=tint.reshape(self.tint.shape), bent=bent, diffuse=diffuse, kd_curve=kd_curve
        )


@dataclass(frozen=True)
class CurveFit:
    """A side fitted by a curve lobe: the document's lobe and diffuse terms, and errors on tuples that were held out.

    Attributes
    ----------
    diffuse : (C,)
        kd or kt_d.
    kd_curve : tuple of float or None
    held_out, lobes_held_out : float
        E of the curve lobe's model and of the lobes' on these tuples.
    """

    lobe: Lobe
    diffuse: Floats
    kd_curve: tuple[float, ...] | None
    held_out: float
    lobes_held_out: float


def _hats(place: Floats, nodes: Floats) -> tuple[NDArray[np.int64], Floats]:
    """Lower node (N,) and share (N,) of the upper one, linear between `nodes` and beyond."""
    low = np.clip(np.searchsorted(nodes, place, side="right") - 1, 0, len(nodes) - 2)
    return low, (place - nodes[low]) / (nodes[low + 1] - nodes[low])


class Terms:
    """The terms of a model at a block of tuples, with their derivatives by the unknowns."""

    def __init__(self, block: Problem, model: CurveModel, background: Floats) -> None:
        alpha, stretch = model.bent
        mx, my = model.m * np.exp(-stretch / 2), model.m * np.exp(stretch / 2)
        x, y = block.slope_x2[0] / (mx * mx), block.slope_y2[0] / (my * my)
        self._slope2, self._difference = x + y, x - y
        self._hats = [_hats(np.log1p(x + y), NODES_LOG), _hats(-block.schlick[0], -schlick_weight(NODES_COSINE))]
        self._of_diffuse = [_hats(-schlick_weight(c), -schlick_weight(NODES_COSINE)) for c in block.cosines]
        self._block, self._model, self.background = block, model, background
        log_p = _at(model.shape, self._hats[0]) + block.base[0] - 2 * np.log(model.m) - alpha * block.log_cosines
        self._tint = _at(np.exp(model.tint), self._hats[1])  # (C, N): curves over cosines are not linear in logarithms
        self.lobe = np.exp(log_p) * self._tint
        self._curve = [_at(np.exp(model.kd_curve), hats) for hats in self._of_diffuse]
        self.diffuse = np.exp(model.diffuse[:, None]) * self._curve[0] * self._curve[1] * block.diffuse

    @property
    def f(self) -> Floats:
        """(C, N) f in 1/sr."""
        return np.asarray(self.lobe + self.diffuse + self.background)

    def rows(self, channel: int) -> Floats:
        """(U, N) derivatives of a channel's f by all unknowns."""
        model, n = self._model, len(self._slope2)
        rows = np.zeros((model.vector.size, n))
        lobe, diffuse, channels = self.lobe[channel], self.diffuse[channel], len(model.diffuse)
        _scatter(rows, 0, self._hats[0], lobe, np.zeros(SHAPE_NODES))
        first = SHAPE_NODES
        _scatter(
            rows, first + channel * COSINE_NODES, self._hats[1], lobe / self._tint[channel], model.tint[channel]
        )  # fmt: skip
        first += channels * COSINE_NODES
        low, _ = self._hats[0]
        power = np.diff(model.shape)[low] / np.diff(NODES_LOG)[low]
        rows[first] = -self._block.log_cosines * lobe
        rows[first + 1] = power / (1 + self._slope2) * self._difference * lobe
        rows[first + 2 + channel] = diffuse
        for hats, curve in zip(self._of_diffuse, self._curve, strict=True):
            _scatter(rows, first + 2 + channels, hats, diffuse / curve, model.kd_curve)
        return rows


def _at(values: Floats, hats: tuple[NDArray[np.int64], Floats]) -> Floats:
    """(..., N) values at nodes (..., K), interpolated."""
    low, share = hats
    return np.asarray(values[..., low] * (1 - share) + values[..., low + 1] * share)


def _scatter(rows: Floats, first: int, hats: tuple[NDArray[np.int64], Floats], term: Floats, log_nodes: Floats) -> None:
    """Add the derivatives of a term by the logarithms of its nodes, from row `first` on."""
    (low, share), nodes = hats, np.exp(log_nodes)
    at = np.arange(len(low))
    rows[first + low, at] += (1 - share) * nodes[low] * term
    rows[first + 1 + low, at] += share * nodes[low + 1] * term


@dataclass(frozen=True)
class _Descent:
    """Least squares of one problem from a model; `free` (U,) are the unknowns that move, `strength` the penalty's."""

    problem: Problem
    others: Mixture  # lobes that stay as they are
    free: Flags
    limits: tuple[Floats, Floats]
    strength: float

    def error(self, model: CurveModel) -> float:
        """The metric's sum, averaged over channels."""
        total = 0.0
        for block in self.problem.blocks:
            f = Terms(block, model, self._background(block)).f
            gap = np.abs(block.target - block.metric.transform(block.c * f))
            total += float(np.mean(gap**block.metric.power @ block.w))
        return total

    def _background(self, block: Problem) -> Floats:
        return block.evaluate(replace(self.others, diffuse=np.zeros(len(block.measured))))

    def _penalty(self, model: CurveModel) -> Floats:
        """(R, U) second differences of the curves, by the unknowns."""
        channels, count = len(model.diffuse), model.vector.size
        starts = [(0, SHAPE_NODES), *((SHAPE_NODES + c * COSINE_NODES, COSINE_NODES) for c in range(channels))]
        starts.append((count - COSINE_NODES, COSINE_NODES))
        each = np.eye(count)
        return np.concatenate([np.diff(each[first : first + nodes], 2, axis=0) for first, nodes in starts])

    def _equations(self, model: CurveModel) -> tuple[Floats, Floats]:
        count = model.vector.size
        matrix, gradient = np.zeros((count, count)), np.zeros(count)
        for block in self.problem.blocks:
            terms = Terms(block, model, self._background(block))
            for channel, (target, value) in enumerate(zip(block.target, block.c * terms.f, strict=True)):
                residual = target - block.metric.transform(value)
                w = reweighted(block, target, residual)
                rows = terms.rows(channel) * (block.c * block.metric.slope(value))
                matrix += (rows * w) @ rows.T
                gradient += (rows * w) @ residual
        return matrix / len(model.diffuse), gradient / len(model.diffuse)

    def run(self, model: CurveModel, steps: int) -> CurveModel:
        """The model after at most `steps` steps."""
        bends = self._penalty(model)
        error = self.error(model)
        weight = self.strength * error

        def total(one: CurveModel, error: float) -> float:
            return error + weight * float(np.sum((bends @ one.vector) ** 2))

        now, damping, free = total(model, error), DAMPING[0], np.flatnonzero(self.free)
        for _ in range(steps):
            matrix, gradient = self._equations(model)
            matrix, gradient = matrix + weight * bends.T @ bends, gradient - weight * bends.T @ (bends @ model.vector)
            before, x = now, model.vector
            while damping < DAMPING[1]:
                there = x.copy()
                there[free] = damped_step(
                    matrix[np.ix_(free, free)], gradient[free], damping, x[free], *(one[free] for one in self.limits)
                )
                candidate = model.at(there)
                reached = total(candidate, self.error(candidate))
                if reached < now:
                    model, now, damping = candidate, reached, max(damping / 10, 1e-9)
                    break
                damping *= 10
            if before - now <= 1e-4 * before:
                break
        return model


def start_of(problem: Problem, mixture: Mixture) -> CurveModel:
    """The mirroring lobes of a mixture as one: their densities add up, their other numbers are means by light."""
    lobes = [one for one in mixture.lobes if not one.retro]
    mx, my, r0, alpha = np.array([one.shape for one in lobes]).T
    f = r0[:, None] + (1 - r0[:, None]) * schlick_weight(NODES_COSINE)
    f = f if problem.side == "reflection" else 1 - f
    k = np.array([np.maximum(one.k, 1e-9) for one in lobes])  # (L, C)
    light = k.mean(axis=1) * f[:, -1] / (k.mean(axis=1) * f[:, -1]).sum()
    m = float(np.exp(light @ np.log(mx * my) / 2))
    rho2 = NODES_RHO**2 * (m * m / (mx * my))[:, None]
    density = (1 + rho2) ** -2.0 if problem.distribution == "ggx" else np.exp(np.maximum(-rho2, DARKEST))
    shape = np.log(np.maximum((light / (mx * my)) @ density * m * m, np.exp(DARKEST)))
    tint = np.log(np.maximum(np.einsum("lc,ln->cn", k, f), 1e-9))
    bent = np.array([light @ alpha, light @ np.log(my / mx)])
    diffuse = np.log(np.maximum(mixture.diffuse, 1e-9))
    return CurveModel(m, shape, tint, bent, diffuse, np.zeros(COSINE_NODES))


def regauged(model: CurveModel) -> CurveModel:
    """The same lobe with the unit of slopes that puts half of it inside the radius of Beckmann's half."""
    half = float(quantile(np.array(0.5), _relative(model.shape), NUMPY))
    scale = half / np.sqrt(np.log(2))
    shape = _at(model.shape, _hats(np.log1p((NODES_RHO * scale) ** 2), NODES_LOG))
    return replace(model, m=model.m * scale, shape=shape + 2 * np.log(scale))


def _relative(log_shape: Floats) -> tuple[float, ...]:
    return tuple(np.exp(np.maximum(log_shape - log_shape.max(), -69.0)).tolist())


def lobe_of(model: CurveModel, side: Side) -> Lobe:
    """The model's lobe in the form of a document."""
    alpha, stretch = (float(v) for v in model.bent)
    relative = _relative(model.shape)
    mass = np.exp(model.shape.max() - slope_table(relative)[::ROW].max())  # twice the integral of P rho
    tint = np.broadcast_to(mass * np.exp(model.tint), (3, COSINE_NODES))
    k = tint.max(axis=1)
    share = np.minimum(tint / k[:, None], 1.0)
    red, green, blue = (share if side == "reflection" else 1 - share).tolist()
    mx, my = (float(np.clip(model.m * np.exp(turn * stretch / 2), 0.001, 4)) for turn in (-1, 1))
    return Lobe(
        side=side, distribution="curve", k=triple(k), mx=mx, my=my, alpha=alpha, shape=relative,
        fresnel=(tuple(red), tuple(green), tuple(blue)),
    )  # fmt: skip


@dataclass(frozen=True)
class _Tried:
    """A descent on the tuples that were seen: its error on those held out, its settings, and where it ended."""

    error: float
    strength: float
    bends_kd: bool
    model: CurveModel


@dataclass(frozen=True)
class _Trial:
    """Tuples to fit and tuples held out, and what the fit may change."""

    seen: Problem
    unseen: Problem
    others: Mixture
    box: Box
    diffuse_free: bool

    def run(self, start: CurveModel, strength: float, bends_kd: bool) -> _Tried:
        """A descent, stopped once on the way to choose the unit of slopes."""
        descent = _Descent(self.seen, self.others, *_bounds(start, self.box, self.diffuse_free, bends_kd), strength)
        model = descent.run(regauged(descent.run(start, CURVE_STEPS[0])), CURVE_STEPS[1])
        return _Tried(replace(descent, problem=self.unseen).error(model), strength, bends_kd, model)


def fit_curve(
    problem: Problem,
    mixtures: Sequence[Mixture],
    box: Box,
    seed: int,
    progress: Progress,
    *,
    diffuse_free: bool = True,
    may_bend_kd: bool = True,
) -> CurveFit:
    """The best curve lobe, from the mirroring lobes of each mixture; the retro lobe of the last one stays.

    The error of the last one on the tuples held out is stated beside the curve lobe's.

    Parameters
    ----------
    box : Box
        Of a lobe: ends of alpha; whether mx and my are one number.
    diffuse_free, may_bend_kd : bool
        Whether the diffuse coefficients may change, and whether the diffuse term may get a curve.
    """
    mixture, channels = mixtures[-1], len(problem.measured)
    others = replace(mixture, lobes=tuple(one for one in mixture.lobes if one.retro))
    tuples, final = problem.thinned([values // channels for values in CURVE_VALUES], seed, (np.float64,) * 2)
    is_held = np.random.default_rng(seed).permutation(len(tuples)) % FOLDS == 0
    seen, unseen = (tuples.take(np.flatnonzero(part), tuples.w[part], np.float64) for part in (~is_held, is_held))
    trial = _Trial(seen, unseen, others, box, diffuse_free)
    starts = [(start_of(problem, one), STRENGTHS[0]) for one in mixtures]
    rounds, tries = len(starts) + len(STRENGTHS) + 1, list[_Tried]()

    def attempt(start: CurveModel, strength: float, bends_kd: bool = False) -> _Tried:
        progress(len(tries), rounds, f"curve lobe, {len(seen)} tuples")
        tries.append(trial.run(start, strength, bends_kd))
        return tries[-1]

    best, start = min(((attempt(*one), one[0]) for one in starts), key=lambda pair: pair[0].error)
    best = min([best, *(attempt(start, strength) for strength in STRENGTHS[1:])], key=lambda one: one.error)
    power = 1 / problem.metric.power
    if diffuse_free and may_bend_kd and np.any(mixture.diffuse > DARK):
        bent = attempt(start, best.strength, True)
        best = bent if bent.error**power < (1 - KD_GAIN) * best.error**power else best
    progress(rounds - 1, rounds, f"curve lobe, {len(final)} tuples")
    bounds = _bounds(best.model, box, diffuse_free, best.bends_kd)
    model = _Descent(final, others, *bounds, best.strength).run(best.model, CURVE_STEPS[1])
    curve = np.exp(model.kd_curve - model.kd_curve.max())
    scale = float((np.exp(model.kd_curve[0]) / normalised(tuple(np.exp(model.kd_curve).tolist()))[0]) ** 2)
    return CurveFit(
        lobe_of(model, problem.side),
        np.exp(model.diffuse) * scale if diffuse_free else mixture.diffuse,
        tuple(curve.tolist()) if best.bends_kd else None,
        (best.error * FOLDS) ** power,
        (unseen.remaining(mixture) * FOLDS) ** power,
    )


def _bounds(model: CurveModel, box: Box, diffuse_free: bool, bends_kd: bool) -> tuple[Flags, tuple[Floats, Floats]]:
    """Which unknowns are free, and their intervals."""
    bent = np.array([box.lo[ALPHA] < box.hi[ALPHA], not box.tied])
    of_kd = np.full(len(model.diffuse), diffuse_free)
    free = np.concatenate([np.ones(SHAPE_NODES + model.tint.size, bool), bent, of_kd, np.full(COSINE_NODES, bends_kd)])
    bound = np.full(model.vector.size, np.inf)
    lo, hi = model.at(-bound), model.at(bound)
    lo.bent[:], hi.bent[:] = (box.lo[ALPHA], -STRETCH), (box.hi[ALPHA], STRETCH)
    return free, (lo.vector, hi.vector)
