"""Closed seams of the light map: both sides of a cut through a smooth surface look up the same light.

Charts of a few texels differ along their cuts whatever their texels' values, because each side interpolates its own.
The texels used by look-ups along cuts are changed as little as possible, relative to their light, to make the look-ups
agree: linear least squares (used for light maps by Iwanicki 2013, "Lighting technology of The Last of Us"). Texels keep
their light more firmly the more surface they hold, because a change shows on all of it.

If one side is a sliver, such as the chamfer of a tile, it follows the broad side: a chamfer's texels include the dark
joint, which would appear as a line on the broad side.

Sides that differ much keep most of their difference: where a smooth surface dips into a gap or turns away from a
window, light changes within a texel, and agreement would carry it a texel far into the dark, and darkness into light.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baking.surfaces.texels import BEYOND
from lambent.core.arrays import Flags, Floats, Indices, ranges
from lambent.core.light.colour import luminance

SMOOTH = 0.98  # least cosine between the normals on both sides of a cut; at sharper cuts light may change abruptly
PER_TEXEL = 2.0  # samples along a cut
MOST_SAMPLES = 64  # per edge
AGREE = 30.0  # weight of agreement at a sample, relative to that of a texel's own light
FILLED, COVERED = (
    0.05,
    5.0,
)  # weight of the light of texels that hold none of their own; more for a whole texel of surface
NARROW = 0.25  # a side with less than this share of the other side's area follows that
CONTRAST = 0.2  # of the brighter side's light: larger steps are light rather than noise, as at contacts and edges
DARK = 0.01  # relative to the mean light: smaller differences are ignored
STEPS, RESIDUE = 100, 1e-3  # of conjugate gradients


@dataclass(frozen=True)
class Cuts:
    """Places on cuts of smooth surfaces: light map coordinates (n, 2) on one side and on the other."""

    here: Floats
    there: Floats


def cuts_of(geometry: dict[str, Floats], width: int, height: int) -> Cuts:
    """The cuts of all surfaces on a map of this size; `geometry` as in `atlas.merged`."""
    faces, size = geometry["faces"].astype(np.int64), np.array([width, height])
    _, place = np.unique(geometry["positions"], axis=0, return_inverse=True)
    edges = np.concatenate([faces[:, [k, (k + 1) % 3]] for k in range(3)])
    ends = place.reshape(-1)[edges]
    edges = np.where((ends[:, 0] > ends[:, 1])[:, None], edges[:, ::-1], edges)
    ends = np.sort(ends, axis=1)
    order = np.lexsort(ends.T)
    twin = np.flatnonzero((ends[order][1:] == ends[order][:-1]).all(axis=1))
    a, b = edges[order[twin]], edges[order[twin + 1]]
    uv, normals = geometry["uv2"].astype(float), geometry["normals"].astype(float)
    apart = (np.abs(uv[a] - uv[b]) * size).max(axis=(1, 2), initial=0) > 1e-3
    smooth = (normals[a] * normals[b]).sum(axis=-1).min(axis=1, initial=1) > SMOOTH
    a, b = uv[a[apart & smooth]], uv[b[apart & smooth]]
    longest = np.maximum(*(np.linalg.norm((side[:, 1] - side[:, 0]) * size, axis=1) for side in (a, b)))
    count = np.ceil(longest * PER_TEXEL).astype(int).clip(1, MOST_SAMPLES)
    edge = np.repeat(np.arange(len(a)), count)
    t = ((ranges(count) + 0.5) / count[edge])[:, None]
    return Cuts(*(side[edge, 0] * (1 - t) + side[edge, 1] * t for side in (a, b)))


def stitched(irradiance: Floats, cuts: Cuts, labels: Indices, area_m2: Floats, covered: Floats) -> Floats:
    """(H, W, 3) light map whose look-ups agree along cuts; parts of charts that no viewer sees (BEYOND) are unchanged.

    `area_m2` (H, W) is the surface in each texel, `covered` (H, W) the covered share of its square. Similar sides meet
    half-way first; then slivers follow the fixed sides next to them.
    """
    height, width = irradiance.shape[:2]
    here, there = (_footprint(uv, width, height) for uv in (cuts.here, cuts.there))
    texel = np.concatenate([here[0], there[0]], axis=1)
    share = np.concatenate([here[1], -there[1]], axis=1)
    keep = ~((labels.reshape(-1)[texel] >= BEYOND) & (share != 0)).any(axis=1)
    on_surface = np.abs(share) * area_m2.reshape(-1)[texel]
    sides = np.stack([on_surface[:, :4].sum(axis=1), on_surface[:, 4:].sum(axis=1)], axis=1)
    narrow = sides < NARROW * sides[:, ::-1]
    like, unlike = keep & ~narrow.any(axis=1), keep & narrow.any(axis=1)
    own = FILLED + COVERED * np.where(labels >= 0, covered, 0.0).reshape(-1)
    met = _close(irradiance, texel[like], share[like], own, np.ones(own.shape, bool))
    of_sliver, counts = np.repeat(narrow[unlike], 4, axis=1), share[unlike] != 0
    moving = np.zeros(own.shape, bool)
    moving[texel[unlike][of_sliver & counts]] = True
    moving[texel[unlike][~of_sliver & counts]] = False
    return _close(met, texel[keep], share[keep], own, moving)


def _close(irradiance: Floats, texel: NDArray[Any], share: Floats, own: Floats, moving: Flags) -> Floats:
    """Bring the sums of `share` times `texel`, both (n, 8), of a light map (H, W, 3) to 0 by changing `moving` texels.

    `own` (H W,) is the weight of a texel's own light, `moving` (H W,) whether it may change.
    """
    from scipy.sparse import csr_matrix, diags
    from scipy.sparse.linalg import LinearOperator, cg

    in_use = (moving[texel] & (share != 0)).any(axis=1)
    touched, number = np.unique(texel[in_use], return_inverse=True)
    if not len(touched):
        return irradiance
    number, share = number.reshape(-1, texel.shape[1]), share[in_use]
    values = irradiance.reshape(-1, 3)[touched].astype(float)
    least = DARK * max(float(luminance(irradiance).mean()), 1e-12)
    relative = 1 / np.maximum(luminance(values), least) ** 2
    of_row = relative[number].min(axis=1)
    likeness = _likeness(luminance(values)[number] * share, least)
    weight = np.sqrt(AGREE * of_row * likeness)[:, None] * share
    rows = np.arange(0, weight.size + 1, weight.shape[1])
    apart = csr_matrix((weight.ravel(), number.ravel(), rows), shape=(len(weight), len(touched)))
    free = moving[touched]
    hold = (own[touched] * relative)[free]
    by_free, by_fixed = apart[:, free], apart[:, ~free]
    system = (by_free.T @ by_free + diags(hold)).tocsr()
    aim = hold[:, None] * values[free] - by_free.T @ (by_fixed @ values[~free])
    scale = 1 / system.diagonal()
    first = LinearOperator(system.shape, matvec=lambda v: scale * v)
    found = irradiance.reshape(-1, 3).astype(float)
    for channel in range(3):
        start = values[free, channel]
        found[touched[free], channel], _ = cg(system, aim[:, channel], x0=start, rtol=RESIDUE, maxiter=STEPS, M=first)
    found[touched] = found[touched].clip(*_ranges(values, number, share))
    return np.asarray(found.reshape(irradiance.shape), irradiance.dtype)


def _likeness(light: Floats, least: float) -> Floats:
    """Weight (n,) of agreement of look-ups `light` (n, 8), the other side's negative: 1 if equal, less by contrast."""
    one, other = light[:, :4].sum(axis=1), -light[:, 4:].sum(axis=1)
    apart = np.abs(one - other) / np.maximum(np.maximum(one, other), least)
    return np.asarray(1 / (1 + (apart / CONTRAST) ** 2) ** 2)


