"""Mixes of light groups of a baked scene, as arrays on the CPU.

A mix is a table of factors (n, 3), by group and channel. All light is in units of the scene. The sun's disc is removed
from the sun's group: the renderer draws it by pixel (`sun_disc`).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from lambent.baked.probes.irradiance import irradiance_of
from lambent.core.arrays import Floats
from lambent.core.plain import Triple, triple
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.sun.sun_disc import sky_without, without_sun
from lambent.scenes.light_groups import SKY, SUN
from lambent.store.contract import ObjectRecord


@dataclass(frozen=True, eq=False)
class GroupLight:
    """Light of a scene under a mix of its groups."""

    scene: BakedScene
    groups: GroupArrays
    _discs: dict[str, Floats] = field(default_factory=dict)  # radiance of the sun's disc, by object with a probe

    def light_map(self, factors: Floats) -> tuple[NDArray[np.float16] | None, ...]:
        """By side of the light map, (H, W, 4) half floats; None for a side that no light reaches."""
        return self.groups.light_map(factors)

    def sky(self, factors: Floats) -> tuple[Floats | None, Floats | None]:
        """The environment (6, N, N, 3) with and without the sun's disc."""
        if self._bare_sky is None or self.scene.environment is None:
            return None, None
        bare = self._bare_sky * self._of(SKY, factors)
        if self._disc is None:
            return bare, bare
        texels, disc = self._disc
        seen = bare.copy()
        seen.reshape(-1, 3)[texels] += disc * self._of(SUN, factors)
        return seen, bare

    @cached_property
    def _bare_sky(self) -> Floats | None:
        """The environment without the sun's disc."""
        whole, sun = self.scene.environment, self.scene.sun
        return whole if whole is None or sun is None else sky_without(whole, sun)

    @cached_property
    def _disc(self) -> tuple[NDArray[np.intp], Floats] | None:
        """Texels (K,) of the flattened environment that show the sun's disc, and its radiance (K, 3) there."""
        if self.scene.environment is None or self._bare_sky is None:
            return None
        disc = (self.scene.environment - self._bare_sky).reshape(-1, 3)
        texels = np.flatnonzero(disc.any(axis=1))
        return (texels, disc[texels]) if len(texels) else None

    def turns_sky(self, factors: Floats, before: Floats) -> bool:
        """Whether the environment differs between the mixes `factors` and `before`."""
        pairs = ((self._of(member, factors), self._of(member, before)) for member in (SKY, SUN))
        return any(not np.array_equal(now, then) for now, then in pairs)

    def sky_change(self, factors: Floats) -> Triple:
        """Ratio, by channel, of the environment without the sun's disc to the baked one."""
        return triple(self._of(SKY, factors))

    def sun(self, factors: Floats) -> Triple | None:
        """Irradiance of the sun, W/m^2 in units of the scene."""
        return None if self.scene.sun is None else triple(np.array(self.scene.sun.irradiance) * self._of(SUN, factors))

    def emission(self, record: ObjectRecord, factors: Floats) -> Triple:
        """Emitted radiance of an object, W/(sr m^2), not in units of the scene."""
        return triple(np.array(record.emission) * self._of(record.part_of or record.name, factors))

    def probe(self, name: str, factors: Floats) -> Probe | None:
        """The probe of an object without the sun's disc; None if the store does not have it by group."""
        by_group = self.probe_by_group(name)
        if by_group is None:
            return None
        probe, radiance = self.scene.probes[name], finite(mixed(by_group, factors))[0]
        scaled = probe.irradiance and tuple(map(float, irradiance_of(radiance) * self.scene.unit))
        return replace(probe, radiance=radiance, irradiance=scaled)

    def probe_by_group(self, name: str) -> Floats | None:
        """Radiance (n, 6, N, N, 3) of an object's probe by group without the sun's disc; None if the store has none."""
        by_group = self.groups.probe(name)
        if by_group is None:
            return None
        probe, sun = self.scene.probes[name], self.groups.number(SUN)
        if self.scene.sun is not None and sun is not None:
            if name not in self._discs:
                bare = without_sun(replace(probe, irradiance=()), self.scene.sun, self.scene.unit)
                self._discs[name] = np.asarray(finite(probe.radiance)[0] - finite(bare.radiance)[0])
            by_group[sun] = np.maximum(by_group[sun] - self._discs[name], 0)
        return by_group

    def _of(self, member: str, factors: Floats) -> Floats:
        number = self.groups.number(member)
        return np.ones(3, np.float32) if number is None else factors[number]


def mixed(by_group: Floats, factors: Floats) -> Floats:
    """Sum over groups of light (n, ..., 3) times factors (n, 3)."""
    total = by_group[0] * factors[0]
    for light, factor in zip(by_group[1:], factors[1:], strict=True):
        if factor.any():
            total += light * factor
    return np.asarray(total)
