"""Light of paths, separated by the group of its emitter: the same paths as without groups, plus an index.

For an environment that contains a sun, the sun's part of the picture belongs to the sun's group, the rest to the sky's.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lambent.baking.tracing.lights.emitters import number_of
from lambent.baking.tracing.lights.sun import Sun
from lambent.baking.tracing.path_tracer import AllLight
from lambent.baking.tracing.scene_builder import SceneBuilder
from lambent.core.arrays import Floats
from lambent.scenes.light_groups import SortedLights


class Direct(Enum):
    """Separately summed light: `straight` from emitters, or `uncached`, which adds lobes but not caches."""

    straight = "straight"
    uncached = "uncached"


class Sorting:
    """Splits light of emitters by group: n groups of `lights`, for scenes of `builder`."""

    def __init__(self, lights: SortedLights, builder: SceneBuilder, sun: Sun | None) -> None:
        self.count, self.of_sun, self._of_sky, self._sun = len(lights.groups), lights.sun, lights.sky, sun
        known = [(builder.meshes[name].emitter(), group) for name, group in lights.of_objects.items()]
        known += list(zip(builder.lights, lights.of_lights, strict=True))
        numbers = [number_of(emitter) for emitter, _ in known]
        table = np.zeros(max(numbers, default=0) + 1, np.uint32)
        table[numbers] = [group for _, group in known]
        self._groups, self._size = mi.UInt32(table), len(table)

    def parts(self, light: Any, emitter: Any, w: Any, factor: Any) -> list[Any]:
        """Light (mi.Color3f) by group, for the arguments of `path_tracer.Tally.emitted`."""
        number = dr.reinterpret_array(mi.UInt32, emitter)
        group = dr.gather(mi.UInt32, self._groups, number, number < self._size)
        of_sun = mi.Color3f(0.0)
        if self._of_sky is not None:
            environment = emitter.is_environment()
            group = dr.select(environment, self._of_sky, group)
            if self._sun is not None and self._sun.is_in_sky:
                of_sun = dr.select(environment, dr.clip(factor * self._sun.radiance(w), 0.0, light), 0.0)
        parts = [dr.select(group == number, light - of_sun, 0.0) for number in range(self.count)]
        if self.of_sun is not None:
            parts[self.of_sun] = parts[self.of_sun] + of_sun
        return parts


class MixTally(AllLight):
    """All light, each group's times its factor: `factors` (n, 3). Caches have the mixed light."""

    def __init__(self, sorting: Sorting, factors: Floats) -> None:
        super().__init__()
        self._sorting = sorting
        self._factors = [mi.Color3f(*(dr.opaque(mi.Float, float(x)) for x in factor)) for factor in factors]

    def emitted(self, sums: list[Any], light: Any, emitter: Any, w: Any, factor: Any, first: Any) -> list[Any]:
        parts = self._sorting.parts(light, emitter, w, factor)
        mixed = sum((part * share for part, share in zip(parts, self._factors, strict=True)), mi.Color3f(0.0))
        return super().emitted(sums, mixed, emitter, w, factor, first)


class GroupTally:
    """A `path_tracer.Tally` with a sum per group and, with `direct`, another per group for its direct light.

    The first `count` sums are of all light. Its caches are `GroupedCache`s, or None.
    """

    def __init__(self, sorting: Sorting, direct: Direct | None) -> None:
        self._sorting, self.count, self._direct = sorting, sorting.count, direct

    def begin(self, width: int) -> list[Any]:
        return [dr.zeros(mi.Color3f, width) for _ in range(self.count * (1 + (self._direct is not None)))]

    def emitted(self, sums: list[Any], light: Any, emitter: Any, w: Any, factor: Any, first: Any) -> list[Any]:
        parts = self._sorting.parts(light, emitter, w, factor)
        direct = parts if self._direct == Direct.uncached else []
        if self._direct == Direct.straight:
            direct = [dr.select(first, part, 0.0) for part in parts]
        return [total + part for total, part in zip(sums, [*parts, *direct], strict=True)]

    def cached(self, sums: list[Any], throughput: Any, cache: Any, si: Any, active: Any, first: Any) -> list[Any]:
        if cache is None:
            return sums
        shown = cache.groups(si, active)
        lit = [total + dr.select(active, throughput * one, 0.0) for total, one in zip(sums, shown, strict=False)]
        return [*lit, *sums[self.count :]]
