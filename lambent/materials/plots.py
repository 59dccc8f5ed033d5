"""Plots of measurements and materials: the plane of incidence, and the polar matrix."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.files import write_bytes
from lambent.core.geometry.directions import Floats, direction
from lambent.core.outputs import MARK
from lambent.materials.fitting.shown.incidence import Incidence, incidences, measured_disk
from lambent.materials.measured.protocol import MeasuredTable

Eval = Callable[[Floats, Floats], Floats]
Placed = tuple[Incidence, bool, tuple[int, int]]  # whether it is the far side's; row and column

THETA_I_DEG = (0, 20, 40, 60, 75)
STEPS = 721  # every quarter of a degree
FLOOR = 1e-5  # 1/sr, the lowest value shown
DISK_PIXELS = 96
WHITE_PERCENTILE = 99.8  # of the brightness over all disks, shown as white
MOST_ROWS, MOST_COLUMNS = 8, 12  # of disks; more incident directions are thinned out
UNKNOWN, SOURCE = (0.66, 0.78, 0.93), "#ffb300"  # shade of unmeasured directions; the light's dot
IN_PLANE_INCHES, DISK_INCHES = 3.2, 1.3


def plot_plane_of_incidence(path: Path, evaluate: Eval, name: str, *, title: str, transmits: bool) -> None:
    """Draw f in 1/sr, mean over channels, against theta_o in the plane of incidence, one panel per theta_i.

    Parameters
    ----------
    path : Path
        Image to write: .png, .pdf or .svg.
    transmits : bool
        Whether to show the far side as well; theta_o then runs from -180 to 180 degrees.
    """
    figure = new_figure(3 * len(THETA_I_DEG), IN_PLANE_INCHES)
    _draw_plane(figure, evaluate, name, transmits)
    figure.suptitle(title, fontsize=10)
    save_figure(figure, path)


def plot_measurement(path: Path, table: MeasuredTable, *, title: str) -> None:
    """Draw a measurement: the in-plane curves as `eval` reconstructs them, above the polar matrix of the raw tuples.

    Disks have the source at the top, theta_o from the centre to the rim, and the cube root of the transfer probability
    as brightness; blue was not measured. Rows are theta_i and columns phi_i; with a single phi_i, theta_i runs along
    the columns. The far side is below the near one.

    Parameters
    ----------
    path : Path
        Image to write: .png, .pdf or .svg.
    """
    samples = table.samples()
    gathered = [_both_sides(entry) for entry in incidences(samples)] if samples.info.isotropic else incidences(samples)
    shown = _thinned(gathered)
    placed, (rows, columns) = disk_places(shown, samples.info.transmits)
    matrix_inches = DISK_INCHES * max(rows, 1) + 0.6
    figure = new_figure(max(3.0 * len(THETA_I_DEG), DISK_INCHES * columns + 1), IN_PLANE_INCHES + matrix_inches)
    above, below = figure.subfigures(2, 1, height_ratios=(IN_PLANE_INCHES, matrix_inches))
    _draw_plane(above, table.eval, "measured", samples.info.transmits)
    above.suptitle(title, fontsize=10)
    if shown:
        _draw_matrix(below, placed, (rows, columns))
    else:
        below.text(0.5, 0.5, "too few tuples per incident direction for disks", ha="center", fontsize=9)
    save_figure(figure, path)


def disk_places(shown: Sequence[Incidence], transmits: bool) -> tuple[list[Placed], tuple[int, int]]:
    """Row and column of the disk of every incident direction and side, and the number of rows and columns.

    Rows are theta_i and columns phi_i, the far side below the near one; with a single phi_i, theta_i is the column.
    """
    thetas, phis = sorted({e.theta_deg for e in shown}), sorted({e.phi_deg for e in shown})
    sides, flat, placed = 1 + transmits, len(phis) <= 1, []
    for entry, far in product(shown, range(sides)):
        theta, phi = thetas.index(entry.theta_deg), phis.index(entry.phi_deg)
        placed.append((entry, bool(far), (far, theta) if flat else (theta * sides + far, phi)))
    return placed, (sides, len(thetas)) if flat else (len(thetas) * sides, len(phis))


def new_figure(width: float, height: float) -> Any:
    """A figure with its own Agg canvas: no global state, no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def white_of(disks: Iterable[Floats]) -> float:
    """The brightness shown as white, from all known pixels of the disks."""
    known = np.concatenate([disk[np.isfinite(disk)] for disk in disks])
    return max(float(np.percentile(known, WHITE_PERCENTILE)), 1e-12) if len(known) else 1.0


