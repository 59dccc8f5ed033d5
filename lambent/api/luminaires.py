"""A luminaire of a photometric file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from lambent.scenes.photometry.files import read_luminaire
from lambent.scenes.photometry.luminaire import Luminaire as Photometry


class Luminaire:
    """A luminaire of an IES or EULUMDAT file: its flux and luminous intensities."""

    def __init__(self, photometry: Photometry) -> None:
        self.photometry = photometry

    @classmethod
    def read(cls, file: str | Path) -> Luminaire:
        """Read a photometric file; raises `UserError` if it cannot be used."""
        return cls(read_luminaire(Path(file)))

    def facts(self) -> dict[str, Any]:
        """Name, flux, angles and faults, by name."""
        from lambent.scenes.photometry.inspection import facts_of

        return {"is": "luminaire", **facts_of(self.photometry)}

    def plot(self, file: str | Path) -> None:
        """Draw its polar diagram (.png, .pdf, .svg)."""
        from lambent.scenes.photometry.inspection import plot_polar

        plot_polar(Path(file), self.photometry)
