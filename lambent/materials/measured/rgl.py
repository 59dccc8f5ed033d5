"""RGL material database (Dupuy & Jakob 2018): BRDF over a warp of the square that follows the material's own lobe.

The file gives f cos(theta_o) = spectra(u) D(u_m) / (4 sigma(u_i)), with u the point that the distribution of visible
normals warps to the half vector's u_m. Mappings: u_theta = sqrt(2 theta / pi), u_phi = (phi + pi) / (2 pi). Isotropic
files have at most two phi_i and measure phi_m from phi_i. Anisotropic ones cover the full circle of phi_i; or a half,
if f is unchanged when both directions turn by 180 degrees; or a quarter, if also when both are mirrored in x or in y.
If the closing node is left out, f is interpolated between the last node and the image of the next.

The warp (section 4 of the paper) is of a density that is bilinear between nodes; the row is drawn from its marginal and
the column from its conditional distribution. Values, marginals and conditionals of neighbouring parameters are
interpolated separately, as in the renderers that define the format; f depends on the order of these steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.errors import UserError
from lambent.core.geometry.directions import direction, elevation, half_vector, reflect
from lambent.materials.measured.parts.spectral import rgb_of_spectra
from lambent.materials.measured.parts.tensor_file import MAGIC, Tensors, read_tensors
from lambent.materials.measured.protocol import MeasuredSamples, TableInfo, collect
from lambent.materials.measured.tables.table import (
    ReflectionTable,
    bracket,
    fill_holes,
    require_values,
    sensible,
    usable_values,
)


class Corners:
    """Slices of a two-parameter table around each query, and their weights: (N, 4) each."""

    def __init__(self, nodes: tuple[Floats, Floats], at: tuple[Floats, Floats]) -> None:
        (i0, i1, u), (j0, j1, v) = (bracket(n, x) for n, x in zip(nodes, at, strict=True))
        columns = len(nodes[1])
        self.slices = np.stack([i0 * columns + j0, i0 * columns + j1, i1 * columns + j0, i1 * columns + j1], axis=-1)
        self.weights = np.stack([(1 - u) * (1 - v), (1 - u) * v, u * (1 - v), u * v], axis=-1)

    def blend(self, table: Floats, *index: Indices) -> Floats:
        """table (slices, ...) at (slice, *index), blended over the four corners: (N, ...)."""
        extra = table.ndim - 1 - len(index)
        parts = [table[(self.slices[:, k], *index)] * _rising(self.weights[:, k], extra) for k in range(4)]
        return np.asarray(sum(parts[1:], parts[0]))


def _rising(weight: Floats, dimensions: int) -> Floats:
    """The array with `dimensions` more axes of size 1."""
    return weight.reshape(weight.shape + (1,) * dimensions)


def _cell(shape: tuple[int, ...], xy: Floats) -> tuple[Indices, Indices, Floats, Floats]:
    """(column, row, x, y): the cell of a (rows, columns) grid of nodes with xy (N, 2), and the place in it."""
    scaled = xy.clip(0, 1) * (shape[1] - 1, shape[0] - 1)
    column = scaled[:, 0].astype(np.int64).clip(0, shape[1] - 2)
    row = scaled[:, 1].astype(np.int64).clip(0, shape[0] - 2)
    return column, row, scaled[:, 0] - column, scaled[:, 1] - row


def bilinear(table: Floats, corners: Corners, xy: Floats) -> Floats:
    """table (slices, rows, columns, ...) interpolated at xy (N, 2) in [0, 1]^2, x along the columns."""
    column, row, x, y = _cell(table.shape[1:3], xy)
    extra = table.ndim - 3
    x, y = _rising(x, extra), _rising(y, extra)
    low = corners.blend(table, row, column) * (1 - x) + corners.blend(table, row, column + 1) * x
    high = corners.blend(table, row + 1, column) * (1 - x) + corners.blend(table, row + 1, column + 1) * x
    return np.asarray(low * (1 - y) + high * y)


class Warp:
    """Density on the unit square per slice, normalised to 1; `sample` and `invert` are mutual inverses.

    Parameters
    ----------
    density : (slices, rows, columns) >= 0, each slice with a positive sum
    """

    def __init__(self, density: Floats) -> None:
        values = density.astype(np.float64)
        rows, columns = values.shape[1:]
        conditional = np.cumsum((values[:, :, :-1] + values[:, :, 1:]) / (2 * (columns - 1)), axis=2)
        row_mass = conditional[:, :, -1]
        marginal = np.cumsum((row_mass[:, :-1] + row_mass[:, 1:]) / (2 * (rows - 1)), axis=1)
        total = marginal[:, -1]
        self.density = values / total[:, None, None]
        # A leading zero: entry k is the mass before cell k.
        self.conditional = np.pad(conditional / total[:, None, None], ((0, 0), (0, 0), (1, 0)))
        self.marginal = np.pad(marginal / total[:, None], ((0, 0), (1, 0)))

    def invert(self, corners: Corners, xy: Floats) -> tuple[Floats, Floats]:
        """The uniform point (N, 2) that `sample` warps to xy (N, 2), and the density (N,) there."""
        rows, columns = self.density.shape[1:]
        column, row, x, y = _cell((rows, columns), xy)
        c0, c1 = (self._between_rows(corners, self.density, row, y, column + k) for k in (0, 1))
        last = np.full_like(column, columns - 1)
        r0, r1 = (corners.blend(self.conditional, row + k, last) for k in (0, 1))
        before = self._between_rows(corners, self.conditional, row, y, column)
        mass = r0 * (1 - y) + r1 * y
        u = np.divide(before + _integral(x, c0, c1) / (columns - 1), mass, out=np.zeros_like(mass), where=mass > 0)
        v = corners.blend(self.marginal, row) + _integral(y, r0, r1) / (rows - 1)
        return np.stack([u, v], axis=-1), c0 * (1 - x) + c1 * x

    def sample(self, corners: Corners, uv: Floats) -> tuple[Floats, Floats]:
        """The point (N, 2) that the uniform point uv (N, 2) is warped to, and the density (N,) there."""
        rows, columns = self.density.shape[1:]
        uv = uv.clip(1e-7, 1 - 1e-7)
        row = _last_not_above(corners.blend(self.marginal), uv[:, 1])
        last = np.full_like(row, columns - 1)
        r0, r1 = (corners.blend(self.conditional, row + k, last) for k in (0, 1))
        y = _solve((uv[:, 1] - corners.blend(self.marginal, row)) * (rows - 1), r0, r1)
        target = uv[:, 0] * (r0 * (1 - y) + r1 * y)
        lines = [corners.blend(self.conditional, row + k) for k in (0, 1)]
        column = _last_not_above(lines[0] * (1 - y[:, None]) + lines[1] * y[:, None], target)
        before = self._between_rows(corners, self.conditional, row, y, column)
        c0, c1 = (self._between_rows(corners, self.density, row, y, column + k) for k in (0, 1))
        x = _solve((target - before) * (columns - 1), c0, c1)
        point = np.stack([(column + x) / (columns - 1), (row + y) / (rows - 1)], axis=-1)
        return point, c0 * (1 - x) + c1 * x

    @staticmethod
    def _between_rows(corners: Corners, table: Floats, row: Indices, y: Floats, column: Indices) -> Floats:
        low, high = corners.blend(table, row, column), corners.blend(table, row + 1, column)
        return np.asarray(low * (1 - y) + high * y)


def _integral(x: Floats, v0: Floats, v1: Floats) -> Floats:
    """Integral from 0 to x of the segment that runs from v0 to v1 over [0, 1]."""
    return np.asarray(x * (v0 + (v1 - v0) * x / 2))


def _solve(mass: Floats, v0: Floats, v1: Floats) -> Floats:
    """x in [0, 1] at which `_integral` is `mass`, in the form that does not cancel for v0 near v1."""
    root = np.sqrt(np.maximum(v0 * v0 + 2 * mass * (v1 - v0), 0))
    denominator = v0 + root
    x: Floats = np.divide(2 * mass, denominator, out=np.zeros_like(mass), where=denominator > 0)
    return x.clip(0, 1)


def _last_not_above(cumulative: Floats, target: Floats) -> Indices:
    """Per line of `cumulative` (N, K + 1), the cell 0..K-1 in which `target` (N,) falls."""
    below = (cumulative[:, 1:-1] < target[:, None]).sum(axis=1)
    return np.asarray(below, dtype=np.int64)


CLOSED_RAD = 1e-3  # distance of the last node from the end at which a part counts as closed
SAME = 1e-6  # relative to a part: the closing node belongs to it


@dataclass(frozen=True)
class Azimuths:
    """Increasing nodes (N,) in radians, N > 1, of one of `parts` equal parts of the circle: 1, 2 or 4."""

    nodes: Floats
    parts: int

    @classmethod
    def of(cls, nodes: Floats) -> Azimuths:
        """Detect the part of the circle that nodes cover, with or without a closing node."""
        span, step = float(nodes[-1] - nodes[0]), float(np.median(np.diff(nodes)))
        whole = [parts for parts in (1, 2, 4) if abs(span - 2 * np.pi / parts) < CLOSED_RAD]
        wide = [parts for parts in (1, 2, 4) if span <= 2 * np.pi / parts + CLOSED_RAD]
        nearest = min(wide, key=lambda parts: abs(np.log((span + step) * parts / (2 * np.pi))))
        return cls(nodes, whole[0] if whole else nearest)

    def folded(self, wi: Floats, wo: Floats) -> tuple[Floats, Floats, Floats]:
        """Pairs (N, 3) folded into the nodes' part of the circle, and the azimuths (N,) of wi there."""
        phi, period = np.arctan2(wi[:, 1], wi[:, 0]), 2 * np.pi / self.parts
        if self.parts < 4:
            parts = (phi - self.nodes[0]) / period
            count = np.where(parts > 0, np.maximum(np.ceil(parts - SAME) - 1, 0), np.floor(parts))
            flip = np.where((count % 2 == self.parts - 1)[:, None], [-1.0, -1.0, 1.0], 1.0) if self.parts > 1 else 1.0
            return wi * flip, wo * flip, phi - count * period
        middle = self._bounds.mean()
        signs = np.array([np.cos(middle), np.sin(middle), 0.0])
        flip = np.where(wi * signs < 0, -1.0, 1.0)
        wi, wo = wi * flip, wo * flip
        off = np.arctan2(wi[:, 1], wi[:, 0]) - middle
        return wi, wo, middle + off - 2 * np.pi * np.round(off / (2 * np.pi))

    def beyond(self, phi: Floats) -> tuple[Floats, Floats, Floats]:
        """For `folded` azimuths (N,): flip (N, 3), azimuth (N,) and weight (N,) of the other image to blend with."""
        first, last = self.nodes[0], self.nodes[-1]
        over, under = np.maximum(phi - last, 0), np.maximum(first - phi, 0)
        if self.parts < 4:
            period = 2 * np.pi / self.parts
            flip = np.broadcast_to([-1.0, -1.0, 1.0] if self.parts == 2 else 1.0, (len(phi), 3))
            return flip, phi - period, np.minimum(over / max(first + period - last, SAME), 1)
        low, high = self._bounds
        across = np.where(over > 0, high, low)
        along_x = np.abs(np.sin(across)) < 0.5  # the mirror there is in y, elsewhere in x
        flip = np.stack([np.where(along_x, 1.0, -1.0), np.where(along_x, -1.0, 1.0), np.ones(len(phi))], axis=-1)
        share = over / max(2 * (high - last), SAME) + under / max(2 * (first - low), SAME)
        return flip, 2 * across - phi, np.minimum(share, 1)  # a quarter's nodes may lie across its ends

    @property
    def _bounds(self) -> Floats:
        """Ends (2,) of the quarter."""
        low = np.floor((self.nodes[0] + self.nodes[-1]) / np.pi) * np.pi / 2
        return np.array([low, low + np.pi / 2])


