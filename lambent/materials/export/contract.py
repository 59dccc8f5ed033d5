"""The contract of the writers in this package, and the verdict on an export in one word, with all limits.

A writer is a module of this package, found by name or by file suffix, with

    NAME = "MERL binary"                # the name to show
    ENDINGS = (".binary",)              # file endings of the format; may be shared with others
    TAKES = ("table", "material")       # subjects it accepts
    write(subject, path, progress) -> Cost

`lambent convert --as` takes the module's name. A writer of tables samples a material; a writer of materials refuses a
table, which must be fitted first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Literal, Protocol, cast

import lambent.materials.export as package
from lambent.core.discovery import known, modules_in
from lambent.core.errors import UserError
from lambent.core.progress import Progress
from lambent.materials.document import Material, Side
from lambent.materials.measured.protocol import MeasuredTable


@cache
def writers() -> dict[str, Writer]:
    """All writers by module name, in alphabetical order."""
    return {name: cast(Writer, module) for name, module in modules_in(package, having="write").items()}


def writer_for(path: Path, name: str | None = None) -> Writer:
    """The writer called `name`, or the only one for this file suffix.

    Raises
    ------
    UserError
        If the name is unknown, or no format or several use the suffix.
    """
    found = writers()
    if name is not None:
        return found[known("format", name, found)]
    fitting = [key for key, writer in found.items() if path.suffix.lower() in writer.ENDINGS]
    if len(fitting) == 1:
        return found[fitting[0]]
    if fitting:
        hint = f"choose one: --as {' or --as '.join(fitting)}"
        raise UserError("several formats have this ending", file=path, hint=hint)
    endings = sorted({ending for writer in found.values() for ending in writer.ENDINGS})
    raise UserError("unknown ending", file=path, got=path.suffix or "none", expected=", ".join(endings))


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


Subject = Material | MeasuredTable
Kind = Literal["table", "material"]


@dataclass(frozen=True)
class Cost:
    """Losses of a conversion.

    Attributes
    ----------
    lost : tuple of str
        Sentences on what the format cannot represent and its replacement.
    errors : dict of float
        Metric name -> E between the subject and the written file, in the metric's unit.
    share : dict of float
        The errors relative to the subject's own size under that metric (E against black).
    light : dict of float
        Side -> light scattered to that side, written file over subject.
    towards_light : float
        f back towards the light, written file over subject, if retro lobes were left out.
    """

    lost: tuple[str, ...] = ()
    errors: dict[str, float] = field(default_factory=dict)
    share: dict[str, float] = field(default_factory=dict)
    light: dict[Side, float] = field(default_factory=dict)
    towards_light: float = 1.0

    @property
    def verdict(self) -> Verdict:
        """Whether the file represents the subject: one word with its reason."""
        return verdict_of(self.share, self.light, self.towards_light)


class Writer(Protocol):
    """Interface of a writer module."""

    NAME: str
    ENDINGS: tuple[str, ...]
    TAKES: tuple[Kind, ...]

    def write(self, subject: Subject, path: Path, progress: Progress) -> Cost:
        """Write the file, atomically, or raise `UserError`."""
        ...
