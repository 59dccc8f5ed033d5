"""Any measured table on one dense grid that a renderer can look up and sample: viewer x half vector.

Axes: the viewer's elevation (and azimuth, of an anisotropic table), then the half vector's elevation with MERL's
square-root map and its azimuth. A lobe about the mirror direction, however narrow, stands at the same cells for every
viewer, so blending neighbouring viewers aligns lobes as thesis M, 3.2 does, and the cells are smallest where lobes are.
Transmission is reflection mirrored at the surface.

Densities: per viewer node a tabulated distribution of half vectors, constant over each cell's solid angle, with
p(wi) = p(h) / (4 wo.h) (Walter et al. 2007, eq. 14); viewer nodes are mixed with their blending weights, and DIFFUSE of
the samples are cosine distributed, for what the table's cells miss near the horizon.

Conventions: wi to the light, wo to the viewer, as components; f in 1/sr without the cosine. Like lobes.py the maths
stands once for numpy and for the JIT path tracer: `ops` names the array library.

Hazard: 1 - cos(theta_h) cancels in float32; elevations go by atan2 and by sin^2(theta/2).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from lambent.core.directions import Floats, direction, normalize, reflect
from lambent.core.progress import Progress, silent
from lambent.materials.lobes import COS_MIN, Vector, dot, half_vector
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.two_sided import DOWN, Sheet

DIFFUSE = 0.1  # share of cosine-distributed samples
MARGIN = 1.2  # the peak is tabulated at nodes and cell centres; between them f cos may be higher
LAST_VIEWER_DEG = 89.0  # beyond it the last viewer's f
_LOWEST_COSINE = 0.02  # cells whose wi is below take f of this height, so that blending sees no edge at the horizon


@dataclass(frozen=True)
class GridOps:
    """The array functions the maths needs; `gather(table, index)` reads from a flat table."""

    sqrt: Callable[..., Any]
    cbrt: Callable[..., Any]
    sin: Callable[..., Any]
    cos: Callable[..., Any]
    atan2: Callable[..., Any]
    floor: Callable[..., Any]
    abs: Callable[..., Any]
    maximum: Callable[..., Any]
    minimum: Callable[..., Any]
    select: Callable[..., Any]
    gather: Callable[..., Any]
    whole: Callable[..., Any]  # to an integer


NUMPY = GridOps(
    np.sqrt, np.cbrt, np.sin, np.cos, np.arctan2, np.floor, np.abs, np.maximum, np.minimum, np.where,
    lambda table, index: table[index], lambda x: np.asarray(x).astype(np.int64),
)  # fmt: skip


@dataclass(frozen=True)
class GridShape:
    """Number of viewers (theta, phi; one phi = isotropic) and of half vectors; the latter are powers of two."""

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
class HalfVectorGrid:
    """A table on the grid; flat arrays of numpy, or of the path tracer.

    Attributes
    ----------
    shape : GridShape
    faces : int
        1: a two-sided sheet; 2: the back scatters otherwise than the front.
    kinds : int
        1: reflection only; 2: transmission as well.
    values : (faces, kinds, viewers, theta_h, phi_h, 3) flat float32
        f in 1/sr at the cells' centres, linear RGB; grey is repeated.
    marginal : (faces, kinds, viewers, theta_h) flat float32
        Probability of the rows up to and with this one.
    conditional : (faces, kinds, viewers, theta_h, phi_h) flat float32
        The same of the cells of a row.
    density : (faces, kinds, viewers, theta_h, phi_h) flat float32
        Density of the half vector in 1/sr.
    across : (faces, viewers) flat float32
        Probability of a transmitted sample.
    albedo, peak : (faces, kinds, viewers) flat float32
        Of f cos(theta_i), mean of the channels: its integral over the side, and its largest value in 1/sr.
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
    peak: Any = None

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

    def evaluate(self, wi: Vector, wo: Vector, ops: GridOps = NUMPY) -> Vector:
        return evaluate(wi, wo, self, ops)

    def pdf(self, wi: Vector, wo: Vector, ops: GridOps = NUMPY) -> Any:
        return pdf(wi, wo, self, ops)

    def sample(self, wo: Vector, u_select: Any, u1: Any, u2: Any, ops: GridOps = NUMPY) -> Vector:
        return sample(wo, u_select, u1, u2, self, ops)

    def share_across(self, wo: Vector, ops: GridOps = NUMPY) -> Any:
        return share_across(wo, self, ops)

    def albedo_of(self, wo: Vector, across: Any, ops: GridOps = NUMPY) -> Any:
        """Share of the light that is reflected or transmitted, mean of the channels, between the viewer nodes."""
        shares = [weight * ops.gather(self.albedo, place) for place, weight in _places(wo, across, self, ops)]
        return ops.select(across & (self.kinds == 1), 0.0, sum(shares[1:], shares[0]))

    def peak_of(self, wo: Vector, across: Any, ops: GridOps = NUMPY) -> Any:
        """Upper bound of f cos(theta_i), mean of the channels, in 1/sr."""
        peaks = [ops.gather(self.peak, place) for place, _ in _places(wo, across, self, ops)]
        return ops.select(across & (self.kinds == 1), 0.0, MARGIN * functools.reduce(ops.maximum, peaks))