NAME = "RGL tensor file"
_DIMENSIONS = {"phi_i": 1, "theta_i": 1, "ndf": 2, "sigma": 2, "vndf": 4}


def recognise(head: bytes, size: int) -> bool:
    """Whether the file begins with the container's magic."""
    return head.startswith(MAGIC)


def read(path: Path) -> RglTable:
    """The table of an RGL file, RGB or spectral.

    Raises
    ------
    UserError
        The container or a tensor in it is broken, or no value is usable.
    """
    tensors = read_tensors(path)
    for name, dimensions in _DIMENSIONS.items():
        _require(name in tensors, path, name, "is missing")
        tensor = tensors[name]
        _require(tensor.dtype == np.float32 and tensor.ndim == dimensions, path, name, "has the wrong shape or type")
        _require(bool(np.isfinite(tensor.astype(np.float32)).all()), path, name, "has values that are not finite")
    phi, theta = (tensors[name].astype(np.float64) for name in ("phi_i", "theta_i"))
    for name, nodes, low, high in (("phi_i", phi, -np.pi, 2 * np.pi), ("theta_i", theta, 0, np.pi / 2)):
        ordered = len(nodes) > 0 and bool((np.diff(nodes) > 0).all())
        inside = ordered and low - 1e-4 <= nodes[0] and nodes[-1] <= min(high, nodes[0] + 2 * np.pi) + 1e-4
        _require(inside, path, name, "is not an increasing list of angles in radians")
    ndf, sigma, vndf = (tensors[name].astype(np.float32) for name in ("ndf", "sigma", "vndf"))
    for name, table in (("ndf", ndf), ("sigma", sigma), ("vndf", vndf)):
        _require(min(table.shape[-2:]) >= 2, path, name, "is too small")
        _require(bool((table >= 0).all()), path, name, "has negative values")
    _require(vndf.shape[:2] == (len(phi), len(theta)), path, "vndf", "does not fit phi_i and theta_i")
    _require(bool((vndf.sum(axis=(2, 3)) > 0).all()), path, "vndf", "is zero for an incident direction")
    _require(bool((sigma > 0).any()), path, "sigma", "is zero")
    return RglTable(tensors, _values_rgb(tensors, path), path)


