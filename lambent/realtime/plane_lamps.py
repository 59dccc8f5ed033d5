"""Small lamps over planar reflectors: emitting objects taken out of a mirrored view for lobes wider than the lamp.

A reflector's pixels evaluate these lamps in closed form (shaders/planar_lamps.wgsl, materials/lamp_light.py) from
position, spread and colour, and from a map over the reflector (lamp_maps.py) of the solid angle visible from the plane.

Seen along w, a lamp's silhouette has the covariance P M P, P = 1 - w w^T. One matrix M serves all directions: exactly
for ellipsoids and flat lamps, by least squares for others.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from lambent.core.arrays import Floats
from lambent.core.colour import luminance
from lambent.core.directions import basis, normalize
from lambent.core.geometry import area_vectors
from lambent.core.plain import Triple
from lambent.realtime.baked import BakedScene
from lambent.store.contract import ReflectorRecord

MOST = 4  # most lamps of a reflector, and channels of its map: size of arrays in shaders/planar_lamp_record.wgsl
POINTS = 64  # sample points of a lamp for visibility; of a ball, some 20 face each point of a reflector
MOST_RADIUS_RAD = 0.35  # seen from the farthest point; larger emitters count as surfaces
AT_ONCE = 1 << 20  # pairs of points and triangles at a time: some 50 MB
WELDED_M = 1e-5  # nearer corners are merged


@dataclass(frozen=True, eq=False)
class PlaneLamp:
    """A connected part of an emitting object: corners (F, 3, 3) of its triangles, m, and radiance of their fronts."""

    object: str
    corners: Floats
    emission: Triple
    areas: Floats = field(init=False)  # (F, 3) normals with the triangles' areas as lengths, m^2
    middles: Floats = field(init=False)  # (F, 3)

    def __post_init__(self) -> None:
        object.__setattr__(self, "areas", area_vectors(self.corners) / 2)
        object.__setattr__(self, "middles", self.corners.mean(axis=1))

    def solid_angles(self, points: Floats) -> Floats:
        """(M,) solid angle, sr, from points (M, 3), unoccluded; exact for a convex lamp."""
        parts = np.array_split(np.arange(len(points)), 1 + len(points) * len(self.middles) // AT_ONCE)
        return np.concatenate([self._facing(points[part]).sum(axis=1) for part in parts])

    def _facing(self, points: Floats) -> Floats:
        """(M, F) solid angle, sr, of every triangle; 0 for back faces."""
        to = points[:, None] - self.middles
        return np.asarray(np.maximum(np.einsum("mfx,fx->mf", to, self.areas), 0) / (to * to).sum(axis=-1) ** 1.5)

    @cached_property
    def centre(self) -> Floats:
        """(3,) centroid by area, m."""
        area = np.linalg.norm(self.areas, axis=1)
        return np.asarray(area @ self.middles / area.sum())

    def spread_from(self, points: Floats) -> Floats:
        """The matrix M (3, 3), m^2, by least squares over the silhouettes seen from points (N, 3)."""
        rows, wanted = [], []
        index = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])
        for point, share in zip(points, self._facing(points), strict=True):
            if share.sum() <= 0:
                continue
            to = self.centre - point
            w = normalize(to)
            axes = np.stack(basis(w))
            # projected to the plane through the centre, perpendicular to the view: (F, 3, 2)
            place = (self.corners - point) @ axes.T * (to @ w / ((self.corners - point) @ w))[..., None]
            mean = share @ place.mean(axis=1) / share.sum()
            about = place - mean
            # second moment over a triangle: (sum of the corners' moments + 9 times the centroid's)/12
            middle = about.mean(axis=1)
            moment = (np.einsum("fca,fcb->fab", about, about) + 9 * np.einsum("fa,fb->fab", middle, middle)) / 12
            covariance = np.einsum("f,fab->ab", share, moment) / share.sum()
            for a, b in ((0, 0), (0, 1), (1, 1)):
                row = np.zeros(6)
                np.add.at(row, index, np.outer(axes[a], axes[b]))
                rows.append(row)
                wanted.append(covariance[a, b])
        if not rows:
            return np.zeros((3, 3))
        matrix = np.linalg.lstsq(np.array(rows), np.array(wanted), rcond=1e-6)[0][index]
        value, vector = np.linalg.eigh(matrix)
        return np.asarray((vector * np.maximum(value, 0)) @ vector.T)

    def light_points(self, points: Floats) -> tuple[Floats, Floats]:
        """At most POINTS positions (K, 3) on triangles that face any of points (M, 3), and area vectors (K, 3)."""
        heights = points @ self.areas.T - (self.middles * self.areas).sum(axis=1)
        facing = np.flatnonzero(heights.max(axis=0) > 0)
        if not len(facing):
            return np.zeros((0, 3)), np.zeros((0, 3))
        pieces, of = _pieces(self.corners[facing], 8 * POINTS)
        areas = self.areas[facing][of] / np.bincount(of)[of][:, None]
        label = _bundles(pieces, POINTS)
        label = np.unique(label, return_inverse=True)[1]
        # a random piece of each bundle: centroids lie in rows, and a straight edge would cover whole rows at once
        order = np.random.default_rng(5).permutation(len(pieces))
        chosen = order[np.unique(label[order], return_index=True)[1]]
        return pieces[chosen], np.stack([np.bincount(label, areas[:, i]) for i in range(3)], axis=-1)


def _bundles(points: Floats, count: int) -> NDArray[np.intp]:
    """(P,) bundle, below `count`, of each of the points (P, 3); neighbours are bundled by recursive halving."""
    label = np.zeros(len(points), np.intp)
    if count < 2 or len(points) < 2:
        return label
    longest = int(np.argmax(np.ptp(points, axis=0)))
    order = np.argsort(points[:, longest], kind="stable")
    for number, part in enumerate(np.array_split(order, 2)):
        label[part] = number * (count // 2) + _bundles(points[part], count // 2)
    return label


def _pieces(corners: Floats, count: int) -> tuple[Floats, NDArray[np.intp]]:
    """At least `count` centroids (P, 3) of equal-area pieces of triangles (F, 3, 3), and the triangle of each."""
    of = np.arange(len(corners))
    while len(corners) < count:
        a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        quarters = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        corners = np.concatenate([np.stack(one, axis=1) for one in quarters])
        of = np.tile(of, 4)
    return corners.mean(axis=1), of


def lamps_of(scene: BakedScene) -> list[PlaneLamp]:
    """Every connected part of every whole emitting object; an object of more than MOST parts is one lamp."""
    found: list[PlaneLamp] = []
    for record in scene.record.objects:
        if not any(record.emission) or record.part_of:
            continue
        faces = scene.faces[record.first_face : record.first_face + record.face_count]
        corners = scene.positions[faces].astype(float)
        corners = corners[np.linalg.norm(area_vectors(corners), axis=1) > 0]
        parts = list(_connected(corners))
        emission: Triple = record.emission
        found += [PlaneLamp(record.name, part, emission) for part in (parts if len(parts) <= MOST else [corners])]
    return found


def _connected(corners: Floats) -> Iterable[Floats]:
    if not len(corners):
        return
    vertex = np.unique(np.round(corners.reshape(-1, 3) / WELDED_M).astype(np.int64), axis=0, return_inverse=True)[1]
    face = vertex.reshape(-1, 3)
    edges = np.concatenate([face[:, :2], face[:, 1:]])
    count = int(vertex.max()) + 1
    label = connected_components(coo_array((np.ones(len(edges)), edges.T), shape=(count, count)), directed=False)[1]
    of = label[face[:, 0]]
    for number in np.unique(of):
        yield corners[of == number]


def over(lamps: Iterable[PlaneLamp], reflector: ReflectorRecord, plane: Floats, clearance_m: float) -> list[PlaneLamp]:
    """Lamps of a reflector seen from the side that the plane (n, d) faces: from the brightest objects, at most MOST.

    An object contributes all of its lamps or none: the mirrored view shows the object either lit or dark.
    """
    outline = np.asarray(reflector.outline, float)
    points = np.concatenate([outline, outline.mean(axis=0)[None]])
    own = {part.object for part in reflector.parts}
    by_object: dict[str, list[PlaneLamp]] = {}
    for lamp in lamps:
        by_object.setdefault(lamp.object, []).append(lamp)
    candidates = []
    for name, group in by_object.items():
        lowest = min(float((lamp.corners @ plane[:3]).min()) for lamp in group) + plane[3]
        if name in own or lowest <= clearance_m or not all(_is_small(lamp, points) for lamp in group):
            continue
        power = sum(float(luminance(np.asarray(lamp.emission))) * lamp.solid_angles(points).max() for lamp in group)
        if power > 0:
            candidates.append((power, group))
    chosen: list[PlaneLamp] = []
    for _, group in sorted(candidates, key=lambda one: -one[0]):
        if len(chosen) + len(group) <= MOST:
            chosen += group
    return chosen


def _is_small(lamp: PlaneLamp, points: Floats) -> bool:
    reach = np.linalg.norm(lamp.corners - lamp.centre, axis=-1).max()
    return bool(reach < MOST_RADIUS_RAD * np.linalg.norm(points - lamp.centre, axis=1).max())
