"""Illuminance on calculation grids of a store, as a table of points and as pages with plans."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, cast

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.files import write_bytes, write_text
from lambent.core.light.false_colour import STOPS, fitting_range, number
from lambent.core.outputs import MARK
from lambent.core.plain import printable
from lambent.core.progress import Progress
from lambent.materials.plots import new_figure
from lambent.render.images import Settings
from lambent.render.output import Note, images
from lambent.render.traced import TracedImages
from lambent.scenes.grids import Grid
from lambent.scenes.loaders.scene_toml.grids import GridSection
from lambent.store.contract import scene_record
from lambent.store.store import MANIFEST, Store
from lambent.traced.room import why_untraceable

A4_INCHES = (11.69, 8.27)
MOST_NUMBERS, SMALL = 500, {"ha": "center", "va": "center", "fontsize": 6}  # points of a plan with a number, its style


@dataclass(frozen=True, eq=False)
class Illuminated:
    """Illuminance (n,) and its standard error (n,), lx, at the points of a grid in one state of the light."""

    grid: Grid
    state: str
    lx: Floats
    error_lx: Floats

    def facts(self) -> dict[str, Any]:
        """Results in lx, uniformities U0 = min/mean and Ud = min/max, and the worst relative standard error."""
        mean, least, most = (float(f(self.lx)) for f in (np.mean, np.min, np.max))
        results = {"mean_lx": mean, "min_lx": least, "max_lx": most, "U0": least / max(mean, 1e-9)}
        results |= {"Ud": least / max(most, 1e-9), "standard_error": float((self.error_lx / (self.lx + 1e-9)).max())}
        return {"grid": self.grid.name, "light": self.state, "points": len(self.lx), **results}


def illuminated(
    store: Store, settings: Settings, wanted: GridSection | Sequence[str], state: str, limit: float, maintenance: float,
    note: Note, progress: Progress,
) -> list[Illuminated]:  # fmt: skip
    """Trace grids in the state of `settings`, to a relative standard error `limit`; results times `maintenance`.

    They are the scene's grids of the names `wanted`, by default all, or the one described; without points within closed
    objects, such as furniture. `UserError` if the store cannot be traced or has no such grid or light.
    """
    if why := why_untraceable(store):
        raise UserError(f"cannot be traced: {why}", file=store.folder)
    traced, results = cast(TracedImages, images(store, settings, note=note)), []
    grids = {one.name: one for one in traced.scene.grids}
    if isinstance(wanted, GridSection):
        grids, wanted = {wanted.name: wanted.grid(traced.scene.objects, None, "--object")}, []
    if not grids:
        raise UserError(
            "scene has no grids", file=store.folder, hint="add [[grids]] to its scene.toml, or --object NAME"
        )
    for grid in [grids[known("grid", name, grids, field="--grid")] for name in wanted or grids]:
        lx, error_lx = traced.room().illuminance(grid.points, grid.normal, limit, progress)
        inside, free = grid.inside.copy(), np.isfinite(lx)
        inside[inside] = free
        values = lx[free] * maintenance, error_lx[free] * maintenance
        results.append(Illuminated(replace(grid, inside=inside), state, *values))
    return results


def write_points(path: Path, results: Sequence[Illuminated]) -> None:
    """Write all points as CSV: position, m; illuminance and its standard error, lx; grid and state."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(("x_m", "y_m", "z_m", "lx", "standard_error_lx", "grid", "light"))
    for one in results:
        for point, *values in zip(one.grid.points, one.lx, one.error_lx, strict=True):
            table.writerow([*(f"{x:.4f}" for x in point), *(f"{x:.5g}" for x in values), one.grid.name, one.state])
    write_text(path, text.getvalue())


def write_pages(path: Path, results: Sequence[Illuminated], store: Store, note: str) -> None:
    """Write a PDF with a page for each result: a plan with false colours, isolux lines and numbers; and a table."""
    from matplotlib.backends.backend_pdf import PdfPages

    baked = datetime.fromtimestamp((store.folder / MANIFEST).stat().st_mtime)
    title = printable(f"{scene_record(store).name} ({store.folder.name}), baked {baked:%Y-%m-%d %H:%M}")
    drawn = io.BytesIO()  # a PDF's writer hides the error of a full disk behind one of its own
    with PdfPages(drawn, metadata={"Creator": MARK}) as pages:
        for one in results:
            figure, grid = new_figure(*A4_INCHES), one.grid
            plan, beside = figure.subplots(1, 2, width_ratios=(3, 1))
            figure.suptitle(title, parse_math=False)
            _draw_plan(figure, plan, one)
            facts = {name: f"{value:.4g}" if isinstance(value, float) else value for name, value in one.facts().items()}
            places = {"corner, m": grid.corner, "edges, m": grid.edges, "normal": grid.normal}
            facts |= {name: np.round(value, 3).tolist() for name, value in places.items()}
            lines = [printable(f"{name}: {value}") for name, value in facts.items()]
            beside.text(0, 1, "\n\n".join([*lines, note]), va="top", fontsize=9, parse_math=False, wrap=True)
            beside.axis("off")
            pages.savefig(figure)
    write_bytes(path, drawn.getvalue())


def _draw_plan(figure: Any, axis: Any, one: Illuminated) -> None:
    """Draw false colours, isolux lines and numbers over the grid's own axes, m."""
    from matplotlib.colors import LinearSegmentedColormap

    scale, (width, height) = fitting_range(one.lx, log=False), np.linalg.norm(one.grid.edges, axis=1)
    (rows, columns), shown = one.grid.inside.shape, np.full(one.grid.inside.shape, np.nan)
    shown[one.grid.inside] = one.lx
    colours = {"cmap": LinearSegmentedColormap.from_list("lx", STOPS), "vmin": scale.low, "vmax": scale.high}
    drawn = axis.imshow(shown, origin="lower", extent=(0, width, 0, height), **colours)
    figure.colorbar(drawn, ax=axis, label="lx", location="bottom")
    levels = [mark for mark in scale.marks() if one.lx.min() < mark < one.lx.max()]
    x, y = (np.arange(columns) + 0.5) * width / columns, (np.arange(rows) + 0.5) * height / rows
    if levels and min(rows, columns) > 1:
        lines = axis.contour(x, y, shown, levels=levels, colors="black", linewidths=0.8)
        axis.clabel(lines, fmt=lambda value: number(float(value)), fontsize=8)
    for row, column in np.argwhere(one.grid.inside) if len(one.lx) <= MOST_NUMBERS else ():
        dark = shown[row, column] < scale.high / 4
        axis.text(x[column], y[row], number(float(shown[row, column])), color="white" if dark else "black", **SMALL)
    axis.set(xlabel="along the first edge, m", ylabel="along the second edge, m")
