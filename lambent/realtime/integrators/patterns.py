"""Sample patterns of a lobe, as tables that the integrators' shaders read.

A table has one row (x, y, z, w) per sample:
    x, y   slopes of the half vector, h = normalize(x, y, 1)
    z      half the log2 of the filter constant c: the sample looks up the solid angle c (wo.h) h_z^3 sr
    w      weight of the sample, of mean 1; in the thesis's estimates the density of slopes, exp(-r^2) for Beckmann
with r the slope in units of (mx, my). Rows depend on the lobe alone, so the shader computes no exp, ratio or border.

Sources: thesis M, section 4.4.3 (eqs 4.10-4.17); Colbert & Krivanek 2007, "GPU-based importance sampling".
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.sequences import hammersley
from lambent.materials.document import Lobe, Material
from lambent.materials.lobes import density_of_slopes, slope_radius, widths

RINGS: dict[int, tuple[int, ...]] = {
    1: (1,), 3: (3,), 5: (1, 4), 7: (1, 6), 9: (2, 7), 11: (1, 5, 5), 13: (1, 6, 6), 15: (1, 7, 7), 17: (1, 8, 8),
    19: (1, 6, 6, 6), 40: (1, 13, 13, 13),
}  # fmt: skip
FEW = 10  # up to this number of samples, the rings of curve lobes are fitted
VIEWER = 2 / 3  # cos_o of their viewer, its mean over a surface's projected area
APART2 = 6.0, 24.0  # squared distance of a fitted ring's samples over their filters' variance; the latter shows them
COS_MIN = 1e-4  # LAMBENT_COS_MIN
N_MAX = 64
LINE_RATIO, LINE_BLEND = 3.0, 4 / 3  # ratio of roughnesses where rings turn into a line, at n = 7; width of the blend
CENTRE_WEIGHT, CENTRE_WEIGHT_FEW = 1.8, 1.3  # of the centre sample, relative to the mean; the latter below 7 samples
STRETCH = {3: 0.89, 5: 0.89, 7: 0.92}  # factor on the rings' radii; .93 for other n, .97 for many samples
BIAS = {3: 0.5, 5: 0.6, 7: 0.75, 11: 0.75}  # filter size relative to filters that cover the lobe; .9 for other n
MANY = 30  # from this number of samples on, filters hardly blur
LINE_TEMPER = 1.16  # tau sqrt(n), see `line_pattern`
LINE_POINTS = 4096  # of a lobe, whose quantiles place the samples of its line
BORDER_MASS = 0.01  # share of the lobe outside its border (4.10)
RING_XI1 = 0.6  # the thesis's ring, 40 % of the way to the border


def ring_counts(n: int, is_fitted: bool = False) -> tuple[int, ...]:
    """Samples per ring, from the centre outwards: tested splits, or a centre and rings of about 7 (fitted: 4)."""
    if n in RINGS and not is_fitted:
        return RINGS[n]
    rings = max(1, round((n - 1) / (4 if is_fitted else 7)))
    outer = [(n - 1) // rings + (1 if j >= rings - (n - 1) % rings else 0) for j in range(rings)]
    return (1, *outer) if n > 1 else (1,)


@dataclass(frozen=True)
class Pattern:
    """n samples of a lobe: slopes (n, 2) in units of (mx, my), filter factors S (n,) (see `table`), weights (n,)."""

    slopes: Floats
    factor: Floats
    weight: Floats


def ring_pattern(n: int, lobe: Lobe) -> Pattern:
    """A centre and staggered rings; each ring's radius halves its mass.

    Ring samples carry equal mass, the centre more: 1.8/n of the lobe, by experiment. Filters of .6 of the covering size
    are the sharpest, but break the highlight of a small lamp into one piece per sample. Filters of `ring_bias` keep it
    nearly whole, and `ring_stretch` shrinks the rings to preserve the lobe's width. Few samples of a curve are fitted.
    """
    if lobe.shape is not None and n <= FEW:
        return fitted_pattern(n, lobe)
    counts = ring_counts(n)
    centred = counts[0] == 1 and n > 1
    centre = 0.0 if not centred else CENTRE_WEIGHT_FEW if n < 7 else CENTRE_WEIGHT
    weight = np.full(n, (n - centre) / (n - centred))
    radii, before = [], 0.0
    for j, count in enumerate(counts):
        if j == 0 and count == 1:
            r, mass = 0.0, centre or 1.0
            weight[0] = mass
        else:
            mass = count * weight[-1]
            r = ring_stretch(n) * float(slope_radius(min((before + mass / 2) / n, 0.9999), lobe))
        radii.append(r)
        before += mass
    points = staggered(counts, radii)
    return Pattern(points, ring_bias(n) * weight / density(points, lobe), weight)


def staggered(counts: tuple[int, ...], radii: Sequence[float] | Floats) -> Floats:
    """(n, 2) points of rings of `counts` samples."""
    turns = [(np.arange(count) + (0.5 if j % 2 else 0)) / count for j, count in enumerate(counts)]
    return np.concatenate([polar(r, 2 * np.pi * turn) for r, turn in zip(radii, turns, strict=True)])


def fitted_pattern(n: int, lobe: Lobe) -> Pattern:
    """A centre and staggered rings that come closest to a curve lobe: to its core, its tail, its flat top."""
    counts, m = ring_counts(n, is_fitted=True), float(np.sqrt(lobe.mx * lobe.my))
    alike = Lobe(mx=m, my=m, alpha=lobe.alpha, retro=lobe.retro, distribution="curve", shape=lobe.shape)
    weights, radii, variances = fitted_rings(counts, alike)
    factor, weight = (np.repeat(each, counts) for each in (4 * n / np.pi * variances, n * weights / counts))
    return Pattern(staggered(counts, radii), factor, weight)


@lru_cache(maxsize=256)
def fitted_rings(counts: tuple[int, ...], lobe: Lobe) -> Floats:
    """(3, J): weights of sum 1, radii, and variances of filters, of rings of `counts` samples; slopes over mx = my.

    A look-up of solid angle w blurs like a Gaussian of variance w/4 (cube_mips.py), so r^2 of what a ring sees has a
    known mean and variance; its law is nearly that of Nakagami, a gamma distribution. The rings' shares and scales
    minimise the squared difference of their law from the lobe's, integrated over r (Cramer's distance).
    """
    from scipy import optimize, special

    rho, inside, gain = shown_radii(lobe)
    at = np.geomspace(0.02, 1.5 * np.interp(0.999, inside, rho), 32)
    rings, count, wanted = len(counts), np.array(counts), np.interp(at, rho, inside)

    def parts(x: Floats) -> tuple[Floats, Floats, Floats]:
        shares, edge = np.exp(np.append(x[: rings - 1], 0.0)), x[-1]
        gap2 = 4 * np.sin(np.pi / count) ** 2 / (APART2[0] ** (1 - edge) * APART2[1] ** edge)
        return shares / shares.sum(), np.exp(x[rings - 1 : -1, None]), np.where(count > 1, 1 / (1 + 2 * gap2), 0.0)

    def difference(x: Floats) -> Floats:
        shares, scales, tight = parts(x)
        k = 1 / (1 - tight[:, None] ** 2)
        return np.asarray((shares @ special.gammainc(k, k / 2 * (at / scales) ** 2) - wanted) * np.sqrt(at))

    middles = np.log(np.interp((np.arange(rings) + 0.5) / rings, inside, rho))
    start, most = np.concatenate([np.zeros(rings - 1), middles, [0.5]]), np.append(np.full(2 * rings - 1, 12.0), 1.0)
    bounds = np.append(-most[:-1], 0), most
    found = optimize.least_squares(difference, start, bounds=bounds, max_nfev=60, xtol=1e-3, ftol=1e-3)
    shares, scales, tight = parts(found.x)  # tight: what its radius makes of the variance of what a ring sees
    radii = scales[:, 0] * np.sqrt(2 * tight)
    weights = shares / np.maximum(np.interp(radii, rho, gain), 0.1)
    return np.stack([weights / weights.sum(), radii, scales[:, 0] ** 2 * (1 - tight)])


def shown_radii(lobe: Lobe) -> tuple[Floats, Floats, Floats]:
    """Radii (N,), the share (N,) of a lobe's light above the horizon within, and the gain (N,) there, by VIEWER."""
    beyond = (np.arange(500)[::-1] + 0.5) / 500
    rho = slope_radius(1 - beyond * beyond, lobe)
    slopes, azimuths = polar(rho * lobe.mx, np.zeros(500)), (np.arange(8) + 0.5) / 8 * np.pi
    gain = np.mean([gains(lobe, slopes, np.array([VIEWER]), phi)[1][0] for phi in azimuths], axis=0)
    inside = np.cumsum(beyond * np.maximum(gain, 1e-6))  # a lobe may lie below the horizon
    return rho, inside / inside[-1], gain


