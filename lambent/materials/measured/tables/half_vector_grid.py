"""A dense grid, viewer x half vector, from which a renderer looks up and samples any measured table.

Axes: the viewer's elevation (and azimuth, for an anisotropic table), then the half vector's elevation with MERL's
square-root map, and its azimuth. A lobe about the mirror direction, however narrow, lies in the same cells for every
viewer. Blending neighbouring viewers therefore aligns lobes as in thesis M, 3.2, and cells are smallest where lobes
are. Transmission is reflection mirrored at the surface. half_vector_resampling.py converts tables to grids.

Densities: each viewer node has a tabulated distribution of half vectors, constant over each cell's solid angle, with
p(wi) = p(h) / (4 wo.h) (Walter et al. 2007, eq. 14). Viewer nodes are mixed with their blending weights; a share
DIFFUSE of the samples is cosine distributed, for light near the horizon that the cells miss.

Conventions: wi to the light, wo to the viewer, as components; f in 1/sr without the cosine. As in lobes.py, one
implementation serves numpy and the JIT path tracer: `ops` is the array library.

Hazard: 1 - cos(theta_h) cancels in float32; elevations use atan2 and sin^2(theta/2) instead.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from lambent.core.arrays import Floats
from lambent.materials.lobes import (
    COS_MIN,
    NUMPY,
    ArrayOps,
    Vector,
    clamped,
    dot,
    half_vector,
    reflect,
    sample_cosine,
    wrapped,
)

DIFFUSE = 0.1  # share of cosine-distributed samples
LAST_VIEWER_DEG = 89.0  # beyond it, f of the last viewer is used


@dataclass(frozen=True)
class GridShape:
    """Number of viewers (theta, phi; one phi = isotropic) and of half vectors; the latter must be powers of two."""

    viewer_theta: int
    viewer_phi: int
    theta_h: int
    phi_h: int

    @property
    def viewers(self) -> int:
        return self.viewer_theta * self.viewer_phi

    @property
    def cells(self) -> int:
        return self.theta_h * self.phi_h


ISOTROPIC = GridShape(90, 1, 256, 64)
ANISOTROPIC = GridShape(32, 24, 128, 64)


@dataclass(frozen=True)
class _Viewers:
    """The viewer nodes around directions wo."""

    nodes: list[tuple[Any, Any]]  # numbers and blending weights
    up: Vector  # wo on the upper side, turned to phi = 0 of an isotropic grid
    turn: tuple[Any, Any]  # cosine and sine of that turn, plus half a turn if the peaks are about the light
    face: Any  # number of the face, 0 or 1

    def blend(self, table: Any, first: Any, ops: ArrayOps) -> Any:
        """Blend a table's entries of the viewer nodes, from `first` on."""
        parts = [weight * ops.gather(table, first + node) for node, weight in self.nodes]
        return sum(parts[1:], parts[0])

    def half(self, wi: Vector, ops: ArrayOps) -> tuple[Any, Any, Any]:
        """Row and column of the half vector, as fractions of the grid's extent, and wo.h."""
        c, s = self.turn
        turned = c * wi[0] + s * wi[1], c * wi[1] - s * wi[0], ops.abs(wi[2])
        h = half_vector(turned, self.up, ops)
        theta = ops.atan2(ops.sqrt(h[0] * h[0] + h[1] * h[1]), h[2])
        return ops.sqrt(theta * (2 / np.pi)), turns(h[1], h[0], ops), dot(self.up, h)


