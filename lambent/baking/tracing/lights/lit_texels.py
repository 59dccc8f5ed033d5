"""Lit texels of a light map as places to send rays to.

Rays in cosine-distributed directions rarely meet the patch of floor that a narrow spot or the sun lights, whose light
may be all that a room has. Further rays go to texels chosen in proportion to the light that they send. Both kinds are
weighted by the balance heuristic (Veach 1997, section 9.2.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.surfaces.texels import Texels
from lambent.baking.tracing import rays
from lambent.baking.tracing.scene_builder import light_map_texel
from lambent.core.arrays import Flags, Floats, Indices

EVERY = 4  # rays in cosine-distributed directions for one to a lit texel
NEAR = 1e-3  # texels: the most by which rounding moves points off their square


@dataclass(frozen=True, eq=False)
class SentLight:
    """Flat texels that send light: number (K,) in a map of `size` (H, W), and power (K,) in W.

    corner (K, 3) is a corner of the texel's square on its surface, sides (K, 2, 3) are those along u and v.
    """

    size: tuple[int, int]
    index: Indices
    corner: Floats
    sides: Floats
    power: Floats

    @classmethod
    def of(cls, texels: Texels, geometry: dict[str, Floats], radiosity: Floats) -> SentLight | None:
        """Those of `radiosity` (K,), W/m^2, on a `geometry` as in `atlas.merged`; None in the dark."""
        size = texels.height, texels.width
        power = radiosity * texels.area_m2
        mine = np.flatnonzero(power > 0)
        faces, (row, column) = geometry["faces"][texels.face[mine, 0]], np.divmod(texels.index[mine], texels.width)
        at = geometry["positions"][faces].astype(float)
        uv = geometry["uv2"][faces].astype(float) * (texels.width, texels.height)
        (x, y), (z, w) = (np.moveaxis(uv[:, corner] - uv[:, 0], -1, 0) for corner in (1, 2))
        with np.errstate(divide="ignore", invalid="ignore"):  # faces without area in the map
            inverse = np.moveaxis(np.array([[w, -y], [-z, x]]) / (x * w - y * z), -1, 0)
            sides = inverse @ (at[:, 1:] - at[:, :1])
            corner = at[:, 0] + ((np.stack([column, row], -1) - uv[:, 0])[:, None] @ sides)[:, 0]
            flat = _holds(corner, sides, texels.positions[mine])
        if not flat.any():
            return None
        kept = mine[flat]
        return cls(
            size, texels.index[kept], corner[flat].astype(np.float32), sides[flat].astype(np.float32), power[kept]
        )


def _holds(corner: Floats, sides: Floats, points: Floats) -> Flags:
    """(K,) whether a square on the surface holds points (K, P, 3): neither bends nor lies beside them."""
    normal = np.cross(sides[:, 0], sides[:, 1])
    area = np.linalg.norm(normal, axis=-1, keepdims=True)
    offset = points - corner[:, None]
    u = np.einsum("kpi,ki->kp", offset, np.cross(sides[:, 1], normal)) / area**2
    v = np.einsum("kpi,ki->kp", offset, np.cross(normal, sides[:, 0])) / area**2
    height = np.einsum("kpi,ki->kp", offset, normal) / area**1.5
    inside = (np.abs(u - 0.5) < 0.5 + NEAR) & (np.abs(v - 0.5) < 0.5 + NEAR) & (np.abs(height) < NEAR)
    return np.asarray(inside.all(axis=1))


class LitTexels:
    """Likewise on the device; of each point, one ray in EVERY + 1 goes to a texel."""

    def __init__(self, sent: SentLight) -> None:
        self._height, self._width = sent.size
        share = sent.power / sent.power.sum()
        area_m2 = np.linalg.norm(np.cross(sent.sides[:, 0], sent.sides[:, 1]), axis=-1)
        per_area = np.zeros(self._width * self._height, np.float32)
        per_area[sent.index] = share / area_m2 / EVERY
        self._choice, self._per_area = mi.DiscreteDistribution(mi.Float(share.astype(np.float32))), mi.Float(per_area)
        self._index = mi.UInt32(sent.index.astype(np.uint32))
        places = sent.corner, sent.sides[:, 0], sent.sides[:, 1]
        self._corner, self._across, self._down = (rays.vectors(mi.Vector3f, place) for place in places)

    def ray(self, scene: Any, p: Any, n: Any, u: Any, v: Any) -> tuple[Any, Any]:
        """Rays from points p of surfaces with normals n to texels chosen by u (mi.Float), and their numbers.

        v (mi.Point2f) is the place in a texel.
        """
        chosen = self._choice.sample(u)
        parts = (dr.gather(mi.Vector3f, part, chosen) for part in (self._corner, self._across, self._down))
        corner, across, down = parts
        target = corner + v.x * across + v.y * down
        return rays.leaving(scene, p, n, dr.normalize(target - p)), dr.gather(mi.UInt32, self._index, chosen)

    def met(self, p: Any, si: Any, active: Any) -> tuple[Any, Any]:
        """Texels (mi.UInt32) at interactions, and the density (mi.Float, sr^-1) of such rays from p for each other."""
        texel = light_map_texel(si, self._width, self._height, active)
        per_area, offset = dr.gather(mi.Float, self._per_area, texel, active), si.p - p
        cosine = dr.abs(dr.dot(si.n, dr.normalize(offset)))
        return texel, dr.select(active, per_area * dr.squared_norm(offset) / dr.maximum(cosine, 1e-6), 0.0)
