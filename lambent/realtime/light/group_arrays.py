"""Light of a store by light group, read when a mix first needs it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.light.light_mix import Factors, factors_of
from lambent.realtime.light.lit_texels import LitTexels
from lambent.store import contract
from lambent.store.contract import SIDES
from lambent.store.light_groups import LightGroupRecord, group_name, light_groups
from lambent.store.store import Store

NO_GROUPS = "the store has no light groups"
BAKE_GROUPS = "`lambent bake` of the same scene with --light-groups scene adds it"
FIELDS_FOLLOW = "light fields follow approximately: scaled by the change of light at their objects' probes"


@dataclass(frozen=True, eq=False)
class GroupArrays:
    """Light of a store by group: sides of the light map (n, H, W, 3), and probes (n, 6, N, N, 3) by object.

    Arrays are read on first use; probes are in `unit` W/(sr m^2).
    """

    records: tuple[LightGroupRecord, ...]
    store: Store
    unit: float = 1.0
    _probes: dict[str, Floats] = field(default_factory=dict)  # as stored, after the first read

    @cached_property
    def sides(self) -> tuple[Floats | None, ...]:
        """Light maps by group, float32; None for a side without light."""
        found = [self.store.read(name) if (name := group_name(side)) in self.store else None for side in SIDES]
        lit = [None if one is None or not one.any() else one.astype(np.float32) for one in found]
        scale = np.float32(1 / self.unit)
        return tuple(None if one is None else one if self.unit == 1 else one * scale for one in lit)

    @cached_property
    def lit_sides(self) -> tuple[LitTexels | None, ...]:
        """`sides` as sparse maps of their lit texels."""
        return tuple(None if side is None else LitTexels.of(side) for side in self.sides)

    def light_map(self, factors: Floats) -> tuple[NDArray[np.float16] | None, ...]:
        """By side, a mix of all groups as (H, W, 4) half floats; `factors` are (n, 3)."""
        return tuple(None if side is None else side.mixed(factors) for side in self.lit_sides)

    def probe(self, name: str) -> Floats | None:
        """Radiance (n, 6, N, N, 3) of an object's probe by group; None if the store has none."""
        array = contract.probe_name(name, "groups")
        if array not in self.store:
            return None
        if name not in self._probes:
            self._probes[name] = self.store.read(array)
        scale = np.float32(contract.radiance_unit(self.store, array) / self.unit)
        return np.asarray(self._probes[name].astype(np.float32) * scale)

    def number(self, member: str) -> int | None:
        """Number of the group of the sun, the sky, or an emitting object."""
        return next((i for i, record in enumerate(self.records) if member in record.members), None)

    def factors(self, light: Factors) -> Floats:
        """Factors (n, 3) of a mix; `UserError` for an unknown group."""
        return factors_of([record.name for record in self.records], light)


def groups_in(store: Store, unit: float) -> GroupArrays | None:
    """Light of a store by group, probes in `unit` W/(sr m^2); None if the store was baked without groups."""
    records = light_groups(store)
    return GroupArrays(records, store, unit) if records else None