def ring_bias(n: int) -> float:
    """Factor on the filters of n ring samples; 1 covers the lobe. Chosen by eye for each n."""
    return BIAS.get(n, 0.9 if n < MANY else 1.0)


def ring_stretch(n: int) -> float:
    """Factor on ring radii of n samples; 1 puts each ring at the half of its mass."""
    return STRETCH.get(n, 0.93 if n < MANY else 0.97)


def line_pattern(n: int, lobe: Lobe) -> Pattern:
    """Samples on the x axis, for lobes much longer than wide.

    The marginal of a Beckmann lobe is p = exp(-x^2). Samples of density p would leave its tails to one or two samples.
    So the density is p^tau and the weight p^(1 - tau): close to the trapezium rule, which is exact to many digits for a
    Gaussian. tau, the filters and their growth outwards are by experiment. Other lobes, whose tails are long, keep
    samples of equal mass and the thesis's filter, narrowed by one level.
    """
    from scipy.special import erfinv

    t = (2 * np.arange(n) + 1) / n - 1
    if lobe.distribution == "beckmann":
        tau = min(1.0, LINE_TEMPER / np.sqrt(n))
        x = erfinv(t) / np.sqrt(tau)
        weight = np.exp(-(1 - tau) * x * x)
        weight /= weight.mean()
        factor = min(0.45 + 0.027 * n, 1.0) * np.exp(0.25 * x * x)
    else:
        half = np.quantile(np.abs(lobe_points(LINE_POINTS, lobe)[:, 0]), np.abs(t))
        x = np.sign(t) * half
        weight, factor = np.ones(n), np.full(n, -np.log(BORDER_MASS) / 4)
    return Pattern(np.stack([x, np.zeros(n)], axis=-1), factor, weight)


