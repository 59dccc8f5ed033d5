"""Which objects get a light field where nobody says it: those whose probe shows viewers most that is wrong.

What is wrong with an object is the error of its look-ups times the solid angle that it takes for viewers. Points are
given where they take most of that away for their memory, until a budget is spent. A number of points is only taken
where it lowers the error of the one before to WORTH, and that of points held out from the choice, too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from lambent.bake.light_fields.trial import Trial

WORTH = 0.85
CHECKED = 0.95  # the same at places that are held out, where noise does not favour what is chosen
SHARE = 0.0002  # of what is wrong with all objects: those with less are not tried
MOST_TRIED = 48


@dataclass(frozen=True)
class Chosen:
    """One object's light field, and what the trial found: errors in log(1 + L/median) of what viewers see."""

    object: str
    points: int
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


def chosen(trials: Mapping[str, Trial], texels: int, budget_mb: float, bytes_per_texel: float) -> list[Chosen]:
    """The objects that get a light field within a budget, the most worth first, and how many points each."""
    megabytes = texels**2 * bytes_per_texel / 1e6  # of a point
    taken = dict[str, int]()
    left = budget_mb
    while True:
        best, gain = None, 0.0
        for name, trial in trials.items():
            before = taken.get(name, 0)
            error, check = trial.fields[before] if before else trial.probe, trial.held_out[before]
            for count, found in trial.fields.items():
                cost = (count - before) * megabytes
                falls = found < WORTH * error and trial.held_out[count] < CHECKED * check
                if count > before and cost <= left and falls:
                    worth = (error - found) * trial.size_sr / cost
                    if worth > gain:
                        best, gain = (name, count, cost), worth
        if best is None:
            break
        taken[best[0]], left = best[1], left - best[2]
    return [
        Chosen(name, count, count * megabytes, trials[name].probe, trials[name].fields[count], trials[name].size_sr)
        for name, count in taken.items()
    ]
