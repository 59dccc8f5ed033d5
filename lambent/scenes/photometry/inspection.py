"""What a photometric file says, checked, and the polar curve of catalogues."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.plots import new_figure, save_figure
from lambent.scenes.photometry.distribution import Photometry
from lambent.scenes.photometry.luminaire import KLM, Luminaire

DEVIATION = 0.02  # of fluxes, above which it is reported
STEPS = 7201  # of a plane, from -180 to 180 degrees: every twentieth of a degree
PLANES = {"C0-C180": 0.0, "C90-C270": 90.0}
INCHES = 6.0


def facts_of(luminaire: Luminaire) -> dict[str, Any]:
    """Facts by name; faults are sentences under `findings`. Flux and candela are of the first lamp set."""
    lamps = luminaire.sets[0]
    light = luminaire.photometry() if lamps.lumens else luminaire.values
    c, gamma = np.unravel_index(light.table.argmax(), light.table.shape)
    found = light.lumens / lamps.lumens if lamps.lumens and not luminaire.absolute else None
    planes = {name: plane_of(light, deg) for name, deg in PLANES.items()}
    return {
        **{name: getattr(luminaire, name) for name in ("format", "name", "maker", "report")},
        "photometry": "absolute" if luminaire.absolute else "relative to the lamps",
        "lamp_sets": {
            str(k): f"{one.count} x {one.kind or 'lamp'}, {one.lumens:g} lm, {one.watts:g} W, {one.colour}".replace(
                ", 0 lm", ""
            ).rstrip(", ")
            for k, one in enumerate(luminaire.sets)
        },
        "flux_lm": light.lumens,
        "light_output_ratio": {"stated": luminaire.ratio, "found": found},
        "downward_share": {"stated": luminaire.downward, "found": _downward(light)},
        "most_cd": float(light.table.max()),
        "most_at_deg": {"gamma": light.vertical_deg[gamma], "C": light.horizontal_deg[c]},
        "beam_angle_deg": {name: angle_above(*plane, 0.5) for name, plane in planes.items()},
        "field_angle_deg": {name: angle_above(*plane, 0.1) for name, plane in planes.items()},
        "symmetry": luminaire.symmetry,
        "opening": str(light.opening),
        "measured_tilt_deg": luminaire.measured_tilt_deg,
        "findings": list(_findings(luminaire, light)) or ["no faults found"],
    }


def plane_of(light: Photometry, c_deg: float) -> tuple[Floats, Floats]:
    """Angles from -180 to 180 degrees, negative in the half plane opposite C, and the intensities there."""
    angles = np.linspace(-180, 180, STEPS)
    return angles, light.at(np.abs(angles), np.where(angles < 0, c_deg + 180, c_deg))


def angle_above(angles_deg: Floats, values: Floats, share: float) -> float:
    """Angle between the outermost directions of a plane with at least a `share` of its largest intensity.

    A half gives the beam angle (half-peak divergence, CIE S 017:2020), a tenth the field angle.
    """
    above = angles_deg[values >= share * values.max()]
    return round(float(above[-1] - above[0]), 2)


def plot_polar(path: Path, luminaire: Luminaire) -> None:
    """Draw both main planes in polar coordinates, 0 below: in cd/klm where the file relates to a flux, else in cd."""
    flux = luminaire.sets[0].lumens
    scale = 1.0 if luminaire.per_klm or not flux else KLM / flux
    figure = new_figure(INCHES, INCHES)
    axis = figure.add_subplot(projection="polar", theta_offset=-np.pi / 2)
    for (name, deg), style in zip(PLANES.items(), ("-", "--"), strict=True):
        angles, values = plane_of(luminaire.values, deg)
        axis.plot(np.radians(angles), scale * values, style, lw=1.4, label=name)
    axis.set_thetagrids(range(0, 360, 30), [f"{min(deg, 360 - deg)}°" for deg in range(0, 360, 30)], fontsize=8)
    axis.set_ylim(bottom=0)
    axis.set_title(luminaire.name or luminaire.file.name, fontsize=10)
    figure.legend(loc="lower right", fontsize=8, title="cd/klm" if luminaire.per_klm or flux else "cd")
    save_figure(figure, path)


def _findings(luminaire: Luminaire, light: Photometry) -> Iterator[str]:
    yield from luminaire.notes
    if not light.lumens:
        yield "gives no light"
    lamps, ratio, share = luminaire.sets[0].lumens, luminaire.ratio, _downward(light)
    if luminaire.per_klm and not lamps:
        yield "the file states no flux of the lamps: values are those of 1000 lm"
    elif ratio and abs(light.lumens - ratio * lamps) > DEVIATION * ratio * lamps:
        yield f"intensities add up to {light.lumens:.4g} lm; the file states {ratio * lamps:.4g} lm"
    elif lamps and light.lumens > (1 + DEVIATION) * lamps:
        yield f"intensities add up to {light.lumens:.4g} lm, more than the {lamps:.4g} lm of the lamps"
    if luminaire.downward and abs(share - luminaire.downward) > DEVIATION:
        yield f"{share:.1%} of the light goes down; the file states {luminaire.downward:.1%}"


def _downward(light: Photometry) -> float:
    return light.lumens_within(90.0) / light.lumens if light.lumens else 0.0
