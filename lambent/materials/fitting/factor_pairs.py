"""Two products of two curves, fitted together to weighted values by alternating non-negative least squares.

    f  ~  a(alpha) b(beta)  +  base c(gamma) d(delta)

One curve of each product is solved with the other fixed, for both products at once, so that light moves freely between
them (Lawrence et al. 2006, SACLS). Curves are linear between knots. Weights are those of the cube root metric at the
model, not at the reading, where noise about zero would dominate.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.materials.measured.inspecting.metrics import CUBEROOT

ROUNDS = 40
ENOUGH = 2e-3  # relative gain of a round below which the rounds end
SMOOTHING = 1e-6  # weight of the curvature of the second product's logarithms, relative to all values
FLATNESS = 3e-4  # likewise for the slope of the first product's: diffuse curves vary little
SHRINKING = 0.05  # of the second product while the two compete: light that both can explain goes to the first
FINAL, A_LITTLE = 5, 0.005  # final rounds, and the shrinking left in them
DARK = 1e-3  # share of the mean value below which all values get equal weight
LEAST = 1e-7  # relative to a curve's largest knot: a knot at zero may still rise


@dataclass(frozen=True)
class Axis:
    """Interpolation of N values between knots: the lower knot, and the weight of the next."""

    knots: int
    low: Indices
    share: Floats

    @classmethod
    def of(cls, unit: Floats, knots: int) -> Axis:
        """Of places (N,) in [0, 1] between equally spaced knots."""
        place = np.clip(unit, 0, 1) * (knots - 1)
        low = np.minimum(place.astype(np.int64), knots - 2)
        return cls(knots, low, place - low)

    def at(self, curve: Floats) -> Floats:
        """(N,) values of a curve (knots,)."""
        return np.asarray(curve[self.low] * (1 - self.share) + curve[self.low + 1] * self.share)


@dataclass
class Products:
    """Two products of curves at N values; a product whose curves are zero is absent and stays so."""

    axes: tuple[Axis, Axis, Axis, Axis]  # alpha, beta, gamma, delta
    base: Floats
    curves: list[Floats]

    def at(self) -> Floats:
        a, b, c, d = (axis.at(curve) for axis, curve in zip(self.axes, self.curves, strict=True))
        return np.asarray(a * b + self.base * c * d)


def fit(products: Products, f: Floats, weight: Floats, cosine: Floats, rounds: int = ROUNDS) -> float:
    """Improve the curves in place; returns the remaining weighted relative error.

    Parameters
    ----------
    f, weight, cosine : (N,)
        Values in 1/sr, which may be noise below zero; weights; cosines by which the metric multiplies f.
    """
    dark = max(DARK * float(np.average(np.abs(f), weights=weight)), 1e-12)
    competing = bool(products.curves[0].any())

    def weights() -> Floats:
        return np.asarray(weight * (cosine * CUBEROOT.slope(cosine * np.maximum(products.at(), dark))) ** 2)

    def error() -> float:
        w = weights()
        return float(np.sqrt(w @ (f - products.at()) ** 2 / max(float(w @ f**2), 1e-300)))

    def improve(shrinking: float) -> None:
        for pair in ((1, 3), (0, 2)):
            _solve(products, pair, f, weights(), shrinking)
        _balance(products)

    left = np.inf
    for _ in range(rounds):
        improve(SHRINKING if competing else 0.0)
        before, left = left, error()
        if left > (1 - ENOUGH) * before:
            break
    for _ in range(FINAL if competing else 0):
        improve(A_LITTLE)
    return error()


def _solve(products: Products, pair: tuple[int, int], f: Floats, w: Floats, shrinking: float) -> None:
    """Solve this pair of curves, one of each product, with the others fixed."""
    from scipy.optimize import nnls

    values = [axis.at(curve) for axis, curve in zip(products.axes, products.curves, strict=True)]
    entries: list[tuple[Indices, Floats]] = []
    first = 0
    for curve, other, factor in ((pair[0], 1 - pair[0], 1.0), (pair[1], 5 - pair[1], products.base)):
        axis, by = products.axes[curve], factor * values[other]
        entries += [(first + axis.low, by * (1 - axis.share)), (first + axis.low + 1, by * axis.share)]
        first += axis.knots
    normal, right = np.zeros(first * first), np.zeros(first)
    for (i, x), (j, y) in combinations_with_replacement(entries, 2):
        normal += np.bincount(i * first + j, weights=w * x * y, minlength=first * first)
        if i is not j:
            normal += np.bincount(j * first + i, weights=w * x * y, minlength=first * first)
    for i, x in entries:
        right += np.bincount(i, weights=w * x * f, minlength=first)
    present = [products.curves[k] for k in pair]
    scale = np.concatenate([np.maximum(curve, LEAST * curve.max()) for curve in present])
    used = scale > 0
    if not used.any():
        return
    matrix = normal.reshape(first, first) * np.outer(scale, scale)
    edge = len(present[0])
    right = right * scale
    right[edge:] *= 1 - shrinking
    energy = float(w @ f**2)
    for part, order, strength in ((slice(edge), 1, FLATNESS), (slice(edge, None), 2, SMOOTHING)):
        if scale[part].any():
            _add_smoothness(matrix, right, part, np.log(scale[part]), order, strength * energy)
    matrix, right = matrix[np.ix_(used, used)], right[used]
    matrix[np.diag_indices_from(matrix)] += 1e-12 * max(float(np.trace(matrix)), 1e-300)
    upper = np.linalg.cholesky(matrix).T
    solved = np.zeros(first)
    solved[used] = scale[used] * nnls(upper, np.linalg.solve(upper.T, right))[0]
    products.curves[pair[0]], products.curves[pair[1]] = solved[:edge], solved[edge:]


def _add_smoothness(matrix: Floats, right: Floats, part: slice, log: Floats, order: int, strength: float) -> None:
    """Add squared differences, of this order, of log(curve s), linearized in s about 1."""
    differences = np.diff(np.eye(len(log)), order, axis=0)
    matrix[part, part] += strength * differences.T @ differences
    right[part] += strength * differences.T @ (differences @ (1 - log))


def _balance(products: Products) -> None:
    """Scale both curves of a product to equal size, so that neither under- nor overflows."""
    for k in (0, 2):
        a, b = products.curves[k], products.curves[k + 1]
        if a.max() > 0 and b.max() > 0:
            ratio = np.sqrt(a.max() / b.max())
            products.curves[k], products.curves[k + 1] = a / ratio, b * ratio
