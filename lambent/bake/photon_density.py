"""From photons per texel to irradiance: flux over area, averaged over neighbours on the same surface.

The areas are exact, those of what of a triangle lies in a texel's square, so no border is darker than its middle and
no energy is lost. The kernel is the same for flux and area: uniform light stays uniform whatever is missing around. It
is narrow, because noise that neighbours share is what the denoiser cannot tell from light.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lambent.bake.texels import CANDIDATES_AT_ONCE, Texels
from lambent.core.frames import normalize

Array = NDArray[np.floating]
KERNEL, WIDE = 0.3, 0.7  # texels: standard deviation along the surface, and that of texels that are mostly off it
LIFT = 0.3  # texels: standard deviation off the surface
NEIGHBOURS = 21
SMALLEST = 0.05  # texels: what gathers photons from a smaller area takes its neighbours' light
TEXELS_AT_ONCE = 1 << 18


def texel_areas(geometry: dict[str, Array], width: int, height: int) -> Array:
    """(H, W) float64: area in m^2 of what the light map has in each texel's square; `geometry` as in `atlas.merged`."""
    corners = geometry["uv2"][geometry["faces"]].astype(float) * (width, height)
    p = geometry["positions"][geometry["faces"]].astype(float)
    world = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    in_map = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    density = np.divide(world, in_map, out=np.zeros(len(world)), where=in_map > 0)
    low = np.floor(corners.min(axis=1)).astype(int).clip(0, (width - 1, height - 1))
    high = np.floor(corners.max(axis=1)).astype(int).clip(0, (width - 1, height - 1))
    counts = high - low + 1
    pairs = counts[:, 0] * counts[:, 1]
    areas = np.zeros(width * height)
    start = 0
    while start < len(corners):
        stop = start + max(1, int(np.searchsorted(np.cumsum(pairs[start:]), CANDIDATES_AT_ONCE, side="right")))
        face = np.repeat(np.arange(start, min(stop, len(corners))), pairs[start:stop])
        number = np.arange(len(face)) - np.repeat(np.cumsum(pairs[start:stop]) - pairs[start:stop], pairs[start:stop])
        x, y = low[face, 0] + number % counts[face, 0], low[face, 1] + number // counts[face, 0]
        overlap = _overlap(corners[face] - np.stack([x, y], axis=-1)[:, None])
        areas += np.bincount(y * width + x, overlap * density[face], minlength=len(areas))
        start = stop
    return areas.reshape(height, width)


def _overlap(triangles: Array) -> Array:
    """Area (n,) of triangles (n, 3, 2) within the unit square, by Green's theorem.

    Each edge brings the signed integral over x in [0, 1] of its height, cut to [0, 1].
    """
    total = np.zeros(len(triangles))
    for i in range(3):
        start, end = triangles[:, i], triangles[:, (i + 1) % 3]
        run, rise = (end - start).T
        slope = np.divide(rise, run, out=np.zeros(len(run)), where=np.abs(run) > 1e-12)
        from_x, to_x = start[:, 0].clip(0, 1), end[:, 0].clip(0, 1)
        from_y, to_y = (start[:, 1] + slope * (x - start[:, 0]) for x in (from_x, to_x))
        climb = to_y - from_y
        flat = np.abs(climb) < 1e-6
        mean = np.divide(_integral(to_y) - _integral(from_y), climb, out=np.zeros(len(run)), where=~flat)
        total += np.where(flat, ((from_y + to_y) / 2).clip(0, 1), mean) * (to_x - from_x)
    return np.abs(total)


def _integral(y: Array) -> Array:
    """Of y cut to [0, 1]."""
    return np.where(y <= 0, 0.0, np.where(y >= 1, y - 0.5, y * y / 2))


class Kernel:
    """Averages over the texels around each texel, on the same surface.

    Parameters
    ----------
    areas : (H, W)
        `texel_areas`.
    open_share : (K,)
        Share of each of the texels that light can reach: 0 within a solid, and only the rest of its area counts.
    """

    def __init__(self, areas: Array, texels: Texels, open_share: Array) -> None:
        self._shape = areas.shape
        lit = open_share > 0
        self._index = texels.index[lit]
        self._area = (areas.reshape(-1)[texels.index] * open_share)[lit]
        small = self._area < 0.5 * texels.spacing[lit] ** 2
        self._weights = _weights(texels, lit, np.where(small, WIDE, KERNEL))
        gathered = self._weights @ self._area
        self._gathered = gathered
        self._enough = gathered > SMALLEST * texels.spacing[lit] ** 2 * np.asarray(self._weights.sum(axis=1)).ravel()

    @property
    def known(self) -> NDArray[np.bool_]:
        """(H, W): where `irradiance` says something."""
        known = np.zeros(self._shape[0] * self._shape[1], bool)
        known[self._index[self._enough]] = True
        return known.reshape(self._shape)

    def irradiance(self, flux: Array) -> Array:
        """(H, W, 3) in W/m^2 from flux (H, W, 3) in W per texel; 0 where nothing is known."""
        gathered = self._weights @ flux.reshape(-1, 3)[self._index].astype(float)
        result = np.zeros((self._shape[0] * self._shape[1], 3))
        mine = self._enough
        result[self._index[mine]] = gathered[mine] / self._gathered[mine, None]
        return result.reshape(*self._shape, 3)


def _weights(texels: Texels, lit: NDArray[np.bool_], width: Array):  # type: ignore[no-untyped-def]
    """Sparse (K, K) weights of the lit texels for each other; `width` (K,) in texels is the kernel's."""
    from scipy.sparse import csr_matrix
    from scipy.spatial import cKDTree

    position = texels.positions[lit].mean(axis=1).astype(float)
    normal = normalize(texels.normals[lit].mean(axis=1).astype(float))
    spacing = np.maximum(texels.spacing[lit], 1e-12)
    n = len(position)
    k = min(NEIGHBOURS, n)
    values, columns = np.zeros((n, k), np.float32), np.zeros((n, k), np.int64)
    tree = cKDTree(position) if n else None
    for start in range(0, n, TEXELS_AT_ONCE):
        mine = slice(start, start + TEXELS_AT_ONCE)
        others = tree.query(position[mine], k=[*range(1, k + 1)])[1]
        offset = position[others] - position[mine, None]
        lift = np.einsum("nkx,nx->nk", offset, normal[mine]) / (LIFT * spacing[mine, None])
        along = np.linalg.norm(offset, axis=2) / (width * spacing)[mine, None]
        facing = np.maximum(np.einsum("nkx,nx->nk", normal[others], normal[mine]), 0) ** 8
        values[mine], columns[mine] = np.exp(-(lift**2 + along**2) / 2) * facing, others
    return csr_matrix((values.ravel(), columns.ravel(), np.arange(0, n * k + 1, max(k, 1))), shape=(n, n))
