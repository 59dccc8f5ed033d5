"""Error metrics between a measured table and a model, by name.

Every metric is E = (mean over channels of sum_t w_t |T(c_t f_measured) - T(c_t f_model)|^p)^(1/p) over the measured
tuples t, with a weight w_t per tuple (its solid angle over the sum of all, so only ratios matter), a cosine c_t, a
transform T and a power p. The search needs these four terms, not only the sum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.materials.document import Side
from lambent.materials.measured.protocol import MeasuredSamples

BLOCK = 8192  # tuples evaluated together, so that intermediate results fit into the processor's cache
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
        Name, unit of E, and publication.
    cosine : "wi" or "wo"
        Whose cosine multiplies f before the transform; with "wo", |cos theta_i| multiplies the weight.
    transform, slope : callable
        T of f cos in 1/sr, and its derivative for f cos >= 0. If T is nearly linear about 0, it takes negative readings
        unchanged, so that noise about zero averages out; a cube root would magnify it, and takes them as 0.
    """

    name: str
    unit: str
    source: str
    power: Literal[1, 2]
    cosine: Literal["wi", "wo"]
    transform: Callable[[Any], Any]
    slope: Callable[[Any], Any]

    @property
    def linear(self) -> bool:
        """Whether T is the identity, which gives the best coefficient in closed form."""
        return self.transform is _same

    @property
    def clamps(self) -> bool:
        """Whether T treats a negative reading as 0."""
        return bool(self.transform(-1.0) == self.transform(0.0))

    def terms(self, samples: MeasuredSamples) -> tuple[Floats, Floats]:
        """(w, c) of every tuple, each (N,)."""
        cos_i = np.abs(samples.wi[:, 2])
        w = samples.weight / samples.weight.sum()
        return (w, cos_i) if self.cosine == "wi" else (w * cos_i, np.abs(samples.wo[:, 2]))

    def error(self, samples: MeasuredSamples, f_model: Floats) -> float:
        """E in `unit` of a model's f (N, C) in 1/sr at the tuples of `samples`."""
        w, c = self.terms(samples)
        total = 0.0
        for start in range(0, len(w), BLOCK):
            part = slice(start, start + BLOCK)
            measured, model = (self.transform(c[part, None] * f[part]) for f in (samples.f, f_model))
            total += float(np.mean(w[part] @ np.abs(measured - model) ** self.power))
        return float(total ** (1 / self.power))


L1 = Metric("l1", "1/sr", "thesis, eq. 3.7", 1, "wo", _same, _one)
L2_NGAN = Metric("l2_ngan", "1/sr", "Ngan, Durand & Matusik 2005, section 3", 2, "wi", _same, _one)
CUBEROOT = Metric(
    "cuberoot",
    "(1/sr)^(1/3)",
    "Fores, Ferwerda & Gu 2012: cosine-weighted L2 of the cube root",
    2,
    "wi",
    lambda x: np.cbrt(np.maximum(x, 0) + CUBEROOT_EPS),
    lambda x: np.cbrt(x + CUBEROOT_EPS) / (3 * (x + CUBEROOT_EPS)),
)
LOG = Metric(
    "log",
    "ln(1 + sr^-1)",
    "Low, Kronander, Ynnerman & Unger 2012: L2 of ln(1 + f cos)",
    2,
    "wi",
    lambda x: np.copysign(np.log1p(np.abs(x)), x),
    lambda x: 1 / (1 + x),
)

METRICS: dict[str, Metric] = {metric.name: metric for metric in (L1, L2_NGAN, CUBEROOT, LOG)}


def metric_named(name: str) -> Metric:
    """The metric of that name; raises `UserError` with the nearest known one."""
    return METRICS[known("metric", name, METRICS, field="metric")]


def errors_of(samples: MeasuredSamples, f_model: Floats) -> dict[str, float]:
    """E of a model's f (N, C) under every metric."""
    return {name: metric.error(samples, f_model) for name, metric in METRICS.items()}


def light_ratios(samples: MeasuredSamples, f_model: Floats) -> dict[Side, float]:
    """Ratio per side of the light scattered by a model with f (N, C), summed over the tuples, to the light measured."""
    light = samples.weight * np.abs(samples.wo[:, 2])
    ratios: dict[Side, float] = {}
    for side in samples.sides:
        here = samples.on(side)
        modelled, measured = (float((light[here] @ f[here]).sum()) for f in (f_model, samples.f))
        if measured > 0:
            ratios[side] = modelled / measured
    return ratios


def errors_and_shares(samples: MeasuredSamples, f_model: Floats) -> tuple[dict[str, float], dict[str, float]]:
    """`errors_of`, and each relative to the error of a black surface; 0 if that error is 0."""
    errors, black = errors_of(samples, f_model), errors_of(samples, np.zeros_like(samples.f))
    return errors, {name: error / black[name] if black[name] > 0 else 0.0 for name, error in errors.items()}
