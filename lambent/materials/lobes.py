"""The Kurt lobe: eval, sample, pdf. One implementation for numpy and the JIT path tracer; lobes.wgsl has parts.

Every function takes directions as (x, y, z) component tuples and the array library `ops`: `NUMPY`, or any module with
the same names, such as drjit.

Sources: Kurt, Szirmay-Kalos & Krivanek 2010, "An anisotropic BRDF model for fitting and Monte Carlo rendering";
thesis M ("Real-time rendering of measured materials"), equations in parentheses. GGX: Walter et al. 2007, eq. 33.
Retro lobes use the back vector instead of the half vector: normalize(wi' + wo), with wi' the mirror image of wi about n
(Belcour, Pacanowski, Delahaie, Laville-Geay & Eupherte 2014, JOSA A 31, 2561). They are reciprocal too: swapping the
directions turns the back vector by 180 degrees about n, which leaves D unchanged.

Hazard: tan^2(theta_h) and 1 - cos^2(theta_h) cancel in float32 at low roughness; everything is built from hx^2, hy^2
and hz of the half vector instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from lambent.materials.document import LEAST_M, MOST_M, Distribution, Lobe
from lambent.materials.slope_curve import NODES_RHO, at_cosine, half_density, log_density, quantile

Vector = tuple[Any, Any, Any]  # components x, y, z: floats or arrays of one shape
COS_MIN = 1e-4  # the lobe is 0 for directions closer to the horizon (the cosine power diverges there)


@dataclass(frozen=True)
class ArrayOps:
    """Array functions under drjit's names; table look-ups need the last five as well."""

    exp: Callable[..., Any]
    log: Callable[..., Any]
    sqrt: Callable[..., Any]
    sin: Callable[..., Any]
    cos: Callable[..., Any]
    power: Callable[..., Any]
    abs: Callable[..., Any]
    maximum: Callable[..., Any]
    minimum: Callable[..., Any]
    select: Callable[..., Any]
    cbrt: Callable[..., Any]
    atan2: Callable[..., Any]
    floor: Callable[..., Any]
    gather: Callable[..., Any]  # (flat table, index)
    whole: Callable[..., Any]  # to an integer


NUMPY = ArrayOps(
    np.exp, np.log, np.sqrt, np.sin, np.cos, np.power, np.abs, np.maximum, np.minimum, np.where, np.cbrt, np.arctan2,
    np.floor, lambda table, index: table[index], lambda x: np.asarray(x).astype(np.int64),
)  # fmt: skip


def clamped(unit: Any, count: int, ops: Any = NUMPY) -> list[tuple[Any, Any]]:
    """Indices and weights of the two cells whose centres surround a place in [0, 1]; the outermost beyond them."""
    place = ops.maximum(ops.minimum(unit * count - 0.5, count - 1.0), 0.0)
    low = ops.minimum(ops.floor(place), count - 2.0)
    return [(ops.whole(low), 1 - (place - low)), (ops.whole(low) + 1, place - low)]


def wrapped(turns: Any, count: int, ops: Any = NUMPY) -> list[tuple[Any, Any]]:
    """Likewise for a place in turns, in [0, 1], of an axis that wraps around."""
    place = turns * count - 0.5
    low = ops.floor(place)
    first = ops.select(low < 0, count - 1.0, low)
    second = ops.select(low + 1.5 > count, 0.0, low + 1)
    return [(ops.whole(first), 1 - (place - low)), (ops.whole(second), place - low)]


def dot(a: Vector, b: Vector) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def reflect(w: Vector, about: Vector) -> Vector:
    """`w` mirrored about the unit axis `about`: 2 (w.a) a - w."""
    twice = 2 * dot(w, about)
    return twice * about[0] - w[0], twice * about[1] - w[1], twice * about[2] - w[2]


def sample_cosine(u1: Any, u2: Any, ops: Any = NUMPY) -> Vector:
    """Cosine-distributed direction of the upper hemisphere; u_* uniform in [0, 1)."""
    r, phi = ops.sqrt(u1), 2 * np.pi * u2
    return r * ops.cos(phi), r * ops.sin(phi), ops.sqrt(ops.maximum(1 - u1, 0.0))


def half_vector(wi: Vector, wo: Vector, ops: Any = NUMPY) -> Vector:
    """normalize(wi + wo); finite but meaningless for opposite directions."""
    x, y, z = wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]
    scale = 1 / ops.sqrt(ops.maximum(x * x + y * y + z * z, 1e-20))
    return x * scale, y * scale, z * scale


