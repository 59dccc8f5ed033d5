"""Names and ranges of the fitted parameters, and the user's restrictions.

Reflection: kd, ks, mx, my, r0, alpha; transmission: kt_d, kt, t_mx, t_my, t_r0, t_alpha; the retro-reflective lobe:
kr, r_mx, r_my, r_r0, r_alpha. From a side's second lobe on, the parameters carry the lobe's number: ks_2, mx_2,
t_alpha_2. kd, kt_d, ks, kt and kr may be one value or three.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.errors import UserError, did_you_mean
from lambent.core.plain import Triple
from lambent.materials.document import LEAST_ALPHA, SIDES, Kind

Value = float | Triple
Fixed = Mapping[str, Value]
Ranges = Mapping[str, tuple[float, float]]

SHAPE = ("mx", "my", "r0", "alpha")  # the axes of the search, in this order
BOUNDS = {"mx": (0.003, 1.5), "my": (0.003, 1.5), "r0": (0.004, 1.0), "alpha": (0.0, 1.0)}
RETRO_BOUNDS = BOUNDS | {"mx": (0.001, 1.5), "my": (0.001, 1.5), "alpha": (LEAST_ALPHA, 1.0)}
LEGAL = {"mx": (0.001, 4.0), "my": (0.001, 4.0), "r0": (0.0, 1.0), "alpha": (0.0, 1.0)}
RETRO_LEGAL = LEGAL | {"alpha": (LEAST_ALPHA, 1.0)}
LEGAL_COEFFICIENT = (0.0, 1e6)
R0_FLOOR = 1e-6  # the search uses the logarithm of r0
LOGARITHMIC = np.array([True, True, True, False])


def to_search(shape: Floats) -> Floats:
    """(..., 4) mx, my, r0, alpha -> coordinates of the search: logarithms of the first three."""
    return np.where(LOGARITHMIC, np.log(np.maximum(shape, R0_FLOOR)), shape)


def from_search(coordinates: Floats) -> Floats:
    """Inverse of `to_search`."""
    return np.where(LOGARITHMIC, np.exp(np.where(LOGARITHMIC, coordinates, 0)), coordinates)


def parameter(kind: Kind, base: str, index: int = 0) -> str:
    """The user's name of a lobe's parameter; `base` is in `SHAPE` or "k", `index` counts lobes of the kind from 0."""
    coefficient, prefix = {"reflection": ("ks", ""), "transmission": ("kt", "t_"), "retro": ("kr", "r_")}[kind]
    name = coefficient if base == "k" else prefix + base
    return name if index == 0 else f"{name}_{index + 1}"


def is_of_retro(name: str) -> bool:
    """Whether a parameter belongs to the retro-reflective lobe."""
    return name.startswith(("kr", "r_"))


def known_parameters(lobes: int) -> list[str]:
    """All names that `fix` and `ranges` may have for this many lobes per side."""
    names = [parameter(side, base, i) for side in SIDES for i in range(lobes) for base in ("k", *SHAPE)]
    return ["kd", "kt_d", *names, *(parameter("retro", base) for base in ("k", *SHAPE))]


@dataclass(frozen=True)
class Box:
    """Search space of one lobe.

    Attributes
    ----------
    lo, hi : (4,) float64
        Bounds in search coordinates; equal if the parameter is fixed.
    tied : bool
        Whether my equals mx (isotropic).
    k_limits : tuple of (float, float)
        Interval of the coefficient per channel.
    retro : bool
        Whether the lobe is centred on the direction to the light.
    """

    lo: Floats
    hi: Floats
    tied: bool
    k_limits: tuple[tuple[float, float], ...]
    retro: bool = False


def box_of(side: Kind, index: int, isotropic: bool, channels: int, fix: Fixed, ranges: Ranges) -> Box:
    """The search box of a lobe under the user's restrictions.

    For an isotropic table my equals mx unless the user restricts my. r0 of a transmission lobe is fixed at 0 unless the
    user restricts it: with Schlick's F, the lobe (3.5) has kt (1 - F(u)) = kt (1 - r0) (1 - (1 - u)^5), so only the
    product kt (1 - r0) can be measured, and kt stands for that product. r0 of a retro lobe is likewise fixed at 1:
    prisms reflect totally, and alpha alone determines the fall-off towards grazing.
    """
    restrictions, bounds = dict(fix), RETRO_BOUNDS if side == "retro" else BOUNDS
    if side != "reflection" and parameter(side, "r0", index) not in {**fix, **ranges}:
        restrictions[parameter(side, "r0", index)] = 0.0 if side == "transmission" else 1.0
    lo, hi = np.zeros(4), np.zeros(4)
    for axis, base in enumerate(SHAPE):
        name = parameter(side, base, index)
        lo[axis], hi[axis] = ranges.get(name, bounds[base])
        if name in restrictions:
            lo[axis] = hi[axis] = scalar(restrictions[name], name)
    tied = isotropic and parameter(side, "my", index) not in {**fix, **ranges}
    name = parameter(side, "k", index)
    if name in fix:
        k_limits = tuple((value, value) for value in per_channel(fix[name], channels))
    else:
        k_limits = (ranges.get(name, (0.0, np.inf)),) * channels
    return Box(to_search(lo), to_search(hi), tied, k_limits, side == "retro")


def scalar(value: Value, name: str) -> float:
    if isinstance(value, tuple):
        raise UserError("takes one value", field=name, got=value)
    return float(value)


def per_channel(value: Value, channels: int) -> tuple[float, ...]:
    """A coefficient as one value per channel."""
    if not isinstance(value, tuple):
        return (float(value),) * channels
    return value if channels == 3 else (sum(value) / 3,) * channels


def check(fix: Fixed, ranges: Ranges, lobes: int) -> None:
    """Raise `UserError` if a name is unknown, a value illegal, or a parameter both fixed and ranged."""
    known = known_parameters(lobes)
    for name in [*fix, *ranges]:
        if name not in known:
            hint = did_you_mean(name, known) or f"known: {', '.join(known)}"
            raise UserError("unknown parameter", field=name, hint=hint)
    both = sorted(set(fix) & set(ranges))
    if both:
        raise UserError("both fixed and given a range", field=both[0])
    for name, value in fix.items():
        for one in value if isinstance(value, tuple) else (value,):
            _check_value(name, one)
    for name, (lo, hi) in ranges.items():
        if name in ("kd", "kt_d"):
            raise UserError(
                "diffuse terms are read from the histogram and take no range", field=name, hint="fix it instead"
            )
        _check_value(name, lo)
        _check_value(name, hi)
        if lo >= hi:
            raise UserError("empty range", field=name, got=f"{lo}:{hi}", expected="lo < hi")


def _check_value(name: str, value: float) -> None:
    base = re.sub(r"(^[tr]_)|(_\d+$)", "", name)
    lo, hi = (RETRO_LEGAL if is_of_retro(name) else LEGAL).get(base, LEGAL_COEFFICIENT)
    if not lo <= value <= hi:  # False for NaN as well
        raise UserError("value out of bounds", field=name, got=value, expected=f"{lo} to {hi:g}")


def parse_fix(options: Iterable[str]) -> dict[str, Value]:
    """{'mx': .1, 'kd': (.1, .2, .3)} from options such as 'mx=.1' and 'kd=.1,.2,.3'; `UserError` if malformed."""
    fix: dict[str, Value] = {}
    for option in options:
        name, text = _split(option, "name=value")
        values = tuple(_number(part, name) for part in text.split(","))
        if len(values) not in (1, 3):
            raise UserError("takes one value or three", field=name, got=text)
        fix[name] = values[0] if len(values) == 1 else (values[0], values[1], values[2])
    return fix


def parse_ranges(options: Iterable[str]) -> dict[str, tuple[float, float]]:
    """{'mx': (.05, .3)} from options such as 'mx=.05:.3'; `UserError` if malformed."""
    ranges = {}
    for option in options:
        name, text = _split(option, "name=lo:hi")
        ends = text.split(":")
        if len(ends) != 2:
            raise UserError("not a range", field=name, got=text, expected="lo:hi")
        ranges[name] = (_number(ends[0], name), _number(ends[1], name))
    return ranges


def _split(option: str, expected: str) -> tuple[str, str]:
    name, equals, text = option.partition("=")
    if not equals or not name.strip():
        raise UserError("cannot be read", field=option, expected=expected)
    return name.strip(), text


def _number(text: str, name: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UserError("not a number", field=name, got=text) from None
