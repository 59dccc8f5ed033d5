"""Haar wavelets of light on a hierarchy of spherical triangles, for relighting.

Each of the icosahedron's 20 faces is divided into four triangles, level by level. A function is stored as its values
times the square roots of the triangles' areas, which turns dot products into integrals. One step converts the values of
four children to one mean and three details, by the reflection that swaps the middle child with the parent's constant
function. It is orthonormal for any areas, and treats the three corners alike (Haar wavelets on the sphere: Schroeder
and Sweldens 1995; with orthonormal bases, Bonneau 1999).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lambent.core.arrays import Floats, Image, Indices, sums_of
from lambent.core.geometry.directions import normalize
from lambent.core.geometry.latlong import lat_long_directions
from lambent.scenes.sky.triangle_lights import icosahedron, solid_angles

FACES, CHILDREN = 20, 4
DEEPEST = 6  # 81,920 triangles of 1.5 degrees
LAMP = 8.0  # times the mean radiance: brighter parts of an environment are lamps
PARTS = 2  # levels below the triangles at which a rotated environment is looked up: 16 points each
ROWS_OF_PARTS = 8  # of a picture, times 2^depth: a part is then two to three texels high


@dataclass(frozen=True)
class TriangleTree:
    """The icosahedron divided `depth` times: N = 20 * 4^depth triangles; children of i are 4 i ... 4 i + 3."""

    depth: int

    def __post_init__(self) -> None:
        if not 0 <= self.depth <= DEEPEST + PARTS:
            raise ValueError(f"a tree is 0 to {DEEPEST + PARTS} levels deep, not {self.depth}")

    def __len__(self) -> int:
        return int(FACES * CHILDREN**self.depth)

    @cached_property
    def corners(self) -> Floats:
        """(N, 3, 3) unit corners of the finest triangles, counter-clockwise from outside."""
        triangles = icosahedron()
        for _ in range(self.depth):
            triangles = children_of(triangles)
        return triangles

    @cached_property
    def areas_sr(self) -> Floats:
        """(N,) solid angles; their sum is 4 pi."""
        return solid_angles(self.corners)

    def of_radiance(self, radiance: Floats) -> Floats:
        """Coefficients (N, ...) of radiance (N, ...) by triangle."""
        return self._transformed(_scaled(radiance, np.sqrt(self.areas_sr)))

    def of_transport(self, transport: Floats) -> Floats:
        """Rows (N, ...) of transport (N, ...), the picture due to each triangle at radiance 1.

        The picture is exactly the sum of the rows times `of_radiance`.
        """
        return self._transformed(_scaled(transport, 1 / np.sqrt(self.areas_sr)))

    def radiance(self, coefficients: Floats) -> Floats:
        """Radiance (N, ...) by triangle of coefficients: the inverse of `of_radiance`."""
        values = np.array(coefficients[:FACES])
        for matrices in self._steps[::-1]:
            details = coefficients[len(values) : CHILDREN * len(values)].reshape(len(values), 3, *values.shape[1:])
            both = np.concatenate([values[:, None], details], axis=1)
            values = np.einsum("nki,nk...->ni...", matrices, both).reshape(-1, *values.shape[1:])
        return _scaled(values, 1 / np.sqrt(self.areas_sr))

    def containing(self, w: Floats) -> Indices:
        """(...) number of the finest triangle that contains each unit direction (..., 3)."""
        flat = np.asarray(w, float).reshape(-1, 3)
        number = np.argmax(flat @ icosahedron().sum(axis=1).T, axis=1)  # the nearest centre: faces are congruent
        for planes in self._cuts:
            beyond = np.matmul(planes[number], flat[:, :, None])[..., 0] > 0
            child = np.select([beyond[:, 0], beyond[:, 1], beyond[:, 2]], [0, 1, 2], 3)
            number = CHILDREN * number + child
        return np.asarray(number.reshape(w.shape[:-1]))

    def means(self, w: Floats, weight_sr: Floats, radiance: Floats) -> Floats:
        """Mean radiance (N, 3) in each triangle of samples: directions (S, 3), solid angles (S,), radiance (S, 3).

        A triangle without samples takes the mean of the smallest enclosing one with samples.
        """
        at, count = self.containing(w), len(self)
        weight = [np.bincount(at, weight_sr, count)]
        light = [sums_of(weight_sr[:, None] * radiance, at, count)]
        while len(weight[-1]) > FACES:
            weight.append(weight[-1].reshape(-1, CHILDREN).sum(axis=1))
            light.append(light[-1].reshape(-1, CHILDREN, 3).sum(axis=1))
        mean = np.broadcast_to(light[-1].sum(axis=0) / max(weight[-1].sum(), 1e-300), (FACES, 3))
        for at_level, (w_sr, total) in enumerate(zip(weight[::-1], light[::-1], strict=True)):
            mean = np.repeat(mean, CHILDREN, axis=0) if at_level else mean
            mean = np.where(w_sr[:, None] > 0, total / np.maximum(w_sr, 1e-300)[:, None], mean)
        return np.asarray(mean)

    def _transformed(self, values: Floats) -> Floats:
        details: list[Floats] = []
        for matrices in self._steps:
            four = values.reshape(-1, CHILDREN, *values.shape[1:])
            both = np.einsum("nki,ni...->nk...", matrices.astype(values.dtype), four)
            details.append(both[:, 1:].reshape(-1, *values.shape[1:]))
            values = both[:, 0]
        return np.concatenate([values, *details[::-1]])

    @cached_property
    def _cuts(self) -> list[Floats]:
        """By level, normals (n, 3, 3) of the planes through two edges' midpoints: corners a, b, c lie beyond."""
        cuts, triangles = [], icosahedron()
        for _ in range(self.depth):
            a, b, c = np.moveaxis(triangles, 1, 0)
            ab, bc, ca = normalize(a + b), normalize(b + c), normalize(c + a)
            cuts.append(np.stack([np.cross(ab, ca), np.cross(bc, ab), np.cross(ca, bc)], axis=1))
            triangles = children_of(triangles)
        return cuts

    @cached_property
    def _steps(self) -> list[Floats]:
        """Matrices (n, 4, 4) from children to mean and details, fine to coarse."""
        steps, areas = [], self.areas_sr
        for _ in range(self.depth):
            four = areas.reshape(-1, CHILDREN)
            areas = four.sum(axis=1)
            steps.append(_reflections(np.sqrt(four / areas[:, None])))
        return steps