def fresnel(cos_d: Any, r0: Any, ops: Any = NUMPY) -> Any:
    """Schlick's approximation (2.9); cos_d in [0, 1]."""
    m = ops.maximum(1 - cos_d, 0.0)
    m2 = m * m
    return r0 + (1 - r0) * (m2 * m2 * m)


def density_of_slopes(slope2: Any, lobe: Lobe, ops: Any = NUMPY) -> Any:
    """D h_z^4 pi mx my at the squared slope radius, in units of (mx, my): 1 at the centre of Beckmann and GGX."""
    if lobe.shape is not None:
        return ops.exp(log_density(slope2, lobe.shape, ops))
    if lobe.distribution == "ggx":
        return 1 / ((1 + slope2) * (1 + slope2))
    return ops.exp(-slope2)


def slope_radius(mass: Any, lobe: Lobe, ops: Any = NUMPY) -> Any:
    """The slope radius, in units of (mx, my), inside which `mass` in [0, 1) of the lobe lies (4.6)."""
    if lobe.shape is not None:
        return quantile(mass, lobe.shape, ops)
    return ops.sqrt(mass / (1 - mass)) if lobe.distribution == "ggx" else ops.sqrt(-ops.log(1 - mass))


def spread(lobe: Lobe) -> float:
    """The radius of the half inside which most of a curve lobe's light lies, over Beckmann's; 1 for other lobes."""
    return 1.0 if lobe.shape is None else _spread(lobe.shape)


@lru_cache(maxsize=512)
def _spread(shape: tuple[float, ...]) -> float:
    return float(quantile(np.array(0.5), shape, NUMPY) / np.sqrt(np.log(2)))


def widths(lobe: Lobe) -> tuple[float, float]:
    """The slopes along t and b of a Beckmann lobe that is as wide."""
    return lobe.mx * spread(lobe), lobe.my * spread(lobe)


def widening(lobe: Lobe) -> float:
    """Factor on a small lamp's squared extent, in slopes, that widens a lobe as convolution does: 2 for Beckmann.

    A lobe counts as the Gaussian of its radius at half height: 1.67 times 2 for GGX.
    """
    radius2 = {"beckmann": np.log(2), "ggx": np.sqrt(2) - 1}.get(lobe.distribution) or half_density(lobe.shape or ())
    return float(2 * np.log(2) / radius2)


def with_distribution(lobe: Lobe, name: Distribution) -> Lobe:
    """The lobe with another distribution; the half of it inside which most light lies keeps its radius.

    A curve follows the lobe at its nodes.
    """
    if name == lobe.distribution:
        return lobe
    if name == "curve":
        shape = tuple(np.asarray(density_of_slopes(NODES_RHO**2, lobe)).tolist())
        return lobe.model_copy(update={"distribution": name, "shape": shape})
    plain = lobe.model_copy(update={"distribution": name, "shape": None})
    scale = float(slope_radius(np.array(0.5), lobe) / slope_radius(np.array(0.5), plain))
    mx, my = (min(max(scale * m, LEAST_M), MOST_M) for m in (lobe.mx, lobe.my))
    return plain.model_copy(update={"mx": mx, "my": my})


def distribution(h: Vector, lobe: Lobe, ops: Any = NUMPY) -> Any:
    """Microfacet density D(h), 1/sr: Beckmann (3.3), anisotropic GGX, or a curve."""
    hz2 = ops.maximum(h[2] * h[2], 1e-12)
    slope2 = ((h[0] / lobe.mx) * (h[0] / lobe.mx) + (h[1] / lobe.my) * (h[1] / lobe.my)) / hz2
    return density_of_slopes(slope2, lobe, ops) / (np.pi * lobe.mx * lobe.my * hz2 * hz2)


def sample_half_vector(u1: Any, u2: Any, lobe: Lobe, ops: Any = NUMPY) -> Vector:
    """h with density D(h) h_z from u1, u2 in [0, 1): (4.5, 4.6) written in slopes, without quadrants."""
    r = slope_radius(ops.minimum(u1, 1 - 1e-7), lobe, ops)
    x = r * lobe.mx * ops.cos(2 * np.pi * u2)
    y = r * lobe.my * ops.sin(2 * np.pi * u2)
    scale = 1 / ops.sqrt(x * x + y * y + 1)
    return x * scale, y * scale, scale


