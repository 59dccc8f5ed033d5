"""Measured tables as they come from laboratories: of a known material, and damaged or written in a known way.

Every text is made of the same seeded material, so that what a reader should find is known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lambent.core.geometry.directions import Floats, direction
from lambent.materials.bsdf import MaterialBSDF
from lambent.materials.document import Lobe, Material

ANGLES = ("theta_i", "phi_i", "theta_o", "phi_o")
RGB = ("f_r", "f_g", "f_b")
SATIN = Material(name="satin", kd=(0.3, 0.2, 0.1), lobes=(Lobe(k=(0.4, 0.4, 0.4), mx=0.2, my=0.2),))
GLOSSY = Material(name="glossy", kd=0.2, lobes=(Lobe(mx=0.1, my=0.1, r0=0.1),))
FABRIC = Material(name="fabric", kd=0.2, lobes=(Lobe(mx=0.05, my=0.5, r0=0.3),))
MIRROR = Material(name="mirror", kd=0.0, lobes=(Lobe(mx=0.002, my=0.002, r0=0.9),))
TRAP = Material(name="trap", kd=0.004, lobes=(Lobe(mx=0.01, my=0.01, r0=0.04),))


def grid(
    theta_i: Sequence[float] = (0, 20, 40, 60),
    phi_i: Sequence[float] = (0,),
    theta_o: Sequence[float] = range(0, 86, 5),
    phi_o: Sequence[float] = range(0, 360, 15),
) -> Floats:
    """(N, 4) angles in degrees, phi_o fastest."""
    return np.array([(a, b, c, d) for a in theta_i for b in phi_i for c in theta_o for d in phi_o], float)


def measured(angles_deg: Floats, material: Material = SATIN) -> Floats:
    """(N, 3) f in 1/sr of a material."""
    wi, wo = (direction(*np.radians(angles_deg[:, k : k + 2].T)) for k in (0, 2))
    return np.asarray(MaterialBSDF(material).eval(wi, wo))


def tape(angles_deg: Floats) -> Floats:
    """(N, 1) f of retro-reflective sheeting: a peak of 2 degrees about the light, on a diffuse ground."""
    wi, wo = (direction(*np.radians(angles_deg[:, k : k + 2].T)) for k in (0, 2))
    apart_deg = np.degrees(np.arccos(np.clip(np.sum(wi * wo, axis=1), -1, 1)))
    return np.asarray((0.1 + 5 * np.exp(-((apart_deg / 2) ** 2)))[:, None])


def written(angles_deg: Floats, values: Floats, names: Sequence[str] = (*ANGLES, *RGB), separator: str = " ") -> str:
    """Columns below their names."""
    rows = [separator.join(f"{v:.7g}" for v in row) for row in np.column_stack([angles_deg, values])]
    return "\n".join([separator.join(names), *rows]) + "\n"


def satin(names: Sequence[str] = (*ANGLES, *RGB), separator: str = " ") -> str:
    """The satin material, without a fault."""
    angles_deg = grid()
    return written(angles_deg, measured(angles_deg), names, separator)


def grey(names: Sequence[str] = (*ANGLES, "f"), scale: Floats | float = 1.0, angles_deg: Floats | None = None) -> str:
    """Its red channel times a factor, or one per column of values."""
    angles_deg = grid() if angles_deg is None else angles_deg
    return written(angles_deg, measured(angles_deg)[:, :1] * scale, names)


def with_line(text: str, number: int, line: str) -> str:
    """A text with another line in place of that with this number, from 1."""
    lines = text.split("\n")
    lines[number - 1] = line
    return "\n".join(lines)


def damaged(text: str, share: float, cells: str, seed: int = 0) -> tuple[str, int]:
    """A text of which a share of the rows has these words for its last three values, and their number."""
    head, *rows = text.rstrip("\n").split("\n")
    hit = np.flatnonzero(np.random.default_rng(seed).random(len(rows)) < share)
    for k in hit:
        separator = "," if "," in rows[k] else " "
        rows[k] = separator.join([*rows[k].split(separator)[:-3], cells])
    return "\n".join([head, *rows]) + "\n", len(hit)
