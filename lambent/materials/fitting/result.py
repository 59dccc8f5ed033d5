"""The result of a fit, and its notes on numbers of lobes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from lambent.materials.document import Material, Side
from lambent.materials.fitting.account import Comparison
from lambent.materials.fitting.problem import Found


@dataclass(frozen=True)
class FitResult:
    """A fitted material and its quality.

    Attributes
    ----------
    material : Material
        With its provenance.
    errors, lambertian_errors : dict of float
        Metric name -> E of the material, and of the best Lambertian surface under that metric.
    seconds : float
        Wall-clock time.
    warnings : tuple of str
        Reasons to doubt the numbers.
    partial : bool
        Whether the fit was cancelled and this is the best found so far.
    notes : tuple of str
        Choices that the fit made.
    albedos : tuple of Comparison
        Albedo of the material and of the whole table, per side; empty if the fit was given tuples alone.
    """

    material: Material
    errors: dict[str, float]
    lambertian_errors: dict[str, float]
    seconds: float
    warnings: tuple[str, ...]
    partial: bool
    notes: tuple[str, ...] = ()
    albedos: tuple[Comparison, ...] = ()


def by_lobes(found: Mapping[Side, Found]) -> list[str]:
    """One line per side with several models: the side's E with one lobe, two, ..."""
    lines = []
    for side, one in found.items():
        metric = one.problem.metric
        if len(one.models) > 1:
            tuples = replace(one.problem, kept=None)
            errors = ", ".join(f"{tuples.remaining(model) ** (1 / metric.power):.4g}" for model in one.models)
            lines.append(f"{side}: {metric.name} error {errors} with 1 to {len(one.models)} lobes")
    return lines


def fewer(found: Mapping[Side, Found], lobes: int | str) -> list[str]:
    return [
        f"{side}: {count} lobe(s); another one reduces the error no further"
        for side, one in found.items()
        if isinstance(lobes, int) and 0 < (count := one.mirroring) < lobes
    ]