def _require(holds: bool, path: Path, field: str, what: str) -> None:
    if not holds:
        raise UserError(what, file=path, field=field)


def _values_rgb(tensors: Tensors, path: Path) -> Floats:
    """Linear RGB (phi, theta, rows, columns, 3) of the file's `rgb` or `spectra`."""
    name = "rgb" if "rgb" in tensors else "spectra"
    _require(name in tensors, path, "rgb", "is missing, and so is spectra")
    values = tensors[name]
    incident = tensors["vndf"].shape[:2]
    usual = values.ndim == 5 and values.dtype == np.float32 and values.shape[:2] == incident
    _require(usual and min(values.shape) > 0 and min(values.shape[3:]) >= 2, path, name, "has the wrong shape or type")
    channels_last = np.moveaxis(values.astype(np.float32), 2, -1)
    if name == "rgb":
        _require(channels_last.shape[-1] == 3, path, name, "does not have three channels")
        return channels_last
    wavelengths = tensors.get("wavelengths", np.empty(0)).astype(np.float64)
    usable = wavelengths.shape == channels_last.shape[-1:] and bool((np.diff(wavelengths) > 0).all())
    _require(usable, path, "wavelengths", "does not name the wavelength of every spectral value, increasing")
    return np.asarray(channels_last @ rgb_of_spectra(wavelengths).T.astype(np.float32))


