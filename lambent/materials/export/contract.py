"""What every writer of this package takes and says.

A writer is a module of this package with

    NAME = "MERL binary"                # how it is shown
    ENDINGS = (".binary",)              # file endings it is the natural choice for; may be shared with others
    TAKES = ("table", "material")       # what it can be given
    write(subject, path, progress) -> Cost

The module's name is what `lambent convert --as` takes. A material given to a writer of tables is sampled; a table given
to a writer of materials is refused: it has to be fitted first.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Protocol

from lambent.core.progress import Progress
from lambent.materials.document import Material
from lambent.materials.measured.protocol import MeasuredTable

Subject = Material | MeasuredTable
Kind = Literal["table", "material"]


@dataclass(frozen=True)
class Cost:
    """What a conversion loses.

    Attributes
    ----------
    lost : tuple of str
        In words: what the format cannot hold, and what stands in its place.
    errors : dict of float
        Metric name -> E between the subject and what the written file says, in the metric's unit.
    share : dict of float
        The same as a share of the subject's own size under that metric (E against black).
    """

    lost: tuple[str, ...] = ()
    errors: dict[str, float] = field(default_factory=dict)
    share: dict[str, float] = field(default_factory=dict)


class Writer(Protocol):
    """What a module of this package offers."""

    NAME: str
    ENDINGS: tuple[str, ...]
    TAKES: tuple[Kind, ...]

    def write(self, subject: Subject, path: Path, progress: Progress) -> Cost:
        """Write the file, atomically, or raise `UserError`."""
        ...
