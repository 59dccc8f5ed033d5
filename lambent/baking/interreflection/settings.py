"""Settings for baking the interreflections of an edited view."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lambent.core.errors import UserError

MOST_HITS = 6


@dataclass(frozen=True)
class Bounces:
    """Series of bands, samples and materials of the interreflections of a view.

    Attributes
    ----------
    series : tuple of int
        Bands of curves with narrow peaks at the surface that a pixel shows, at the next one, ... (Ben-Artzi 2007,
        section 5.2); 1 stands for the equivalent albedo. Its length is the number of surfaces on the longest path.
    samples : int
        Paths per pixel. More can be added to a store later.
    fixed : frozenset of str
        Uneditable materials. They scatter by their own BRDF and need neither bands nor tails.
    diffuse_seen : bool
        Treat surfaces seen in others as Lambertian, as in the thesis, instead of keeping the shape of their baked
        lobes. Intended for edits that replace narrow lobes by anything else.
    """

    series: tuple[int, ...] = (64, 1, 1, 1)
    samples: int = 1024
    fixed: frozenset[str] = frozenset()
    diffuse_seen: bool = False

    def __post_init__(self) -> None:
        wrong = "cannot be read as a series of bands"
        faults = (
            (not 2 <= len(self.series) <= MOST_HITS, wrong, f"2 to {MOST_HITS} numbers"),
            (any(n < 1 or n > 256 or n & (n - 1) for n in self.series), wrong, "powers of two up to 256"),
            (any(n > 1 for n in self.series[2:]), "bands beyond the second surface", "1 from the third number on"),
        )
        for fault, message, expected in faults:
            if fault:
                raise UserError(message, field="series", got=",".join(map(str, self.series)), expected=expected)
        if self.samples < 1:
            raise UserError("no samples", field="samples", got=self.samples, expected="at least 1")

    def said(self) -> dict[str, Any]:
        """For JSON; `Bounces.of` is the inverse."""
        return {"series": list(self.series), "samples": self.samples, "fixed": sorted(self.fixed)}

    @classmethod
    def of(cls, said: Mapping[str, Any]) -> Bounces:
        return cls(tuple(said["series"]), said["samples"], frozenset(said["fixed"]))

    @classmethod
    def of_text(cls, text: str) -> tuple[int, ...]:
        """Parse a series such as "64,1,1,1"."""
        try:
            return tuple(int(part) for part in text.split(","))
        except ValueError:
            raise UserError(
                "cannot be read as a series of bands", field="series", got=text, expected="numbers, as in 64,1,1,1"
            ) from None
