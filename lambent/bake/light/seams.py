"""Seams of the light map: texels are averaged across charts that meet in the scene.

Charts are denoised separately, so two that share an edge in the scene differ slightly along it. Near the border of its
chart a texel is therefore replaced by the mean of the texels around it in the scene, regardless of chart: both sides of
a seam get the same mean. Texels are weighted by surface area: the chamfer of a tile has as many texels along an edge as
the tile, but hardly any area. Only charts separated by a cut of a smooth surface are averaged: mouldings of a frame, a
texel apart and facing the same way, have their own light.
"""

from __future__ import annotations

import numpy as np

from lambent.bake.light.stitching import Cuts
from lambent.bake.surfaces.texels import BEYOND, Texels
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.directions import normalize

BORDER = 4.0  # texels from the border beyond which nothing is averaged
RADIUS = 1.0  # texels: standard deviation of the weight along the surface
LIFT = 0.3  # texels: standard deviation perpendicular to the surface, so that a rug does not light the floor below
NEIGHBOURS = 24


def blend_seams(irradiance: Floats, known: Flags, texels: Texels, labels: Indices, cuts: Cuts) -> Floats:
    """Blend seams of irradiance (H, W, C) at `cuts`; hidden parts of charts (`BEYOND`) only blend with each other.

    `known` (H, W) are the sampled texels.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.spatial import cKDTree

    lit = known.reshape(-1)[texels.index]
    index, position = texels.index[lit], texels.positions[lit].mean(axis=1).astype(float)
    normal = normalize(texels.normals[lit].mean(axis=1).astype(float))
    share = np.clip(1 - distance_transform_edt(~_borders(labels)).reshape(-1)[index] / BORDER, 0, 1)
    # triangles degenerate in the scene or in the map have no metres per texel, and no distances to neighbours
    near = np.flatnonzero((share > 0) & (texels.spacing[lit] > 0))
    if len(index) < NEIGHBOURS or not len(near):
        return irradiance
    channels = irradiance.shape[-1]
    values = irradiance.reshape(-1, channels)[index].astype(float)
    spacing = np.repeat(texels.spacing[lit][near, None], NEIGHBOURS, axis=1)
    others = cKDTree(position).query(position[near], k=NEIGHBOURS)[1]
    offset = position[others] - position[near, None]
    lift = np.einsum("nkx,nx->nk", offset, normal[near]) / (LIFT * spacing)
    along = np.linalg.norm(offset, axis=2) / (RADIUS * spacing)
    facing = np.maximum(np.einsum("nkx,nx->nk", normal[others], normal[near]), 0) ** 8
    weight = np.exp(-(lift**2 + along**2) / 2) * facing
    weight *= np.minimum(texels.area_m2[lit][others] / spacing**2, 1)
    chart = labels.reshape(-1)[index]
    row, column = np.nonzero((chart[others] != chart[near, None]) & (weight > 0))
    weight[row, column] *= _parted(chart[near[row]], chart[others[row, column]], labels, cuts)
    beyond = chart >= BEYOND
    weight *= beyond[others] == beyond[near][:, None]
    weight[:, 0] += 1e-6  # the texel itself, or its twin at the same place: the sum is never empty
    mean = np.einsum("nk,nkx->nx", weight, values[others]) / weight.sum(axis=1, keepdims=True)
    blended = irradiance.reshape(-1, channels).copy()
    blended[index[near]] += share[near, None] * (mean - values[near])
    return blended.reshape(irradiance.shape)


def _parted(one: Indices, other: Indices, labels: Indices, cuts: Cuts) -> Flags:
    """Whether a cut separates charts `one` and `other` (n,) of a map of `labels` (H, W)."""
    height, width = labels.shape
    sides = []
    for uv in (cuts.here, cuts.there):
        column, row = (uv * [width, height]).astype(int).clip(0, [width - 1, height - 1]).T
        sides.append(labels[row, column])
    names = np.unique(labels)

    def pairs(a: Indices, b: Indices) -> Indices:
        return np.searchsorted(names, np.minimum(a, b)) * len(names) + np.searchsorted(names, np.maximum(a, b))

    return np.isin(pairs(one, other), np.unique(pairs(*sides)))


def _borders(labels: Indices) -> Flags:
    """Texels next to another chart or a gutter."""
    from scipy.ndimage import maximum_filter, minimum_filter

    return np.asarray((maximum_filter(labels, 3) != labels) | (minimum_filter(labels, 3) != labels))
