"""MERL binary: an isotropic RGB BRDF on 90 x 90 x 180 half and difference angles, see measured/merl.py.

Every bin gets the value at its centre. The format drops the specimen's azimuth and the order of wi and wo; means over
both are written.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.files import atomic_path
from lambent.core.progress import Progress, silent, tracked
from lambent.materials.export.contract import Cost, Kind, Subject
from lambent.materials.export.resampling.resampled import LOST_TRANSMISSION, Scatterer, read_back, scatterer_of
from lambent.materials.measured.merl import SCALES, bin_centres, directions_of

NAME = "MERL binary"
ENDINGS = (".binary",)
TAKES: tuple[Kind, ...] = ("table", "material")
SHAPE = (90, 90, 180)  # bins of theta_h, theta_d, phi_d
TURNS = 16  # azimuths that an anisotropic specimen is averaged over
_SEEN = 1e-9  # relative difference of the two orders above which it is reported
_COS_MIN = 1e-6


def write(subject: Subject, path: Path, progress: Progress = silent) -> Cost:
    """Write the file and return its losses."""
    scatterer = scatterer_of(subject)
    planes, order = _planes(scatterer, progress)
    with atomic_path(Path(path)) as temporary, temporary.open("wb") as file:
        file.write(struct.pack("<3i", *SHAPE))
        file.write(planes.astype("<f8").tobytes())
    lost = [LOST_TRANSMISSION] if scatterer.transmits else []
    if scatterer.symmetry != "isotropic":
        lost.append(f"anisotropy: the file holds the mean over {TURNS} azimuths of the specimen")
    if order > _SEEN:
        lost.append(f"the order of wi and wo: the file holds the mean of both, which differ by {order:.1%} on average")
    return read_back(subject, Path(path), tuple(lost))


def _planes(scatterer: Scatterer, progress: Progress) -> tuple[Floats, float]:
    """(3, theta_h, theta_d, phi_d) as stored, -1 below the surface, and the difference between the two orders."""
    planes = np.full((3, *SHAPE), -1.0)
    theta_h, theta_d, phi_d = bin_centres(SHAPE)
    difference = total = 0.0
    for i in tracked(range(SHAPE[0]), progress, "sampling for MERL"):
        wi, wo = directions_of(*np.broadcast_arrays(theta_h[i], theta_d[0], phi_d[0]))
        seen = (wi[..., 2] > _COS_MIN) & (wo[..., 2] > _COS_MIN)
        if seen.any():
            forth, back = (_turned(scatterer, *pair) for pair in ((wi[seen], wo[seen]), (wo[seen], wi[seen])))
            planes[:, i, seen] = ((forth + back) / 2 / SCALES).T
            cosines = (wi[seen, 2] * wo[seen, 2])[:, None]
            difference += float((cosines * np.abs(forth - back)).sum())
            total += float((cosines * (forth + back)).sum() / 2)
    return planes, difference / total if total > 0 else 0.0


def _turned(scatterer: Scatterer, wi: Floats, wo: Floats) -> Floats:
    """f (N, 3), averaged over azimuths of the specimen unless it is isotropic."""
    if scatterer.symmetry == "isotropic":
        return scatterer.rgb(wi, wo)
    total = np.zeros((len(wi), 3))
    for turn in (np.arange(TURNS) + 0.5) * (2 * np.pi / TURNS):
        c, s = np.cos(turn), np.sin(turn)
        about_n = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        total += scatterer.rgb(wi @ about_n, wo @ about_n)
    return total / TURNS
