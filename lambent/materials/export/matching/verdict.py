"""The verdict on an export in one word; all limits are in this file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from lambent.materials.document import Side

# E relative to the subject's own size: (faithful up to, approximate up to). L1 is light in wrong directions; the
# cube root is close to what is seen; Ngan's L2 sees peaks above all: beyond 1 they are worse than a black surface.
LIMITS: dict[str, tuple[float, float]] = {
    "l1": (0.1, 0.5),
    "l2_ngan": (0.3, 1.0),
    "cuberoot": (0.1, 0.35),
    "log": (0.2, 0.75),
}
LIGHT_LIMITS = (0.05, 0.25)  # relative difference of the light to either side
RETRO_LIMITS = (0.3, 0.75)  # of f back towards the light, the purpose of retro-reflective tape
_LIGHT: dict[Side, str] = {"reflection": "reflected light", "transmission": "transmitted light"}


@dataclass(frozen=True)
class Verdict:
    """Whether an export represents its subject.

    Attributes
    ----------
    word : str
        faithful, approximate or unusable; "not compared" without errors to judge by.
    reason : str
        The figures that decided it.
    """

    word: Literal["faithful", "approximate", "unusable", "not compared"]
    reason: str

    def __str__(self) -> str:
        return f"{self.word}: {self.reason}"


def verdict_of(share: Mapping[str, float], light: Mapping[Side, float], towards_light: float = 1.0) -> Verdict:
    """The verdict from errors relative to the subject's size, and from ratios written over subject.

    `light` is the ratio of scattered light per side, `towards_light` that of f back towards the light. The worst figure
    decides; all figures beyond the same limit are named.
    """
    if not share:
        return Verdict("not compared", "the file was not compared with its source")
    measures = [(f"{name} {value:.0%}", value, *LIMITS[name]) for name, value in share.items()]
    measures += [(f"{_LIGHT[side]} {ratio:.2f} times", abs(ratio - 1), *LIGHT_LIMITS) for side, ratio in light.items()]
    if towards_light != 1:
        measures.append((f"f towards the light {towards_light:.2g} times", abs(towards_light - 1), *RETRO_LIMITS))
    unusable = [f"{text} (limit {limit:.0%})" for text, value, _, limit in measures if not value <= limit]
    if unusable:
        return Verdict("unusable", ", ".join(unusable))
    approximate = [f"{text} (faithful to {limit:.0%})" for text, value, limit, _ in measures if value > limit]
    if approximate:
        return Verdict("approximate", ", ".join(approximate))
    return Verdict("faithful", ", ".join(text for text, *_ in measures))
