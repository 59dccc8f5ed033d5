"""Lamps of a baked scene, drawn by pixel: their arrays from a store (`store.lamps`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.store.lamps import DISTANCES, LAMPS, PROFILES, REACHED, SEEN, LampRecord, drawn_lamps
from lambent.store.store import Store

BIAS, NEAR_TEXELS = 2e-3, 1.5  # as LAMP_BIAS and LAMP_NEAR of lamp_direct.wgsl, for the nearest texel alone


@dataclass(frozen=True, eq=False)
class DrawnLamps:
    """The lamps of a scene, in units of `BakedScene.unit`, and what the light map holds of their direct light.

    Attributes
    ----------
    records : (n,) LampRecord
        The most important lamp first.
    profiles : (P, S, S) float16
    distances : (n, S, S) float16
        m.
    reached : (H, W, 4) uint32
        Bits of the lamps whose light arrives at texels, and of those whose shadows pixels look up.
    seen : (m, H, W) uint8
        Visible share of the openings of lamps that have one, where pixels do not look it up.
    light : list of (G, H, W, 3) float32
        Direct light in the light map, by side and light group.
    """

    records: tuple[LampRecord, ...]
    profiles: NDArray[np.float16]
    distances: NDArray[np.float16]
    reached: NDArray[np.uint32]
    seen: NDArray[np.uint8]
    light: list[Floats]

    @property
    def rows(self) -> int:
        """Rows of four words by texel that pixels read: `reached`, and one for each 16 of `seen`."""
        return 1 + -(-len(self.seen) // 16)

    def intensities(self, factors: Floats | None = None) -> Floats:
        """(n, 3) largest intensities, in a mix of light groups with factors (G, 3)."""
        found = np.array([lamp.intensity for lamp in self.records]).reshape(-1, 3)
        return found if factors is None else found * factors[[lamp.group for lamp in self.records]]

    def in_map(self, factors: Floats | None = None) -> list[Floats]:
        """Direct light (H, W, 3) in the light map, by side, in a mix of light groups with factors (G, 3)."""
        if factors is None:
            return [side.sum(axis=0) for side in self.light]
        return [np.einsum("ghwc,gc->hwc", side, factors, optimize=True) for side in self.light]


@dataclass(frozen=True, eq=False)
class ShadowedLamp:
    """A lamp with its profile and shadow map, (S, S) each, as in `store.lamps`."""

    record: LampRecord
    profile: NDArray[np.float16]
    distances: NDArray[np.float16]

    def irradiance(self, p: Floats, n: Floats) -> Floats:
        """(k, 3), in units of the record, at points p (k, 3) of normals n (k, 3)."""
        lamp, side, found = self.record, len(self.profile), np.zeros_like(p)
        away = (p - np.array(lamp.position)) @ np.array(lamp.axes).T
        normal = n @ np.array(lamp.axes).T
        distance = np.linalg.norm(away, axis=1)
        d = away / np.maximum(distance, 1e-6)[:, None]
        scale = np.sin(np.radians(lamp.reach_deg) / 2)
        place = d[:, :2] / np.sqrt(np.maximum(2 + 2 * d[:, 2:], 1e-12)) / scale
        cosine = -(normal * d).sum(axis=1)
        lit = np.flatnonzero(((place**2).sum(axis=1) < 1) & (cosine > 0))
        column, row = ((place[lit] * 0.5 + 0.5) * side).astype(int).clip(0, side - 1).T
        s = (np.stack([column, row], axis=-1) * 2 + 1 - side) / side * scale
        square = np.minimum((s * s).sum(axis=1), 1.0)
        centre = np.column_stack([2 * s * np.sqrt(1 - square)[:, None], 1 - 2 * square])
        plane = cosine[lit] / np.maximum(-(normal[lit] * centre).sum(axis=1), 1e-6) * distance[lit]  # along `centre`
        first = self.distances[row, column].astype(float)
        near = distance[lit] * (1 - NEAR_TEXELS * 4 * scale / side)
        seen = lit[(first >= plane * (1 - BIAS)) | (first >= near)]
        share = self.profile.astype(float)[row, column][np.searchsorted(lit, seen)]
        square = distance[seen] ** 2 + lamp.half_axes_m[0] * lamp.half_axes_m[1]
        found[seen] = (share * cosine[seen] / square)[:, None] * lamp.intensity
        return found


def read_lamps(store: Store, unit: float) -> DrawnLamps | None:
    """The lamps of a store; None if it has none, as earlier stores."""
    records = drawn_lamps(store)
    if not records:
        return None
    scaled = tuple(
        lamp.model_copy(update={"intensity": tuple(np.divide(lamp.intensity, unit).tolist())}) for lamp in records
    )
    light = [store.read(name).astype(np.float32) / np.float32(unit) for name in LAMPS if name in store]
    for name in (REACHED, LAMPS[0]):
        if store.artefact(name).shape[-3:-1] != (of_map := store.artefact("light_map/irradiance").shape[:2]):
            raise store.broken(name, got=store.artefact(name).shape, expected=f"{of_map}, as the light map")
    sized = sum(lamp.has_opening for lamp in records)
    seen = store.read(SEEN) if sized else np.zeros((0, 1, 1), np.uint8)
    if sized and seen.shape != (sized, *store.artefact(REACHED).shape[:2]):
        raise store.broken(SEEN, got=seen.shape, expected=f"{sized} openings on the light map")
    return DrawnLamps(scaled, store.read(PROFILES), store.read(DISTANCES), store.read(REACHED), seen, light)