def density(slopes: Floats, lobe: Lobe) -> Floats:
    """Density of slopes (n, 2) in units of (mx, my), times pi: 1 at the centre of Beckmann and GGX."""
    return np.asarray(density_of_slopes(np.sum(slopes * slopes, axis=-1), lobe))


def line_share(lobe: Lobe, n: int) -> float:
    """0 for rings, 1 for a line, smooth in my/mx between, so that nothing pops while a slider moves.

    More samples on rings cover longer lobes: by experiment, the change is at a ratio of 3 sqrt(n/7).
    """
    middle = np.log(LINE_RATIO * np.sqrt(n / 7))
    s = float(np.clip((abs(np.log(lobe.my / lobe.mx)) - middle) / (2 * np.log(LINE_BLEND)) + 0.5, 0, 1))
    return s * s * (3 - 2 * s)


def along_axis(slopes: Floats, lobe: Lobe) -> tuple[Floats, NDArray[np.integer]]:
    """Slopes with x along the lobe's long axis, and the order of the samples along it.

    Both patterns are sorted along the long axis, so that a blend moves the k-th sample of one to the k-th of the other.
    """
    turned = slopes if lobe.mx >= lobe.my else slopes[:, ::-1]
    return turned, np.lexsort((turned[:, 1].round(9), turned[:, 0].round(9)))


def blended(rings: Floats, line: Floats, lobe: Lobe) -> Floats:
    """Slopes (n, 2) blended between a ring pattern and a line along x by the lobe's anisotropy."""
    share = line_share(lobe, len(rings))
    if share == 0:
        return rings
    turned, order = along_axis(rings, lobe)
    mixed = (1 - share) * turned[order] + share * line
    return np.asarray(mixed if lobe.mx >= lobe.my else mixed[:, ::-1])


def table(slopes: Floats, filter_factor: Floats, lobe: Lobe, fourth: Floats | None = None) -> Floats:
    """Rows (x, y, z, w) of samples at slopes (n, 2) in units of (mx, my), each of solid angle S/(n pdf).

    `fourth` is w; 1 by default.
    """
    n = len(slopes)
    constant = filter_factor * 4 * np.pi * lobe.mx * lobe.my / n
    w = np.ones(n) if fourth is None else fourth
    return np.column_stack([slopes * [lobe.mx, lobe.my], 0.5 * np.log2(constant), w]).astype(np.float32)


def rings_table(lobe: Lobe, n: int) -> Floats:
    """Table of the `rings` integrator: rings, or a line for lobes much longer than wide."""
    rings, line = ring_pattern(n, lobe), line_pattern(n, lobe)
    share = line_share(lobe, n)
    order = along_axis(rings.slopes, lobe)[1] if share > 0 else np.arange(n)
    factor = np.exp((1 - share) * np.log(rings.factor[order]) + share * np.log(line.factor))
    weight = (1 - share) * rings.weight[order] + share * line.weight
    return table(blended(rings.slopes, line.slopes, lobe), factor, lobe, weight)


