"""The light map of a store in a state of its room: edited materials answered, light groups mixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import has_answer, read_answer
from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.light.light_mix import Factors
from lambent.core.plain import triple
from lambent.materials.document import Material
from lambent.realtime.lamps.drawn import ShadowedLamp
from lambent.realtime.light.baked import read_baked
from lambent.realtime.light.group_arrays import BAKE_GROUPS, NO_GROUPS, GroupArrays
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.scene import IesLight, Light, MaterialTextures, PointLight
from lambent.store.lamp_discs import axes_of
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.baking.pictures.tracer import LightMap
    from lambent.baking.tracing.traced_scene import TracedScene
    from lambent.realtime.answering.answering import AnsweredLight, Lit

Textures = Mapping[str, MaterialTextures | None]  # exchanged ones, by material


class StoredLight:
    """The light map of a store; `answers` tells whether it follows edited materials.

    Lamps that renderers draw by pixel are traced if they are among the `lights` of the scene, as they were baked.
    """

    def __init__(self, store: Store, lights: Sequence[Light]) -> None:
        self._store, self.answers = store, has_answer(store)
        self._baked = read_baked(store, probes=False)
        self._lamps = self._baked.lamps
        records = () if self._lamps is None else self._lamps.records
        positions = {number: light.position for number, light in enumerate(lights) if hasattr(light, "position")}
        if any(positions.get(lamp.number) != lamp.position for lamp in records):
            self._lamps = None
        self._lit: tuple[object, Lit] | None = None
        self._edits: Mapping[int, LampEdit] = {}

    def edit(self, traced: TracedScene, lamps: Mapping[int, LampEdit]) -> None:
        """Answer edits of lamps, which the scene that is traced has."""
        self._traced, self._edits, self._lit = traced, lamps, None
        self.__dict__.pop("_change", None)

    def of(
        self, materials: Mapping[str, Material], textures: Textures, factors: Factors, *, lamps: bool = True
    ) -> LightMap:
        """The light map for edited materials, exchanged textures and factors of light groups, all by name.

        With `lamps`, it answers those that were edited.
        """
        lit, baked = self._answered(materials, textures, lamps and bool(self._edits)), self._baked
        if not factors:
            maps = (baked.irradiance, baked.irradiance_back) if lit is None else self._answer.maps(lit)
            return self._without_lamps(maps, None)
        groups, by_group = self._groups, self._groups.factors(factors)
        answered = None if lit is None else self._answer.groups(lit)
        mixed = [None if side is None else side[..., :3] for side in (answered or groups).light_map(by_group)]
        return self._without_lamps(mixed, by_group)

    def check(self, factors: Factors) -> None:
        """Raise `UserError` if the store has no light groups, or none of a name."""
        if factors:
            self._groups.factors(factors)

    @property
    def _groups(self) -> GroupArrays:
        if self._baked.groups is None:
            raise UserError(NO_GROUPS, field="--light", hint=BAKE_GROUPS)
        return self._baked.groups

    def _answered(self, materials: Mapping[str, Material], textures: Textures, lamps: bool) -> Lit | None:
        """The answer to edits; None without edits, or where light stays as baked."""
        if not self.answers or not (materials or textures or lamps):
            return None
        of = dict(materials), dict(textures), lamps
        if self._lit is None or self._lit[0] != of:
            self._lit = of, self._answer.lit(materials, textures, self._change if lamps else None)
        return self._lit[1]

    @cached_property
    def _change(self) -> NDArray[np.float32]:
        """The change of direct light (G, T, 3) on the answering texels, by shadow maps of the edited lamps."""
        from lambent.baking.light.lamp_maps import shadow_map  # imports Mitsuba, whose variant `engine` has set
        from lambent.realtime.lamps.changed import changed  # imports what draws

        pairs, drawn = [], self._baked.lamps
        for place, was in enumerate(() if drawn is None else drawn.records):
            if (edit := self._edits.get(was.number)) is None or drawn is None:
                continue
            light = self._traced.scene.lights[was.number]
            assert isinstance(light, PointLight | IesLight), "lamps are at points"
            now, shape = changed(was, edit, self._baked.unit)
            now = now.model_copy(update={"axes": tuple(map(triple, axes_of(light)))})
            distances, _ = shadow_map(self._traced.whole(diffuse=False), light, (1, 1))
            before, profile = drawn.profiles[was.profile], shape if shape is not None else drawn.profiles[was.profile]
            pairs.append((ShadowedLamp(was, before, drawn.distances[place]), ShadowedLamp(now, profile, distances)))
        return self._answer.lamp_changes.of(pairs)

    @cached_property
    def _answer(self) -> AnsweredLight:
        from lambent.realtime.answering.answering import AnsweredLight  # imports what draws

        return AnsweredLight(self._baked, read_answer(self._store))

    def _without_lamps(self, maps: Sequence[Floats | None], factors: Floats | None) -> LightMap:
        from lambent.baking.pictures.tracer import LightMap  # imports Mitsuba, whose variant `engine` has set

        front, back = map(self._in_watts, maps)
        if self._lamps is None:
            return LightMap(front, back, factors)
        drawn = [self._in_watts(light) for light in self._lamps.in_map(factors)]
        sides = [
            None if of is None else np.maximum(of - (light if light is not None else 0), 0)
            for of, light in zip((front, back), (*drawn, None), strict=False)
        ]
        groups = tuple((lamp.number, lamp.group) for lamp in self._lamps.records)
        return LightMap(sides[0], sides[1], factors, groups)

    def _in_watts(self, side: Floats | None) -> Floats | None:
        """A side (H, W, 3) as float32, W/m^2."""
        return None if side is None else np.asarray(side, np.float32) * np.float32(self._baked.unit)
