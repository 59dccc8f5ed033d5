"""Methods for looking up a gonio table between its incident directions, and the choice of the best for a table.

Each method gives the direction at which the sheet of a neighbouring incident direction w_k is looked up for a pair
(thesis M, 3.2):

- `half_vector`: w_k mirrored about h(wi, wo). Peaks follow the mirror direction (Rusinkiewicz 1998).
- `back_vector`: the same, but if wo is nearer to the light than to its mirror direction, wo turned as wi is turned to
  w_k. Peaks about the light, those of retro-reflectors, follow it. At normal incidence the peaks coincide and count as
  the light's, which is far stronger in tables that use this method.
- `quadrilinear`: wo itself. Peaks stay where they were measured.

The choice is made by leaving one out: inner theta_i are predicted from their neighbours. The error is E under the
cube-root metric, which weighs faint peaks and dark parts alike, relative to E against black.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import half_vector, reflect
from lambent.materials.bsdf import components
from lambent.materials.measured.inspecting.metrics import CUBEROOT
from lambent.materials.measured.parts.back_vector import back_share
from lambent.materials.measured.protocol import MeasuredSamples

Reconstruction = Literal["half_vector", "back_vector", "quadrilinear"]
RECONSTRUCTIONS: tuple[Reconstruction, ...] = get_args(Reconstruction)
AUTO: Literal["auto"] = "auto"
CLEARLY = 0.9  # share of the error of `half_vector` that another method must not exceed
_TUPLES = 3000  # per incident direction that is left out


@dataclass(frozen=True)
class Choice:
    """The method in use; `errors` has E of each method relative to E against black, and is empty if unknown."""

    way: Reconstruction
    errors: dict[Reconstruction, float] = field(default_factory=dict)


Fold = tuple[MeasuredSamples, Callable[[Reconstruction, MeasuredSamples], Floats]]
"""Tuples of an incident direction, and f (N, C) at them as predicted by the table without it."""


def choice_of(folds: Iterable[Fold]) -> Choice:
    """The method with the best predictions; `half_vector` unless another one is clearly better."""
    off, whole = dict.fromkeys(RECONSTRUCTIONS, 0.0), 0.0
    for samples, predicted in folds:
        some = _thinned(samples)
        whole += CUBEROOT.error(some, np.zeros_like(some.f)) ** 2
        for way in off:
            off[way] += CUBEROOT.error(some, predicted(way, some)) ** 2
    if whole <= 0:
        return Choice("half_vector")
    errors = {way: float(np.sqrt(error / whole)) for way, error in off.items()}
    best = min(errors, key=lambda way: errors[way])
    return Choice(best if errors[best] < CLEARLY * errors["half_vector"] else "half_vector", errors)


def _thinned(samples: MeasuredSamples) -> MeasuredSamples:
    """Up to _TUPLES tuples, half of them by solid angle and half by light; weights compensate for the choice."""
    if len(samples) <= _TUPLES:
        return samples
    light = samples.weight * np.abs(samples.wo[:, 2])
    of_peaks = light * samples.f.mean(axis=1)
    density = light / max(float(light.sum()), 1e-300) + of_peaks / max(float(of_peaks.sum()), 1e-300) + 1e-12
    summed = np.cumsum(density)
    drawn = np.searchsorted(summed, (np.arange(_TUPLES) + 0.5) / _TUPLES * summed[-1]).clip(max=len(samples) - 1)
    some = samples.take(drawn)
    return replace(some, weight=some.weight / density[drawn])


def looked_up(way: Reconstruction, wi: Floats, wo: Floats) -> Callable[[Floats], list[tuple[Floats, Any, bool]]]:
    """Where to look up the sheets of neighbouring incident directions (N, 3) for the pairs wi, wo (N, 3).

    The returned function gives directions (N, 3), their weights (N), and whether they belong to a peak about the light.
    """
    if way == "quadrilinear":
        return lambda neighbour: [(wo, 1.0, False)]
    h = half_vector(wi, wo)
    if way == "half_vector":
        return lambda neighbour: [(reflect(neighbour, h), 1.0, False)]
    share, behind = back_share(components(wi), components(wo)), reflect(wo, wi)

    def both(neighbour: Floats) -> list[tuple[Floats, Any, bool]]:
        mirrored = reflect(neighbour, h)
        # two half turns, about wi and about the midpoint: the shortest rotation from wi to the neighbour
        turned = reflect(behind, half_vector(wi, neighbour))
        # if h is the neighbour itself, its peak about the light would appear elsewhere
        of_light = np.maximum(share, back_share(components(neighbour), components(mirrored)))
        return [(mirrored, 1 - of_light, False), (turned, of_light, True)]

    return both
