"""Base of the analytic models: named parameters with their bounds, eval, sample and pdf on arrays; shared formulas.

Conventions: directions (..., 3) in the local frame, wi to the light, wo to the viewer, f in 1/sr without the cosine,
one row of RGB per direction. A model is two-sided unless it says otherwise.

A parameter's metadata is defined once, in its model; validation, sliders and documentation use it.
"""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np

from lambent.core.arrays import Flags
from lambent.core.arrays import Floats as Floats  # re-exported for models
from lambent.core.errors import UserError, did_you_mean
from lambent.core.geometry.directions import half_vector, normalize, raised, reflect
from lambent.core.geometry.sequences import cosine_hemisphere
from lambent.core.plain import Triple, triple

LOWEST_COSINE = 1e-9  # keeps 1/cos finite


@dataclass(frozen=True)
class Pair:
    """wi and wo on the upper side with their half vector.

    Attributes
    ----------
    wi, wo, h : (..., 3)
        Unit; z of wi and wo at least LOWEST_COSINE.
    cos_i, cos_o, cos_h, cos_d : (...)
        wi.n, wo.n, h.n, and wo.h.
    seen : (...) bool
        Whether both directions are on one side of the surface.
    """

    wi: Floats
    wo: Floats
    h: Floats
    cos_i: Floats
    cos_o: Floats
    cos_h: Floats
    cos_d: Floats
    seen: Flags


def upper(wi: Floats, wo: Floats) -> Pair:
    """The pair (..., 3) seen from above; a two-sided surface scatters identically from below."""
    seen = np.asarray(wi[..., 2] * wo[..., 2] > 0)
    up_i, up_o = np.broadcast_arrays(raised(wi), raised(wo))
    up_i, up_o = (np.maximum(w, (-np.inf, -np.inf, LOWEST_COSINE)) for w in (up_i, up_o))
    h = half_vector(up_i, up_o)
    cos_d = np.maximum(np.sum(up_o * h, axis=-1), LOWEST_COSINE)
    return Pair(up_i, up_o, h, up_i[..., 2], up_o[..., 2], h[..., 2], cos_d, seen)


def beckmann(h: Floats, mx: float, my: float) -> Floats:
    """Beckmann's distribution of the normals h (..., 3) with slopes mx, my, in 1/sr.

    tan^2(theta_h) is computed from the components of h, which avoids cancellation.
    """
    slope2 = ((h[..., 0] / mx) ** 2 + (h[..., 1] / my) ** 2) / np.maximum(h[..., 2] ** 2, 1e-12)
    return np.asarray(np.exp(-slope2) / (np.pi * mx * my * np.maximum(h[..., 2] ** 4, 1e-24)))


def sample_beckmann(u1: Floats, u2: Floats, mx: float, my: float) -> Floats:
    """h (..., 3) with density beckmann(h) h.z from u1, u2 uniform in [0, 1) (Ward 1992, eqs 6, 7, in slopes)."""
    r, phi = np.sqrt(-np.log1p(-np.minimum(u1, 1 - 1e-12))), 2 * np.pi * u2
    return normalize(np.stack([mx * r * np.cos(phi), my * r * np.sin(phi), np.ones_like(r)], axis=-1))


def reflected(wo: Floats, h: Floats) -> Floats:
    """wi = wo mirrored about h (..., 3), which is on the upper side; wi.z = 0 if that falls below the surface."""
    wi = reflect(raised(wo), h)
    wi[..., 2] = np.maximum(wi[..., 2], 0.0) * np.where(wo[..., 2] > 0, 1.0, -1.0)
    return wi


def sample_cosine(wo: Floats, u: Floats) -> Floats:
    """wi (..., 3) of a diffuse surface, on the side of wo, from u (..., 2) uniform in [0, 1)."""
    wi = cosine_hemisphere(u)
    wi[..., 2] *= np.where(wo[..., 2] > 0, 1.0, -1.0)
    return wi


def cosine_pdf(wi: Floats, wo: Floats) -> Floats:
    """Density (...) of `sample_cosine` in 1/sr."""
    return np.asarray(np.where(wi[..., 2] * wo[..., 2] > 0, np.abs(wi[..., 2]) / np.pi, 0.0))


Value = float | Triple

PROPERTIES: dict[str, str] = {
    "reciprocal": "f does not change when wi and wo are swapped",
    "sampled": "samples follow pdf, and the albedo by sampling is the albedo by quadrature",
    "passive": "no direction returns more light than arrives, for any parameters within their bounds",
    "lossless": "with the parameters of `white`, all light returns from every direction",
}


@dataclass(frozen=True)
class Parameter:
    """One user-controlled parameter. `rgb` parameters take one value per channel; `scale` is for sliders and fits."""

    name: str
    low: float
    high: float
    default: float
    meaning: str
    unit: str = "1"
    scale: Literal["linear", "log"] = "linear"
    rgb: bool = False

    def checked(self, value: object) -> Value:
        """`value` as float, or as RGB for an rgb parameter; raises `UserError` if it is out of bounds."""
        try:
            numbers = np.asarray(value, float)
        except (TypeError, ValueError):
            numbers = np.array(np.nan)
        shapes: list[tuple[int, ...]] = [(), (3,)] if self.rgb else [()]
        if numbers.shape not in shapes or not np.all((numbers >= self.low) & (numbers <= self.high)):
            expected = f"a number{' or RGB' if self.rgb else ''} from {self.low:g} to {self.high:g}"
            raise UserError(self.meaning, field=self.name, got=value, expected=expected)
        return triple(np.broadcast_to(numbers, 3)) if self.rgb else float(numbers)


class Model(ABC):
    """A scattering model with its parameter values; subclasses set the class variables."""

    name: ClassVar[str]
    title: ClassVar[str]
    source: ClassVar[str]  # author, year, title, equations
    parameters: ClassVar[tuple[Parameter, ...]]
    white: ClassVar[Mapping[str, Value]]  # parameters with which everything should be reflected
    known_deficiencies: ClassVar[Mapping[str, str]] = {}  # name in PROPERTIES -> why the model lacks it

    def __init__(self, **values: object) -> None:
        known = {p.name: p for p in self.parameters}
        for name in values:
            if name not in known:
                hint = did_you_mean(name, known)
                raise UserError(f"the {self.name} model has no such parameter", field=name, hint=hint)
        self.values: dict[str, Value] = {n: p.checked(values.get(n, p.default)) for n, p in known.items()}

    def number(self, name: str) -> float:
        """The value of a scalar parameter."""
        value = self.values[name]
        assert isinstance(value, float), f"{name} is an RGB parameter"
        return value

    def rgb(self, name: str) -> Floats:
        """The value (3,) of an RGB parameter."""
        return np.asarray(self.values[name])

    @abstractmethod
    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3) in 1/sr, without the cosine."""

    @abstractmethod
    def pdf(self, wi: Floats, wo: Floats) -> Floats:
        """Density (...) in 1/sr of `sample` given wo; 0 for directions that are never drawn."""

    @abstractmethod
    def sample(self, wo: Floats, u: Floats) -> Floats:
        """wi (..., 3) from wo (..., 3) and u (..., 3) uniform in [0, 1); rejected samples have wi.z = 0 or pdf 0."""

    @classmethod
    def shader(cls) -> str | None:
        """WGSL of the model, from the .wgsl file beside its module; None if there is none."""
        file = Path(inspect.getfile(cls)).with_suffix(".wgsl")
        return file.read_text(encoding="utf-8") if file.is_file() else None
