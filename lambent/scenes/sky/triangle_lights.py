"""Light as triangles: the environment divided into spherical triangles, and glowing surfaces into small ones.

Triangles are small where much light comes from. Their corners give the extent of each piece of light, which editing a
highlight needs; equally many point samples would show as dots (Ben-Artzi 2007, section 4.2.3).
"""

from __future__ import annotations

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from lambent.core.arrays import Floats, Indices
from lambent.core.geometry.directions import normalize
from lambent.core.plain import Triple
from lambent.scenes.scene import DirectionalLight, IesLight, Light, PointLight

SMALLEST_SR, POWER = 0.01, 0.25  # of the importance L omega^POWER (Agarwal et al. 2003, eq. 5 with a = 1)
FEWEST_SAMPLES = 12  # samples of the environment in a triangle; with fewer, it is not split
FEWEST, MOST = 20, 100_000  # lights


@dataclass(frozen=True)
class TriangleLights:
    """M lights that are triangles.

    Attributes
    ----------
    corners : (M, 3, 3)
        Unit world directions of the corners at infinity; positions in metres of near ones.
    centres : (M, 3)
        Mean direction, or position, of the light.
    light : (M, 3)
        Radiance times solid angle, W/m^2, for lights at infinity; radiance, W/(sr m^2), for near ones.
    near : (M,) bool
        Whether a light is a surface of the scene. It emits on the side from which its corners are counter-clockwise.
        Near lights with coincident corners are points; `light` is then their intensity, W/sr.
    cones : (M, 5)
        For near points: unit axis, and half-angles in radians of full emission and of the cut-off. Empty if all lights
        emit in all directions.
    luminaires : mapping of int to IesLight
        Near points, by number, that emit by their photometry; `light` is the factor on its candela.
    """

    corners: Floats
    centres: Floats
    light: Floats
    near: np.ndarray
    cones: Floats = field(default_factory=lambda: np.zeros((0, 5)))
    luminaires: Mapping[int, IesLight] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.light)


EVERYWHERE = (0.0, 1.0, 0.0, np.pi, np.pi)  # the cone of an omnidirectional point


def joined(parts: Sequence[TriangleLights]) -> TriangleLights:
    """Concatenate sets of lights."""
    if not parts:
        return TriangleLights(np.zeros((0, 3, 3)), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, bool))
    cones = [p.cones if len(p.cones) else np.tile(EVERYWHERE, (len(p), 1)) for p in parts]
    corners, centres, light, near = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("corners", "centres", "light", "near")
    )
    with_cones = any(len(p.cones) for p in parts)
    first = np.cumsum([0, *map(len, parts)]).tolist()
    luminaires = {m + k: one for k, p in zip(first, parts, strict=False) for m, one in p.luminaires.items()}
    return TriangleLights(
        corners, centres, light, near, np.concatenate(cones) if with_cones else np.zeros((0, 5)), luminaires
    )


def small_lights(lights: Sequence[Light]) -> TriangleLights:
    """Point and directional lights, and luminaires, as triangles with coincident corners."""
    places, values, near, cones = [], [], [], []
    for light in lights:
        near.append(not isinstance(light, DirectionalLight))
        places.append(
            -normalize(np.asarray(light.direction, float)) if isinstance(light, DirectionalLight) else light.position
        )
        values.append(_value(light))
        cones.append(_cone(light) if isinstance(light, PointLight) else EVERYWHERE)
    luminaires = {m: light for m, light in enumerate(lights) if isinstance(light, IesLight)}
    centres = np.array(places, float).reshape(-1, 3)
    corners = np.repeat(centres[:, None], 3, axis=1)
    return TriangleLights(
        corners, centres, np.array(values, float).reshape(-1, 3), np.array(near, bool), np.array(cones), luminaires
    )


def _value(light: Light) -> Triple:
    if isinstance(light, DirectionalLight):
        return light.irradiance
    return light.intensity if isinstance(light, PointLight) else light.scale


def _cone(light: PointLight) -> tuple[float, ...]:
    if light.direction is None:
        return EVERYWHERE
    inner, outer = np.radians([min(light.inner_deg, light.outer_deg), light.outer_deg])
    return (*normalize(np.asarray(light.direction, float)), inner, outer)


def environment_triangles(w: Floats, weight_sr: Floats, radiance: Floats, count: int) -> TriangleLights:
    """An environment as about `count` spherical triangles, by hierarchical subdivision of an icosahedron.

    Parameters
    ----------
    w, weight_sr, radiance
        Samples of the environment: unit world directions (N, 3), their solid angles (N,), radiance (N, 3). Every sample
        lies in one triangle, so the triangles together have the light of the samples exactly.
    count
        Number of lights wanted. Each subdivision adds three to the first 20; triangles with fewer than
        `FEWEST_SAMPLES` samples are not divided, so there may be fewer.
    """
    light = radiance * weight_sr[:, None]
    tree = _Tree(w, weight_sr, light)
    while len(tree.leaves) + 3 <= max(count, FEWEST) and tree.divide():
        pass
    corners = np.array([leaf.corners for leaf in tree.leaves.values()])
    inside = [leaf.samples for leaf in tree.leaves.values()]
    total = np.array([light[samples].sum(axis=0) for samples in inside])
    by_light = np.array([light[samples].sum(axis=1) @ w[samples] for samples in inside])
    centres = np.where(total.sum(axis=1, keepdims=True) > 0, by_light, corners.sum(axis=1))
    return TriangleLights(corners, normalize(centres), total, np.zeros(len(total), bool))


