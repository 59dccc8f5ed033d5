"""Reference errors and warnings of a fit, and its albedo over the angle of incidence beside that of the whole table.

The errors of a fit are sums over measured tuples. Where these are sparse, above all near grazing, a material with small
errors can scatter several times as much light as the table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lambent.core.arrays import Flags, Indices, sums_of
from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.materials.bsdf import MaterialBSDF, more_than_arrives
from lambent.materials.document import Kind, Material, Side
from lambent.materials.fitting.gradient import Bounds, minimise
from lambent.materials.fitting.parameters import LEGAL, RETRO_LEGAL, SHAPE, Box, Fixed, Ranges, from_search, parameter
from lambent.materials.fitting.problem import Candidate, Found, KeptAlbedo, Mixture, Problem, problem_of, replace_metric
from lambent.materials.fitting.scale import weighted_median
from lambent.materials.fresnel import schlick_weight
from lambent.materials.measured.inspecting.metrics import METRICS, Metric, light_ratios
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, MeasuredTable, negative_readings, quadrature

THETA_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 75.0, 80.0)
PHI_DEG = (0.0, 90.0)  # of an anisotropic table
MARGIN_DEG = 4.0  # measured theta_o must exceed theta_i by this; otherwise much of the lobe is missing
POINTS = 2048  # of the quadrature, per incident direction
DARK = 0.005  # albedo that counts as black: .002 instead of .001 is no doubt about a fit
KEEP = 3.0  # weight of the mean squares of the log ratios, in units of the error of a black surface
TOLERANCE = 1.25  # ratio of the two albedos beyond which a fit is in doubt
CHANNELS = {1: ("",), 3: ("red", "green", "blue")}


@dataclass(frozen=True)
class Curve:
    """Albedo of one side of a table over the incident directions.

    Attributes
    ----------
    theta_deg : (A,)
        Of the incident directions; for an anisotropic table, each with two phi_i in turn.
    pairs : MeasuredSamples
        N pairs for integrating a model's albedo, without f; the weight includes the cosine.
    which : (N,)
        Index of the incident direction of each pair.
    albedo : (A, C)
        Of the table.
    guessed : (A,) bool
        Whether much of the lobe is missing: tuples do not reach MARGIN_DEG beyond the mirror direction.
    """

    side: Side
    theta_deg: Floats
    pairs: MeasuredSamples
    which: Indices
    albedo: Floats
    guessed: Flags

    def of(self, f: Floats) -> Floats:
        """Albedo (A, C) of a model's f (N, C) in 1/sr at the pairs."""
        return sums_of(f * self.pairs.weight[:, None], self.which, len(self.theta_deg))


@dataclass(frozen=True)
class Comparison:
    """Albedo of a side of a table and of its fit, both (A, C), over theta_i in degrees (A,); `guessed`: see `Curve`."""

    side: Side
    theta_deg: Floats
    table: Floats
    fit: Floats
    guessed: Flags

    @property
    def ratio(self) -> Floats:
        """(A, C) albedo of the fit over that of the table; DARK is added to both."""
        return np.asarray((self.fit + DARK) / (self.table + DARK))

    @property
    def worst(self) -> tuple[int, int]:
        """Index of the incident direction (not a guessed one) and of the channel whose ratio is furthest from 1."""
        return self._worst(~self.guessed)

    def _worst(self, among: Flags) -> tuple[int, int]:
        off = np.where(among[:, None], np.abs(np.log(self.ratio)), -1.0)
        row, channel = np.unravel_index(int(np.argmax(off)), off.shape)
        return int(row), int(channel)

    @property
    def doubtful(self) -> bool:
        """Whether the worst ratio is beyond TOLERANCE either way."""
        return bool(np.abs(np.log(self.ratio[self.worst])) > np.log(TOLERANCE))

    def __str__(self) -> str:
        at = self.worst
        said = f"albedo in {self.side} at worst {self.ratio[at]:.2f} times the table's: {self._at(at)}"
        if not self.guessed.any():
            return said
        at = self._worst(self.guessed)
        return f"{said} ({self.ratio[at]:.2f} times at {self.theta_deg[at[0]]:g} degrees, where much was not measured)"

    def _at(self, at: tuple[int, int]) -> str:
        name = CHANNELS[self.table.shape[1]][at[1]]
        where = f"theta_i {self.theta_deg[at[0]]:g} degrees" + (f", {name}" if name else "")
        return f"{self.fit[at]:.3f} for the table's {self.table[at]:.3f} at {where}"

    def warning(self, kept: bool) -> str:
        """The doubt with a remedy; `kept`: the fit was constrained to the albedos already."""
        return f"{self}; " + ("more lobes follow it better" if kept else "--keep-albedo constrains the fit to it")

    def to_json(self) -> dict[str, Any]:
        return {
            "side": self.side,
            "theta_i_deg": self.theta_deg,
            "table": self.table,
            "fit": self.fit,
            "guessed": self.guessed,
            "says": str(self),
        }