def grid_of(
    table: MeasuredTable | Sheet, shape: GridShape | None = None, progress: Progress = silent
) -> HalfVectorGrid:
    """A table or a `Sheet` on the grid; `shape` is by default ISOTROPIC or ANISOTROPIC, as the table says of itself."""
    shape = shape or (ISOTROPIC if table.info.isotropic else ANISOTROPIC)
    sheet = table if isinstance(table, Sheet) else Sheet(table)
    faces, kinds = 2 if sheet.has_a_back else 1, 2 if table.info.transmits else 1
    values = np.zeros((faces, kinds, shape.viewer_theta, shape.viewer_phi, shape.cells, 3), np.float32)
    weights, peak = np.zeros(values.shape[:-1]), np.zeros(values.shape[:-2], np.float32)
    viewers, h = viewer_nodes(shape).reshape(shape.viewer_theta, shape.viewer_phi, 3), cell_centres(shape)
    twins = _twins(sheet, shape)
    for a, ring in enumerate(viewers):
        progress(a, len(viewers), f"resampling {table.info.file}")
        for b, viewer in enumerate(ring):
            twin, cells = twins[b]
            if twin != b:
                values[..., a, b, :, :] = values[..., a, twin, cells, :]
                weights[..., a, b, :] = weights[..., a, twin, cells]
                peak[..., a, b] = peak[..., a, twin]
                continue
            wo = np.broadcast_to(viewer, h.shape)
            wi = reflect(wo, h)
            cos_i = np.maximum(wi[:, 2], 0)
            gain = 4 * np.maximum(np.sum(wo * h, axis=-1), 0)  # d_wi/d_h
            wi[:, 2] = np.maximum(wi[:, 2], _LOWEST_COSINE)
            wi = normalize(wi)
            for face, kind in np.ndindex(faces, kinds):
                wo_there, wi_there = (w * DOWN if below else w for w, below in ((wo, face), (wi, face != kind)))
                f = sheet.eval(wi_there, wo_there)
                values[face, kind, a, b] = f
                p = f.mean(axis=-1) * cos_i
                weights[face, kind, a, b] = p * gain
                peak[face, kind, a, b] = p.max()
    progress(len(viewers), len(viewers), f"resampled {table.info.file}")
    sizes = (faces, kinds, shape.viewers, shape.cells)
    return _with_distributions(shape, values.reshape(*sizes, 3), weights.reshape(sizes), peak)