@dataclass(frozen=True)
class _Leaf:
    corners: Floats
    samples: Indices


class _Tree:
    def __init__(self, w: Floats, weight_sr: Floats, light: Floats) -> None:
        self._w, self._weight_sr, self._light = w, weight_sr, light.sum(axis=1)
        self.leaves: dict[int, _Leaf] = {}
        self._queue: list[tuple[float, int]] = []
        self._made = 0
        faces = icosahedron()
        face = np.argmax(faces.sum(axis=1) @ w.T, axis=0)  # the nearest centre: faces are congruent
        for i, corners in enumerate(faces):
            self._add(_Leaf(corners, np.flatnonzero(face == i)))

    def divide(self) -> bool:
        """Divide the most important triangle into four; returns False if none can be divided."""
        if not self._queue:
            return False
        leaf = self.leaves.pop(heapq.heappop(self._queue)[1])
        a, b, c = leaf.corners
        ab, bc, ca = normalize(a + b), normalize(b + c), normalize(c + a)
        w, rest = self._w[leaf.samples], np.ones(len(leaf.samples), bool)
        for child, edge in (((a, ab, ca), (ab, ca)), ((ab, b, bc), (bc, ab)), ((ca, bc, c), (ca, bc))):
            beyond = rest & (w @ np.cross(*edge) > 0)
            rest &= ~beyond
            self._add(_Leaf(np.array(child), leaf.samples[beyond]))
        self._add(_Leaf(np.array([ab, bc, ca]), leaf.samples[rest]))
        return True

    def _add(self, leaf: _Leaf) -> None:
        self.leaves[self._made] = leaf
        if len(leaf.samples) >= FEWEST_SAMPLES:
            omega = max(float(self._weight_sr[leaf.samples].sum()), SMALLEST_SR)
            heapq.heappush(self._queue, (-float(self._light[leaf.samples].sum()) * omega**POWER, self._made))
        self._made += 1


def icosahedron() -> Floats:
    """(20, 3, 3) unit corners of its faces, counter-clockwise from outside."""
    golden = (1 + np.sqrt(5)) / 2
    points = np.array([np.roll([0, a, b * golden], k) for k in range(3) for a in (-1, 1) for b in (-1, 1)])
    faces = [
        (i, j, k)
        for i in range(12)
        for j in range(i + 1, 12)
        for k in range(j + 1, 12)
        if all(np.isclose(np.linalg.norm(points[p] - points[q]), 2) for p, q in ((i, j), (j, k), (k, i)))
    ]
    corners = normalize(points[np.array(faces)])
    outward = np.einsum("fx,fx->f", np.cross(corners[:, 0], corners[:, 1]), corners[:, 2]) > 0
    return np.where(outward[:, None, None], corners, corners[:, ::-1])


def surface_triangles(corners: Floats, radiance: Floats, largest_m: float) -> TriangleLights:
    """Glowing triangles (F, 3, 3) of radiances (F, 3), each cut into equal parts with no edge over `largest_m`."""
    pieces, glow = [], []
    for triangle, value in zip(corners, radiance, strict=True):
        longest = float(np.linalg.norm(triangle - np.roll(triangle, 1, axis=0), axis=1).max())
        n = max(1, int(np.ceil(longest / largest_m)))
        pieces.append(_cut(triangle, n))
        glow.append(np.broadcast_to(value, (n * n, 3)))
    cut, light = np.concatenate(pieces), np.concatenate(glow)
    return TriangleLights(cut, cut.mean(axis=1), light, np.ones(len(cut), bool))


def _cut(triangle: Floats, n: int) -> Floats:
    """Divide a triangle (3, 3) into n^2 equal ones."""
    a, (u, v) = triangle[0], (triangle[1:] - triangle[0]) / n
    upright = [(i, j) for i in range(n) for j in range(n - i)]
    turned = [(i, j) for i in range(n - 1) for j in range(n - 1 - i)]
    parts = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in upright]
    parts += [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in turned]
    steps = np.array(parts, float)
    return np.asarray(a + steps[..., :1] * u + steps[..., 1:] * v)


def solid_angles(corners: Floats) -> Floats:
    """Solid angles (...) in sr of triangles (..., 3, 3) of unit directions (van Oosterom and Strackee 1983, eq. 8)."""
    a, b, c = corners[..., 0, :], corners[..., 1, :], corners[..., 2, :]
    volume = np.abs(np.sum(a * np.cross(b, c), axis=-1))
    flat = 1 + np.sum(a * b, axis=-1) + np.sum(b * c, axis=-1) + np.sum(c * a, axis=-1)
    return np.asarray(2 * np.arctan2(volume, flat))