@dataclass(frozen=True)
class HalfVectorGrid:
    """A table on the grid, as flat arrays of numpy or of the path tracer.

    Attributes
    ----------
    faces : int
        1: a two-sided sheet; 2: the back scatters differently from the front.
    kinds : int
        1: reflection only; 2: transmission as well.
    values : (faces, kinds, viewers, theta_h, phi_h, 3) flat float32
        f in 1/sr at the cells' centres, linear RGB; grey is repeated.
    marginal : (faces, kinds, viewers, theta_h) flat float32
        Cumulative probability of the rows.
    conditional : (faces, kinds, viewers, theta_h, phi_h) flat float32
        Cumulative probability of the cells of a row.
    density : (faces, kinds, viewers, theta_h, phi_h) flat float32
        Density of the half vector in 1/sr.
    across : (faces, viewers) flat float32
        Probability of a transmitted sample.
    albedo : (faces, kinds, viewers) flat float32
        Integral of f cos(theta_i) over the side, mean over the channels.
    about_light : bool
        Whether the cells are those of back vectors: of half vectors with wi mirrored about n (Belcour et al. 2014).
    """

    ARRAYS: ClassVar[tuple[str, ...]] = ("values", "marginal", "conditional", "density", "across")

    shape: GridShape
    faces: int
    kinds: int
    values: Any
    marginal: Any
    conditional: Any
    density: Any
    across: Any
    albedo: Any = None
    about_light: bool = False

    @property
    def sizes(self) -> tuple[int, ...]:
        return (*(getattr(self.shape, field.name) for field in fields(GridShape)), self.faces, self.kinds)

    @classmethod
    def of_sizes(cls, sizes: tuple[int, ...], arrays: dict[str, Any]) -> HalfVectorGrid:
        """The inverse of `sizes` and `ARRAYS`."""
        *shape, faces, kinds = sizes
        return cls(GridShape(*shape), faces, kinds, **arrays)

    @property
    def anisotropic(self) -> bool:
        return self.shape.viewer_phi > 1

    def evaluate(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Vector:
        """f in 1/sr per RGB channel, without the cosine; linear between cell centres and between viewers."""
        shape, viewers = self.shape, self._viewers(wo, ops)
        u, v, _ = viewers.half(wi, ops)
        rows, columns = clamped(u, shape.theta_h, ops), wrapped(v, shape.phi_h, ops)
        page = self._page(viewers, wi[2] * wo[2] < 0, ops)
        value: list[Any] = [0.0, 0.0, 0.0]
        for node, share in viewers.nodes:
            for row, along in rows:
                for column, across in columns:
                    cell = 3 * (((page + node) * shape.theta_h + row) * shape.phi_h + column)
                    weight = share * along * across
                    value = [total + weight * ops.gather(self.values, cell + c) for c, total in enumerate(value)]
        seen = self._seen(wi, wo, ops)
        red, green, blue = (ops.select(seen, total, 0.0) for total in value)
        return red, green, blue

    def pdf(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Density of `sample` in 1/sr."""
        shape, viewers = self.shape, self._viewers(wo, ops)
        u, v, cos_d = viewers.half(wi, ops)
        row = ops.whole(ops.minimum(ops.floor(u * shape.theta_h), shape.theta_h - 1.0))
        column = ops.whole(ops.minimum(ops.floor(v * shape.phi_h), shape.phi_h - 1.0))
        page = self._page(viewers, wi[2] * wo[2] < 0, ops)
        of_h = 0.0
        for node, weight in viewers.nodes:
            cell = ((page + node) * shape.theta_h + row) * shape.phi_h + column
            of_h = of_h + weight * ops.gather(self.density, cell)
        value = DIFFUSE * ops.abs(wi[2]) / np.pi + (1 - DIFFUSE) * of_h / (4 * ops.maximum(cos_d, 1e-6))
        across = self.transmitted_share(wo, ops, viewers)
        value = value * ops.select(wi[2] * wo[2] < 0, across, 1 - across)
        return ops.select(self._seen(wi, wo, ops), value, 0.0)

    def sample(self, wo: Vector, u_select: Any, u1: Any, u2: Any, ops: ArrayOps = NUMPY) -> Vector:
        """wi; u_* uniform in [0, 1). A sample at or beyond the horizon is returned with wi.z = 0."""
        shape, viewers = self.shape, self._viewers(wo, ops)
        across, u_select = chosen_side(u_select, self.transmitted_share(wo, ops, viewers), ops)
        diffuse = u_select < DIFFUSE
        u_select = (u_select - DIFFUSE) / (1 - DIFFUSE)

        node, up_to = viewers.nodes[0][0], viewers.nodes[0][1]
        for other, weight in viewers.nodes[1:]:
            node = ops.select(u_select >= up_to, other, node)
            up_to = up_to + weight
        page = self._page(viewers, across, ops) + node
        row, along = _drawn(u1, self.marginal, page * shape.theta_h, shape.theta_h, ops)
        column, within = _drawn(u2, self.conditional, (page * shape.theta_h + row) * shape.phi_h, shape.phi_h, ops)
        x, y, z = reflect(viewers.up, _within(row, along, column, within, shape, ops))
        c, s = viewers.turn
        x, y = c * x - s * y, s * x + c * y

        x, y, z = (
            ops.select(diffuse, flat, lobe) for flat, lobe in zip(sample_cosine(u1, u2, ops), (x, y, z), strict=True)
        )
        z = ops.select(z > COS_MIN, z, 0.0)
        return x, y, ops.select((wo[2] > 0) == across, -z, z)

    def transmitted_share(self, wo: Vector, ops: ArrayOps = NUMPY, viewers: _Viewers | None = None) -> Any:
        """Probability of a transmitted sample; `viewers` are the nodes around wo, if known."""
        return self.of_viewer(self.across, wo, ops, viewers)

    def of_viewer(self, table: Any, wo: Vector, ops: ArrayOps = NUMPY, viewers: _Viewers | None = None) -> Any:
        """Interpolate a table (faces, viewers) between the viewer nodes."""
        viewers = viewers or self._viewers(wo, ops)
        return viewers.blend(table, viewers.face * self.shape.viewers, ops)

    def cell_borders(self) -> Floats:
        """(N, 4) ranges of z and phi of the half vectors' cells, sorted; mirrored to z < 0 for transmission."""
        shape = self.shape
        z = np.cos(((np.arange(shape.theta_h, -1, -1)) / shape.theta_h) ** 2 * np.pi / 2)
        z[0], phi = 0.0, np.linspace(0, 2 * np.pi, shape.phi_h + 1)
        rows = [(low, high, a, b) for low, high in pairwise(z) for a, b in pairwise(phi)]
        if self.kinds == 1:
            return np.array([(-1.0, 0.0, 0.0, 2 * np.pi), *rows])
        mirrored = [(low, high, a, b) for low, high in pairwise(-z[::-1]) for a, b in pairwise(phi)]
        return np.array(mirrored + rows)

    def _viewers(self, wo: Vector, ops: ArrayOps) -> _Viewers:
        shape, half_turn = self.shape, -1.0 if self.about_light else 1.0
        face = ops.whole(ops.select((wo[2] < 0) & (self.faces == 2), 1.0, 0.0))
        x, y, z = wo[0], wo[1], ops.abs(wo[2])
        sin_theta = ops.sqrt(x * x + y * y)
        left = ops.maximum(1 - ops.atan2(sin_theta, z) * (180 / np.pi / LAST_VIEWER_DEG), 0.0)
        place = (1 - ops.cbrt(left * left)) * (shape.viewer_theta - 1)
        low = ops.minimum(ops.floor(place), shape.viewer_theta - 2.0)
        share, row = place - low, ops.whole(low) * shape.viewer_phi
        if shape.viewer_phi == 1:
            off = sin_theta > 1e-7
            length = ops.maximum(sin_theta, 1e-7)
            turn = half_turn * ops.select(off, x / length, 1.0), half_turn * ops.select(off, y / length, 0.0)
            return _Viewers([(row, 1 - share), (row + 1, share)], (sin_theta, 0 * z, z), turn, face)
        place = turns(y, x, ops) * shape.viewer_phi
        left = ops.minimum(ops.floor(place), shape.viewer_phi - 1.0)
        share_phi, first = place - left, ops.whole(left)
        second = ops.whole(ops.select(left + 1.5 > shape.viewer_phi, 0.0, left + 1))
        nodes = [
            (row + step * shape.viewer_phi + column, along * across)
            for step, along in ((0, 1 - share), (1, share))
            for column, across in ((first, 1 - share_phi), (second, share_phi))
        ]
        return _Viewers(nodes, (x, y, z), (half_turn + 0 * z, 0.0 * z), face)

    def _page(self, viewers: _Viewers, across: Any, ops: ArrayOps) -> Any:
        """Number of the first viewer of a face and kind."""
        kind = ops.whole(ops.select(across & (self.kinds == 2), 1.0, 0.0))
        return (viewers.face * self.kinds + kind) * self.shape.viewers

    def _seen(self, wi: Vector, wo: Vector, ops: ArrayOps) -> Any:
        off_horizon = (ops.abs(wi[2]) > COS_MIN) & (ops.abs(wo[2]) > COS_MIN)
        return off_horizon & ((wi[2] * wo[2] > 0) | (self.kinds == 2))


def turns(y: Any, x: Any, ops: ArrayOps) -> Any:
    """Azimuth in turns, in [0, 1]."""
    turns = ops.atan2(y, x) / (2 * np.pi)
    return ops.select(turns < 0, turns + 1, turns)


def chosen_side(u_select: Any, share: Any, ops: ArrayOps) -> tuple[Any, Any]:
    """Whether u_select, uniform in [0, 1), chooses transmission of probability `share`; u_select rescaled."""
    across = u_select < share
    near = (u_select - share) / ops.maximum(1 - share, 1e-9)
    return across, ops.select(across, u_select / ops.maximum(share, 1e-9), near)


def first_above(u: Any, table: Any, first: Any, count: int, ops: ArrayOps) -> Any:
    """Index of the first entry above `u` in the ascending `table[first:first + count]`; the last one is above."""
    found, step = 0 * first, 1 << (count - 1).bit_length() >> 1
    while step:
        probe = ops.minimum(found + (step - 1), count - 1)
        found = ops.select(ops.gather(table, first + probe) <= u, found + step, found)
        step //= 2
    return found


def _drawn(u: Any, table: Any, first: Any, count: int, ops: ArrayOps) -> tuple[Any, Any]:
    """The cell of a CDF that contains `u`, and the position in the cell, in [0, 1)."""
    found = first_above(u, table, first, count, ops)
    high = ops.gather(table, first + found)
    low = ops.select(found > 0, ops.gather(table, first + ops.select(found > 0, found - 1, found)), 0.0)
    return found, ops.minimum((u - low) / ops.maximum(high - low, 1e-12), 1 - 1e-6)


def _within(row: Any, along: Any, column: Any, within: Any, shape: GridShape, ops: ArrayOps) -> Vector:
    """Half vector at these fractions of a cell's solid angle."""
    low, high = (ops.sin(((row + step) / shape.theta_h) ** 2 * (np.pi / 4)) ** 2 for step in (0.0, 1.0))
    half = low + along * (high - low)  # sin^2(theta/2)
    phi = (column + within) * (2 * np.pi / shape.phi_h)
    sin_theta = 2 * ops.sqrt(half * (1 - half))
    return sin_theta * ops.cos(phi), sin_theta * ops.sin(phi), 1 - 2 * half
