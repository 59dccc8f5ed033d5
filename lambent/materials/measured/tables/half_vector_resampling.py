"""Resample a measured table, as the two-sided sheet on meshes, onto the dense grid of half_vector_grid.py.

A table with peaks about the light has two grids: one for mirrored light, one for returned light. f is their sum, split
by `back_share`, which is smooth, so that each part lies in the same cells for every viewer. A sample comes from one of
them, with probabilities by albedo; the density is that of the mixture. Transmitted light is in the first only.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal

import numpy as np

from lambent.core.geometry.directions import FLIP_Z, HALF_TURN, Floats, direction, normalize, reflect
from lambent.core.progress import Progress, silent
from lambent.materials.bsdf import components
from lambent.materials.lobes import NUMPY, ArrayOps, Vector
from lambent.materials.measured.protocol import MeasuredTable
from lambent.materials.measured.tables.gonio import back_share
from lambent.materials.measured.tables.half_vector_grid import (
    ANISOTROPIC,
    ISOTROPIC,
    LAST_VIEWER_DEG,
    GridShape,
    HalfVectorGrid,
)


@dataclass(frozen=True)
class RetroGrid:
    """The two parts; `returned` (faces, viewers) flat float32 is the probability that a sample comes from `light`."""

    ARRAYS: ClassVar[tuple[str, ...]] = (
        *(f"{part}.{name}" for part in ("mirror", "light") for name in HalfVectorGrid.ARRAYS), "returned",
    )  # fmt: skip

    mirror: HalfVectorGrid
    light: HalfVectorGrid
    returned: Any

    @property
    def sizes(self) -> tuple[int, ...]:
        return self.mirror.sizes

    @classmethod
    def of_sizes(cls, sizes: tuple[int, ...], arrays: dict[str, Any]) -> RetroGrid:
        """The inverse of `sizes` and `ARRAYS`."""
        mirror, light = (
            {name: arrays[f"{part}.{name}"] for name in HalfVectorGrid.ARRAYS} for part in ("mirror", "light")
        )
        *rest, _ = sizes
        about_light = HalfVectorGrid.of_sizes((*rest, 1), light | {"about_light": True})
        return cls(HalfVectorGrid.of_sizes(sizes, mirror), about_light, arrays["returned"])

    @property
    def anisotropic(self) -> bool:
        return self.mirror.anisotropic

    @property
    def kinds(self) -> int:
        return self.mirror.kinds

    def evaluate(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Vector:
        """f in 1/sr per RGB channel, without the cosine."""
        parts = (grid.evaluate(wi, wo, ops) for grid in (self.mirror, self.light))
        red, green, blue = (one + other for one, other in zip(*parts, strict=True))
        return red, green, blue

    def pdf(self, wi: Vector, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Density of `sample` in 1/sr."""
        share = self.returned_share(wo, ops)
        return share * self.light.pdf(wi, wo, ops) + (1 - share) * self.mirror.pdf(wi, wo, ops)

    def sample(self, wo: Vector, u_select: Any, u1: Any, u2: Any, ops: ArrayOps = NUMPY) -> Vector:
        """wi; u_* uniform in [0, 1): transmitted, then towards the light, then mirrored."""
        share, across = self.returned_share(wo, ops), self.transmitted_share(wo, ops)
        back = (u_select >= across) & (u_select < across + share)
        returned = self.light.sample(wo, (u_select - across) / ops.maximum(share, 1e-9), u1, u2, ops)
        rest = ops.select(u_select < across, u_select, u_select - share) / ops.maximum(1 - share, 1e-9)
        mirrored = self.mirror.sample(wo, rest, u1, u2, ops)
        x, y, z = (ops.select(back, one, other) for one, other in zip(returned, mirrored, strict=True))
        return x, y, z

    def returned_share(self, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Probability that a sample comes from `light`."""
        return self.mirror.of_viewer(self.returned, wo, ops)

    def transmitted_share(self, wo: Vector, ops: ArrayOps = NUMPY) -> Any:
        """Probability of a transmitted sample."""
        return (1 - self.returned_share(wo, ops)) * self.mirror.transmitted_share(wo, ops)


def retro_grid_of(
    table: MeasuredTable | TwoSided, shape: GridShape | None = None, progress: Progress = silent
) -> RetroGrid:
    """Resample a table to two grids; `shape` as in `grid_of`, for each."""
    mirror, light = (grid_of(table, shape, progress, part=part) for part in ("mirror", "light"))
    nodes = (mirror.faces, mirror.kinds, mirror.shape.viewers)
    whole = mirror.albedo.reshape(nodes).sum(axis=1)
    returned = light.albedo.reshape(mirror.faces, -1)
    share = returned / np.maximum(whole + returned, 1e-30)
    return RetroGrid(mirror, light, share.astype(np.float32).ravel())


class TwoSided:
    """A table for light from both sides; without its own back, it treats light from below as the mirrored pair.

    The attribute `has_a_back`, if present, decides. Otherwise the table has a back if, at random pairs, f for light
    from below (wi.z < 0) differs from that of the mirrored pair.
    """

    def __init__(self, table: MeasuredTable) -> None:
        self.table, self.info = table, table.info
        stated: bool | None = getattr(table, "has_a_back", None)
        if stated is not None:
            self.has_a_back = stated
            return
        z, phi = np.random.default_rng(0).uniform((0.1, 0), (1, 2 * np.pi), (2, 64, 2)).transpose(2, 0, 1)
        up, other = direction(np.arccos(z), phi)
        front = [table.eval(up, other), table.eval(up, other * FLIP_Z)]
        back = [table.eval(up * FLIP_Z, other * FLIP_Z), table.eval(up * FLIP_Z, other)]
        self.has_a_back = bool(np.any(back)) and not np.allclose(front, back, rtol=1e-3, atol=1e-6)

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        """f (..., C) in 1/sr, without the cosine."""
        if not self.has_a_back:
            below = np.asarray(wi)[..., 2:] < 0
            wi, wo = np.where(below, wi * FLIP_Z, wi), np.where(below, wo * FLIP_Z, wo)
        return np.asarray(self.table.eval(wi, wo))


class Reversed(TwoSided):
    """The sheet with light and viewer swapped; its grid samples wo for a given wi."""

    def eval(self, wi: Floats, wo: Floats) -> Floats:
        return super().eval(wo, wi)


_FLAT = (*HalfVectorGrid.ARRAYS, "albedo")
_LOWEST_COSINE = 0.02  # cells with wi below use f at this height, so that blending meets no edge at the horizon


def grid_of(
    table: MeasuredTable | TwoSided,
    shape: GridShape | None = None,
    progress: Progress = silent,
    part: Literal["whole", "mirror", "light"] = "whole",
) -> HalfVectorGrid:
    """Resample a table to the grid; `shape` defaults to ISOTROPIC or ANISOTROPIC, by the table's declaration.

    `part` serves `RetroGrid`: "mirror" and "light" are the shares that `back_share` assigns to each peak.
    """
    shape = shape or (ISOTROPIC if table.info.isotropic else ANISOTROPIC)
    sheet = table if isinstance(table, TwoSided) else TwoSided(table)
    faces, kinds = 2 if sheet.has_a_back else 1, 2 if table.info.transmits and part != "light" else 1
    values = np.zeros((faces, kinds, shape.viewer_theta, shape.viewer_phi, shape.cells, 3), np.float32)
    weights = np.zeros(values.shape[:-1])
    viewers, h = _viewer_nodes(shape), _cell_centres(shape)
    symmetric = _symmetric_viewers(sheet, shape)
    for a, ring in enumerate(viewers):
        progress(a, len(viewers), f"resampling {table.info.file}")
        for b, viewer in enumerate(ring):
            other, cells = symmetric[b]
            if other != b:
                values[..., a, b, :, :] = values[..., a, other, cells, :]
                weights[..., a, b, :] = weights[..., a, other, cells]
                continue
            wo = np.broadcast_to(viewer, h.shape)
            wi = reflect(wo, h)
            cos_i = np.maximum(wi[:, 2], 0)
            gain = 4 * np.maximum(np.sum(wo * h, axis=-1), 0)  # d_wi/d_h
            wi[:, 2] = np.maximum(wi[:, 2], _LOWEST_COSINE)
            wi = normalize(wi) * (HALF_TURN if part == "light" else 1.0)
            share = _share_of(part, wi, wo)
            for face, kind in np.ndindex(faces, kinds):
                wo_there, wi_there = (w * FLIP_Z if below else w for w, below in ((wo, face), (wi, face != kind)))
                f = sheet.eval(wi_there, wo_there) * (share if kind == 0 else 1.0)
                values[face, kind, a, b] = f
                weights[face, kind, a, b] = f.mean(axis=-1) * cos_i * gain
    progress(len(viewers), len(viewers), f"resampled {table.info.file}")
    sizes = (faces, kinds, shape.viewers, shape.cells)
    found = _with_distributions(shape, values.reshape(*sizes, 3), weights.reshape(sizes))
    return replace(found, about_light=part == "light")


def _share_of(part: str, wi: Floats, wo: Floats) -> Any:
    """Share (N, 1) of f that belongs to a part of the table."""
    if part == "whole":
        return 1.0
    back = back_share(components(wi), components(wo))[:, None]
    return back if part == "light" else 1 - back


def _symmetric_viewers(table: TwoSided, shape: GridShape) -> list[tuple[int, Any]]:
    """For each viewer azimuth, the one whose values it can share, and the order of cells; tables are often symmetric.

    Mirror symmetry at x = 0 and y = 0, and under half a turn, is detected by look-ups at random pairs.
    """
    n, columns = shape.viewer_phi, shape.phi_h
    own = [(k, np.arange(shape.cells)) for k in range(n)]
    if n % 4 or columns % 4:
        return own
    rng = np.random.default_rng(1)
    wi, wo = direction(np.arccos(rng.uniform(0.1, 1, (2, 256))), rng.uniform(0, 2 * np.pi, (2, 256)))
    wo = wo * np.where(rng.random((256, 1)) < (0.5 if table.info.transmits else 0), FLIP_Z, 1.0)
    expected = table.eval(wi, wo)

    def same(flip: list[int]) -> bool:
        return np.allclose(table.eval(wi * flip, wo * flip), expected, rtol=1e-4, atol=1e-5 * expected.max())

    def ordered(column: Any) -> Any:
        return (np.arange(shape.theta_h)[:, None] * columns + column % columns).ravel()

    j = np.arange(columns)
    if same([1, -1, 1]) and same([-1, 1, 1]):
        for k in range(n):
            if k > n // 2:
                other, order = own[n - k][0], columns - 1 - j
                own[k] = (other, ordered(order if other == n - k else columns // 2 + j))
            elif k > n // 4:
                own[k] = (n // 2 - k, ordered(columns // 2 - 1 - j))
    elif same([-1, -1, 1]):
        for k in range(n // 2, n):
            own[k] = (k - n // 2, ordered(j - columns // 2))
    return own


def _viewer_nodes(shape: GridShape) -> Floats:
    """(viewer_theta, viewer_phi, 3) directions of the viewer nodes."""
    left = np.linspace(1, 0, shape.viewer_theta)
    theta = np.radians(LAST_VIEWER_DEG * (1 - left * np.sqrt(left)))  # denser towards grazing, where f curves most
    phi = np.arange(shape.viewer_phi) * 2 * np.pi / shape.viewer_phi
    return direction(theta[:, None], phi)


def _cell_centres(shape: GridShape) -> Floats:
    """(cells, 3) half vectors at the cells' centres, phi fastest."""
    theta = ((np.arange(shape.theta_h) + 0.5) / shape.theta_h) ** 2 * np.pi / 2
    phi = (np.arange(shape.phi_h) + 0.5) / shape.phi_h * 2 * np.pi
    return direction(theta[:, None], phi).reshape(-1, 3)


def _with_distributions(shape: GridShape, values: Floats, weights: Floats) -> HalfVectorGrid:
    """The grid with the CDFs of weights (faces, kinds, viewers, cells), which are unnormalized densities.

    Cells and densities are derived from the stored float32 CDFs, so that both agree.
    """
    faces, kinds = weights.shape[:2]
    edges = (np.arange(shape.theta_h + 1) / shape.theta_h) ** 2 * np.pi / 2
    omega = np.diff(2 * np.sin(edges / 2) ** 2)[:, None] * (2 * np.pi / shape.phi_h)  # solid angle of a row's cells
    mass = weights.reshape(faces, kinds, shape.viewers, shape.theta_h, shape.phi_h) * omega
    total = mass.sum(axis=(-1, -2))
    across = total[:, 1] / np.maximum(total.sum(axis=1), 1e-30) if kinds == 2 else np.zeros((faces, shape.viewers))
    mass = np.where(total[..., None, None] > 0, mass, omega)  # for a black viewer node any distribution works
    rows = mass.sum(axis=-1)
    mass = np.where(rows[..., None] > 0, mass, 1.0)
    marginal, conditional = _cdf(rows), _cdf(mass)
    share = np.diff(marginal.astype(float), axis=-1, prepend=0.0)[..., None]
    density = share * np.diff(conditional.astype(float), axis=-1, prepend=0.0) / omega
    flat = (a.astype(np.float32).ravel() for a in (values, marginal, conditional, density, across, total))
    arrays: dict[str, Any] = dict(zip(_FLAT, flat, strict=True))
    return HalfVectorGrid(shape, faces, kinds, **arrays)


def _cdf(mass: Floats) -> Floats:
    cdf = np.cumsum(mass, axis=-1)
    return np.asarray((cdf / cdf[..., -1:]).astype(np.float32))
