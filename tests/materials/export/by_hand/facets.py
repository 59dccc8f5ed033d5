"""Microfacets from the literature, to evaluate written models apart from the code that wrote them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from lambent.core.geometry.directions import Floats, normalize
from lambent.materials.measured.inspecting.metrics import errors_and_shares
from lambent.materials.measured.protocol import MeasuredSamples


class Geometry:
    """wi, wo (N, 3) on the upper side, as wo is mirrored where it is below, and their half vector."""

    def __init__(self, samples: MeasuredSamples) -> None:
        self.far = samples.wo[:, 2] < 0
        self.wi, self.wo = samples.wi, samples.wo * np.where(self.far[:, None], (1, 1, -1), 1)
        self.h = normalize(self.wi + self.wo)
        self.cos_d = np.sum(self.wo * self.h, axis=1)

    def ggx(self, ax: float, ay: float, *, correlated: bool = True) -> Floats:
        """D G / (4 cos_i cos_o) of GGX (Heitz 2014, eqs 72, 85, 86, 98, 99)."""
        d = 1 / (np.pi * ax * ay * np.sum((self.h / (ax, ay, 1)) ** 2, axis=1) ** 2)
        one, other = (
            0.5 * (np.sqrt(1 + ((ax * w[:, 0]) ** 2 + (ay * w[:, 1]) ** 2) / w[:, 2] ** 2) - 1)
            for w in (self.wi, self.wo)
        )
        g = 1 / (1 + one + other) if correlated else 1 / ((1 + one) * (1 + other))
        return np.asarray(d * g / (4 * self.wi[:, 2] * self.wo[:, 2]))

    def beckmann(self, ax: float, ay: float) -> Floats:
        """The same of Beckmann, separable, with the rational masking of Walter et al. 2007."""
        x, y, z = self.h.T
        d = np.exp(-((x / ax) ** 2 + (y / ay) ** 2) / z**2) / (np.pi * ax * ay * z**4)
        g = np.ones(len(d))
        for w in (self.wi, self.wo):
            a = w[:, 2] / np.maximum(np.hypot(ax * w[:, 0], ay * w[:, 1]), 1e-9)
            g = g * np.where(a < 1.6, (3.535 * a + 2.181 * a**2) / (1 + 2.276 * a + 2.577 * a**2), 1)
        return np.asarray(d * g / (4 * self.wi[:, 2] * self.wo[:, 2]))


def assert_costs(samples: MeasuredSamples, f: Floats, share: Mapping[str, float]) -> None:
    """The errors of f (N, 3), evaluated from the written file alone, are those that the writer states."""
    channels = samples.f.shape[1]
    if channels == 1:
        np.testing.assert_allclose(f, np.repeat(f[:, :1], 3, axis=1), rtol=1e-9)
    found = errors_and_shares(samples, f[:, :channels])[1]
    for name, value in share.items():
        assert found[name] == np.float64(value) or abs(found[name] - value) < 2e-3 * value + 1e-6, name
