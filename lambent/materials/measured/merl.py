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

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.ceilings import MEASURED_BYTES
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction, elevation, half_vector, reflect
from lambent.core.inputs import read_bytes
from lambent.materials.measured.protocol import LARGEST_F, MeasuredSamples, collect
from lambent.materials.measured.tables.table import ReflectionTable, fill_holes, isotropic_brdf, require_values

NAME = "MERL binary"
SCALES = np.array([1.0, 1.15, 1.66]) / 1500
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
        The size does not match the header, the byte order is big-endian, or nothing was measured.
    """
    content = read_bytes(path, MEASURED_BYTES)
    shape = struct.unpack_from("<3i", content)
    if shape != _USUAL and struct.unpack_from(">3i", content) == _USUAL:
        raise UserError("is big-endian", file=path, expected="little-endian numbers, as MERL publishes them")
    if min(shape) <= 0 or len(content) != _bytes_of(shape):
        got = f"{' x '.join(map(str, shape))} bins in {len(content)} bytes"
        raise UserError("size does not match the header", file=path, got=got, expected=f"{_bytes_of(shape)} bytes")
    planes = np.frombuffer(content, "<f8", offset=_HEADER_BYTES).reshape(3, *shape)
    return MerlTable(planes, path)


def _bytes_of(shape: tuple[int, ...]) -> int:
    return _HEADER_BYTES + 3 * 8 * shape[0] * shape[1] * shape[2]


class MerlTable(ReflectionTable):
    """BRDF on (theta_h, theta_d, phi_d) bins; values stand at the bins' centres.

    Parameters
    ----------
    planes : (3, theta_h, theta_d, phi_d)
        R, G, B as stored, before MERL's scales.
    """

    def __init__(self, planes: Floats, path: Path) -> None:
        self._raw = planes
        with np.errstate(invalid="ignore"):
            # Channel by channel: flags of a million bins at once would take as much memory as a plane.
            bounds = [scale * LARGEST_F for scale in 1 / SCALES]
            self._measured = np.logical_and.reduce(
                [(plane >= 0) & (plane <= bound) for plane, bound in zip(planes, bounds, strict=True)]
            )
        require_values(np.moveaxis(planes, 0, -1), self._measured, path)
        sizes = dict(zip(("theta_h", "theta_d", "phi_d"), planes.shape[1:], strict=True))
        self.info = isotropic_brdf(path, NAME, sizes, ("values lie at the centres of their bins",))

    @cached_property
    def _filled(self) -> Floats:
        """(bins, 3) f in 1/sr without holes, phi_d fastest."""
        with np.errstate(invalid="ignore", over="ignore"):  # in holes, filled below
            f = np.moveaxis(self._raw, 0, -1) * SCALES
        return fill_holes(f, self._measured).reshape(-1, 3)

    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 3) in 1/sr; trilinear between bin centres."""
        theta_h, theta_d, phi_d = half_difference_angles(wi, wo)
        shape = self._measured.shape
        i, u = _between(np.sqrt(theta_h * 2 / np.pi), shape[0])
        j, v = _between(theta_d * 2 / np.pi, shape[1])
        k, w = _between(phi_d / np.pi, shape[2])
        value = np.zeros((len(wi), 3))
        for a, b, c in np.ndindex(2, 2, 2):
            row = (i + a).clip(0, shape[0] - 1) * shape[1] + (j + b).clip(0, shape[1] - 1)
            weight = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
            value += weight[:, None] * np.take(self._filled, row * shape[2] + (k + c) % shape[2], axis=0)
        return value

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """One tuple per bin whose directions are above the surface, with wi at phi_i = 0.

        The weight is the bin's share of d_wi d_wo = 4 cos(theta_d) d_wh d_wd (Rusinkiewicz 1998), in sr^2.
        """
        shape = self._measured.shape
        theta_h, theta_d, phi_d = bin_centres(shape)
        wi, wo, exists = _above_horizon(theta_h, theta_d, phi_d)
        i = np.arange(shape[0])[:, None, None]
        cell_h = (((i + 1) / shape[0]) ** 2 - (i / shape[0]) ** 2) * np.pi / 2
        turns = 2 * np.pi * 2  # phi_h covers the circle, and phi_d + pi is the same bin
        cell_d = (np.pi / 2 / shape[1]) * (np.pi / shape[2]) * np.sin(theta_d)
        weight = 4 * np.cos(theta_d) * np.sin(theta_h) * cell_h * cell_d * turns
        f = np.empty((len(wi), 3))
        with np.errstate(invalid="ignore", over="ignore"):  # collect counts and drops values that are not finite
            for channel, (plane, scale) in enumerate(zip(self._raw, SCALES, strict=True)):
                np.multiply(plane[exists], scale, out=f[:, channel])
        shadowed = np.asarray((f < 0).any(axis=1))
        return collect(wi, wo, f, np.broadcast_to(weight, shape)[exists], self.info, shadowed, max_count)


def bin_centres(shape: tuple[int, ...]) -> tuple[Floats, Floats, Floats]:
    """theta_h (A, 1, 1), theta_d (1, B, 1) and phi_d (1, 1, C) at the bins' centres."""
    i, j, k = np.ogrid[tuple(slice(0, n) for n in shape)]
    return ((i + 0.5) / shape[0]) ** 2 * np.pi / 2, (j + 0.5) / shape[1] * np.pi / 2, (k + 0.5) / shape[2] * np.pi


def _between(unit: Floats, count: int) -> tuple[Indices, Floats]:
    """Index of the bin centre at or before `unit` in [0, 1], from -1 on, and the weight of the next one."""
    place = unit * count - 0.5
    low = np.floor(place)
    return low.astype(np.int64), np.asarray(place - low)


def _above_horizon(theta_h: Floats, theta_d: Floats, phi_d: Floats) -> tuple[Floats, Floats, Flags]:
    """wi (N, 3) at phi_i = 0 and wo (N, 3) at half and difference angles for which both are above the surface.

    By component: whole (..., 3) arrays of a million bins would take four times the memory.
    """
    across, along = np.cos(theta_h) * np.sin(theta_d) * np.cos(phi_d), np.sin(theta_h) * np.cos(theta_d)
    up, tilt = np.cos(theta_h) * np.cos(theta_d), np.sin(theta_h) * np.sin(theta_d) * np.cos(phi_d)
    exists = np.asarray((up - tilt > 0) & (up + tilt > 0))
    wi, wo = np.zeros((2, int(exists.sum()), 3))
    wi[:, 2], wo[:, 2] = (up - tilt)[exists], (up + tilt)[exists]
    x_i, x_o = (along + across)[exists], (along - across)[exists]
    y_i = np.broadcast_to(np.sin(theta_d) * np.sin(phi_d), exists.shape)[exists]  # and y_o = -y_i, as phi_h = 0
    sin_i = np.hypot(x_i, y_i, out=wi[:, 0])
    c = np.divide(x_i, sin_i, out=np.ones_like(x_i), where=sin_i > 0)
    s = np.divide(y_i, sin_i, out=np.zeros_like(y_i), where=sin_i > 0)
    wo[:, 0], wo[:, 1] = c * x_o - s * y_i, -c * y_i - s * x_o
    return wi, wo, exists


def half_difference_angles(wi: Floats, wo: Floats) -> tuple[Floats, Floats, Floats]:
    """(theta_h, theta_d, phi_d) of Rusinkiewicz 1998; phi_d in [0, pi), because phi_d + pi swaps wi and wo."""
    h = half_vector(wi, wo)
    theta_h, phi_h = elevation(h), np.arctan2(h[..., 1], h[..., 0])
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
