"""The contract of the writers in this package.

A writer is a module of this package with

    NAME = "MERL binary"                # the name to show
    ENDINGS = (".binary",)              # file endings of the format; may be shared with others
    TAKES = ("table", "material")       # subjects it accepts
    write(subject, path, progress) -> Cost

`lambent convert --as` takes the module's name. A writer of tables samples a material; a writer of materials refuses a
table, which must be fitted first.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from lambent.core.progress import Progress
from lambent.materials.document import Material, Side
from lambent.materials.export.matching.verdict import Verdict, verdict_of
from lambent.materials.measured.protocol import MeasuredTable

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
