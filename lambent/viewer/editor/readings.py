"""Values of a material that the editor plots: disks, curves in the plane of incidence, albedo.

All values come from the material's own BSDF. While a slider moves, disks have fewer pixels and the albedo fewer
samples, to keep frames short.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import direction
from lambent.core.geometry.sequences import radical_inverse
from lambent.materials.bsdf import MaterialBSDF, components, evaluate
from lambent.materials.document import Material
from lambent.materials.fitting.shown.incidence import (
    Incidence,
    brightness,
    disk_directions,
    in_plane_directions,
    measured_disk,
    mirrored,
)
from lambent.materials.lobes import Vector
from lambent.viewer.mode import Image

FINE_PX = 72  # diameter of a disk at rest
WHITE_PERCENTILE = 99.8
UNKNOWN = (56, 68, 90)  # colour of directions that were not measured
HATCH_PX = 5  # distance of hatching lines over values known by symmetry only
THETA_O_DEG = np.linspace(-89.5, 89.5, 359)
ALBEDO_THETA_DEG = np.linspace(0.0, 85.0, 18)
WITHOUT_MEASUREMENT_DEG = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0)


@dataclass(frozen=True)
class Incident:
    """An incident direction."""

    theta_deg: float
    phi_deg: float

    def __str__(self) -> str:
        return f"theta_i {self.theta_deg:g}°, phi_i {self.phi_deg:g}°"


def incidents_of(gathered: Sequence[Incidence]) -> tuple[Incident, ...]:
    """The measured incident directions; without a measurement, a few theta_i at phi_i = 0."""
    if not gathered:
        return tuple(Incident(theta, 0.0) for theta in WITHOUT_MEASUREMENT_DEG)
    return tuple(Incident(entry.theta_deg, entry.phi_deg) for entry in gathered)


class Disks:
    """Disks of many incident directions in one picture, laid out in rows of `columns`, `pixels` a side.

    `tiles` lists them: (index of the incident direction, far side).
    """

    def __init__(self, incidents: Sequence[Incident], transmits: bool, pixels: int) -> None:
        self.pixels = pixels
        self.tiles = tuple((index, far) for far in ((False, True) if transmits else (False,))
                           for index in range(len(incidents)))  # fmt: skip
        self.columns = int(np.ceil(np.sqrt(len(self.tiles))))
        self._inside = disk_directions(pixels, 0.0, False)[1]
        rows, columns = np.nonzero(self._inside)
        self._hatch = (rows + columns) % HATCH_PX == 0
        wi, wo = [], []
        for index, far in self.tiles:
            towards = disk_directions(pixels, incidents[index].phi_deg, far)[0][self._inside]
            theta, phi = np.radians([incidents[index].theta_deg, incidents[index].phi_deg])
            wi.append(np.broadcast_to(direction(theta, phi), towards.shape))
            wo.append(towards)
        self._wi, self._wo = single(np.concatenate(wi)), single(np.concatenate(wo))

    def model(self, material: Material) -> Floats:
        """(K, inside, 3) brightness, float32."""
        f = np.stack(evaluate(self._wi, self._wo, material), axis=-1)
        cosine = np.abs(self._wo[2])[:, None]
        return np.asarray(np.cbrt(f * cosine), np.float32).reshape(len(self.tiles), -1, 3)

    def mirrored(self, gathered: Sequence[Incidence]) -> Floats:
        """(K, inside, 3) brightness known by symmetry from other measured directions, else NaN."""
        return self.measured([mirrored(entry, gathered) for entry in gathered])

    def measured(self, gathered: Sequence[Incidence | None]) -> Floats:
        """(K, inside, 3) brightness, NaN without a measurement."""
        values = np.full((len(self.tiles), int(self._inside.sum()), 3), np.nan, np.float32)
        for disk, (index, far) in zip(values, self.tiles, strict=True):
            entry = gathered[index] if gathered else None
            if entry is not None:
                disk[:] = measured_disk(entry, far, self.pixels)[self._inside]
        return values

    def picture(self, values: Floats, white: float, guessed: Floats | None = None) -> Image:
        """RGBA picture of all disks, black to `white`; transparent outside of the disks.

        NaN in `values` shows `guessed`, hatched.
        """
        unknown = np.isnan(values[..., :1])
        if guessed is not None:
            values = np.where(unknown, guessed, values)
        shown = np.clip(values / white, 0, 1) * 255
        hatched = unknown & self._hatch[None, :, None]
        unknown = np.isnan(shown[..., :1]) | hatched
        shown = np.where(unknown, np.array(UNKNOWN, np.float32), np.nan_to_num(shown))
        side, rows = self.pixels, -(-len(self.tiles) // self.columns)
        cells = np.zeros((rows * self.columns, side, side, 4), np.uint8)
        cells[: len(self.tiles), self._inside, :3] = shown
        cells[: len(self.tiles), self._inside, 3] = 255
        grid = cells.reshape(rows, self.columns, side, side, 4).swapaxes(1, 2)
        return np.ascontiguousarray(grid.reshape(rows * side, self.columns * side, 4))

    def place(self, index: int, far: bool) -> tuple[tuple[float, float], tuple[float, float]]:
        """Texture coordinates of a disk's corners in `picture`."""
        rows = -(-len(self.tiles) // self.columns)
        row, column = divmod(self.tiles.index((index, far)), self.columns)
        return (column / self.columns, row / rows), ((column + 1) / self.columns, (row + 1) / rows)


def white_of(values: Floats) -> float:
    """The brightness shown as white."""
    known = values[np.isfinite(values)]
    return max(float(np.percentile(known, WHITE_PERCENTILE)), 1e-6) if len(known) else 1.0


def in_plane(material: Material, incident: Incident, far: bool) -> Floats:
    """p (359, 3) in 1/sr at `THETA_O_DEG` in the plane of incidence."""
    wi, wo = in_plane_directions(incident.theta_deg, incident.phi_deg, THETA_O_DEG, far)
    return np.asarray(brightness(MaterialBSDF(material).eval(wi, wo), wo) ** 3)


def albedo(material: Material, phi_deg: float, samples: int) -> tuple[Floats, Floats]:
    """Reflected and transmitted albedo, (18, 3) each, for incidence at `ALBEDO_THETA_DEG`."""
    bsdf = MaterialBSDF(material)
    wo = direction(np.radians(ALBEDO_THETA_DEG), np.radians(phi_deg))
    wo = np.broadcast_to(wo[:, None], (len(wo), samples, 3))
    wi = bsdf.sample(wo, np.broadcast_to(_points(samples), wo.shape))
    pdf = bsdf.pdf(wi, wo)
    weight = np.divide(np.abs(wi[..., 2]), pdf, out=np.zeros_like(pdf), where=pdf > 0)
    value = bsdf.eval(wi, wo) * weight[..., None]
    across = (wi[..., 2] < 0)[..., None]
    return np.where(across, 0, value).mean(axis=1), np.where(across, value, 0).mean(axis=1)


@cache
def _points(count: int) -> Floats:
    """(count, 3) low-discrepancy points; the first coordinate, which chooses the component, is stratified."""
    k = np.arange(count)
    return np.stack([(k + 0.5) / count, radical_inverse(k, 2), radical_inverse(k, 3)], axis=-1)


def single(w: Floats) -> Vector:
    """Components of directions (N, 3), contiguous, float32."""
    x, y, z = components(w)
    return x.astype(np.float32), y.astype(np.float32), z.astype(np.float32)
