"""Measured tables, and fits to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from lambent.api.materials import Material
from lambent.api.progress import Wanted, progress_of
from lambent.core.arrays import Floats
from lambent.materials.fitting.choices import DISTRIBUTION, DistributionChoice
from lambent.materials.measured import load
from lambent.materials.measured.protocol import MeasuredSamples, MeasuredTable

if TYPE_CHECKING:
    from lambent.materials.fitting.result import FitResult


Reconstruction = Literal["auto", "half_vector", "back_vector", "quadrilinear"]


class Table:
    """A measured material, of any format.

    Directions are unit vectors (..., 3) in the local frame with n = +z, away from the surface: wi to the light, wo to
    the viewer. wo.z < 0 is transmission.
    """

    def __init__(self, table: MeasuredTable, file: Path | None = None) -> None:
        self.table, self.file = table, file
        self._samples: MeasuredSamples | None = None

    @classmethod
    def read(cls, file: str | Path, reconstruction: Reconstruction = "auto") -> Table:
        """Read a measured file; see `lambent.read`."""
        return cls(load(Path(file), reconstruction), Path(file))

    @property
    def name(self) -> str:
        return self.table.info.file

    @property
    def samples(self) -> MeasuredSamples:
        """The usable tuples: wi, wo (N, 3), f (N, C) in 1/sr, weight (N,)."""
        if self._samples is None:
            self._samples = self.table.samples()
        return self._samples

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr without the cosine, of wi, wo (..., 3); holes are filled from their neighbours."""
        return self.table.eval(np.asarray(wi, float), np.asarray(wo, float))

    def albedo(self, wi: Floats) -> Floats:
        """Share (..., C) of the light from wi (..., 3) that is scattered to either side."""
        return self.table.albedo(np.asarray(wi, float))

    def fit(
        self,
        lobes: int | Literal["auto", "curve"] = "auto",
        *,
        metric: str = "cuberoot",
        distribution: DistributionChoice = DISTRIBUTION,
        coupled: bool = False,
        keep_albedo: bool = False,
        retro: bool | None = None,
        gain: float = 0.05,
        fix: Mapping[str, Any] | None = None,
        ranges: Mapping[str, tuple[float, float]] | None = None,
        seed: int = 0,
        progress: Wanted = None,
    ) -> Fit:
        """Fit a diffuse term and lobes.

        Parameters
        ----------
        lobes
            1 to 4 per side; "curve", one lobe shaped by curves; or "auto", which adds lobes while each removes at least
            the share `gain` of the error, and takes a curve lobe where that predicts held-out tuples better.
        metric : {"l1", "l2_ngan", "cuberoot", "log"}
            The error to minimise.
        distribution, coupled, keep_albedo, retro, fix, ranges, seed
            As the options of `lambent fit`.
        progress : bool or callable, optional
            Whether to show a bar; by default in a terminal or a notebook. A callable gets (done, total, what).

        Raises
        ------
        UserError
            If an option is unknown, or the table has too few usable tuples.
        """
        from lambent.materials.fitting.fit import fit

        with progress_of(progress) as bar:
            result = fit(
                self.samples, lobes=lobes, metric=metric, distribution=distribution, coupled=coupled, retro=retro,
                gain=gain, fix=fix, ranges=ranges, seed=seed, source=self.file, progress=bar, whole=self.table,
                keep_albedo=keep_albedo,
            )  # fmt: skip
        return Fit(self, result)

    def facts(self) -> dict[str, Any]:
        """Format, dimensions, usable share, albedo and faults, by name."""
        from lambent.materials.measured.inspecting import inspection

        facts = inspection.inspect_table(self.table)
        return {"is": "measured table", **facts, "findings": facts["findings"] or ["no faults found"]}

    def plot(self, file: str | Path) -> None:
        """Draw the plane of incidence above the polar matrix of the raw tuples (.png, .pdf, .svg)."""
        from lambent.materials.plots import plot_measurement

        plot_measurement(Path(file), self.table, title=self.name)

    def __repr__(self) -> str:
        info = self.table.info
        size = " x ".join(map(str, info.sizes.values()))
        sides = "reflection and transmission" if info.transmits else "reflection"
        low, high = self.samples.f.min(), self.samples.f.max()
        return (
            f"Table({info.file!r}, {info.format}, {size}, {'RGB' if info.channels == 3 else 'grey'}, {sides}, "
            f"{'isotropic' if info.isotropic else 'anisotropic'}, f {low:.3g} to {high:.3g} 1/sr)"
        )

    def _repr_png_(self) -> bytes:
        from lambent.api.pictures import png_of_plot

        return png_of_plot(self.plot)


@dataclass(frozen=True)
class Fit:
    """A material fitted to a table, and its quality."""

    table: Table
    result: FitResult

    @property
    def material(self) -> Material:
        """The fitted material, with its provenance."""
        return Material(self.result.material)

    @property
    def errors(self) -> dict[str, float]:
        """Error by metric."""
        return self.result.errors

    @property
    def lambertian_errors(self) -> dict[str, float]:
        """Error of the best Lambertian surface, by metric."""
        return self.result.lambertian_errors

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the numbers."""
        return self.result.warnings

    def plots(self, folder: str | Path, stem: str = "fit") -> list[Path]:
        """Write STEM_polar.png, STEM_in_plane.png and STEM_albedo.png into a folder."""
        from lambent.materials.fitting.shown.plot import save_plots

        return save_plots(self.table.samples, self.result.material, Path(folder), stem)

    def report(self, file: str | Path, *, environment: str | Path | None = None, progress: Wanted = None) -> None:
        """Write a full report as one page (.html), with previews under a lat-long image, by default daylight."""
        from lambent.core.files import write_text
        from lambent.report import fit_report
        from lambent.scenes.scene import ImageEnvironment

        around = ImageEnvironment(Path(environment)) if environment is not None else None
        with progress_of(progress) as bar:
            page = fit_report.report(
                self.table.table, self.table.samples, self.result, source=self.table.file, environment=around,
                progress=bar,
            )  # fmt: skip
        write_text(Path(file), page)

    def __repr__(self) -> str:
        material = self.result.material
        metric = str(material.provenance.metric) if material.provenance else "cuberoot"
        error, rival = self.errors[metric], max(self.lambertian_errors[metric], 1e-30)
        share = f"{metric} error {error:.3g}, {error / rival:.0%} of a Lambertian surface's"
        return f"Fit({self.table.name!r}, {len(material.lobes)} lobe(s), {share})"
