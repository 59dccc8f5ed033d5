"""MERL binary: an isotropic RGB BRDF on 90 x 90 x 180 half and difference angles, see measured/merl.py.

Every bin gets the value at its centre. The format knows neither the specimen's orientation nor which of the two
directions is the light's: over both the mean is taken.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from lambent.core.directions import Floats
from lambent.core.files import atomic_path
from lambent.core.progress import Progress, silent
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampled import LOST_TRANSMISSION, Scatterer, read_back, scatterer_of
from lambent.materials.measured.merl import SCALES, directions_of

NAME = "MERL binary"
ENDINGS = (".binary",)
TAKES: tuple[Kind, ...] = ("table", "material")
SHAPE = (90, 90, 180)  # bins of theta_h, theta_d, phi_d
TURNS = 16  # azimuths of the specimen that an anisotropic one is averaged over
_SEEN = 1e-9  # relative difference of the two orders above which the mean of them is said
_COS_MIN = 1e-6


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and say what it lost."""
    scatterer = scatterer_of(subject)
    planes, order = _planes(scatterer, progress)
    with atomic_path(Path(path)) as beside, beside.open("wb") as file:
        file.write(struct.pack("<3i", *SHAPE))
        file.write(planes.astype("<f8").tobytes())
    lost: list[str] = []
    if scatterer.transmits:
        lost.append(LOST_TRANSMISSION)
    if scatterer.symmetry != "isotropic":
        lost.append(f"anisotropy: the mean over {TURNS} azimuths of the specimen stands for all")
    if order > _SEEN:
        lost.append(f"the order of wi and wo: the mean of both stands for both; they differ by {order:.1%} on the mean")
    return read_back(subject, Path(path), tuple(lost))


def _planes(scatterer: Scatterer, progress: Progress) -> tuple[Floats, float]:
    """(3, theta_h, theta_d, phi_d) as stored, -1 where a direction is below the surface; how much the orders differ."""
    planes = np.full((3, *SHAPE), -1.0)
    theta_d, phi_d = np.meshgrid(
        (np.arange(SHAPE[1]) + 0.5) / SHAPE[1] * np.pi / 2,
        (np.arange(SHAPE[2]) + 0.5) / SHAPE[2] * np.pi,
        indexing="ij",
    )
    difference = total = 0.0
    for i in range(SHAPE[0]):
        progress(i, SHAPE[0], "sampling for MERL")
        theta_h = np.full(theta_d.shape, ((i + 0.5) / SHAPE[0]) ** 2 * np.pi / 2)
        wi, wo = directions_of(theta_h, theta_d, phi_d)
        seen = (wi[..., 2] > _COS_MIN) & (wo[..., 2] > _COS_MIN)
        if seen.any():
            forth, back = (_turned(scatterer, *pair) for pair in ((wi[seen], wo[seen]), (wo[seen], wi[seen])))
            planes[:, i, seen] = ((forth + back) / 2 / SCALES).T
            cosines = (wi[seen, 2] * wo[seen, 2])[:, None]
            difference += float((cosines * np.abs(forth - back)).sum())
            total += float((cosines * (forth + back)).sum() / 2)
    progress(SHAPE[0], SHAPE[0], "sampling for MERL")
    return planes, difference / total if total > 0 else 0.0


def _turned(scatterer: Scatterer, wi: Floats, wo: Floats) -> Floats:
    """f (N, 3), the mean over azimuths of the specimen unless it is isotropic."""
    if scatterer.symmetry == "isotropic":
        return scatterer.rgb(wi, wo)
    total = np.zeros((len(wi), 3))
    for turn in (np.arange(TURNS) + 0.5) * (2 * np.pi / TURNS):
        c, s = np.cos(turn), np.sin(turn)
        about_n = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        total += scatterer.rgb(wi @ about_n, wo @ about_n)
    return total / TURNS
