"""MERL binary (Matusik et al. 2003): isotropic RGB BRDF over half and difference angles.

Layout, little-endian: 3 x int32 (bins of theta_h, theta_d, phi_d; 90, 90, 180), then the planes R, G, B as float64,
phi_d fastest. f = value / 1500 x (1, 1.15, 1.66), in 1/sr without the cosine. A negative value was not measured.
Bins: theta_h = floor(90 sqrt(2 theta_h / pi)), theta_d = floor(90 (2 theta_d / pi)), phi_d over [0, pi).
"""

from __future__ import annotations

import struct
from functools import cached_property
from pathlib import Path

import numpy as np

from lambent.core.errors import UserError
from lambent.core.files import read_bytes
from lambent.core.frames import Floats, direction, normalize, reflect
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect
from lambent.materials.measured.table import IntegratedTable, fill_holes, require_values

NAME = "MERL binary"
SCALES = np.array([1.0, 1.15, 1.66]) / 1500
LIMIT_BYTES = 1 << 30
_HEADER_BYTES = 12
_USUAL = (90, 90, 180)


def recognise(head: bytes, size: int) -> bool:
    """Whether the dimensions fit the file's size, or are MERL's in either byte order."""
    if len(head) < _HEADER_BYTES:
        return False
    shape = struct.unpack_from("<3i", head)
    fits = min(shape) > 0 and size == _bytes_of(shape)
    return fits or shape == _USUAL or struct.unpack_from(">3i", head) == _USUAL


def read(path: Path) -> MerlTable:
    """The table of a MERL file.

    Raises
    ------
    UserError
        Where the size does not fit the header, the byte order is foreign, or nothing was measured.
    """
    content = read_bytes(path, LIMIT_BYTES)
    shape = struct.unpack_from("<3i", content)
    if shape != _USUAL and struct.unpack_from(">3i", content) == _USUAL:
        raise UserError("is big-endian", file=path, expected="little-endian numbers, as MERL publishes them")
    if min(shape) <= 0 or len(content) != _bytes_of(shape):
        got = f"{' x '.join(map(str, shape))} bins in {len(content)} bytes"
        raise UserError("size does not fit the header", file=path, got=got, expected=f"{_bytes_of(shape)} bytes")
    planes = np.frombuffer(content, "<f8", offset=_HEADER_BYTES).reshape(3, *shape)
    return MerlTable(planes, path)


def _bytes_of(shape: tuple[int, ...]) -> int:
    return _HEADER_BYTES + 3 * 8 * shape[0] * shape[1] * shape[2]


