"""A luminaire as a photometric file describes it: what it is, its lamps, and its intensities."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from lambent.core.errors import UserError
from lambent.scenes.photometry.distribution import Photometry

KLM = 1000.0


@dataclass(frozen=True)
class LampSet:
    """Lamps that a luminaire can hold.

    Attributes
    ----------
    count : int
        Number of lamps.
    lumens, watts : float
        Of all lamps of the set together, 0 where the file leaves them open; of an absolute measurement in EULUMDAT, the
        lumens are the luminaire's own.
    """

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
    format, symmetry : str
        In words.
    name, maker, report : str
        Of the luminaire, its maker, and its measurement; empty where the file has none.
    sets : tuple of LampSet
        Alternatives, at least one.
    values : Photometry
        Intensities in candela; with `per_klm`, in candela per 1000 lm of the lamps.
    absolute : bool
        Whether the luminaire's own flux was measured, without reference to its lamps'.
    ratio, downward : float or None
        Light output ratio of the luminaire, and the share of its flux below the horizontal, as stated: 0 to 1.
    measured_tilt_deg : float
        Tilt of the luminaire while it was measured. Intensities are those of the tilted luminaire.
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

    def lamps(self, lamp_set: int = 0) -> LampSet:
        """The lamp set of that index; raise `UserError` if there is none."""
        if not 0 <= lamp_set < len(self.sets):
            fault, expected = "has no such lamp set", f"0 to {len(self.sets) - 1}"
            raise UserError(fault, file=self.file, field="lamp_set", got=lamp_set, expected=expected)
        return self.sets[lamp_set]

    def photometry(self, lamp_set: int = 0) -> Photometry:
        """Intensities in candela with the lamp set of that index."""
        lumens = self.lamps(lamp_set).lumens
        if self.per_klm and not lumens:
            hint = "write the flux of the lamps into the file, or give the light's lumens"
            raise UserError("lamp set has no luminous flux", file=self.file, field=f"lamp set {lamp_set}", hint=hint)
        return self.values.scaled(lumens / KLM) if self.per_klm else self.values

    def stated_lumens(self, lamp_set: int = 0) -> float | None:
        """Flux of the luminaire by its lamps and their light output ratio; None if the file leaves it open."""
        return self.ratio * self.lamps(lamp_set).lumens if self.ratio else None
