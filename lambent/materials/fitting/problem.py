"""One side of a table, prepared so that a lobe of any shape is a few multiplications per tuple.

ln f_lobe / k = ln F + base - hx^2/hz^2/mx^2 - hy^2/hz^2/my^2 - ln(mx my) - alpha ln(cos_i cos_o)   (3.3-3.5)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lambent.materials.fitting.metrics import Metric
from lambent.materials.fitting.parameters import Side
from lambent.materials.fitting.scale import Channel
from lambent.materials.measured.protocol import MeasuredSamples

Floats = NDArray[np.floating]


@dataclass(frozen=True)
class Problem:
    """What one lobe has to explain.

    Attributes
    ----------
    slope_x2, slope_y2, base, log_cosines, schlick : (N,)
        (hx/hz)^2, (hy/hz)^2, -ln(4 pi hz^4 cos_d), ln(cos_i cos_o) and (1 - cos_d)^5 of every tuple.
    measured, background : (C, N)
        f in 1/sr, and the part of it that other terms of the model explain.
    w, c : (N,)
        The metric's weight and cosine.
    """

    side: Side
    metric: Metric
    slope_x2: Floats
    slope_y2: Floats
    base: Floats
    log_cosines: Floats
    schlick: Floats
    measured: Floats
    background: Floats
    w: Floats
    c: Floats

    def __len__(self) -> int:
        return len(self.w)

    @property
    def channels(self) -> tuple[Channel, ...]:
        return tuple(Channel(m, b, self.w, self.c) for m, b in zip(self.measured, self.background, strict=True))

    def fresnel(self, r0: Floats) -> Floats:
        """(..., N) F, or 1 - F for transmission, of r0 (...)."""
        f = r0[..., None] + (1 - r0[..., None]) * self.schlick
        return f if self.side == "reflection" else 1 - f

    def distribution(self, mx: float, my: float) -> Floats:
        """(N,) the factor of a lobe that depends on mx and my."""
        exponent = self.base - self.slope_x2 / (mx * mx) - self.slope_y2 / (my * my) - np.log(mx * my)
        return np.asarray(np.exp(exponent))

    def basis(self, shape: Floats) -> Floats:
        """(N,) f in 1/sr of the lobe (mx, my, r0, alpha) with coefficient 1."""
        mx, my, r0, alpha = (float(v) for v in shape)
        return np.asarray(self.distribution(mx, my) * self.fresnel(np.array(r0)) * np.exp(-alpha * self.log_cosines))

    def against(self, measured: Floats, background: Floats) -> Problem:
        """The same tuples with another target."""
        return replace(self, measured=measured, background=background)

    def take(self, index: NDArray[np.integer], w: Floats) -> Problem:
        """The tuples `index` in float32, with weights of their own."""
        per_tuple = ("slope_x2", "slope_y2", "base", "log_cosines", "schlick", "measured", "background", "c")
        taken = {name: getattr(self, name)[..., index].astype(np.float32) for name in per_tuple}
        return replace(self, **taken, w=w.astype(np.float32))

    def thinned(self, count: int, seed: int) -> Problem:
        """About `count` tuples that estimate the metric without bias.

        Systematic sampling along the storage order: half of the density follows the metric's weight, half follows
        weight times the transformed measurement, so that narrow peaks are met; each tuple's weight is divided by its
        density. The same seed gives the same tuples.
        """
        if count >= len(self):
            return self.take(np.arange(len(self)), self.w)
        height = np.abs(self.metric.transform(self.c * self.measured.mean(axis=0))) ** self.metric.power
        salient = self.w * height
        density = 0.5 * self.w / self.w.sum() + 0.5 * salient / max(float(salient.sum()), 1e-300)
        offset = np.random.default_rng(seed).random()
        positions = (np.arange(count) + offset) / count
        drawn = np.searchsorted(np.cumsum(density) / density.sum(), positions)
        index, times = np.unique(np.minimum(drawn, len(self) - 1), return_counts=True)
        return self.take(index, self.w[index] * times / (count * density[index]))


def problem_of(samples: MeasuredSamples, side: Side, metric: Metric, background: Floats) -> Problem:
    """The tuples of one side; `background` (N, C) is the diffuse term's f at every tuple of `samples`."""
    here = samples.transmitted if side == "transmission" else ~samples.transmitted
    wi, wo = samples.wi[here].astype(np.float64), samples.wo[here].astype(np.float64)
    cos_i, cos_o = np.abs(wi[:, 2]), np.abs(wo[:, 2])
    h = np.stack([wi[:, 0] + wo[:, 0], wi[:, 1] + wo[:, 1], cos_i + cos_o], axis=-1)
    h /= np.linalg.norm(h, axis=-1, keepdims=True)
    cos_d = np.clip(h[:, 0] * wo[:, 0] + h[:, 1] * wo[:, 1] + h[:, 2] * cos_o, 1e-6, 1)
    hz2 = np.maximum(h[:, 2] ** 2, 1e-12)
    w, c = metric.terms(samples)
    return Problem(
        side,
        metric,
        h[:, 0] ** 2 / hz2,
        h[:, 1] ** 2 / hz2,
        -np.log(4 * np.pi * hz2 * hz2 * cos_d),
        np.log(np.maximum(cos_i * cos_o, 1e-12)),
        (1 - cos_d) ** 5,
        np.ascontiguousarray(samples.f[here].T.astype(np.float64)),
        np.ascontiguousarray(background[here].T),
        w[here],
        c[here],
    )