class MerlTable(IntegratedTable):
    """BRDF on (theta_h, theta_d, phi_d) bins; values stand at the bins' centres.

    Parameters
    ----------
    planes : (3, theta_h, theta_d, phi_d)
        R, G, B as stored, before MERL's scales.
    path : Path
    """

    def __init__(self, planes: Floats, path: Path) -> None:
        self._raw = planes
        with np.errstate(invalid="ignore"):
            self._measured = np.asarray(((planes >= 0) & np.isfinite(planes)).all(axis=0))
        require_values(np.moveaxis(planes, 0, -1), self._measured, path)
        theta_h, theta_d, phi_d = planes.shape[1:]
        self.info = TableInfo(
            file=Path(path).name,
            format=NAME,
            isotropic=True,
            transmits=False,
            channels=3,
            stored="f",
            sizes={"theta_h": theta_h, "theta_d": theta_d, "phi_d": phi_d},
            notes=("values stand at the centres of their bins",),
        )

    @cached_property
    def _filled(self) -> Floats:
        """(theta_h, theta_d, phi_d, 3) f in 1/sr without holes."""
        return fill_holes(np.moveaxis(self._raw, 0, -1) * SCALES, self._measured)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., 3), trilinear between bin centres; 0 where wi or wo is below the surface."""
        theta_h, theta_d, phi_d = half_difference_angles(wi, wo)
        shape = np.array(self._measured.shape)
        unit = np.stack([np.sqrt(theta_h * 2 / np.pi), theta_d * 2 / np.pi, phi_d / np.pi], axis=-1)
        place = unit * shape - 0.5
        low = np.floor(place).astype(np.int64)
        share = place - low
        value = np.zeros((*unit.shape[:-1], 3))
        for corner in np.ndindex(2, 2, 2):
            i, j, k = np.moveaxis(low + corner, -1, 0)
            weight = np.where(corner, share, 1 - share).prod(axis=-1)
            cell = self._filled[i.clip(0, shape[0] - 1), j.clip(0, shape[1] - 1), k % shape[2]]
            value += weight[..., None] * cell
        above = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        return np.where(above[..., None], value, 0)

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """One tuple per bin whose directions are above the surface; wi stands at phi_i = 0.

        The weight is the bin's share of d_wi d_wo = 4 cos(theta_d) d_wh d_wd (Rusinkiewicz 1998), in sr^2.
        """
        shape = self._measured.shape
        i, j, k = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
        theta_h = ((i + 0.5) / shape[0]) ** 2 * np.pi / 2
        theta_d, phi_d = (j + 0.5) / shape[1] * np.pi / 2, (k + 0.5) / shape[2] * np.pi
        wi, wo = directions_of(theta_h, theta_d, phi_d)
        exists = (wi[..., 2] > 0) & (wo[..., 2] > 0)
        cell_h = (((i + 1) / shape[0]) ** 2 - (i / shape[0]) ** 2) * np.pi / 2
        turns = 2 * np.pi * 2  # phi_h runs round, and phi_d + pi is the same bin
        cell_d = (np.pi / 2 / shape[1]) * (np.pi / shape[2]) * np.sin(theta_d)
        weight = 4 * np.cos(theta_d) * np.sin(theta_h) * cell_h * cell_d * turns
        f = np.moveaxis(self._raw, 0, -1)[exists] * SCALES
        shadowed = np.asarray((f < 0).any(axis=1))
        wi, wo = _turned_to_phi_0(wi[exists], wo[exists])
        return collect(wi, wo, f, weight[exists], self.info, shadowed, max_count)


def half_difference_angles(wi: Floats, wo: Floats) -> tuple[Floats, Floats, Floats]:
    """(theta_h, theta_d, phi_d) of Rusinkiewicz 1998; phi_d in [0, pi), because phi_d + pi swaps wi and wo."""
    h = normalize(wi + wo)
    theta_h = np.arctan2(np.hypot(h[..., 0], h[..., 1]), h[..., 2])
    phi_h = np.arctan2(h[..., 1], h[..., 0])
    c, s = np.cos(phi_h), np.sin(phi_h)
    x, y = c * wi[..., 0] + s * wi[..., 1], c * wi[..., 1] - s * wi[..., 0]
    c, s = np.cos(theta_h), np.sin(theta_h)
    x, z = c * x - s * wi[..., 2], s * x + c * wi[..., 2]
    return theta_h, np.arctan2(np.hypot(x, y), z).clip(0, np.pi / 2), np.arctan2(y, x) % np.pi


def directions_of(theta_h: Floats, theta_d: Floats, phi_d: Floats) -> tuple[Floats, Floats]:
    """(wi, wo) of half and difference angles, with phi_h = 0."""
    d = direction(theta_d, phi_d)
    c, s = np.cos(theta_h), np.sin(theta_h)
    wi = np.stack([c * d[..., 0] + s * d[..., 2], d[..., 1], c * d[..., 2] - s * d[..., 0]], axis=-1)
    return wi, reflect(wi, direction(theta_h, 0.0))


def _turned_to_phi_0(wi: Floats, wo: Floats) -> tuple[Floats, Floats]:
    """The pair turned about n so that wi lies in the x-z plane."""
    sin_theta = np.hypot(wi[:, 0], wi[:, 1])
    c, s = (np.divide(wi[:, a], sin_theta, out=np.full(len(wi), 1.0 - a), where=sin_theta > 0) for a in (0, 1))
    turned = np.stack([c * wo[:, 0] + s * wo[:, 1], c * wo[:, 1] - s * wo[:, 0], wo[:, 2]], axis=-1)
    return np.stack([sin_theta, np.zeros_like(sin_theta), wi[:, 2]], axis=-1), turned