class RglTable(ReflectionTable):
    """BRDF of an RGL file, evaluated as in the renderers that define the format, then divided by cos(theta_o).

    Parameters
    ----------
    tensors : dict
        The file's checked tensors.
    values : (phi, theta, rows, columns, 3)
        Linear RGB at the nodes of the warped square, as stored: negative and not finite values included.
    """

    def __init__(self, tensors: Tensors, values: Floats, path: Path) -> None:
        self._phi, self._theta = (tensors[name].astype(np.float64) for name in ("phi_i", "theta_i"))
        self._isotropic = len(self._phi) <= 2
        self._azimuths = None if self._isotropic else Azimuths.of(self._phi)
        self._with_jacobian = bool(np.any(tensors.get("jacobian", np.ones(1))))
        self._raw = values
        finite = sensible(values)
        require_values(values, usable_values(values), path)
        slices = (-1, *values.shape[2:])
        self._values = fill_holes(values, finite).reshape(slices).astype(np.float64)
        self._warp = Warp(tensors["vndf"].astype(np.float64).reshape(-1, *tensors["vndf"].shape[2:]))
        self._ndf, self._sigma = (tensors[name].astype(np.float64)[None] for name in ("ndf", "sigma"))
        negative = int((values < 0).sum())
        notes = [f"{negative} of {values.size} stored values are negative"] if negative else []
        if not finite.all():
            notes.append(f"{int((~finite).sum())} nodes are not finite; eval takes the nearest node")
        sizes = dict(zip(("phi_i", "theta_i", "rows", "columns"), values.shape[:4], strict=True))
        self.info = TableInfo(Path(path).name, NAME, self._isotropic, False, 3, "f_cos", sizes, tuple(notes))

    def _eval_above(self, wi: Floats, wo: Floats) -> Floats:
        """f (N, 3) in 1/sr; negative values become 0."""
        if self._azimuths is None:
            return self._at(wi, wo, np.arctan2(wi[:, 1], wi[:, 0]))
        wi, wo, phi_i = self._azimuths.folded(wi, wo)
        value = self._at(wi, wo, phi_i)
        flip, phi_there, share = self._azimuths.beyond(phi_i)
        gap = share > 0
        if gap.any():
            there = self._at((wi * flip)[gap], (wo * flip)[gap], phi_there[gap])
            value[gap] += share[gap, None] * (there - value[gap])
        return value

    def _at(self, wi: Floats, wo: Floats, phi_i: Floats) -> Floats:
        """f (N, 3) interpolated between the nodes around phi_i (N,), clamped to the outermost."""
        theta_i = elevation(wi)
        m = half_vector(wi, wo)
        phi_m = np.arctan2(m[:, 1], m[:, 0]) - (phi_i if self._isotropic else 0)
        u_m = _u_of(elevation(m), phi_m)
        u_m[:, 1] %= 1.0
        corners = Corners((self._phi, self._theta), (phi_i, theta_i))
        u, _ = self._warp.invert(corners, u_m)
        value = bilinear(self._values, corners, u) * self._factor(u_m, theta_i, np.arctan2(wi[:, 1], wi[:, 0]))
        return np.asarray(np.maximum(value, 0) / wo[:, 2:])

    def _factor(self, u_m: Floats, theta_i: Floats, phi_i: Floats) -> Floats:
        """(N, 1) D / (4 sigma), or 1 for a file that stores f cos directly."""
        if not self._with_jacobian:
            return np.ones((len(u_m), 1))
        whole = Corners((np.zeros(1), np.zeros(1)), (theta_i, phi_i))
        sigma = bilinear(self._sigma, whole, _u_of(theta_i, 0 * phi_i if self._isotropic else phi_i))
        factor: Floats = np.divide(bilinear(self._ndf, whole, u_m), 4 * sigma, out=np.zeros(len(u_m)), where=sigma > 0)
        return factor[:, None]

    def samples(self, max_count: int | None = None) -> MeasuredSamples:
        """One tuple per node of the warped square; nodes whose wo is below the surface count as shadowed.

        The weight is the node's share of the square times d_wo/du, in sr.
        """
        phi, theta, rows, columns = self._raw.shape[:4]
        i, j, y, x = (a.ravel() for a in np.meshgrid(*map(np.arange, (phi, theta, rows, columns)), indexing="ij"))
        corners = Corners((self._phi, self._theta), (self._phi[i], self._theta[j]))
        u = np.stack([x / (columns - 1), y / (rows - 1)], axis=-1)
        u_m, density = self._warp.sample(corners, u)
        wi = direction(self._theta[j], self._phi[i])
        m = half_vectors_at(u_m, self._phi[i] if self._isotropic else 0)
        wo = reflect(wi, m)
        with np.errstate(invalid="ignore", over="ignore"):  # collect counts and drops values that are not finite
            value = self._raw.reshape(-1, 3) * self._factor(u_m, self._theta[j], self._phi[i])
        below: Flags = (wo[:, 2] <= 0) | (density <= 0)
        f = np.divide(value, wo[:, 2:], out=np.zeros_like(value, dtype=float), where=~below[:, None])
        share = _share(x, columns) * _share(y, rows)
        weight = np.divide(share * d_wo_d_um(u_m, wi, m), density, out=np.zeros(len(f)), where=~below)
        return collect(wi, wo, f, weight, self.info, below, max_count)


def half_vectors_at(u_m: Floats, turned_rad: Floats | float) -> Floats:
    """Half vectors (N, 3) at points (N, 2) of the square, turned about n by an angle."""
    return direction(u_m[:, 0] ** 2 * np.pi / 2, (2 * u_m[:, 1] - 1) * np.pi + turned_rad)


def d_wo_d_um(u_m: Floats, wi: Floats, m: Floats) -> Floats:
    """Solid angle (N,) of wo per area of the square, for wi (N, 3) and the half vectors m (N, 3) at u_m (N, 2)."""
    theta_m = u_m[:, 0] ** 2 * np.pi / 2
    return np.asarray(2 * np.pi**2 * u_m[:, 0] * np.sin(theta_m) * 4 * np.sum(wi * m, axis=-1))


def _share(index: NDArray[np.integer], count: int) -> Floats:
    """Weight of a node of a uniform grid on [0, 1], by the trapezoidal rule."""
    return np.where((index == 0) | (index == count - 1), 0.5, 1.0) / (count - 1)


def _u_of(theta: Floats, phi: Floats) -> Floats:
    """Points (N, 2) of the square."""
    return np.stack([np.sqrt(theta * (2 / np.pi)), (phi + np.pi) / (2 * np.pi)], axis=-1)