def _twins(table: Sheet, shape: GridShape) -> list[tuple[int, Any]]:
    """For each viewer azimuth the one whose values it shares, and in which order of cells: tables are often symmetric.

    Asked of the table itself, at random pairs: mirrored at x = 0 and y = 0, or turned by half a turn.
    """
    n, columns = shape.viewer_phi, shape.phi_h
    own = [(k, np.arange(shape.cells)) for k in range(n)]
    if n % 4 or columns % 4:
        return own
    rng = np.random.default_rng(1)
    wi, wo = direction(np.arccos(rng.uniform(0.1, 1, (2, 256))), rng.uniform(0, 2 * np.pi, (2, 256)))
    wo = wo * np.where(rng.random((256, 1)) < (0.5 if table.info.transmits else 0), [1, 1, -1], [1, 1, 1])
    given = table.eval(wi, wo)

    def same(flip: list[int]) -> bool:
        return np.allclose(table.eval(wi * flip, wo * flip), given, rtol=1e-4, atol=1e-5 * given.max())

    def ordered(column: Any) -> Any:
        return (np.arange(shape.theta_h)[:, None] * columns + column % columns).ravel()

    j = np.arange(columns)
    if same([1, -1, 1]) and same([-1, 1, 1]):
        for k in range(n):
            if k > n // 2:
                twin, order = own[n - k][0], columns - 1 - j
                own[k] = (twin, ordered(order if twin == n - k else columns // 2 + j))
            elif k > n // 4:
                own[k] = (n // 2 - k, ordered(columns // 2 - 1 - j))
    elif same([-1, -1, 1]):
        for k in range(n // 2, n):
            own[k] = (k - n // 2, ordered(j - columns // 2))
    return own


def viewer_nodes(shape: GridShape) -> Floats:
    """(viewers, 3) directions of the viewer nodes, phi fastest."""
    left = np.linspace(1, 0, shape.viewer_theta)
    theta = np.radians(LAST_VIEWER_DEG * (1 - left * np.sqrt(left)))  # closer towards grazing, where f bends most
    phi = np.arange(shape.viewer_phi) * 2 * np.pi / shape.viewer_phi
    return direction(*np.meshgrid(theta, phi, indexing="ij")).reshape(-1, 3)


def cell_centres(shape: GridShape) -> Floats:
    """(cells, 3) half vectors at the cells' centres, phi fastest."""
    theta = ((np.arange(shape.theta_h) + 0.5) / shape.theta_h) ** 2 * np.pi / 2
    phi = (np.arange(shape.phi_h) + 0.5) / shape.phi_h * 2 * np.pi
    return direction(*np.meshgrid(theta, phi, indexing="ij")).reshape(-1, 3)


def cell_borders(shape: GridShape, kinds: int) -> Floats:
    """(N, 4) ranges of z and phi of the cells, sorted; those of transmission are mirrored to z < 0."""
    z = np.cos(((np.arange(shape.theta_h, -1, -1)) / shape.theta_h) ** 2 * np.pi / 2)
    z[0], phi = 0.0, np.linspace(0, 2 * np.pi, shape.phi_h + 1)
    rows = [(low, high, a, b) for low, high in pairwise(z) for a, b in pairwise(phi)]
    if kinds == 1:
        return np.array([(-1.0, 0.0, 0.0, 2 * np.pi), *rows])
    mirrored = [(low, high, a, b) for low, high in pairwise(-z[::-1]) for a, b in pairwise(phi)]
    return np.array(mirrored + rows)


def _solid_angles(shape: GridShape) -> Floats:
    """(theta_h, 1) solid angle of the cells of each row, in sr."""
    edges = (np.arange(shape.theta_h + 1) / shape.theta_h) ** 2 * np.pi / 2
    return np.diff(2 * np.sin(edges / 2) ** 2)[:, None] * (2 * np.pi / shape.phi_h)


def _with_distributions(shape: GridShape, values: Floats, weights: Floats, peak: Floats) -> HalfVectorGrid:
    """The grid with the CDFs of weights (faces, kinds, viewers, cells), which are densities up to a factor.

    Cells and densities follow from the CDFs as they are stored, rounded to float32, so that both agree.
    """
    faces, kinds = weights.shape[:2]
    omega = _solid_angles(shape)
    mass = weights.reshape(faces, kinds, shape.viewers, shape.theta_h, shape.phi_h) * omega
    total = mass.sum(axis=(-1, -2))
    across = total[:, 1] / np.maximum(total.sum(axis=1), 1e-30) if kinds == 2 else np.zeros((faces, shape.viewers))
    mass = np.where(total[..., None, None] > 0, mass, omega)  # nothing is scattered: anywhere will do
    rows = mass.sum(axis=-1)
    mass = np.where(rows[..., None] > 0, mass, 1.0)
    marginal, conditional = _cdf(rows), _cdf(mass)
    share = np.diff(marginal.astype(float), axis=-1, prepend=0.0)[..., None]
    density = share * np.diff(conditional.astype(float), axis=-1, prepend=0.0) / omega
    flat = (a.astype(np.float32).ravel() for a in (values, marginal, conditional, density, across, total, peak))
    return HalfVectorGrid(shape, faces, kinds, *flat)


def _cdf(mass: Floats) -> Floats:
    cdf = np.cumsum(mass, axis=-1)
    return np.asarray((cdf / cdf[..., -1:]).astype(np.float32))


@dataclass(frozen=True)
class _Viewers:
    """The neighbouring viewer nodes of directions wo: their numbers and blending weights, and the wo they stand for."""

    nodes: list[tuple[Any, Any]]
    up: Vector  # wo on the upper side, turned to phi = 0 of an isotropic grid
    turn: tuple[Any, Any]  # cosine and sine of that turn
    face: Any  # number of the face, 0 or 1


def _viewers(wo: Vector, grid: HalfVectorGrid, ops: GridOps) -> _Viewers:
    shape = grid.shape
    face = ops.whole(ops.select((wo[2] < 0) & (grid.faces == 2), 1.0, 0.0))
    x, y, z = wo[0], wo[1], ops.abs(wo[2])
    sin_theta = ops.sqrt(x * x + y * y)
    left = ops.maximum(1 - ops.atan2(sin_theta, z) * (180 / np.pi / LAST_VIEWER_DEG), 0.0)
    place = (1 - ops.cbrt(left * left)) * (shape.viewer_theta - 1)
    low = ops.minimum(ops.floor(place), shape.viewer_theta - 2.0)
    share, row = place - low, ops.whole(low) * shape.viewer_phi
    if shape.viewer_phi == 1:
        off = sin_theta > 1e-7
        length = ops.maximum(sin_theta, 1e-7)
        turn = ops.select(off, x / length, 1.0), ops.select(off, y / length, 0.0)
        return _Viewers([(row, 1 - share), (row + 1, share)], (sin_theta, 0 * z, z), turn, face)
    around = turns(y, x, ops) * shape.viewer_phi
    left = ops.minimum(ops.floor(around), shape.viewer_phi - 1.0)
    beside, first = around - left, ops.whole(left)
    second = ops.whole(ops.select(left + 1.5 > shape.viewer_phi, 0.0, left + 1))
    nodes = [
        (row + step * shape.viewer_phi + column, along * across)
        for step, along in ((0, 1 - share), (1, share))
        for column, across in ((first, 1 - beside), (second, beside))
    ]
    return _Viewers(nodes, (x, y, z), (1.0 + 0 * z, 0.0 * z), face)


def turns(y: Any, x: Any, ops: GridOps) -> Any:
    """Azimuth in turns, in [0, 1]."""
    turns = ops.atan2(y, x) / (2 * np.pi)
    return ops.select(turns < 0, turns + 1, turns)


def _half(wi: Vector, viewers: _Viewers, ops: GridOps) -> tuple[Any, Any, Any]:
    """Place of the half vector in rows and columns of the grid, as shares of 1, and wo.h."""
    c, s = viewers.turn
    turned = c * wi[0] + s * wi[1], c * wi[1] - s * wi[0], ops.abs(wi[2])
    h = half_vector(turned, viewers.up, ops)
    theta = ops.atan2(ops.sqrt(h[0] * h[0] + h[1] * h[1]), h[2])
    return ops.sqrt(theta * (2 / np.pi)), turns(h[1], h[0], ops), dot(viewers.up, h)


def evaluate(wi: Vector, wo: Vector, grid: HalfVectorGrid, ops: GridOps = NUMPY) -> Vector:
    """f in 1/sr per RGB channel, without the cosine, linear between the cells' centres and between viewers."""
    shape, viewers = grid.shape, _viewers(wo, grid, ops)
    u, v, _ = _half(wi, viewers, ops)
    i = ops.maximum(ops.minimum(u * shape.theta_h - 0.5, shape.theta_h - 1.0), 0.0)
    i0 = ops.minimum(ops.floor(i), shape.theta_h - 2.0)
    j = v * shape.phi_h - 0.5
    j0 = ops.floor(j)
    columns = [
        (ops.whole(ops.select(j0 < 0, shape.phi_h - 1.0, j0)), 1 - (j - j0)),
        (ops.whole(ops.select(j0 + 1.5 > shape.phi_h, 0.0, j0 + 1)), j - j0),
    ]
    rows = [(ops.whole(i0), 1 - (i - i0)), (ops.whole(i0) + 1, i - i0)]
    page = _page(wi, wo, viewers, grid, ops)
    value: list[Any] = [0.0, 0.0, 0.0]
    for node, share in viewers.nodes:
        for row, along in rows:
            for column, across in columns:
                cell = 3 * (((page + node) * shape.theta_h + row) * shape.phi_h + column)
                weight = share * along * across
                value = [total + weight * ops.gather(grid.values, cell + c) for c, total in enumerate(value)]
    seen = _seen(wi, wo, grid, ops)
    red, green, blue = (ops.select(seen, total, 0.0) for total in value)
    return red, green, blue


def _page(wi: Vector, wo: Vector, viewers: _Viewers, grid: HalfVectorGrid, ops: GridOps) -> Any:
    """Number of the first viewer of the face and kind that the pair belongs to."""
    across = ops.whole(ops.select((wi[2] * wo[2] < 0) & (grid.kinds == 2), 1.0, 0.0))
    return (viewers.face * grid.kinds + across) * grid.shape.viewers


def _seen(wi: Vector, wo: Vector, grid: HalfVectorGrid, ops: GridOps) -> Any:
    off_horizon = (ops.abs(wi[2]) > COS_MIN) & (ops.abs(wo[2]) > COS_MIN)
    return off_horizon & ((wi[2] * wo[2] > 0) | (grid.kinds == 2))


def _places(wo: Vector, across: Any, grid: HalfVectorGrid, ops: GridOps) -> list[tuple[Any, Any]]:
    """Neighbouring viewer nodes among those of all faces and kinds, with their blending weights."""
    viewers = _viewers(wo, grid, ops)
    kind = ops.whole(ops.select(across & (grid.kinds == 2), 1.0, 0.0))
    first = (viewers.face * grid.kinds + kind) * grid.shape.viewers
    return [(first + node, weight) for node, weight in viewers.nodes]


def share_across(wo: Vector, grid: HalfVectorGrid, ops: GridOps = NUMPY) -> Any:
    """Probability of a transmitted sample."""
    return _share_across(_viewers(wo, grid, ops), grid, ops)


def _share_across(viewers: _Viewers, grid: HalfVectorGrid, ops: GridOps) -> Any:
    first = viewers.face * grid.shape.viewers
    parts = [weight * ops.gather(grid.across, first + node) for node, weight in viewers.nodes]
    return sum(parts[1:], parts[0])


def pdf(wi: Vector, wo: Vector, grid: HalfVectorGrid, ops: GridOps = NUMPY) -> Any:
    """Density of `sample` in 1/sr."""
    shape, viewers = grid.shape, _viewers(wo, grid, ops)
    u, v, cos_d = _half(wi, viewers, ops)
    row = ops.whole(ops.minimum(ops.floor(u * shape.theta_h), shape.theta_h - 1.0))
    column = ops.whole(ops.minimum(ops.floor(v * shape.phi_h), shape.phi_h - 1.0))
    page = _page(wi, wo, viewers, grid, ops)
    of_h = 0.0
    for node, weight in viewers.nodes:
        of_h = of_h + weight * ops.gather(grid.density, ((page + node) * shape.theta_h + row) * shape.phi_h + column)
    value = DIFFUSE * ops.abs(wi[2]) / np.pi + (1 - DIFFUSE) * of_h / (4 * ops.maximum(cos_d, 1e-6))
    across = _share_across(viewers, grid, ops)
    value = value * ops.select(wi[2] * wo[2] < 0, across, 1 - across)
    return ops.select(_seen(wi, wo, grid, ops), value, 0.0)


def sample(wo: Vector, u_select: Any, u1: Any, u2: Any, grid: HalfVectorGrid, ops: GridOps = NUMPY) -> Vector:
    """wi; u_* uniform in [0, 1). A sample at or across the horizon comes back with wi.z = 0."""
    shape, viewers = grid.shape, _viewers(wo, grid, ops)
    share = _share_across(viewers, grid, ops)
    across = u_select < share
    u_select = ops.select(
        across, u_select / ops.maximum(share, 1e-9), (u_select - share) / ops.maximum(1 - share, 1e-9)
    )
    diffuse = u_select < DIFFUSE
    u_select = (u_select - DIFFUSE) / (1 - DIFFUSE)

    node, up_to = viewers.nodes[0][0], viewers.nodes[0][1]
    for other, weight in viewers.nodes[1:]:
        node = ops.select(u_select >= up_to, other, node)
        up_to = up_to + weight
    kind = ops.whole(ops.select(across, 1.0, 0.0))
    page = (viewers.face * grid.kinds + kind) * shape.viewers + node
    row, along = _drawn(u1, grid.marginal, page * shape.theta_h, shape.theta_h, ops)
    column, beside = _drawn(u2, grid.conditional, (page * shape.theta_h + row) * shape.phi_h, shape.phi_h, ops)
    h = _within(row, along, column, beside, shape, ops)
    up = viewers.up
    twice = 2 * dot(up, h)
    x, y, z = (twice * a - b for a, b in zip(h, up, strict=True))
    c, s = viewers.turn
    x, y = c * x - s * y, s * x + c * y

    r, phi = ops.sqrt(u1), 2 * np.pi * u2
    x, y = ops.select(diffuse, r * ops.cos(phi), x), ops.select(diffuse, r * ops.sin(phi), y)
    z = ops.select(diffuse, ops.sqrt(ops.maximum(1 - u1, 0.0)), z)
    z = ops.select(z > COS_MIN, z, 0.0)
    return x, y, ops.select((wo[2] > 0) == across, -z, z)


def _drawn(u: Any, table: Any, first: Any, count: int, ops: GridOps) -> tuple[Any, Any]:
    """The cell of a CDF that `u` falls in, by bisection (`count` is a power of two), and where in it, in [0, 1)."""
    found, step = 0 * first, count // 2
    while step:
        found = ops.select(ops.gather(table, first + (found + (step - 1))) <= u, found + step, found)
        step //= 2
    high = ops.gather(table, first + found)
    low = ops.select(found > 0, ops.gather(table, first + ops.select(found > 0, found - 1, found)), 0.0)
    return found, ops.minimum((u - low) / ops.maximum(high - low, 1e-12), 1 - 1e-6)


def _within(row: Any, along: Any, column: Any, beside: Any, shape: GridShape, ops: GridOps) -> Vector:
    """Half vector at these shares of a cell's solid angle."""
    low, high = (ops.sin(((row + step) / shape.theta_h) ** 2 * (np.pi / 4)) ** 2 for step in (0.0, 1.0))
    half = low + along * (high - low)  # sin^2(theta/2)
    phi = (column + beside) * (2 * np.pi / shape.phi_h)
    sin_theta = 2 * ops.sqrt(half * (1 - half))
    return sin_theta * ops.cos(phi), sin_theta * ops.sin(phi), 1 - 2 * half
