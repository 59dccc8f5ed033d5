"""Which objects get a light field where nobody says it: those whose probe shows viewers most that is wrong.

What is wrong with an object is the error of its look-ups times the solid angle that it takes for viewers. Memory goes
where it takes most of that away, until a budget is spent or a megabyte takes away too little of it. A light field is
only taken where it lowers the error by a share WORTH of the probe's, and certainly lowers that at places held out from
the choice, too.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from lambent.baking.light_fields.trial import PROBE, Option, Trial

WORTH = 0.05
PER_MB = 0.0001  # of what is wrong with all objects that are tried: what a megabyte takes away at least
CERTAINTY = 2.0  # standard errors by which the error falls at places held out, where noise does not favour the choice
SHARE = 0.0002  # of what is wrong with all objects: those with less are not tried
MOST_TRIED = 48


@dataclass(frozen=True)
class Chosen:
    """One object's light field, and what the trial found: errors in log(1 + L/median) of what viewers see."""

    object: str
    points: int
    texels: int
    megabytes: float
    probe_error: float
    error: float
    size_sr: float

    def said(self) -> dict[str, Any]:
        return asdict(self)


def worth_trying(wrong: Mapping[str, float]) -> list[str]:
    """Of objects, by what is wrong with them, those that are tried, the worst first."""
    total = sum(wrong.values())
    names = sorted(wrong, key=lambda name: (-wrong[name], name))
    return [name for name in names if wrong[name] > SHARE * total][:MOST_TRIED]


def chosen(
    trials: Mapping[str, Trial], budget_mb: float, bytes_per_texel: float, sample_map_mb: Callable[[str, int], float]
) -> list[Chosen]:
    """The objects that get a light field within a budget, the most worth first, and which.

    `sample_map_mb` is the memory of a sample map, MB, by object and number of points.
    """
    taken, left = dict[str, Option](), budget_mb
    least = PER_MB * sum(trial.probe * trial.size_sr for trial in trials.values())  # of a megabyte

    def megabytes(name: str, option: Option) -> float:
        if option == PROBE:
            return 0.0
        return option.points * option.texels**2 * bytes_per_texel / 1e6 + sample_map_mb(name, option.points)

    while True:
        best, gain, cost = None, 0.0, 0.0
        for name, trial in trials.items():
            before = taken.get(name, PROBE)
            for option, error in trial.fields.items():
                more, falls = megabytes(name, option) - megabytes(name, before), trial.error(before) - error
                if not 0 < more <= left or falls <= WORTH * trial.probe:
                    continue
                worth = falls * trial.size_sr / more
                if worth > max(gain, least) and trial.falls(before, option, CERTAINTY):
                    best, gain, cost = (name, option), worth, more
        if best is None:
            break
        taken[best[0]], left = best[1], left - cost
    return [
        Chosen(name, *option, megabytes(name, option), trial.probe, trial.error(option), trial.size_sr)
        for name, option in taken.items()
        for trial in (trials[name],)
    ]
