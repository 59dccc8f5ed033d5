"""A luminaire as a photometric file describes it: what it is, its lamps, and its intensities."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from lambent.core.errors import UserError
from lambent.scenes.photometry.distribution import Photometry

KLM = 1000.0


@dataclass(frozen=True)
class LampSet:
    """Lamps that a luminaire can hold: their number, and `lumens` and `watts` together, 0 where the file has none."""

    count: int
    kind: str
    lumens: float
    watts: float
    colour: str = ""


@dataclass(frozen=True)
class Luminaire:
    """A luminaire.

    Attributes
    ----------
    format, symmetry, name, maker, report : str
        In words; the last three are empty where the file has none.
    sets : tuple of LampSet
        Alternatives, at least one.
    values : Photometry
        Intensities in candela; with `per_klm`, in candela per 1000 lm of the lamps.
    absolute : bool
        Whether the luminaire itself was measured. In EULUMDAT, the lumens of its lamps are then its own.
    ratio, downward : float or None
        Light output ratio, and share of the flux below the horizontal, as stated: 0 to 1.
    measured_tilt_deg : float
        Tilt of the luminaire while it was measured. Intensities are those of the tilted luminaire.
    notes : tuple of str
        What of the file was not taken as it is.
    """

    file: Path
    format: str
    symmetry: str
    name: str
    maker: str
    report: str
    sets: tuple[LampSet, ...]
    values: Photometry
    per_klm: bool
    absolute: bool
    ratio: float | None = None
    downward: float | None = None
    measured_tilt_deg: float = 0.0
    notes: tuple[str, ...] = ()

    def photometry(self, lamp_set: int = 0) -> Photometry:
        """Intensities in candela with the lamp set of that index; `UserError` if there is none, or none with a flux."""
        error = partial(UserError, file=self.file, field="lamp_set", got=lamp_set)
        if not 0 <= lamp_set < len(self.sets):
            raise error("has no such lamp set", expected=f"0 to {len(self.sets) - 1}")
        lumens = self.sets[lamp_set].lumens
        if self.per_klm and not lumens:
            raise error("has no luminous flux", hint="write it into the file, or give the light's lumens")
        return self.values.scaled(lumens / KLM) if self.per_klm else self.values
