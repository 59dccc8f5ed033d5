"""RGL tensor file (Dupuy & Jakob 2018), as Mitsuba's `measured` plugin and measured/rgl.py read it.

For each incident direction, half vectors get a density that follows the light, p times d_wo/d_u_m, raised to a power
that keeps the tails, plus a floor. The square that it warps to is sampled uniformly, so that rows and columns of the
file are dense in the lobe, whatever its width; between incident directions the warp moves, and the lobe with it.
f cos theta_o is stored directly (`jacobian` = 0) instead of being divided by a microfacet term, so that nothing is
assumed about the material.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lambent.core.files import write_bytes
from lambent.core.geometry.directions import Floats, direction, normalize, reflect
from lambent.core.light.colour import luminance
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampling.resampled import LOST_TRANSMISSION, Scatterer, read_back, scatterer_of
from lambent.materials.measured.parts.tensor_file import Tensors, tensor_bytes
from lambent.materials.measured.rgl import Corners, Warp, d_wo_d_um, half_vectors_at

NAME = "RGL tensor file"
ENDINGS = (".bsdf",)
TAKES: tuple[Kind, ...] = ("table", "material")
THETA_I_DEG = np.array([0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 54, 58, 62, 65, 68, 71, 74, 77, 80, 82, 84, 86, 88.0])
PHI_I_NODES = {"quadrant": 9, "half": 17, "none": 33}  # over a quarter, half and the whole of the turn
PHI_I_END = {"quadrant": -np.pi / 2, "half": 0.0, "none": np.pi}  # they begin at -pi, as the format demands
ROWS, COLUMNS = 64, 128  # of the density: azimuth and elevation of the half vector
NODES = {"isotropic": 64, "other": 32}  # rows and columns of the warped square
_POWER = 0.35
_FLOOR, _FLOOR_BELOW = 0.02, 0.002  # uniform share of the density, which keeps every direction reachable
_LOWEST = 1e-4  # cosine that replaces directions below the horizon


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and return its losses."""
    scatterer = scatterer_of(subject)
    content = tensor_bytes(_tensors(scatterer, progress))
    write_bytes(Path(path), content)
    return read_back(subject, Path(path), (LOST_TRANSMISSION,) if scatterer.transmits else ())


def _tensors(scatterer: Scatterer, progress: Progress) -> Tensors:
    isotropic = scatterer.symmetry == "isotropic"
    n = NODES["isotropic" if isotropic else "other"]
    phi_i = np.zeros(1)
    if not isotropic:
        phi_i = np.linspace(-np.pi, PHI_I_END[scatterer.symmetry], PHI_I_NODES[scatterer.symmetry])
    theta_i = np.radians(THETA_I_DEG)
    pairs = [(theta, phi) for phi in phi_i for theta in theta_i]
    slices = [_slice(scatterer, *pair, n) for pair in tracked(pairs, progress, "sampling for RGL")]
    incident = (len(phi_i), len(theta_i))
    density, values, bright = (np.stack(parts) for parts in zip(*slices, strict=True))
    values = np.moveaxis(values.reshape(*incident, n, n, 3), -1, 2)
    description = f"{scatterer.name}: resampled by Lambent; rgb is f cos theta_o"
    return {
        "description": np.frombuffer(description.encode("utf-8", "backslashreplace"), dtype=np.uint8),
        "phi_i": phi_i.astype(np.float32),
        "theta_i": theta_i.astype(np.float32),
        "ndf": np.ones((2, 2), np.float32),
        "sigma": np.ones((2, 2), np.float32),
        "vndf": density.reshape(*incident, ROWS, COLUMNS).astype(np.float32),
        "luminance": bright.reshape(*incident, n, n).astype(np.float32),
        "rgb": np.ascontiguousarray(values, dtype=np.float32),
        "jacobian": np.zeros(1, np.uint8),
    }


def _slice(scatterer: Scatterer, theta_i: float, phi_i: float, n: int) -> tuple[Floats, Floats, Floats]:
    """For an incident direction: density (ROWS, COLUMNS), and f cos (n, n, 3) and luminance (n, n) of the square."""
    wi, turned = direction(theta_i, phi_i), phi_i if scatterer.symmetry == "isotropic" else 0
    y, x = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(0, 1, COLUMNS), indexing="ij")
    values, share = _asked(scatterer, wi, np.stack([x.ravel(), y.ravel()], axis=-1), turned)
    density = ((luminance(values) * share) ** _POWER).reshape(ROWS, COLUMNS)
    density[[0, -1]] = (density[0] + density[-1]) / 2  # both ends of the turn are one azimuth
    floor = np.where(share > 0, _FLOOR, _FLOOR_BELOW).reshape(ROWS, COLUMNS)
    density = density / max(float(density.mean()), 1e-12) + floor
    density = density.astype(np.float32).astype(np.float64)
    v, u = (grid.ravel() for grid in np.meshgrid(*[np.linspace(0, 1, n)] * 2, indexing="ij"))
    one = Corners((np.zeros(1), np.zeros(1)), (np.zeros(n * n), np.zeros(n * n)))
    place, pdf = Warp(density[None]).sample(one, np.stack([u, v], axis=-1))
    values, share = _asked(scatterer, wi, place, turned)
    bright = luminance(values) * share / np.maximum(pdf, 1e-12)
    bright = bright + _FLOOR * max(float(bright.mean()), 1e-12)
    return density, values.reshape(n, n, 3), bright.reshape(n, n)


def _asked(scatterer: Scatterer, wi: Floats, u_m: Floats, turned_rad: float) -> tuple[Floats, Floats]:
    """f cos theta_o (N, 3) with wi mirrored about the half vectors at u_m (N, 2), and d_wo / d_u_m (N,).

    Below the horizon, f cos is taken just above it, so that nodes there do not affect their neighbours, and d_wo /
    d_u_m is 0.
    """
    m = half_vectors_at(u_m, turned_rad)
    all_wi = np.broadcast_to(wi, m.shape)
    wo = reflect(all_wi, m)
    above = wo[:, 2] > _LOWEST
    # wi along the normal, mirrored about a half vector at the horizon, points straight down; m then gives the azimuth.
    level = normalize((wo + 0.1 * m) * (1, 1, 0)) + np.array([0.0, 0.0, _LOWEST])
    lifted = normalize(np.where(above[:, None], wo, level))
    values = np.maximum(scatterer.rgb(all_wi, lifted), 0) * lifted[:, 2:]
    return values, np.where(above, np.abs(d_wo_d_um(u_m, all_wi, m)), 0.0)
