"""Measured tables as products of curves (Ben-Artzi 2007, section 3.5; Lawrence et al. 2006).

    f = rho_q (G_d(theta_i) H_d(theta_o) + base G_s(theta_d) H_s(theta_h))

per channel and side. `base` is 1, or the masking and foreshortening of a microfacet lobe, G / (4 cos_i cos_o), which
makes G_s and H_s resemble Fresnel's factor and a distribution of normals; the fit takes the base with the smaller
residual. The remainder rho_q is the table over the sum of products, on a grid, clamped to [0, MOST]: with it, the
unedited curves reproduce the table, and never exceed it.

Curves are linear between knots, and fitted by alternating non-negative least squares: one curve of each product is
solved with the other fixed, for both products at once, so that light moves freely between them (SACLS). Weights are
those of the cube root metric at the model, not at the reading, where noise about zero would dominate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations_with_replacement

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import FLIP_Z, direction
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components
from lambent.materials.document import Side
from lambent.materials.factored.curve import END_RAD, Curve, angles_rad
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.quotients import Grooves, One
from lambent.materials.factored.tabulated import MOST, Grid, Tabulated
from lambent.materials.factored.terms import Editable, Factor, Quotient, Term
from lambent.materials.fitting.scale import diffuse_mode
from lambent.materials.lobes import NUMPY
from lambent.materials.measured.inspecting.metrics import CUBEROOT, errors_and_shares
from lambent.materials.measured.protocol import GRAZING_DEG, MeasuredSamples, MeasuredTable

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


def fit_products(products: Products, f: Floats, weight: Floats, cosine: Floats, rounds: int = ROUNDS) -> float:
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


FITTED, FITTED_ANISOTROPIC = Grid(90, 45, 24, turns_d=2), Grid(64, 24, 12, 12, turns_d=2)
RATIOS, RATIOS_ANISOTROPIC = Grid(90, 45, 36), Grid(64, 24, 24, 24)
KNOTS = {"theta_h": 90, "theta_d": 30, "theta_i": 24, "theta_o": 24}
NEGLIGIBLE = 1e-3  # share of the light below which a product is dropped
TRIED = 8  # rounds for trying each base
JUDGED = 20_000  # tuples at which errors are evaluated
AT_ONCE = 1 << 16


@dataclass(frozen=True)
class Factored:
    """Terms and curves of a material, and their errors.

    Attributes
    ----------
    editable : Editable
    errors, without_quotient : dict
        Metric -> error relative to a black surface: of the editable, and of its products of curves alone (empty for a
        material whose quotients are formulas).
    """

    editable: Editable
    errors: dict[str, float]
    without_quotient: dict[str, float]


def judged(editable: Editable, samples: MeasuredSamples, products: Editable | None = None) -> Factored:
    """The editable and its products of curves alone, with their errors at these tuples."""

    def shares(some: Editable) -> dict[str, float]:
        f = some.eval(samples.wi, samples.wo)
        return errors_and_shares(samples, f[:, : samples.f.shape[1]])[1]

    return Factored(editable, shares(editable), shares(products) if products else {})


def factorise(table: MeasuredTable, progress: Progress = silent) -> Factored:
    """The terms and curves of a measured table; deterministic."""
    sides: list[Side] = ["reflection", "transmission"] if table.info.transmits else ["reflection"]
    terms: list[Term] = []
    bare: list[Term] = []
    curves: dict[str, Curve] = {}
    for side in sides:
        products, found = _products(table, side, progress)
        bare += products
        curves |= found
        terms += _with_ratios(table, side, products, found, progress)
    name = table.info.file
    editable, plain = (Editable(name, tuple(some), curves, ("remainder",)) for some in (terms, bare))
    return judged(editable, table.samples(JUDGED), plain)


def _products(table: MeasuredTable, side: Side, progress: Progress) -> tuple[list[Term], dict[str, Curve]]:
    """Terms without the remainder, and their curves."""
    grid = FITTED if table.info.isotropic else FITTED_ANISOTROPIC
    wi, wo = (w.reshape(-1, 3) for w in grid.directions())
    used = np.flatnonzero(np.minimum(wi[:, 2], wo[:, 2]) > np.cos(np.radians(GRAZING_DEG)))
    weight, wi, wo = grid.solid_angles()[used], wi[used], wo[used]
    f = _values(table, side, wi, wo, progress, f"reading {table.info.file}")
    pair = components(wi), components(wo)
    units = {name: _unit(name, angle_of(name, *pair)) for name in KNOTS}
    axes = tuple(Axis.of(units[name], KNOTS[name]) for name in ("theta_i", "theta_o", "theta_d", "theta_h"))
    bases: dict[Quotient, Floats] = {base: np.asarray(base.evaluate(*pair, NUMPY)) for base in (One(), Grooves())}
    light = (weight, wi[:, 2], wo[:, 2])

    def left(base: Quotient) -> float:
        return _channel(f.mean(axis=1), *light, bases[base], axes, TRIED)[0]

    base = min(bases, key=left)
    channels = []
    for c in range(f.shape[1]):
        progress(c, f.shape[1], f"factors of {table.info.file}")
        channels.append(_channel(f[:, c], *light, bases[base], axes)[1])
    progress(f.shape[1], f.shape[1], f"factors of {table.info.file}")
    return _terms(base, channels, side)


def _channel(
    f: Floats, weight: Floats, cos_i: Floats, cos_o: Floats, base: Floats, axes: tuple[Axis, ...], rounds: int = ROUNDS
) -> tuple[float, list[Floats]]:
    """Error and curves of one channel.

    The diffuse product starts at the mode of the values, the highlight at the excess. A product that is absent at the
    start, or that ends up with almost no light, is zero.
    """
    light = weight * cos_i * cos_o
    level = diffuse_mode(np.maximum(f, 0), weight * cos_o) / np.pi
    above = np.maximum(f - level, 0) / base
    rest = _means(above, weight * cos_i * base, axes[3])
    curves = [np.full(axes[0].knots, level), np.ones(axes[1].knots), np.ones(axes[2].knots), rest]
    if not level:
        curves[1] = np.zeros(axes[1].knots)
    products = Products((axes[0], axes[1], axes[2], axes[3]), base, curves)
    total = float(light @ np.maximum(f, 0))
    if total <= 0:
        return 0.0, [0 * curve for curve in curves]
    error = fit_products(products, f, weight, cos_i, rounds)
    a, b, c, d = (axis.at(curve) for axis, curve in zip(axes, products.curves, strict=True))
    kept = [(light @ (a * b)) / total > NEGLIGIBLE, (light @ (base * c * d)) / total > NEGLIGIBLE]
    if not all(kept):
        products.curves = [curve * kept[k // 2] for k, curve in enumerate(products.curves)]
        error = fit_products(products, f, weight, cos_i, rounds)
    return error, products.curves


def _means(values: Floats, weight: Floats, axis: Axis) -> Floats:
    """(knots,) weighted means of values about each knot; taken from neighbours if a knot has none."""
    near = axis.low + (axis.share > 0.5)
    total = np.bincount(near, weights=weight, minlength=axis.knots)
    mean = np.bincount(near, weights=weight * values, minlength=axis.knots) / np.maximum(total, 1e-300)
    knots = np.arange(axis.knots)
    return np.interp(knots, knots[total > 0], mean[total > 0])


def _terms(base: Quotient, channels: list[list[Floats]], side: Side) -> tuple[list[Term], dict[str, Curve]]:
    """Terms of the products that are not black; the curves over theta_o and theta_d are 1 where they are largest."""
    through = " through" if side == "transmission" else ""
    curves: dict[str, Curve] = {}
    terms: list[Term] = []
    for k, names, angles in (
        (0, ("diffuse", "diffuse viewer"), ("theta_i", "theta_o")),
        (2, ("highlight", "fresnel"), ("theta_h", "theta_d")),
    ):
        first, second = (k, k + 1) if k == 0 else (k + 1, k)
        pairs = [(found[first], found[second]) for found in channels]
        if not any(one.any() and other.any() for one, other in pairs):
            continue
        tops = [max(float(other.max()), 1e-300) for _, other in pairs]
        main = [one * top for (one, _), top in zip(pairs, tops, strict=True)]
        rest = [other / top for (_, other), top in zip(pairs, tops, strict=True)]
        names = (f"{names[0]}{through}", f"{names[1]}{through}")
        curves |= {names[0]: _curve(angles[0], main), names[1]: _curve(angles[1], rest)}
        factor = Factor(names[0], angles[0])
        if k == 0:
            terms.append(Term(names[0], One(), factors=(factor,), viewer=names[1], side=side))
        else:
            factors = (factor, Factor(names[1], angles[1]))
            terms.append(Term(f"specular{through}", base, factors=factors, side=side))
    return terms, curves


def _curve(angle: str, channels: list[Floats]) -> Curve:
    """The curve (KNOTS + 1, 3) of one or three channels on equally spaced knots of `_unit`."""
    axis = Axis.of(_unit(angle, angles_rad()), KNOTS[angle])
    columns = np.stack([axis.at(channel) for channel in channels], axis=-1)
    return Curve(np.broadcast_to(columns, (len(columns), 3)))


def _unit(angle: str, value_rad: Floats) -> Floats:
    """Position in [0, 1] of an angle; square-root steps along theta_h, where highlights are narrow."""
    unit = np.asarray(value_rad) / END_RAD
    return np.sqrt(unit) if angle == "theta_h" else unit


def _with_ratios(
    table: MeasuredTable, side: Side, terms: list[Term], curves: dict[str, Curve], progress: Progress
) -> list[Term]:
    """The terms with the shared remainder in their quotients."""
    if not terms:
        return []
    sizes = table.info.sizes
    grid = RATIOS if table.info.isotropic else RATIOS_ANISOTROPIC
    own = [sizes.get(name, 0) for name in ("theta_h", "theta_d", "phi_d")]
    if table.info.isotropic and min(own) > 1:
        grid = Grid(*own)  # MERL's own bins: no resampling
    grid = _reciprocal(grid, table, side)
    wi, wo = grid.raised_directions()
    used = {name: curve for name, curve in curves.items() if any(name in term.curves for term in terms)}
    f = np.maximum(_values(table, side, wi, wo, progress, f"remainder of {table.info.file}"), 0)
    across = FLIP_Z if side == "transmission" else np.ones(3)
    plain = Editable("", tuple(terms), used)
    model = np.concatenate(
        [plain.eval(wi[k : k + AT_ONCE] * across, wo[k : k + AT_ONCE]) for k in range(0, len(wi), AT_ONCE)]
    )
    ratios = np.divide(f, model, out=np.ones_like(model), where=model > 0).clip(0, MOST)
    shared = Tabulated(grid, ratios)
    return [replace(term, quotient=replace(shared, base=term.quotient)) for term in terms]


def _reciprocal(grid: Grid, table: MeasuredTable, side: Side) -> Grid:
    """The grid over the full circle of phi_d, for a table that is not reciprocal."""
    rng = np.random.default_rng(2)
    wi, wo = direction(np.arccos(rng.uniform(0.1, 1, (2, 128))), rng.uniform(0, 2 * np.pi, (2, 128)))
    one, other = _values(table, side, wi, wo), _values(table, side, wo, wi)
    if np.allclose(one, other, rtol=1e-4, atol=1e-6 * float(np.abs(one).max(initial=0))):
        return grid
    return replace(grid, turns_d=2, phi_d=2 * grid.phi_d)


def _values(
    table: MeasuredTable, side: Side, wi: Floats, wo: Floats, progress: Progress = silent, doing: str = ""
) -> Floats:
    """f (N, C) of upper pairs (N, 3), the viewer mirrored for transmission; 0 where not finite."""
    towards = wo * FLIP_Z if side == "transmission" else wo
    parts = []
    for k in range(0, len(wi), AT_ONCE):
        progress(k, len(wi), doing)
        parts.append(np.asarray(table.eval(wi[k : k + AT_ONCE], towards[k : k + AT_ONCE]), float))
    progress(len(wi), len(wi), doing)
    return np.asarray(np.nan_to_num(np.concatenate(parts), nan=0.0, posinf=0.0, neginf=0.0))
