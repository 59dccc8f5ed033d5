"""Albedo over the angle of incidence: of a whole table, and of a material fitted to it.

The errors of a fit are sums over measured tuples. Where these are sparse, above all near grazing, a material with small
errors can scatter several times as much light as the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lambent.core.arrays import Flags, Indices
from lambent.core.geometry.directions import FLIP_Z, Floats, direction
from lambent.materials.document import Material, Side
from lambent.materials.fitting.account import evaluate
from lambent.materials.fitting.problem import KeptAlbedo, Mixture, Problem, problem_of
from lambent.materials.measured.protocol import LeftOut, MeasuredSamples, MeasuredTable, quadrature

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
        light = f * self.pairs.weight[:, None]
        return np.stack([np.bincount(self.which, light[:, c], len(self.theta_deg)) for c in range(f.shape[1])], axis=1)


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
