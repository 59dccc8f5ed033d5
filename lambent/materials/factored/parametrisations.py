"""The angles over which curves are defined, from 0 to 90 degrees (Ben-Artzi 2007, chapter 3).

Functions take directions as component tuples in the local frame and `ops`, as `materials.lobes` does, so that the same
code runs in numpy and in the path tracer; wi and wo are on the upper side. `stretch` is the ratio by which the half
vector is lengthened along t and shortened along b: sqrt(my / mx) turns the ellipses of an anisotropic lobe to circles.

Hazard: arccos of a cosine near 1 loses half the digits in float32; every angle is an arctangent of its sine and cosine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from lambent.materials.lobes import NUMPY, Vector, half_vector


@dataclass(frozen=True)
class Parametrisation:
    """An angle of a pair of directions: `angle(wi, wo, stretch, ops)` in radians.

    `polar` times it is an angle from an axis of rotation, see `Curve.band_means`; 0 if there is no axis.
    """

    title: str
    meaning: str
    angle: Callable[[Vector, Vector, float, Any], Any]
    polar: int = 0


def angle_of(name: str, wi: Vector, wo: Vector, stretch: float = 1.0, ops: Any = NUMPY) -> Any:
    """The angle of that name (a key of `PARAMETRISATIONS`) in radians."""
    return PARAMETRISATIONS[name].angle(wi, wo, stretch, ops)


def _theta_i(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _elevation(wi, ops)


def _theta_o(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _elevation(wo, ops)


def _theta_h(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    x, y, z = half_vector(wi, wo, ops)
    return _elevation((x * stretch, y / stretch, z), ops)


def _theta_d(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _between(wi, wo, ops) / 2


def _theta_r(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _between(wi, (-wo[0], -wo[1], wo[2]), ops)


def _slope_t(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    h = half_vector(wi, wo, ops)
    return ops.atan2(ops.abs(h[0]), h[2])


def _slope_b(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    h = half_vector(wi, wo, ops)
    return ops.atan2(ops.abs(h[1]), h[2])


def _gamma_t(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _power_angle(half_vector(wi, wo, ops), 0, ops)


def _gamma_b(wi: Vector, wo: Vector, stretch: float, ops: Any) -> Any:
    return _power_angle(half_vector(wi, wo, ops), 1, ops)


def _elevation(w: Vector, ops: Any) -> Any:
    """Angle from the normal; 90 degrees below the horizon, which corners of lights can reach."""
    return ops.atan2(ops.sqrt(w[0] * w[0] + w[1] * w[1]), ops.maximum(w[2], 0.0))


def _between(a: Vector, b: Vector, ops: Any) -> Any:
    """Angle between unit vectors: twice the arctangent of |a - b| / |a + b|."""
    apart = [(p - q) * (p - q) for p, q in zip(a, b, strict=True)]
    together = [(p + q) * (p + q) for p, q in zip(a, b, strict=True)]
    return 2 * ops.atan2(ops.sqrt(apart[0] + apart[1] + apart[2]), ops.sqrt(together[0] + together[1] + together[2]))


def _power_angle(h: Vector, axis: int, ops: Any) -> Any:
    """arccos((cos theta_h)^(cos^2 of the angle between h's projection and the axis)) (3.7, 3.8).

    With p the power, 1 - p^2 = 1 - exp(e log(cos^2 theta_h)); both are summed as series where they cancel.
    """
    sin2 = h[0] * h[0] + h[1] * h[1]
    share = ops.select(sin2 > 0, h[axis] * h[axis] / ops.maximum(sin2, 1e-30), 0.0)
    series = -sin2 * (1 + sin2 * (1 / 2 + sin2 * (1 / 3 + sin2 * (1 / 4 + sin2 / 5))))
    exponent = share * ops.select(sin2 < 0.05, series, ops.log(ops.maximum(h[2] * h[2], 1e-30)))
    rest = ops.select(
        exponent > -0.05,
        -exponent * (1 + exponent * (1 / 2 + exponent * (1 / 6 + exponent * (1 / 24 + exponent / 120)))),
        1 - ops.exp(exponent),
    )
    return ops.atan2(ops.sqrt(rest), ops.exp(exponent / 2))


PARAMETRISATIONS = {
    "theta_i": Parametrisation("θ of the light", "angle between the light and the normal", _theta_i),
    "theta_o": Parametrisation("θ of the viewer", "angle between the viewer and the normal", _theta_o),
    "theta_h": Parametrisation("θ half", "angle between the half vector and the normal: the highlight", _theta_h, 1),
    "theta_d": Parametrisation("θ difference", "angle between the light and the half vector: Fresnel", _theta_d, 2),
    "theta_r": Parametrisation("θ mirror", "angle between the light and the mirrored viewer", _theta_r, 1),
    "slope_t": Parametrisation("slope along t", "tilt of the half vector along the brushing direction", _slope_t),
    "slope_b": Parametrisation("slope across t", "tilt of the half vector across the brushing direction", _slope_b),
    "gamma_t": Parametrisation("γ along t", "Ashikhmin and Shirley's highlight along the brushing direction", _gamma_t),
    "gamma_b": Parametrisation("γ across t", "Ashikhmin and Shirley's highlight across it", _gamma_b),
}
