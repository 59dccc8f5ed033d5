"""Error metrics between a measured table and a model, by name.

Every metric is E = (mean over channels of sum_t w_t |T(c_t f_measured) - T(c_t f_model)|^p)^(1/p) over the tuples t
that were measured: a weight w_t per tuple (its solid angle over the sum of all, so only ratios matter), a cosine c_t, a
transform T and a power p. The search needs these four parts, not only the sum; that is why they are named here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lambent.core.errors import UserError, did_you_mean
from lambent.materials.measured.protocol import MeasuredSamples

Floats = NDArray[np.floating]

BLOCK = 8192  # tuples looked at together: what is computed of them stays in the processor's cache
CUBEROOT_EPS = 1e-5  # keeps the slope of the cube root finite where nothing is scattered


def _same(x: Any) -> Any:
    return x


def _one(x: Any) -> Any:
    return np.ones_like(x)


@dataclass(frozen=True)
class Metric:
    """One error metric.

    Attributes
    ----------
    name, unit, source : str
        How it is called, the unit of E, and where it comes from.
    power : 1 or 2
    cosine : "wi" or "wo"
        Whose cosine multiplies f before the transform.
    weigh_cos_i : bool
        Whether |cos theta_i| multiplies the weight as well.
    transform, slope : callable
        T and its derivative, of f cos >= 0 in 1/sr.
    """

    name: str
    unit: str
    source: str
    power: Literal[1, 2]
    cosine: Literal["wi", "wo"]
    weigh_cos_i: bool
    transform: Callable[[Any], Any]
    slope: Callable[[Any], Any]

    @property
    def linear(self) -> bool:
        """Whether T is the identity, so that the best coefficient has a closed form."""
        return self.transform is _same

    def terms(self, samples: MeasuredSamples) -> tuple[Floats, Floats]:
        """(w, c) of every tuple, each (N,)."""
        cos_i = np.abs(samples.wi[:, 2])
        w = samples.weight / samples.weight.sum()
        if self.weigh_cos_i:
            w = w * cos_i
        return w, cos_i if self.cosine == "wi" else np.abs(samples.wo[:, 2])

    def error(self, samples: MeasuredSamples, f_model: Floats) -> float:
        """E of a model's f (N, C) in 1/sr at the tuples of `samples`, in `unit`."""
        w, c = self.terms(samples)
        total = 0.0
        for start in range(0, len(w), BLOCK):
            part = slice(start, start + BLOCK)
            measured, model = (self.transform(c[part, None] * f[part]) for f in (samples.f, f_model))
            total += float(np.mean(w[part] @ np.abs(measured - model) ** self.power))
        return float(total ** (1 / self.power))


L1 = Metric("l1", "1/sr", "thesis, eq. 3.7", 1, "wo", True, _same, _one)
L2_NGAN = Metric("l2_ngan", "1/sr", "Ngan, Durand & Matusik 2005, section 3", 2, "wi", False, _same, _one)
CUBEROOT = Metric(
    "cuberoot",
    "(1/sr)^(1/3)",
    "Fores, Ferwerda & Gu 2012: cosine-weighted L2 of the cube root",
    2,
    "wi",
    False,
    lambda x: np.cbrt(x + CUBEROOT_EPS),
    lambda x: np.cbrt(x + CUBEROOT_EPS) / (3 * (x + CUBEROOT_EPS)),
)
LOG = Metric(
    "log",
    "ln(1 + sr^-1)",
    "Low, Kronander, Ynnerman & Unger 2012: L2 of ln(1 + f cos)",
    2,
    "wi",
    False,
    np.log1p,
    lambda x: 1 / (1 + x),
)

METRICS: dict[str, Metric] = {metric.name: metric for metric in (L1, L2_NGAN, CUBEROOT, LOG)}


def metric_named(name: str) -> Metric:
    """The metric of that name, or a `UserError` with the nearest known one."""
    if name not in METRICS:
        known = ", ".join(METRICS)
        raise UserError("unknown metric", field="metric", got=name, expected=known, hint=did_you_mean(name, METRICS))
    return METRICS[name]


def errors_of(samples: MeasuredSamples, f_model: Floats) -> dict[str, float]:
    """E of a model's f (N, C) under every metric."""
    return {name: metric.error(samples, f_model) for name, metric in METRICS.items()}