def gains(lobe: Lobe, slopes: Floats, cos_o: Floats, phi_rad: float = 0.0) -> tuple[Floats, Floats]:
    """cos_d = wo.h, and f cos_i/pdf without k and Fresnel: both (views, n), for half vectors with slopes (n, 2).

    Viewers are at cos_o (views,) and azimuth `phi_rad`. Directions below the horizon have gain 0.
    """
    h = normalize(np.column_stack([slopes, np.ones(len(slopes))]))
    cos_o = cos_o[:, None]
    cos_d = np.sqrt(1 - cos_o**2) * (h[:, 0] * np.cos(phi_rad) + h[:, 1] * np.sin(phi_rad)) + cos_o * h[:, 2]
    cos_i = 2 * cos_d * h[:, 2] - cos_o
    seen = (cos_d > COS_MIN) & (cos_i > COS_MIN)
    safe = np.where(seen, cos_i, 1.0)
    return cos_d, np.where(seen, safe / ((safe * cos_o) ** lobe.alpha * h[:, 2]), 0.0)


def lobe_points(n: int, lobe: Lobe) -> Floats:
    """Hammersley points distributed by the lobe: (n, 2) slopes in units of (mx, my)."""
    u1, u2 = hammersley(n).T
    return polar(slope_radius(u1, lobe), 2 * np.pi * u2)


def fis_table(lobe: Lobe, n: int) -> Floats:
    """Filtered importance sampling (Colbert & Krivanek 2007): Hammersley points, filter 1/(n pdf), no bias."""
    slopes = lobe_points(n, lobe)
    return table(slopes, 1 / density(slopes, lobe), lobe)


def lobe_table(lobe: Lobe, n: int) -> Floats:
    """The thesis's pattern within the lobe's border: a centre and a ring, or a line, equally spaced in angle."""
    ring = polar(1 - RING_XI1, 2 * np.pi * np.arange(n - 1) / max(1, n - 1))
    return lobe_table_at(lobe, np.concatenate([np.zeros((1, 2)), ring]))


def lobe_table_at(lobe: Lobe, ring: Floats) -> Floats:
    """`lobe_table` with another pattern: points (n, 2) in the unit disc, with the lobe's border at radius 1."""
    n = len(ring)
    t = (2 * np.arange(n) + 1) / n - 1
    of_border = blended(ring, np.stack([t, np.zeros(n)], axis=-1), lobe)
    share = np.hypot(of_border[:, 0], of_border[:, 1])  # 1 - xi1 (4.13)
    at_border = np.divide(of_border, share[:, None], out=np.zeros_like(of_border), where=share[:, None] > 0)
    limit = at_border * border(lobe)
    length = np.hypot(limit[:, 0], limit[:, 1])
    tangent = np.tan(share * np.arctan(length))  # slope = tan(theta_h)
    scale = np.divide(tangent, length, out=np.zeros_like(length), where=length > 0)
    slopes = limit * scale[:, None] / [lobe.mx, lobe.my]
    return table(slopes, np.ones(n), lobe, density(slopes, lobe))


def polar(r: Any, phi_rad: Floats) -> Floats:
    """(n, 2) points at radii r, a number or (n,), and angles (n,), rad."""
    return np.stack([r * np.cos(phi_rad), r * np.sin(phi_rad)], axis=-1)


def border(lobe: Lobe) -> Floats:
    """Slopes (2,) along t and b of the lobe's border, which leaves 1 % of the lobe outside (4.10)."""
    return float(slope_radius(1 - BORDER_MASS, lobe)) * np.array([lobe.mx, lobe.my])


def automatic_n(material: Material, roughness: float = 1.0, without_lamps: bool = False) -> int:
    """Samples per lobe for a material; grows with the width of its widest lobe times `roughness`.

    Fewer suffice with `without_lamps`, for light that holds no lamps (docs/decisions/lamps-in-closed-form.md).
    """
    m = roughness * max((max(widths(lobe)) for lobe in material.lobes), default=0.0)
    steps = ((0.004, 1), (0.015, 3), (0.04, 5), (0.1, 7), (0.2, 11), (0.35, 15))
    n = next((n for limit, n in steps if m <= limit), 19)
    return min(n, 3 if n <= 11 else 5) if without_lamps else n