@dataclass(frozen=True)
class TurningLight:
    """An environment that can be rotated, as radiance by triangle.

    Attributes
    ----------
    tree
        The triangles that light the scene.
    fine : (N * 16, 3)
        Mean radiance of the environment before rotation, in the parts of the triangles.
    """

    tree: TriangleTree
    fine: Floats

    @classmethod
    def of_samples(cls, tree: TriangleTree, w: Floats, weight_sr: Floats, radiance: Floats) -> TurningLight:
        """From samples as in `TriangleTree.means`."""
        return cls(tree, TriangleTree(tree.depth + PARTS).means(w, weight_sr, radiance))

    @classmethod
    def of_picture(cls, tree: TriangleTree, picture: Image) -> TurningLight:
        """From a lat-long picture (H, W, 3), with texels repeated until every part has some."""
        finer = -(-ROWS_OF_PARTS * 2 ** (tree.depth + PARTS) // len(picture))
        picture = picture.repeat(finer, axis=0).repeat(finer, axis=1)
        height, width = picture.shape[:2]
        weight = np.repeat(-np.diff(np.cos(np.linspace(0, np.pi, height + 1))) * (2 * np.pi / width), width)
        return cls.of_samples(tree, lat_long_directions(height, width).reshape(-1, 3), weight, picture.reshape(-1, 3))

    def seen(self, w: Floats) -> Floats:
        """(n, 3) radiance, in unit directions (n, 3), of the environment before rotation, as fine as its parts."""
        return np.asarray(self.fine[self._parts.containing(w)])

    def radiance(self, rotation: Floats | None = None) -> Floats:
        """(N, 3) mean radiance by triangle after rotating the environment by `rotation` (3, 3)."""
        parts, each = self._parts, CHILDREN**PARTS
        light = self.fine * parts.areas_sr[:, None]
        if rotation is not None:
            turn, lamps = np.asarray(rotation, float), self._lamps
            light = np.minimum(self.fine, self._even)[parts.containing(self._centres @ turn)] * parts.areas_sr[:, None]
            gone = (self.fine[lamps] - np.minimum(self.fine[lamps], self._even)) * parts.areas_sr[lamps, None]
            np.add.at(light, parts.containing(self._centres[lamps] @ turn.T), gone)
        whole = light.reshape(-1, each, 3).sum(axis=1)
        return np.asarray(whole / parts.areas_sr.reshape(-1, each).sum(axis=1, keepdims=True))

    @cached_property
    def _even(self) -> Floats:
        """(3,) radiance up to which light is looked up after rotation; the excess of lamps is moved instead.

        A look-up could miss a lamp as small as a part, or find it twice.
        """
        return np.asarray(LAMP * (self.fine * self._parts.areas_sr[:, None]).sum(axis=0) / (4 * np.pi))

    @cached_property
    def _lamps(self) -> Indices:
        return np.flatnonzero((self.fine > self._even).any(axis=1))

    @cached_property
    def _parts(self) -> TriangleTree:
        return TriangleTree(self.tree.depth + PARTS)

    @cached_property
    def _centres(self) -> Floats:
        return normalize(self._parts.corners.sum(axis=1))


def children_of(triangles: Floats) -> Floats:
    """(4 n, 3, 3): every spherical triangle (n, 3, 3) divided at its edges' midpoints; the middle child is the last."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    ab, bc, ca = normalize(a + b), normalize(b + c), normalize(c + a)
    four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.stack([np.stack(child, axis=1) for child in four], axis=1).reshape(-1, 3, 3)


def _reflections(constant: Floats) -> Floats:
    """(n, 4, 4) orthonormal, first row `constant` (n, 4), which must be unit and positive.

    The reflection I - 2 v v^T swaps the unit vector of the middle child, the last, with `constant`; its rows are then
    ordered as constant, corners.
    """
    middle = np.array([0.0, 0.0, 0.0, 1.0])
    v = normalize(middle - constant)
    matrix = np.eye(CHILDREN) - 2 * v[:, :, None] * v[:, None, :]
    return np.asarray(matrix[:, [3, 0, 1, 2]])


def _scaled(values: Floats, factors: Floats) -> Floats:
    return np.asarray(values * factors.astype(values.dtype).reshape(-1, *[1] * (values.ndim - 1)))
