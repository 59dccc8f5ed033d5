"""Plots of a fit and its measurement (thesis figures 3.11, 3.12, 3.14): polar plots, in-plane curves, albedo."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.geometry.directions import Floats, direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import BLACK, Material
from lambent.materials.fitting.shown.incidence import (
    Incidence,
    brightness,
    disk_directions,
    in_plane_directions,
    in_plane_tuples,
    incidences,
    measured_disk,
)
from lambent.materials.fitting.shown.slices import Slice
from lambent.materials.measured.inspecting.metrics import Metric
from lambent.materials.measured.protocol import MeasuredSamples
from lambent.materials.plots import DISK_PIXELS, SOURCE, disk_places, draw_disk, new_figure, save_figure, white_of

MEASURED, MODEL = "#1a7f37", "#c62828"
COLUMNS = 4
LABELS = {"m": "$m_x = m_y$", "mx": "$m_x$", "my": "$m_y$", "r0": "$r_0$", "alpha": "$\\alpha$"}


def save_plots(samples: MeasuredSamples, material: Material, folder: Path, stem: str = "fit") -> list[Path]:
    """Write STEM_polar.png, STEM_in_plane.png and STEM_albedo.png into `folder`.

    Raises
    ------
    UserError
        A file cannot be written.
    """
    gathered = incidences(samples)
    figures = (
        polar_matrix(gathered, material, samples.info.transmits),
        in_plane(gathered, material),
        albedo(gathered, material),
    )
    paths = plot_files(folder, stem)
    for path, figure in zip(paths, figures, strict=True):
        save_figure(figure, path, dpi=110)
    return paths


def plot_files(folder: Path, stem: str) -> list[Path]:
    """The files that `save_plots` writes."""
    return [Path(folder) / f"{stem}_{name}.png" for name in ("polar", "in_plane", "albedo")]


def polar_matrix(gathered: Sequence[Incidence], material: Material, transmits: bool) -> Any:
    """Figure: disks of measured and model brightness, rows theta_i and columns phi_i.

    With a single phi_i (isotropic tables) theta_i runs along the columns and the measurement is above the model,
    otherwise left of it; the far side is below the near one, in the same azimuths. The source is at the top of
    every disk (theta_o from the centre to the rim); the bars are the brushing direction, along which the fitted lobe is
    narrower.
    """
    placed, (rows, columns) = disk_places(gathered, transmits)
    upright = len({entry.phi_deg for entry in gathered}) == 1
    drawn = [_disks(entry, material, far) for entry, far, _ in placed]
    white = white_of(disk for pair in drawn for disk in pair)
    size = min(1.5, 10 / columns) if upright else min(1.05, 5.2 / columns)
    if upright:
        figure = new_figure(columns * size + 1.2, 2 * rows * size + 1.3)
        halves = figure.subfigures(2, 1)
    else:
        figure = new_figure(2 * columns * size + 1.6, rows * size + 1.2)
        halves = figure.subfigures(1, 2)
    for which, (half, title) in enumerate(zip(halves, ("measured", "model"), strict=True)):
        half.suptitle(title, fontsize=11)
        axes = half.subplots(rows, columns, squeeze=False)
        for ax in axes.flat:
            ax.set_axis_off()
        labelled = set()
        for (entry, far, place), pair in zip(placed, drawn, strict=True):
            theta_deg, phi_deg, ax = entry.theta_deg, entry.phi_deg, axes[place]
            across, down = (theta_deg, phi_deg) if upright else (phi_deg, theta_deg)
            _show_disk(ax, pair[which] / white, theta_deg, phi_deg, _brushing(material))
            across_name, down_name = ("theta", "phi") if upright else ("phi", "theta")
            if place[1] == 0:
                side = ("transmitted" if far else "reflected") if transmits else ""
                text = side if upright else f"$\\{down_name}_i$ {down:g}°" + (f"\n{side}" if side else "")
                ax.text(-1.3, 0, text, ha="right", va="center", fontsize=8, rotation=90 if upright else 0)
            if across not in labelled and (upright or theta_deg > 0):
                ax.set_title(f"$\\{across_name}_i$ {across:g}°", fontsize=8)
                labelled.add(across)
    _legend(figure, "cube root of the transfer probability (blue: not measured)", _brushing(material) is not None)
    return figure


def _legend(figure: Any, title: str, brushed: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [Line2D([], [], ls="", marker="o", ms=4, mfc=SOURCE, mec="black", mew=0.4, label="source")]
    if brushed:
        handles.append(Line2D([], [], color="0.4", lw=2, label="brushing direction"))
    handles.insert(0, Line2D([], [], ls="", label=title))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8, frameon=False)


def _brushing(material: Material) -> float | None:
    """phi in degrees of the axis along which the first lobe is narrower; None for an isotropic material."""
    if not material.lobes or material.lobes[0].mx == material.lobes[0].my:
        return None
    return 0.0 if material.lobes[0].mx < material.lobes[0].my else 90.0


def _disks(entry: Incidence, material: Material, far: bool) -> tuple[Floats, Floats]:
    """Measured and model brightness, each (pixels, pixels, 3), NaN where unknown, with the source at the top."""
    wo, inside = disk_directions(DISK_PIXELS, entry.phi_deg, far)
    model = brightness(MaterialBSDF(material).eval(np.broadcast_to(entry.wi, wo.shape), wo), wo)
    model = np.where(inside[..., None], model, np.nan)
    return np.array(np.broadcast_to(measured_disk(entry, far, DISK_PIXELS), model.shape)), model


def _show_disk(ax: Any, image: Floats, theta_deg: float, phi_deg: float, brushing_deg: float | None) -> None:
    draw_disk(ax, image, theta_deg, 1.22)
    if brushing_deg is not None:
        turned = np.radians(brushing_deg - phi_deg + 90)
        for end in (turned, turned + np.pi):
            ends = np.array([1.02, 1.18])
            ax.plot(ends * np.cos(end), ends * np.sin(end), color="0.4", lw=2)


def in_plane(gathered: Sequence[Incidence], material: Material) -> Any:
    """Figure: the plane of incidence, one panel per theta_i for the phi_i nearest 0 and 90 degrees; mean over channels.

    theta_o is negative on the source's side; transmission is drawn over the angle from the far normal.
    """
    phis = sorted({entry.phi_deg for entry in gathered})
    shown = sorted({min(phis, key=lambda p: abs(p - target)) for target in (0.0, 90.0)})
    entries = [entry for phi in shown for entry in gathered if entry.phi_deg == phi]
    rows = -(-len(entries) // COLUMNS)
    figure = new_figure(2.7 * COLUMNS, 2.1 * rows + 0.8)
    axes = figure.subplots(rows, COLUMNS, squeeze=False)
    for ax in axes.flat[len(entries) :]:
        ax.set_axis_off()
    for ax, entry in zip(axes.flat, entries, strict=False):
        for far in (False, True) if material.transmits else (False,):
            _curve(ax, entry, material, far)
        ax.axvline(-entry.theta_deg, color=SOURCE, lw=1, label="source")
        ax.set_title(f"$\\theta_i$ {entry.theta_deg:g}°, $\\phi_i$ {entry.phi_deg:g}°", fontsize=9)
        ax.set(xlim=(-90, 90), xticks=[-90, -45, 0, 45, 90])
        ax.set_ylim(bottom=0)
        ax.tick_params(labelsize=7)
    figure.supxlabel("$\\theta_o$ in the plane of incidence, degrees", fontsize=9)
    figure.supylabel("cube root of the transfer probability, sr$^{-1/3}$", fontsize=9)
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels), fontsize=8, frameon=False)
    return figure


def _curve(ax: Any, entry: Incidence, material: Material, far: bool) -> None:
    from_normal, p = in_plane_tuples(entry, far)
    side = ", transmitted" if far else ""
    mark, line = ("^", "--") if far else (".", "-")
    ax.plot(from_normal, np.cbrt(p.mean(axis=1)), mark, color=MEASURED, ms=3, label=f"measured{side}")
    x = np.linspace(-89.5, 89.5, 359)
    wi, wo = in_plane_directions(entry.theta_deg, entry.phi_deg, x, far)
    f = MaterialBSDF(material).eval(wi, wo)
    ax.plot(x, np.cbrt((f * np.abs(wo[:, 2:])).mean(axis=1)), line, color=MODEL, lw=1.2, label=f"model{side}")


def albedo(gathered: Sequence[Incidence], material: Material) -> Any:
    """Figure: reflectivity (and transmissivity) over theta_i, mean over channels and phi_i."""
    figure = new_figure(6.4, 3.6)
    ax = figure.subplots()
    thetas = sorted({entry.theta_deg for entry in gathered})
    x = np.linspace(0, 85, 18)
    for far in (False, True) if material.transmits else (False,):
        word = "transmitted" if far else "reflected"
        measured = [np.mean([e.albedo(far) for e in gathered if e.theta_deg == theta]) for theta in thetas]
        mark, line = ("^", "--") if far else ("o", "-")
        ax.plot(thetas, measured, mark, color=MEASURED, label=f"measured, {word}")
        one_side = _one_side(material, far)
        wo = direction(np.radians(x)[:, None], np.radians([0.0, 45.0, 90.0])[None])
        ax.plot(x, MaterialBSDF(one_side).albedo(wo).mean(axis=(1, 2)), line, color=MODEL, label=f"model, {word}")
    ax.axhline(1, color="0.6", lw=0.8)
    ax.set(xlim=(0, 90))
    ax.set_xlabel("$\\theta_i$, degrees", fontsize=9)
    ax.set_ylabel("albedo", fontsize=9)
    ax.tick_params(labelsize=8)
    ax.set_ylim(bottom=0)
    figure.legend(loc="outside upper center", ncols=2, fontsize=8, frameon=False)
    return figure


def _one_side(material: Material, far: bool) -> Material:
    lobes = material.transmission_lobes if far else material.reflection_lobes
    return material.model_copy(update={"lobes": lobes, "kd" if far else "kt_d": BLACK})


def error_slices(drawn: Sequence[Slice], metric: Metric, name: str) -> Any:
    """Figure: E around the optimum of the lobe called `name` (thesis figure 3.9), one panel per pair of parameters."""
    from matplotlib.ticker import LogLocator

    figure = new_figure(4.6 * len(drawn), 4.0)
    for ax, one in zip(figure.subplots(1, len(drawn), squeeze=False).flat, drawn, strict=True):
        low = float(one.error.min())
        levels = low * np.geomspace(1, max(float(one.error.max()) / max(low, 1e-300), 1.01), 14)
        shades = ax.contourf(one.x, one.y, np.clip(one.error, levels[0], levels[-1]), levels=levels, cmap="cividis_r")
        ax.contour(one.x, one.y, one.error, levels=levels[1:-1], colors="white", linewidths=0.4)
        ax.plot(*one.best, "+", color="black", ms=11, mew=1.6, label="the fit")
        for axis, parameter in ((ax.xaxis, one.across), (ax.yaxis, one.down)):
            if parameter != "alpha":
                axis.axes.set(**{f"{axis.axis_name}scale": "log"})
                axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
                axis.set_major_formatter("{x:g}")
                axis.set_minor_formatter("")
        ax.set(xlabel=LABELS[one.across], ylabel=LABELS[one.down])
        ax.tick_params(labelsize=8)
        bar = figure.colorbar(shades, ax=ax, format="%.3g")
        bar.ax.tick_params(labelsize=8)
        bar.set_label(f"E ({metric.name}), {metric.unit}", fontsize=8)
    figure.suptitle(f"{name}; + is the fit, everything else held, its coefficient solved for again", fontsize=9)
    return figure
