"""Tables and materials as functions of two directions, where they scatter light, and pairs of directions, for writers.

Pairs have the terms of the microfacet models of other tools: D G / (4 (wi.n)(wo.n)) over a GGX (or Beckmann)
distribution with Smith's masking. The tools differ in the form of masking and in the factors.

Sources: Walter et al. 2007, Microfacet models for refraction, eqs 25-28, 33, 34; Heitz 2014, Understanding the
masking-shadowing function, eqs 72, 86, 99 (anisotropic, height-correlated).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from lambent.core.arrays import Flags, Floats
from lambent.core.geometry.directions import direction, raised
from lambent.materials import lobes
from lambent.materials.bsdf import MaterialBSDF, components
from lambent.materials.document import BLACK, Distribution, Lobe, Material
from lambent.materials.export.contract import Cost, Subject
from lambent.materials.fresnel import schlick_weight, smith_lambda
from lambent.materials.lobes import Vector
from lambent.materials.measured.inspecting.inspection import retro, towards_light
from lambent.materials.measured.inspecting.metrics import errors_and_shares, light_ratios
from lambent.materials.measured.protocol import GRAZING_DEG, LeftOut, MeasuredSamples, TableInfo, negative_readings
from lambent.materials.measured.registry import load
from lambent.materials.measured.tables.gonio import Symmetry, symmetry_of

FIT_LOG2, CHECK_LOG2 = 12, 14  # number of pairs for the fit, and for measuring the errors
Masking = Literal["correlated", "separable"]


@dataclass(frozen=True)
class Pairs:
    """A material's values at pairs of directions, with the terms of all microfacet models.

    Attributes
    ----------
    samples : MeasuredSamples
        wi, wo, f (1 channel for a grey material) and the solid angle of wo.
    wi, wo, h : component tuples of (N,)
        Directions on the upper side (wo mirrored at the surface where it is below), and their half vector.
    cos_d : (N,)
        wo.h.
    """

    samples: MeasuredSamples
    wi: Vector
    wo: Vector
    h: Vector
    cos_d: Floats

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def far(self) -> Flags:
        """(N,) whether wo is on the far side."""
        return self.samples.transmitted

    @cached_property
    def schlick(self) -> Floats:
        """(N,) (1 - wo.h)^5."""
        return schlick_weight(self.cos_d)

    def facets(
        self, mx: float, my: float, masking: Masking = "correlated", distribution: Distribution = "ggx"
    ) -> Floats:
        """(N,) D G / (4 cos_i cos_o) in 1/sr, without Fresnel; uses the mirrored pair if wo is on the far side."""
        hz2 = self.h[2] ** 2
        slope2 = ((self.h[0] / mx) ** 2 + (self.h[1] / my) ** 2) / hz2
        tails = np.exp(-slope2) if distribution == "beckmann" else (1 + slope2) ** -2.0
        d = tails / (np.pi * mx * my * hz2**2)
        return np.asarray(d * self._masking(mx, my, masking, distribution) / (4 * self.wi[2] * self.wo[2]))

    def _masking(self, mx: float, my: float, masking: Masking, distribution: Distribution) -> Floats:
        """(N,) Smith's G in [0, 1]."""
        slopes2 = (((mx * w[0]) ** 2 + (my * w[1]) ** 2) / w[2] ** 2 for w in (self.wi, self.wo))
        one, other = (smith_lambda(slope2, distribution) for slope2 in slopes2)
        return np.asarray(1 / (1 + one + other) if masking == "correlated" else 1 / ((1 + one) * (1 + other)))


def is_grey(material: Material) -> bool:
    """Whether all coefficients are equal in the three channels."""
    triples = [material.kd, material.kt_d, *(rgb for lobe in material.lobes for rgb in (lobe.k, lobe.r0))]
    triples += [rgb for lobe in material.lobes for rgb in zip(*(lobe.fresnel or ()), strict=True)]
    return all(len(set(rgb)) == 1 for rgb in triples)


def is_isotropic(material: Material) -> bool:
    return all(lobe.mx == lobe.my for lobe in material.lobes)


def pairs_of(material: Material, log2_count: int, seed: int) -> Pairs:
    """Draw pairs distributed as in a measurement: theta_i uniform up to the grazing limit, wo over both sides.

    Half of the wo are uniform in solid angle, half follow the material's own lobes, so that no peak is missed. A pair's
    weight is the solid angle of wo, as in a measured table.

    Parameters
    ----------
    log2_count : int
        2^log2_count pairs are drawn; those beyond the grazing limit are dropped.
    """
    from scipy.stats import qmc

    u = qmc.Sobol(6, scramble=True, rng=seed).random_base2(log2_count)
    lowest = np.cos(np.radians(GRAZING_DEG))
    phi_i = 0 * u[:, 1] if is_isotropic(material) else 2 * np.pi * u[:, 1]
    wi = direction(np.radians(GRAZING_DEG) * u[:, 0], phi_i)
    sides = 2 if material.transmits else 1
    z = 2 * u[:, 3] - 1 if material.transmits else u[:, 3]
    even = direction(np.arccos(z), 2 * np.pi * u[:, 4])
    bsdf = MaterialBSDF(material)
    wo = np.where((u[:, 2] < 0.5)[:, None], even, bsdf.sample(wi, u[:, 3:6]))
    density = 0.5 / (2 * np.pi * sides) + 0.5 * bsdf.pdf(wo, wi)
    seen = np.abs(wo[:, 2]) > lowest
    wi, wo, weight = wi[seen], wo[seen], 1 / density[seen]
    f = bsdf.eval(wi, wo)[:, : 1 if is_grey(material) else 3]
    info = TableInfo(material.name, "direction pairs", is_isotropic(material), material.transmits, f.shape[1], "f")
    upper_wi, upper_wo = components(wi), components(raised(wo))
    h = lobes.half_vector(upper_wi, upper_wo)
    samples = MeasuredSamples(wi, wo, f, weight, LeftOut(), info)
    return Pairs(samples, upper_wi, upper_wo, h, lobes.dot(upper_wo, h))