def _same_side(wi: Vector, wo: Vector, lobe: Lobe, ops: Any) -> tuple[Vector, Vector, Any]:
    """wi and wo on the upper side (wi mirrored at the surface for transmission), and whether the lobe scatters them.

    The sheet is two-sided: a pair seen from below equals the same pair seen from above. wi of a retro lobe is mirrored
    about n; the rest is then the same as for a reflection lobe.
    """
    across = lobe.side == "transmission"
    same = wi[2] * wo[2] > 0
    valid = (ops.abs(wi[2]) > COS_MIN) & (ops.abs(wo[2]) > COS_MIN) & (~same if across else same)
    x, y = (-wi[0], -wi[1]) if lobe.retro else wi[:2]
    return (x, y, ops.abs(wi[2])), (wo[0], wo[1], ops.abs(wo[2])), valid


def _cosine_power(wi: Vector, wo: Vector, lobe: Lobe, ops: Any) -> Any:
    return ops.power(ops.maximum(wi[2] * wo[2], 1e-12), lobe.alpha)


def shape(wi: Vector, wo: Vector, lobe: Lobe, ops: Any = NUMPY) -> tuple[Any, Any]:
    """The lobe without its Fresnel factor, D/(4 (wo.h) (cos_i cos_o)^alpha) in 1/sr, and cos_d = wo.h."""
    wi, wo, valid = _same_side(wi, wo, lobe, ops)
    h = half_vector(wi, wo, ops)
    cos_d = dot(wo, h)
    value = distribution(h, lobe, ops) / (4 * ops.maximum(cos_d, 1e-6) * _cosine_power(wi, wo, lobe, ops))
    return ops.select(valid, value, 0.0), cos_d


def reflectance(cos_d: Any, lobe: Lobe, channel: int, ops: Any = NUMPY) -> Any:
    """F of a channel: the lobe's curve, or Schlick's approximation; cos_d in [0, 1]."""
    if lobe.fresnel is not None:
        return at_cosine(cos_d, lobe.fresnel[channel], ops)
    return fresnel(cos_d, lobe.r0[channel], ops)


def mean_reflectance(cos_d: Any, lobe: Lobe, ops: Any = NUMPY) -> Any:
    """`reflectance`, averaged over channels."""
    if lobe.fresnel is None:
        return fresnel(cos_d, sum(lobe.r0) / 3, ops)
    return sum(reflectance(cos_d, lobe, c, ops) for c in range(3)) / 3


def passed(cos_d: Any, lobe: Lobe, channel: int, ops: Any = NUMPY) -> Any:
    """Fresnel's factor: F for reflection (3.4), 1 - F for transmission (3.5)."""
    f = reflectance(cos_d, lobe, channel, ops)
    return f if lobe.side == "reflection" else 1 - f


def tint(cos_d: Any, lobe: Lobe, channel: int, ops: Any = NUMPY) -> Any:
    """k times Fresnel's factor."""
    return lobe.k[channel] * passed(cos_d, lobe, channel, ops)


def evaluate(wi: Vector, wo: Vector, lobe: Lobe, ops: Any = NUMPY) -> Vector:
    """f of one lobe in 1/sr per RGB channel, without the cosine (3.4, 3.5)."""
    value, cos_d = shape(wi, wo, lobe, ops)
    red, green, blue = (value * tint(cos_d, lobe, c, ops) for c in range(3))
    return red, green, blue


def sample(wo: Vector, u1: Any, u2: Any, lobe: Lobe, ops: Any = NUMPY) -> Vector:
    """wi = 2 (wo.h) h - wo (4.8), mirrored to the far side for transmission, and about n for a retro lobe.

    A direction on the wrong side of the surface is returned unchanged; `pdf` and `evaluate` are 0 there.
    """
    x, y, z = reflect((wo[0], wo[1], ops.abs(wo[2])), sample_half_vector(u1, u2, lobe, ops))
    side = ops.select(wo[2] > 0, 1.0, -1.0) * (-1.0 if lobe.side == "transmission" else 1.0)
    x, y = (-x, -y) if lobe.retro else (x, y)
    return x, y, z * side


def pdf(wi: Vector, wo: Vector, lobe: Lobe, ops: Any = NUMPY) -> Any:
    """Density of `sample` in 1/sr: D h_z / (4 (wo.h)) (4.9)."""
    wi, wo, valid = _same_side(wi, wo, lobe, ops)
    h = half_vector(wi, wo, ops)
    value = distribution(h, lobe, ops) * h[2] / (4 * ops.maximum(dot(wo, h), 1e-6))
    return ops.select(valid, value, 0.0)
