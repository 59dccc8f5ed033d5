"""Reference errors and warnings of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from lambent.core.geometry.directions import Floats, direction
from lambent.materials.bsdf import MaterialBSDF, more_than_arrives
from lambent.materials.document import Kind, Material, Side
from lambent.materials.fitting.least_squares import Bounds, minimise
from lambent.materials.fitting.parameters import LEGAL, RETRO_LEGAL, SHAPE, Box, Fixed, Ranges, from_search, parameter
from lambent.materials.fitting.problem import Candidate, Found, Mixture, Problem, problem_of, replace_metric
from lambent.materials.fitting.scale import weighted_median
from lambent.materials.fresnel import schlick_weight
from lambent.materials.measured.inspecting.metrics import METRICS, Metric, light_ratios
from lambent.materials.measured.protocol import MeasuredSamples, negative_readings

AT_BOUND = 0.005  # of the interval
UNDERSHOOT = 0.7  # of the measured peak
TOTAL_TOLERANCE = 0.1  # of the light scattered to one side, over all tuples
PEAK_SHARE = 0.001  # share of the tuples, brightest first, that form the peak
LAMBERTIAN_STEPS = 30
CHUNK = 1 << 14  # tuples evaluated at once
SCHLICK_SPAN = 0.1  # (1 - cos_d)^5 that the bright tuples must reach to determine both r0 and ks


def lambertian_errors(samples: MeasuredSamples) -> dict[str, float]:
    """E of the best Lambertian surface under each metric, each with its own coefficient per side and channel."""
    totals = dict.fromkeys(METRICS, 0.0)
    for side in samples.sides:
        problem = problem_of(samples, side, METRICS["l1"], "beckmann", False)
        for name, metric in METRICS.items():
            totals[name] += _lambertian_rest(replace_metric(problem, samples, metric))
    return {name: total ** (1 / METRICS[name].power) for name, total in totals.items()}


def _lambertian_rest(problem: Problem) -> float:
    """The residual of the best diffuse term alone: a weighted median, exact for L1; least squares otherwise."""
    if problem.metric.power == 1:
        best = np.pi * weighted_median(problem.measured, np.broadcast_to(problem.w * problem.c, problem.measured.shape))
        return problem.remaining(Mixture(best))
    mean = np.pi * problem.measured @ problem.w / problem.w.sum()
    return minimise(problem, Bounds((), True), Mixture(np.maximum(mean, 1e-12)), LAMBERTIAN_STEPS, 1e-6)[1]


def evaluate(material: Material, samples: MeasuredSamples) -> Floats:
    """f (N, C) in 1/sr of the material at the tuples, in chunks to save memory."""
    bsdf, channels = MaterialBSDF(material), samples.f.shape[1]
    value = np.empty_like(samples.f)
    for start in range(0, len(samples), CHUNK):
        part = slice(start, start + CHUNK)
        value[part] = bsdf.eval(samples.wi[part], samples.wo[part])[:, :channels]
    return value


def warnings_of(
    samples: MeasuredSamples, material: Material, model: Floats, found: Mapping[Side, Found], metric: str
) -> tuple[str, ...]:
    """One line per doubt about a fit; `model` is its f (N, C) at the tuples, `found` has the sides with a model."""
    lines = [line for side, one in found.items() for line in _bounds(side, one.models[-1].lobes, one.boxes)]
    share = peak_share(samples, model)
    if share < UNDERSHOOT:
        hint = "try more lobes" if metric == "l2_ngan" else "more lobes or the l2_ngan metric follow it better"
        lines.append(f"the model reaches {share:.2f} of the measured peak; {hint}")
    for side, ratio in light_ratios(samples, model).items():
        if abs(ratio - 1) > TOTAL_TOLERANCE:
            word = "reflects" if side == "reflection" else "transmits"
            lines.append(f"the model {word} {ratio:.2f} times the light that was measured")
    lines += _energy(material)
    lines += _ambiguity(samples, found)
    return tuple(lines)


def below_zero(samples: MeasuredSamples, metric: Metric) -> list[str]:
    """A line on readings below zero and their treatment by the metric, if there are any."""
    if not (negative := negative_readings(samples)):
        return []
    taken = "as 0" if metric.clamps else "as measured"
    return [f"{negative}; a fit keeps them, and the {metric.name} metric counts them {taken}"]


def restrictions(fix: Fixed, ranges: Ranges) -> list[str]:
    """The user's restrictions, for the provenance."""
    return [f"{name} fixed at {value}" for name, value in fix.items()] + [
        f"{name} sought in {lo:g}..{hi:g}" for name, (lo, hi) in ranges.items()
    ]


def _bounds(side: Side, lobes: Sequence[Candidate], boxes: Sequence[Box]) -> list[str]:
    lines = []
    for place, (lobe, box) in enumerate(zip(lobes, boxes, strict=False)):
        kind: Kind = "retro" if lobe.retro else side
        index = 0 if lobe.retro else place - boxes[0].retro  # the retro lobe is the first
        legal = RETRO_LEGAL if lobe.retro else LEGAL
        for axis, base in enumerate(SHAPE):
            extent = box.hi[axis] - box.lo[axis]
            if extent == 0 or (base == "my" and box.tied):
                continue
            for bound, word in ((box.lo, "lower"), (box.hi, "upper")):
                value = from_search(bound)[axis]
                if abs(lobe.coordinates[axis] - bound[axis]) <= AT_BOUND * extent and value not in legal[base]:
                    lines.append(f"{parameter(kind, base, index)} is at its {word} bound {value:.3g}")
        if not np.any(lobe.k > 0):
            lines.append(f"{parameter(kind, 'k', index)} is 0: the lobe contributes nothing")
    return lines


def peak_share(samples: MeasuredSamples, model: Floats) -> float:
    """Sum of p over the brightest PEAK_SHARE of the tuples: model f (N, C) over measurement."""
    measured = samples.p.mean(axis=1)
    fitted = (model * np.abs(samples.wo[:, 2:])).mean(axis=1)
    brightest = np.argsort(measured)[-max(int(PEAK_SHARE * len(measured)), 10) :]
    return float(fitted[brightest].sum() / max(measured[brightest].sum(), 1e-300))


def _energy(material: Material) -> list[str]:
    theta = np.radians([0.0, 30.0, 45.0, 60.0, 75.0, 80.0])
    phi = np.radians([0.0, 90.0])
    albedo = MaterialBSDF(material).albedo(direction(theta[:, None], phi[None, :]), samples=1024)
    highest = np.unravel_index(np.argmax(albedo), albedo.shape)
    if not more_than_arrives(albedo).any():
        return []
    at = f"theta {np.degrees(theta[highest[0]]):.0f} deg"
    return [f"scatters more light than it receives: albedo {albedo[highest]:.2f} at {at}"]


def _ambiguity(samples: MeasuredSamples, found: Mapping[Side, object]) -> list[str]:
    lines = []
    if found.get("transmission"):
        lines.append("transmission: only the product kt (1 - r0) can be determined")
    if found.get("reflection"):
        cos_d = np.sqrt(np.maximum((1 + np.sum(samples.wi * samples.wo, axis=1)) / 2, 0))
        near = ~samples.transmitted
        brightest = np.argsort(samples.f[near].mean(axis=1))[-max(int(0.02 * near.sum()), 10) :]
        if schlick_weight(cos_d[near][brightest]).max() < SCHLICK_SPAN:
            lines.append("ks and r0: only their product is well determined, no bright tuple is near grazing")
    return lines
