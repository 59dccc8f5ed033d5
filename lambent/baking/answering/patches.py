"""Patches: clusters of texels that send light as one.

Clusters begin as what one material has facing each of six directions, and are cut in two, time and again, where the sum
of their weighted squared distances in (position in metres, half the normal, log10 of the light on both sides) is
largest. Weights are how many rays from texels that viewers see end there. Both sides of a surface that light crosses
have the same clusters, paired.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass

import numpy as np

from lambent.baking.answering.spots import Spots
from lambent.core.arrays import Flags, Floats, Indices
from lambent.core.light.colour import luminance

NORMAL_M = 0.5  # metres that a unit of the normal counts for
LEAST_SHARE = 0.05  # of the mean weight, that every texel has
DARKEST = 1e-5  # of the mean light: log10 of less is of this


@dataclass(frozen=True, eq=False)
class Clusters:
    """of (2, K): the patch of each texel and side, -1 where there is none; material, paired (P,)."""

    of: Indices
    material: Indices
    paired: Indices

    @property
    def count(self) -> int:
        return len(self.material)


def clustered(spots: Spots, hits: Floats, most: int) -> Clusters:
    """About `most` patches of all texels; `hits` (2, K) are the rays that ended on each."""
    members = np.flatnonzero(spots.lit.any(axis=0))
    crossed = spots.there[1]
    features = _features(spots)
    weights = hits.sum(axis=0) + LEAST_SHARE * hits.sum() * spots.area / max(float(spots.area.sum()), 1e-30)
    begun = _begun(spots, members)
    sides = sum(1 + int(crossed[one[0]]) for one in begun)
    groups = _split(begun, features, weights, crossed, most - sides)
    cluster = np.full(len(spots.area), -1)
    for number, group in enumerate(groups):
        cluster[group] = number
    _grown(cluster, spots, features)
    return _numbered(cluster, groups, spots, crossed)


def _features(spots: Spots) -> Floats:
    """(K, 8) of each texel."""
    light = luminance(spots.light)
    mean = float(light[spots.lit].mean()) if spots.lit.any() else 1.0
    logs = np.log10(np.maximum(light, max(DARKEST * mean, 1e-30))) * spots.there
    return np.concatenate([spots.position, NORMAL_M * spots.normal, logs.T], axis=1)


def _begun(spots: Spots, members: Indices) -> list[Indices]:
    """Texels by material, by whether light crosses them, and by the main direction of their normals."""
    normal = spots.normal[members]
    axis = np.abs(normal).argmax(axis=1)
    facing = 2 * axis + (np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0)
    kind = (spots.material[members] * 2 + spots.there[1][members]) * 6 + facing
    order = np.argsort(kind, kind="stable")
    cuts = np.flatnonzero(np.diff(kind[order])) + 1
    return [members[part] for part in np.split(order, cuts) if len(part)]


def _split(begun: list[Indices], features: Floats, weights: Floats, crossed: Flags, more: int) -> list[Indices]:
    """The groups after cuts that add `more` patches; a cut adds two where light crosses the surface."""
    heap: list[tuple[float, int, Indices]] = []
    done: list[Indices] = []
    number = 0
    for group in begun:
        heap.append((-_spread(features[group], weights[group]), number, group))
        number += 1
    heapq.heapify(heap)
    while heap and more > 0:
        spread, _, group = heapq.heappop(heap)
        halves = _halves(group, features[group], weights[group]) if spread < 0 else None
        if halves is None:
            done.append(group)
            continue
        more -= 1 + int(crossed[group[0]])
        for half in halves:
            heapq.heappush(heap, (-_spread(features[half], weights[half]), number, half))
            number += 1
    return done + [group for _, _, group in heap]


def _spread(features: Floats, weights: Floats) -> float:
    """Weighted sum of squared distances from the mean."""
    total = max(float(weights.sum()), 1e-30)
    mean = weights @ features / total
    return float(weights @ ((features - mean) ** 2).sum(axis=1)) if len(features) > 1 else 0.0


def _halves(group: Indices, features: Floats, weights: Floats) -> tuple[Indices, Indices] | None:
    """A group cut at its weighted mean across its longest axis; None where that parts nothing."""
    mean = weights @ features / max(float(weights.sum()), 1e-30)
    offset = features - mean
    axis = np.linalg.eigh((offset * weights[:, None]).T @ offset)[1][:, -1]
    upper = offset @ axis > 0
    return None if upper.all() or not upper.any() else (group[upper], group[~upper])


def _grown(cluster: Indices, spots: Spots, features: Floats) -> None:
    """Give every texel without a cluster that of the nearest one of its object, else of its material."""
    from scipy.spatial import KDTree

    for owner in (spots.object, spots.material):
        left = np.flatnonzero(cluster < 0)
        for one in np.unique(owner[left]):
            known = np.flatnonzero((cluster >= 0) & (owner == one))
            mine = left[owner[left] == one]
            if len(known):
                near = KDTree(features[known, :6]).query(features[mine, :6])[1]
                cluster[mine] = cluster[known[near]]


def _numbered(cluster: Indices, groups: list[Indices], spots: Spots, crossed: Flags) -> Clusters:
    """Front patches are numbered as the groups, those of far sides after them."""
    has_back = np.array([crossed[group[0]] for group in groups], bool)
    back = np.where(has_back, len(groups) + np.cumsum(has_back) - 1, -1)
    paired = np.where(has_back, back, np.arange(len(groups)))
    material = np.array([spots.material[group[0]] for group in groups])
    of = np.stack([cluster, np.where(crossed & (cluster >= 0), back[cluster], -1)])
    both = np.concatenate([paired, np.flatnonzero(has_back)])
    return Clusters(of, np.concatenate([material, material[has_back]]), both)