def _ranges(values: Floats, number: NDArray[Any], share: Floats) -> tuple[Floats, Floats]:
    """Range of `values` (m, 3) among each texel's look-ups; beyond it the fit would oscillate.

    `number` and `share` (n, 8) are the texels of the look-ups on both sides, and their weights.
    """
    low, high, counts = values.copy(), values.copy(), share != 0
    met, row = values[number], np.nonzero(counts)[0]
    np.minimum.at(low, number[counts], np.where(counts[..., None], met, np.inf).min(axis=1)[row])
    np.maximum.at(high, number[counts], np.where(counts[..., None], met, -np.inf).max(axis=1)[row])
    return low, high


def _footprint(uv: Floats, width: int, height: int) -> tuple[NDArray[Any], Floats]:
    """Texels (n, 4) of bilinear look-ups (n, 2), and their weights."""
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    column, row = np.floor(x), np.floor(y)
    right, down = x - column, y - row
    texels, shares = [], []
    for dy, dx in ((0, 0), (0, 1), (1, 0), (1, 1)):
        at = (row + dy).clip(0, height - 1) * width + (column + dx).clip(0, width - 1)
        texels.append(at.astype(np.int64))
        shares.append((down if dy else 1 - down) * (right if dx else 1 - right))
    return np.stack(texels, axis=1), np.stack(shares, axis=1)
