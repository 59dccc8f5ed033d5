"""A measured file, prepared for comparison with a material while a slider moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components, evaluate
from lambent.materials.document import Lobe, Material
from lambent.materials.fitting.scale import diffuse_mode
from lambent.materials.fitting.shown.incidence import Incidence, incidences
from lambent.materials.lobes import Vector
from lambent.materials.measured import load
from lambent.materials.measured.inspecting.metrics import METRICS
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.viewer.editor.readings import FINE_PX, Disks, incidents_of, single

FEW = 12_000  # tuples that stand for all while a slider moves
CHUNK = 100_000  # tuples between two checks for cancellation
NEAR = Lobe(mx=0.3, my=0.3)
FAR = Lobe(side="transmission", mx=0.3, my=0.3, r0=(0.0, 0.0, 0.0), k=(0.1, 0.1, 0.1))


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured table. The weighted subset `few` of `samples` reproduces every metric to about 1 %."""

    path: Path
    samples: MeasuredSamples
    few: MeasuredSamples  # at most `FEW`
    gathered: tuple[Incidence, ...]  # by incident direction, for disks and curves
    disks: Floats  # (K, pixels, 3) from `readings.Disks.measured` at `FINE_PX`
    mirrored: Floats  # (K, pixels, 3) from `Disks.mirrored`
    lambertian: Mapping[str, float]  # metric -> E of the best Lambertian surface

    @property
    def is_small(self) -> bool:
        """Whether `few` has all samples."""
        return len(self.few) == len(self.samples)

    @cached_property
    def _few_directions(self) -> tuple[Vector, Vector]:
        return single(self.few.wi), single(self.few.wo)

    def error(self, material: Material, metric: str) -> float:
        """E of the material over the subset; takes a few milliseconds."""
        wi, wo = self._few_directions
        f = np.stack(evaluate(wi, wo, material), axis=-1)
        return METRICS[metric].error(self.few, _channels(f, self.few))

    def exact_errors(self, material: Material, progress: Progress = silent) -> dict[str, float]:
        """Metric name -> E over all tuples; `progress` may raise `Cancelled`."""
        parts = []
        for first in range(0, len(self.samples), CHUNK):
            progress(first, len(self.samples), "error over all tuples")
            here = slice(first, first + CHUNK)
            wi, wo = components(self.samples.wi[here]), components(self.samples.wo[here])
            parts.append(np.stack(evaluate(wi, wo, material), axis=-1))
        f = _channels(np.concatenate(parts), self.samples)
        return {name: metric.error(self.samples, f) for name, metric in METRICS.items()}


def read_measurement(path: Path, progress: Progress = silent) -> Measurement:
    """Load a measured file in any known format and prepare it; errors as in `lambent.materials.measured.load`."""
    from lambent.materials.fitting.account import lambertian_errors

    progress(0, 5, "reading")
    samples = load(path).samples()
    progress(1, 5, "thinning")
    few = thinned(samples, FEW)
    progress(2, 5, "sorting by incident direction")
    gathered = tuple(incidences(samples))
    progress(3, 5, "drawing disks")
    laid_out = Disks(incidents_of(gathered), samples.info.transmits, FINE_PX)
    disks, mirrored = laid_out.measured(gathered), laid_out.mirrored(gathered)
    progress(4, 5, "fitting a Lambertian surface")
    return Measurement(path, samples, few, gathered, disks, mirrored, lambertian_errors(few))


def thinned(samples: MeasuredSamples, count: int) -> MeasuredSamples:
    """A deterministic subset of about `count` tuples, weighted so that every metric's sum is unbiased.

    Systematic sampling in storage order, with a third of the density each by weight, by weight times the cube root of
    p, and by weight times p, so that both narrow peaks and dark parts are sampled.
    """
    if len(samples) <= count:
        return samples
    p = np.maximum(samples.p.mean(axis=1), 0)
    shares = [samples.weight, samples.weight * np.cbrt(p), samples.weight * p]
    density = np.mean([share / max(float(share.sum()), 1e-300) for share in shares], axis=0)
    cumulated = np.cumsum(density)
    positions = (np.arange(count) + np.random.default_rng(0).random(count)) / count * cumulated[-1]
    index, times = np.unique(np.searchsorted(cumulated, positions).clip(0, len(p) - 1), return_counts=True)
    weight = samples.weight[index] * times / (count * density[index])
    return replace(samples, wi=samples.wi[index], wo=samples.wo[index], f=samples.f[index], weight=weight)


def _channels(f: Floats, samples: MeasuredSamples) -> Floats:
    """The model's f (N, 3) in the table's channels; for a grey table, its mean."""
    return f if samples.f.shape[1] == 3 else f.mean(axis=1, keepdims=True)


def start_material(measurement: Measurement) -> Material:
    """Start material: a diffuse term read off the measurement, and one plain lobe per side."""
    samples = measurement.few
    far = samples.transmitted
    lobes = tuple(lobe for lobe, here in ((NEAR, ~far), (FAR, far)) if here.any())
    kd, kt_d = _diffuse(samples, ~far), _diffuse(samples, far)
    return Material(name=Path(samples.info.file).stem, kd=kd, kt_d=kt_d, lobes=lobes)


def _diffuse(samples: MeasuredSamples, here: NDArray[np.bool_]) -> Triple:
    f, weight = samples.f[here], samples.weight[here] * np.abs(samples.wo[here, 2])
    values = [min(diffuse_mode(f[:, channel], weight), 1.0) for channel in range(f.shape[1])]
    return triple(values if len(values) == 3 else values * 3)
