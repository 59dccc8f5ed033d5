"""RGL tensor file (Dupuy & Jakob 2018), as Mitsuba's `measured` plugin and measured/rgl.py read it.

Per incident direction the half vectors get a density that follows the light, p times d_wo/d_u_m, to a power that leaves
something for the tails, and a floor. The square that it warps to is then sampled evenly, and so the rows and columns of
the file stand close together where the lobe is, whatever its width; between incident directions the warp moves, and the
lobe with it. f cos theta_o is stored as it is (`jacobian` = 0), not divided by a microfacet term: nothing is assumed
about the material.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.colour import luminance
from lambent.core.directions import Floats, direction, normalize, reflect
from lambent.core.files import atomic_path
from lambent.core.progress import Progress, silent
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampled import LOST_TRANSMISSION, Scatterer, read_back, scatterer_of
from lambent.materials.measured.marginal import Corners, Warp
from lambent.materials.measured.tensor_file import tensor_bytes

NAME = "RGL tensor file"
ENDINGS = (".bsdf",)
TAKES: tuple[Kind, ...] = ("table", "material")
THETA_I_DEG = np.array([0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 54, 58, 62, 65, 68, 71, 74, 77, 80, 82, 84, 86, 88.0])
PHI_I_NODES = {"quadrant": 9, "half": 17, "none": 33}  # over a quarter, half and the whole of the turn
PHI_I_END = {"quadrant": -np.pi / 2, "half": 0.0, "none": np.pi}  # they begin at -pi, as the format has it
ROWS, COLUMNS = 64, 128  # of the density: azimuth and elevation of the half vector
NODES = {"isotropic": 64, "other": 32}  # rows and columns of the warped square
_POWER = 0.35
_FLOOR, _FLOOR_BELOW = 0.02, 0.002  # share of the density that is even: no direction is out of reach
_LOWEST = 1e-4  # cosine of the directions asked in place of those below the horizon

Tensors = dict[str, NDArray[np.generic]]


@dataclass(frozen=True)
class _Slice:
    """One incident direction: density (ROWS, COLUMNS), and f cos (n, n, 3) and luminance (n, n) of the square."""

    density: Floats
    values: Floats
    luminance: Floats


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and say what it lost."""
    scatterer = scatterer_of(subject)
    content = tensor_bytes(_tensors(scatterer, progress))
    with atomic_path(Path(path)) as beside:
        beside.write_bytes(content)
    lost = [LOST_TRANSMISSION] if scatterer.transmits else []
    return read_back(subject, Path(path), tuple(lost))


def _tensors(scatterer: Scatterer, progress: Progress) -> Tensors:
    isotropic = scatterer.symmetry == "isotropic"
    n = NODES["isotropic" if isotropic else "other"]
    phi_i = np.zeros(1)
    if not isotropic:
        phi_i = np.linspace(-np.pi, PHI_I_END[scatterer.symmetry], PHI_I_NODES[scatterer.symmetry])
    theta_i = np.radians(THETA_I_DEG)
    slices: list[_Slice] = []
    for phi in phi_i:
        for theta in theta_i:
            progress(len(slices), len(phi_i) * len(theta_i), "sampling for RGL")
            slices.append(_slice(scatterer, theta, phi, n))
    progress(1, 1, "sampling for RGL")
    incident = (len(phi_i), len(theta_i))
    stacked = {name: np.stack([getattr(part, name) for part in slices]) for name in ("density", "values", "luminance")}
    values = np.moveaxis(stacked["values"].reshape(*incident, n, n, 3), -1, 2)
    description = f"{scatterer.name}: resampled by Lambent; rgb is f cos theta_o"
    return {
        "description": np.frombuffer(description.encode("utf-8"), dtype=np.uint8),
        "phi_i": phi_i.astype(np.float32),
        "theta_i": theta_i.astype(np.float32),
        "ndf": np.ones((2, 2), np.float32),
        "sigma": np.ones((2, 2), np.float32),
        "vndf": stacked["density"].reshape(*incident, ROWS, COLUMNS).astype(np.float32),
        "luminance": stacked["luminance"].reshape(*incident, n, n).astype(np.float32),
        "rgb": np.ascontiguousarray(values, dtype=np.float32),
        "jacobian": np.zeros(1, np.uint8),
    }


