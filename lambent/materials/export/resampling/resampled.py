"""Tables and materials as functions of two directions, and where they scatter light, for writers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Lobe, Material
from lambent.materials.export.contract import Cost, Subject
from lambent.materials.export.resampling.pairs import CHECK_LOG2, is_isotropic, pairs_of
from lambent.materials.measured.inspecting.faults import retro, towards_light
from lambent.materials.measured.inspecting.metrics import errors_and_shares, light_ratios
from lambent.materials.measured.protocol import MeasuredSamples, negative_readings
from lambent.materials.measured.registry import load
from lambent.materials.measured.tables.gonio import Symmetry, symmetry_of

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