def curves_of(table: MeasuredTable, samples: MeasuredSamples) -> dict[Side, Curve]:
    """The albedos of a table, per side, at angles within those of its tuples, to half a degree."""
    theta_i, theta_o = (np.degrees(np.arccos(np.abs(w[:, 2]).clip(0, 1))) for w in (samples.wi, samples.wo))
    lowest, largest, last = theta_i.min() - 0.5, theta_i.max() + 0.5, theta_o.max() + 0.5 - MARGIN_DEG
    thetas = [theta for theta in THETA_DEG if lowest <= theta <= largest] or [float(np.median(theta_i))]
    incident = [(theta, phi) for theta in thetas for phi in (PHI_DEG[:1] if table.info.isotropic else PHI_DEG)]
    curves = {side: _curve(table, samples, side, incident) for side in samples.sides}
    guessed = np.array([theta > last >= thetas[0] for theta, _ in incident])
    return {side: replace(curve, guessed=guessed) for side, curve in curves.items()}


def _curve(table: MeasuredTable, samples: MeasuredSamples, side: Side, incident: list[tuple[float, float]]) -> Curve:
    wi = direction(*np.radians(incident).T)
    measured = table.reflectivity if side == "reflection" else table.transmissivity
    albedo = measured(wi)
    if not albedo.any():  # a file with light from -z alone, which `samples` turns over
        albedo = measured(wi * FLIP_Z)
    drawn = [quadrature(one, table.proposal, POINTS) for one in wi]
    which = np.repeat(np.arange(len(drawn)), [len(weight) for _, weight in drawn])
    wo = np.concatenate([wo for wo, _ in drawn]) * (FLIP_Z if side == "transmission" else 1)
    weight = np.concatenate([weight for _, weight in drawn])
    nothing = np.zeros((len(wo), samples.f.shape[1]))
    pairs = MeasuredSamples(wi[which], wo, nothing, weight, LeftOut(), samples.info)
    return Curve(side, np.array(incident)[:, 0], pairs, which, albedo, np.zeros(len(wi), dtype=bool))


def keep(curve: Curve, problem: Problem, coupled: bool) -> Problem:
    """The problem with the table's albedos as additional targets."""
    pairs = problem_of(curve.pairs, curve.side, problem.metric, problem.distribution, coupled)
    first = np.searchsorted(curve.which, np.arange(len(curve.theta_deg)))
    black = problem.remaining(Mixture(np.zeros(len(problem.measured))))
    kept = KeptAlbedo(pairs, curve.pairs.weight, first, np.ascontiguousarray(curve.albedo.T), KEEP * black, DARK)
    return replace(problem, kept=kept)


def compare(curves: Mapping[Side, Curve], material: Material) -> tuple[Comparison, ...]:
    """The albedos of a material and of the table, per side."""
    return tuple(
        Comparison(side, curve.theta_deg, curve.albedo, curve.of(evaluate(material, curve.pairs)), curve.guessed)
        for side, curve in curves.items()
    )


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