def _slice(scatterer: Scatterer, theta_i: float, phi_i: float, n: int) -> _Slice:
    wi = direction(theta_i, phi_i)
    y, x = np.meshgrid(np.linspace(0, 1, ROWS), np.linspace(0, 1, COLUMNS), indexing="ij")
    density, above = _light(
        scatterer, wi, _half_vectors(x.ravel(), y.ravel(), phi_i if scatterer.symmetry == "isotropic" else 0)
    )
    density, above = (density**_POWER).reshape(ROWS, COLUMNS), above.reshape(ROWS, COLUMNS)
    density[[0, -1]] = (density[0] + density[-1]) / 2  # one azimuth, at both ends of the turn
    density = density / max(float(density.mean()), 1e-12) + np.where(above, _FLOOR, _FLOOR_BELOW)
    density = density.astype(np.float32).astype(np.float64)
    v, u = (grid.ravel() for grid in np.meshgrid(*[np.linspace(0, 1, n)] * 2, indexing="ij"))
    one = Corners((np.zeros(1), np.zeros(1)), (np.zeros(n * n), np.zeros(n * n)))
    place, pdf = Warp(density[None]).sample(one, np.stack([u, v], axis=-1))
    m = _half_vectors(place[:, 0], place[:, 1], phi_i if scatterer.symmetry == "isotropic" else 0)
    values, share = _asked(scatterer, wi, m)
    bright = luminance(values) * share / np.maximum(pdf, 1e-12)
    bright = bright + _FLOOR * max(float(bright.mean()), 1e-12)
    return _Slice(density, values.reshape(n, n, 3), bright.reshape(n, n))


def _half_vectors(x: Floats, y: Floats, turned_rad: float) -> Floats:
    """(N, 3) half vectors at a place of the square: x is sqrt(2 theta / pi), y the share of the turn from -pi."""
    return direction(x**2 * np.pi / 2, (2 * y - 1) * np.pi + turned_rad)


def _light(scatterer: Scatterer, wi: Floats, m: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """(N,) luminance of p per unit of the square of half vectors, and whether it goes above the horizon at all."""
    values, share = _asked(scatterer, wi, m)
    return np.asarray(luminance(values) * share), np.asarray(share > 0)


def _asked(scatterer: Scatterer, wi: Floats, m: Floats) -> tuple[Floats, Floats]:
    """f cos theta_o (N, 3) at wi mirrored about the half vectors, and d_wo / d_u_m (N,), 0 below the horizon.

    Where wo is below the horizon f cos is that of the direction just above it, so that nodes there spoil no neighbour.
    """
    all_wi = np.broadcast_to(wi, m.shape)
    wo = reflect(all_wi, m)
    above = wo[:, 2] > _LOWEST
    # Mirrored about a half vector at the horizon, wi at the normal goes straight down: then m says the azimuth.
    level = normalize((wo + 0.1 * m) * (1, 1, 0)) + np.array([0.0, 0.0, _LOWEST])
    lifted = normalize(np.where(above[:, None], wo, level))
    values = np.maximum(scatterer.rgb(all_wi, lifted), 0) * lifted[:, 2:]
    theta_m = np.arctan2(np.hypot(m[:, 0], m[:, 1]), m[:, 2])
    u = np.sqrt(theta_m * 2 / np.pi)
    jacobian = 2 * np.pi**2 * u * np.sin(theta_m) * 4 * np.abs(np.sum(all_wi * m, axis=1))
    return values, np.where(above, jacobian, 0.0)