_WIDTHS = (0.004, 0.02, 0.08, 0.3)  # of the lobes of the proposal for a table
_MOST_TUPLES = 100_000  # tuples of a table used to detect retro-reflection
_ASKED_DEG, _TURN_DEG = (1.0, 20.0, 45.0, 70.0), 45.0  # theta, and steps of phi, at which light from behind is tested


def proposal_of(subject: Subject) -> MaterialBSDF:
    """A material itself; for a table, a material with lobes of every width that measured lobes can have.

    For a retro-reflective table, lobes about the light are added.
    """
    if isinstance(subject, Material):
        return MaterialBSDF(subject)
    white, part = (1.0, 1.0, 1.0), (1 / len(_WIDTHS),) * 3
    lobes = [Lobe(distribution="ggx", mx=m, my=m, r0=white, k=part) for m in _WIDTHS]
    if retro(subject, subject.samples(_MOST_TUPLES))[0] > 1:
        lobes += [lobe.of_kind("retro") for lobe in lobes]
    if subject.info.transmits:
        lobes += [lobe.model_copy(update={"side": "transmission", "r0": BLACK}) for lobe in lobes if lobe.mirrors]
    quarter = (0.25, 0.25, 0.25)
    return MaterialBSDF(Material(kd=quarter, kt_d=quarter if subject.info.transmits else BLACK, lobes=tuple(lobes)))


def knows_the_back(subject: Subject) -> bool:
    """Whether light from -z is scattered: as the table's `has_a_back` states, or as found at any of many directions.

    A material is equal from both sides.
    """
    if isinstance(subject, Material):
        return True
    stated: bool | None = getattr(subject, "has_a_back", None)
    if stated is not None:
        return stated
    theta, phi = np.meshgrid(180 - np.array(_ASKED_DEG), np.arange(0, 360, _TURN_DEG))
    return bool(subject.albedo(direction(np.radians(theta), np.radians(phi))).any())


MOST_TUPLES = 200_000  # tuples of a table at which the written file is compared
PEAK_RATIO, PEAK_DEG, PEAK_TOLERANCE = 1.25, 10.0, 0.1  # of a retro-reflective peak; its tolerated loss
LOST_TRANSMISSION = "transmission: the format holds reflection alone"


@dataclass(frozen=True)
class Scatterer:
    """A subject as a function.

    Attributes
    ----------
    eval : callable
        f (N, C) in 1/sr of wi and wo (N, 3), C as in `channels`.
    symmetry : str
        isotropic, quadrant, half or none, as in `GonioTable`.
    """

    name: str
    eval: Callable[[Floats, Floats], Floats]
    symmetry: Symmetry
    transmits: bool
    channels: int

    def rgb(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 3), grey repeated."""
        f = self.eval(wi, wo)
        return np.asarray(np.broadcast_to(f, (len(f), 3)))


def scatterer_of(subject: Subject) -> Scatterer:
    """The subject as a function, with its symmetry."""
    if isinstance(subject, Material):
        symmetry: Symmetry = "isotropic" if is_isotropic(subject) else "quadrant"
        return Scatterer(subject.name, MaterialBSDF(subject).eval, symmetry, subject.transmits, 3)
    info = subject.info
    return Scatterer(Path(info.file).stem, subject.eval, symmetry_of(subject), info.transmits, info.channels)


def tuples_of(subject: Subject, most: int = MOST_TUPLES) -> MeasuredSamples:
    """At most `most` of a table's measured tuples; for a material, pairs distributed as in a measurement."""
    if isinstance(subject, Material):
        return pairs_of(subject, CHECK_LOG2, seed=1).samples
    return subject.samples(most)


def read_back(subject: Subject, path: Path, lost: tuple[str, ...]) -> Cost:
    """Compare the file at `path`, read back, with the subject at the subject's own tuples.

    Raises
    ------
    UserError
        If no reader recognises the file.
    """
    samples, written = tuples_of(subject), load(path)
    negative = negative_readings(samples)
    if negative and not written.samples(MOST_TUPLES).below_zero:
        lost += (f"readings below zero became 0: {negative}",)
    f = written.eval(samples.wi, samples.wo)
    if f.shape[1] != samples.f.shape[1]:
        f = f.mean(axis=1, keepdims=True) if samples.f.shape[1] == 1 else np.repeat(f, 3, axis=1)
    return Cost(
        (*lost, *_of_the_peak_about_the_light(samples, f)), *errors_and_shares(samples, f), light_ratios(samples, f)
    )


def _of_the_peak_about_the_light(samples: MeasuredSamples, f: Floats) -> list[str]:
    """A sentence if the subject has a retro-reflective peak that f (N, C) of the file, at the tuples, lacks."""
    if towards_light(samples) < PEAK_RATIO:
        return []
    apart = np.linalg.norm(samples.wi - samples.wo, axis=1)
    near = (apart < np.radians(PEAK_DEG)) & ~samples.transmitted
    light = (samples.weight * np.abs(samples.wo[:, 2]))[near]
    expected, kept = (light @ values[near].mean(axis=1) for values in (samples.f, f))
    misplaced = (light @ np.abs(f - samples.f)[near].mean(axis=1)) / max(expected, 1e-30)
    if misplaced < PEAK_TOLERANCE:
        return []
    return [
        f"the retro-reflective peak: within {PEAK_DEG:g} degrees of it the file returns {kept / expected:.2f} times as "
        f"much light, {misplaced:.0%} of it misplaced"
    ]
