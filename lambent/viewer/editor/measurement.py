"""A measured file, prepared so that a material can be judged against it while a slider moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components, evaluate
from lambent.materials.document import Material
from lambent.materials.fitting.incidence import Incidence, incidences
from lambent.materials.fitting.metrics import METRICS
from lambent.materials.lobes import Vector
from lambent.materials.measured import load
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.viewer.editor.readings import FINE_PX, Disks, incidents_of

Floats = NDArray[np.floating]

FEW = 12_000  # tuples that stand for all while a slider moves
CHUNK = 100_000  # tuples between two looks at whether to go on


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured table.

    Attributes
    ----------
    path : Path
    samples, few : MeasuredSamples
        All tuples, and at most `FEW` of them whose weights make every metric come out as of all, within a percent.
    gathered : tuple of Incidence
        By incident direction, for disks and curves.
    disks : (K, pixels, 3)
        Measured brightness as `readings.Disks.measured` of `FINE_PX` gives it.
    lambertian : mapping
        Metric name -> E of the best Lambertian surface.
    """

    path: Path
    samples: MeasuredSamples
    few: MeasuredSamples
    gathered: tuple[Incidence, ...]
    disks: Floats
    lambertian: Mapping[str, float]

    @property
    def is_small(self) -> bool:
        """Whether `few` are all."""
        return len(self.few) == len(self.samples)

    @cached_property
    def _few_directions(self) -> tuple[Vector, Vector]:
        return _single(self.few.wi), _single(self.few.wo)

    def error(self, material: Material, metric: str) -> float:
        """E of the material over the few tuples: a few milliseconds."""
        wi, wo = self._few_directions
        f = np.stack(evaluate(wi, wo, material), axis=-1)
        return METRICS[metric].error(self.few, _channels(f, self.few))

    def exact_errors(self, material: Material, progress: Progress = silent) -> dict[str, float]:
        """Metric name -> E over all tuples; `progress` may raise `Cancelled`."""
        parts = []
        for first in range(0, len(self.samples), CHUNK):
            progress(first, len(self.samples), "error of all tuples")
            here = slice(first, first + CHUNK)
            wi, wo = components(self.samples.wi[here]), components(self.samples.wo[here])
            parts.append(np.stack(evaluate(wi, wo, material), axis=-1))
        f = _channels(np.concatenate(parts), self.samples)
        return {name: metric.error(self.samples, f) for name, metric in METRICS.items()}


def read_measurement(path: Path, progress: Progress = silent) -> Measurement:
    """Load a measured file in any known format and prepare it.

    Raises
    ------
    UserError
        As `lambent.materials.measured.load`.
    """
    from lambent.materials.fitting.account import lambertian_errors

    progress(0, 5, "reading")
    samples = load(path).samples()
    progress(1, 5, "thinning")
    few = thinned(samples, FEW)
    progress(2, 5, "gathering incident directions")
    gathered = tuple(incidences(samples))
    progress(3, 5, "drawing disks")
    disks = Disks(incidents_of(gathered), samples.info.transmits, FINE_PX).measured(gathered)
    progress(4, 5, "the best Lambertian surface")
    return Measurement(path, samples, few, gathered, disks, lambertian_errors(few))


def thinned(samples: MeasuredSamples, count: int) -> MeasuredSamples:
    """About `count` tuples whose weights make any metric's sum come out without bias; always the same ones.

    Systematic sampling in storage order, a third of the density each by weight, by weight times the cube root of p, and
    by weight times p, so that both narrow peaks and what is dark are met.
    """
    if len(samples) <= count:
        return samples
    p = samples.p.mean(axis=1)
    shares = [samples.weight, samples.weight * np.cbrt(p), samples.weight * p]
    density = np.mean([share / max(float(share.sum()), 1e-300) for share in shares], axis=0)
    cumulated = np.cumsum(density)
    positions = (np.arange(count) + np.random.default_rng(0).random(count)) / count * cumulated[-1]
    index, times = np.unique(np.searchsorted(cumulated, positions).clip(0, len(p) - 1), return_counts=True)
    weight = samples.weight[index] * times / (count * density[index])
    return replace(samples, wi=samples.wi[index], wo=samples.wo[index], f=samples.f[index], weight=weight)


def _single(w: Floats) -> Vector:
    x, y, z = np.ascontiguousarray(w.T, np.float32)
    return x, y, z


def _channels(f: Floats, samples: MeasuredSamples) -> Floats:
    """The model's f (N, 3) in the table's channels: a grey table sees the mean."""
    return f if samples.f.shape[1] == 3 else f.mean(axis=1, keepdims=True)
