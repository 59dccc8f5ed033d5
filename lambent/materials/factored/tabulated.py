"""A quotient on a grid of half and difference angles: the remainder of a measured table after its curves."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property, reduce
from operator import mul
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.core.geometry.directions import direction, normalize
from lambent.materials.factored.parametrisations import angle_of
from lambent.materials.factored.quotients import One
from lambent.materials.factored.terms import Quotient
from lambent.materials.lobes import NUMPY, Vector, clamped, half_vector, wrapped

MOST = 10.0  # largest ratio: 100 changes errors of measured tables by less than a per mille, and magnifies edits
LOWEST_COSINE = 0.02  # nodes with wi or wo below take the value at this height, which avoids an edge at the horizon


@dataclass(frozen=True)
class Grid:
    """Number of nodes along theta_h (square-root steps, as MERL's), theta_d, phi_d and phi_h, at cell centres.

    `turns_d` is the period of phi_d in half turns: 1 for a reciprocal table, because phi_d + pi swaps light and viewer.
    An isotropic table has one node of phi_h.
    """

    theta_h: int
    theta_d: int
    phi_d: int
    phi_h: int = 1
    turns_d: int = 1

    @property
    def shape(self) -> tuple[int, int, int, int]:
        return self.phi_h, self.theta_h, self.theta_d, self.phi_d

    def angles(self) -> tuple[Floats, Floats, Floats, Floats]:
        """phi_h, theta_h, theta_d and phi_d of the nodes in radians, each (1.., n, 1..)."""
        i = np.ogrid[tuple(slice(0, n) for n in self.shape)]
        h, th, td, pd = ((k + 0.5) / n for k, n in zip(i, self.shape, strict=True))
        return (
            2 * np.pi * (h if self.phi_h > 1 else 0 * h),
            th**2 * np.pi / 2,
            td * np.pi / 2,
            pd * np.pi * self.turns_d,
        )

    def directions(self) -> tuple[Floats, Floats]:
        """wi, wo (*shape, 3) of the nodes, some below the horizon."""
        phi_h, theta_h, theta_d, phi_d = self.angles()
        d = direction(theta_d, phi_d)
        c, s = np.cos(theta_h), np.sin(theta_h)
        pair = []
        for sign in (1, -1):
            along, y, z = sign * d[..., 0], sign * d[..., 1], d[..., 2]
            x, up = c * along + s * z, c * z - s * along
            w = np.cos(phi_h) * x - np.sin(phi_h) * y, np.sin(phi_h) * x + np.cos(phi_h) * y, up
            pair.append(np.stack(np.broadcast_arrays(*w), axis=-1))
        return pair[0], pair[1]

    def raised_directions(self) -> tuple[Floats, Floats]:
        """(N, 3) `directions` in storage order, raised to LOWEST_COSINE."""
        pair = [w.reshape(-1, 3) for w in self.directions()]
        for w in pair:
            np.maximum(w[:, 2], LOWEST_COSINE, out=w[:, 2])
        return normalize(pair[0]), normalize(pair[1])

    def solid_angles(self) -> Floats:
        """(N,) share of d_wi d_wo = 4 cos(theta_d) d_wh d_wd of each node (Rusinkiewicz 1998), up to a factor."""
        _, theta_h, theta_d, _ = self.angles()
        return np.broadcast_to(
            np.sqrt(theta_h) * np.sin(theta_h) * np.sin(theta_d) * np.cos(theta_d), self.shape
        ).ravel()

    def corners(self, wi: Vector, wo: Vector, ops: Any) -> Iterator[tuple[Any, Any]]:
        """Indices of the nodes around a pair of directions on the upper side, with their weights."""
        h = half_vector(wi, wo, ops)
        sin_h = ops.sqrt(h[0] * h[0] + h[1] * h[1])
        off = sin_h > 1e-7
        length = ops.maximum(sin_h, 1e-7)
        c, s = ops.select(off, h[0] / length, 1.0), ops.select(off, h[1] / length, 0.0)
        along, y = c * wi[0] + s * wi[1], c * wi[1] - s * wi[0]
        phi_d = ops.atan2(y, h[2] * along - sin_h * wi[2]) / (np.pi * self.turns_d)
        theta_h = ops.sqrt(ops.atan2(sin_h, h[2]) * (2 / np.pi))
        phi_h = ops.atan2(s, c) / (2 * np.pi)
        axes: list[list[tuple[Any, Any]]] = [
            [(0, None)] if self.phi_h == 1 else wrapped(phi_h - ops.floor(phi_h), self.phi_h, ops),
            clamped(theta_h, self.theta_h, ops),
            clamped(angle_of("theta_d", wi, wo, ops=ops) * (2 / np.pi), self.theta_d, ops),
            wrapped(phi_d - ops.floor(phi_d), self.phi_d, ops),
        ]
        _, n_h, n_d, n_p = self.shape
        for a, share_a in axes[0]:
            for b, share_b in axes[1]:
                for c_, share_c in axes[2]:
                    for d, share_d in axes[3]:
                        shares = [share for share in (share_a, share_b, share_c, share_d) if share is not None]
                        yield ((a * n_h + b) * n_d + c_) * n_p + d, reduce(mul, shares)


@dataclass(frozen=True)
class Tabulated:
    """`base` times RGB ratios on a grid, linear between its nodes.

    Parameters
    ----------
    ratios : (N, 3)
        In the grid's order; kept as float32.
    """

    grid: Grid
    ratios: Floats = field(repr=False, compare=False)
    base: Quotient = field(default_factory=One)
    digest: str = ""

    def __post_init__(self) -> None:
        flat = np.ascontiguousarray(self.ratios, np.float32).ravel()
        assert flat.size == 3 * int(np.prod(self.grid.shape)), "three ratios per node"
        flat.flags.writeable = False
        object.__setattr__(self, "ratios", flat)
        object.__setattr__(self, "digest", digest_of(flat))

    def evaluate(self, wi: Vector, wo: Vector, ops: Any = NUMPY) -> Vector:
        """rho_q as RGB; `ops` has `gather` and `whole` as well."""
        value: list[Any] = [0.0, 0.0, 0.0]
        for node, share in self.grid.corners(wi, wo, ops):
            value = [total + share * ops.gather(self.ratios, 3 * node + c) for c, total in enumerate(value)]
        base = self.base.evaluate(wi, wo, ops)
        parts = base if isinstance(base, tuple) else (base, base, base)
        red, green, blue = (part * total for part, total in zip(parts, value, strict=True))
        return red, green, blue

    @cached_property
    def range(self) -> tuple[float, float]:
        """Least and largest ratio."""
        return float(self.ratios.min()), float(self.ratios.max())


def digest_of(*arrays: Floats) -> str:
    """A string for `repr` that identifies the arrays."""
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()[:16]