def draw_disk(axis: Any, image: Floats, theta_deg: float, limit: float = 1.1) -> None:
    """Draw a disk of brightness (pixels, pixels, 1 or 3), white at 1, with its rim and the source at the top.

    Pixels outside the rim show their inner neighbours, and a circle clips the image smoothly instead of whole pixels.
    """
    from matplotlib.patches import Circle

    steps = (np.arange(DISK_PIXELS) + 0.5) / DISK_PIXELS * 2 - 1
    x, y = np.meshgrid(steps, steps)
    inwards = np.minimum(1, (1 - 2.5 / DISK_PIXELS) / np.hypot(x, y))
    row, column = (((v * inwards + 1) / 2 * DISK_PIXELS).astype(int) for v in (y, x))
    colours = np.where(np.isnan(image), UNKNOWN, np.clip(image, 0, 1))[row, column]
    drawn = axis.imshow(colours, extent=(-1, 1, -1, 1), interpolation="nearest")
    drawn.set_clip_path(Circle((0, 0), 1, transform=axis.transData))
    rim = np.linspace(0, 2 * np.pi, 128)
    axis.plot(np.cos(rim), np.sin(rim), color="0.5", lw=0.6)
    axis.plot(0, theta_deg / 90, "o", ms=3.2, mfc=SOURCE, mec="black", mew=0.4)
    axis.set(xlim=(-limit, limit), ylim=(-limit, limit), aspect="equal")


def save_figure(figure: Any, path: Path, dpi: int = 120) -> None:
    """Write a figure, atomically, in the format of the suffix: .png, .pdf or .svg."""
    made_by = "Software" if path.suffix.lower() == ".png" else "Creator"
    drawn = io.BytesIO()  # a PDF's writer hides the error of a full disk behind one of its own
    figure.savefig(drawn, dpi=dpi, format=path.suffix.lower().removeprefix("."), metadata={made_by: MARK})
    write_bytes(path, drawn.getvalue())


def _draw_plane(figure: Any, evaluate: Eval, name: str, transmits: bool) -> None:
    """Draw a panel per theta_i; positive theta_o lies opposite the light, on the side of the mirror direction."""
    limit = 180 if transmits else 90
    theta_o = np.linspace(-limit, limit, STEPS)[1:-1]
    wo = direction(np.radians(np.abs(theta_o)), np.where(theta_o >= 0, np.pi, 0.0))
    axes = figure.subplots(1, len(THETA_I_DEG), sharey=True)
    for axis, theta_i in zip(axes, THETA_I_DEG, strict=True):
        wi = np.broadcast_to(direction(np.radians(theta_i), 0.0), wo.shape)
        axis.semilogy(theta_o, np.maximum(evaluate(wi, wo).mean(axis=-1), FLOOR), label=name, lw=1.2)
        axis.axvline(theta_i, color="0.5", lw=0.5, ls=":")
        axis.set_title(f"light at {theta_i} deg", fontsize=9)
        axis.set_xlabel("theta_o (deg)", fontsize=8)
        axis.tick_params(labelsize=8)
    axes[0].set_ylabel("f (1/sr)", fontsize=8)
    axes[-1].legend(fontsize=8)


def _draw_matrix(figure: Any, placed: Sequence[Placed], shape: tuple[int, int]) -> None:
    disks = [measured_disk(entry, far, DISK_PIXELS) for entry, far, _ in placed]
    white = white_of(disks)
    axes = figure.subplots(*shape, squeeze=False)
    for axis in axes.flat:
        axis.set_axis_off()
    for (entry, far, place), disk in zip(placed, disks, strict=True):
        draw_disk(axes[place], disk / white, entry.theta_deg)
        side = ", transmitted" if far else ""
        axes[place].set_title(f"{entry.theta_deg:g}°, {entry.phi_deg:g}°{side}", fontsize=7, pad=2)
    figure.supxlabel(
        "raw tuples, theta_i and phi_i above each: cube root of the transfer probability; the dot is the source, "
        "blue was not measured",
        fontsize=8,
    )


def _both_sides(entry: Incidence) -> Incidence:
    """The entry of an isotropic table; tuples on only one side of the plane of incidence are mirrored to the other."""
    aside = entry.wo[:, 1]
    left, right = aside > 1e-6, aside < -1e-6
    if left.any() == right.any():
        return entry
    other = left | right
    wo = np.concatenate([entry.wo, entry.wo[other] * (1, -1, 1)])
    f, weight = (np.concatenate([a, a[other]]) for a in (entry.f, entry.weight))
    return replace(entry, wo=wo, f=f, weight=weight)


def _thinned(gathered: Sequence[Incidence]) -> list[Incidence]:
    """At most MOST_ROWS theta_i and MOST_COLUMNS phi_i, evenly spaced, ends included."""
    phis = sorted({entry.phi_deg for entry in gathered})
    most = (MOST_COLUMNS, 1) if len(phis) <= 1 else (MOST_ROWS, MOST_COLUMNS)
    kept = []
    for angles, count in zip((sorted({entry.theta_deg for entry in gathered}), phis), most, strict=True):
        chosen = np.unique(np.linspace(0, len(angles) - 1, min(count, len(angles))).round().astype(int))
        kept.append({angles[k] for k in chosen} if angles else set())
    return [entry for entry in gathered if entry.theta_deg in kept[0] and entry.phi_deg in kept[1]]
