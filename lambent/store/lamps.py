"""Lamps that renderers draw by pixel: light, shadow maps, and what the light map holds of them.

A direction d from a lamp, in its axes, is at q = d.xy / (2 cos(theta/2)) / sin(reach/2) in the unit disc, which keeps
areas (Lambert's azimuthal projection): |q| = sin(theta/2) / sin(reach/2).

    lamps/profiles         (P, S, S) float16, intensities over the largest; texel (row, column) has its centre at
                           q = (2 (column + 1/2)/S - 1, 2 (row + 1/2)/S - 1)
    lamps/distances        (n, S, S) float16, likewise, m to the first surface that blocks light. meta["lamps"]:
                           LampRecords
    light_map/lamps, lamps_back  (G, H, W, 3) float16, W/m^2, their direct light in the light map, by light group
    light_map/lamps_reach  (H, W, 4) uint32, bit k % 32 of word k // 32: whether the light of lamp k arrives; of word
                           2 + k // 32: whether pixels look its shadow up, because a part of the texel, or of a
                           neighbour, may be in it
    light_map/lamps_seen   (m, H, W) uint8, for the lamps with an opening in their order, the visible share of it (255:
                           all), for texels whose shadow is not looked up
"""

from __future__ import annotations

import numpy as np
from pydantic import Field, ValidationError

from lambent.core.errors import invalid
from lambent.core.plain import Triple
from lambent.core.strict import Strict
from lambent.store.contract import SIDES
from lambent.store.store import MANIFEST, Store

MOST_LAMPS = 64
PROFILES, DISTANCES, REACHED = "lamps/profiles", "lamps/distances", "light_map/lamps_reach"
SEEN = "light_map/lamps_seen"
LAMPS = tuple(f"light_map/{side.replace('irradiance', 'lamps')}" for side in SIDES)  # by side


class LampRecord(Strict):
    """A lamp: `axes` are unit rows, the last one along its axis; `intensity` is the largest, W/sr.

    `number` is its place among the lights. `half_axes_m` are those of its opening, an ellipse, or 0 of a point.
    `silhouettes_m2` of the opening are those seen along the axes; along others, those of a box add up, and those of
    other shapes count as an ellipsoid's. `moved` is as in `scenes.scene.SceneObject`.
    """

    number: int = Field(ge=0)
    position: Triple
    axes: tuple[Triple, Triple, Triple]
    intensity: Triple
    reach_deg: float = Field(gt=0, le=180)
    half_axes_m: tuple[float, float] = (0.0, 0.0)
    silhouettes_m2: Triple = (0.0, 0.0, 0.0)
    is_box: bool = False
    moved: tuple[tuple[float, float, float, float], ...] | None = Field(default=None, min_length=4, max_length=4)
    profile: int = Field(ge=0)
    group: int = Field(ge=0)

    @property
    def has_opening(self) -> bool:
        return self.half_axes_m[0] > 0


def drawn_lamps(store: Store) -> tuple[LampRecord, ...]:
    """The lamps that renderers draw; empty for a store without any. `UserError` if one is invalid."""
    if DISTANCES not in store or LAMPS[0] not in store:
        return ()
    said = store.artefact(DISTANCES).meta.get("lamps")
    try:
        found = tuple(map(LampRecord.model_validate, said if isinstance(said, list) else ()))
    except ValidationError as error:
        raise invalid(error, store.folder / MANIFEST) from error
    numbers = [
        (
            *lamp.position,
            *lamp.intensity,
            *lamp.half_axes_m,
            *lamp.silhouettes_m2,
            *np.ravel(lamp.moved or ()).sum(keepdims=True),
        )
        for lamp in found
    ]
    axes = np.array([lamp.axes for lamp in found])
    profiles, groups = store.artefact(PROFILES).shape[0], store.artefact(LAMPS[0]).shape[0]
    whole = all(lamp.profile < profiles and lamp.group < groups for lamp in found)
    count, side, _ = store.artefact(DISTANCES).shape
    whole &= store.artefact(PROFILES).shape[1:] == (side, side)
    if not (
        whole and np.isfinite(np.array(numbers)).all() and np.isfinite(axes).all() and len(found) == count <= MOST_LAMPS
    ):
        raise store.broken(f"{DISTANCES}: lamps", got=said, expected=f"{count} lamps of {profiles} profiles")
    return found
