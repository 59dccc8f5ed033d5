"""Baked light that answers edited materials: light maps and probes, from a store's answer (`baked.answering.answer`).

A texel of a probe keeps its baked radiance plus the change a E' - a E of the diffuse light that it sees: edges stay
smooth, and reflections in mirrors stay as baked. Before the first edit every array equals the store's, to the bit.
Light by group answers group by group, and is mixed like baked light.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.albedos import albedos_of, changed_lobes, edited_albedos
from lambent.baked.answering.answer import Albedos, Answer, side_by_side, upsampled
from lambent.baked.answering.direct_change import with_direct_change
from lambent.baked.answering.probes import change
from lambent.baked.answering.stored import StoredAnswer
from lambent.baked.probes.irradiance import irradiance_of
from lambent.core.arrays import Floats
from lambent.materials.document import Material
from lambent.realtime.answering.lamp_change import LampChanges
from lambent.realtime.answering.texture_detail import (
    Detail,
    TextureDetails,
    Textures,
    own_rows,
    placed_alike,
    with_own_albedos,
)
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.light.baked import BakedScene, Probe
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.light.lit_texels import LitTexels, mix_into
from lambent.realtime.resources import light_layers

MOST_WRONG = 0.3  # relative error of the computed indirect light before edits that counts; more lies at contacts
OF_CHANGE, OF_TEXTURE = 0.1, 0.15  # error of a change itself, by noise; with textures, by detail between points, too
ERROR_TEXELS = 1 << 15  # texels in the estimate of the error, about; more would make an edit wait
NO_TEXTURES: Textures = {}
FAINT = 0.01  # of the mean indirect light: darker texels do not count in the estimate of the error


@dataclass(frozen=True, eq=False)
class Lit:
    """Light of the answering texels for materials with these albedos: irradiance (G, T, 3) by light group, W/m^2.

    `is_baked`: this is the baked light. `detail`: that of exchanged textures. `lobes`: (M, 3) how much the lobes of
    materials scatter less or more than the baked ones.
    `change`: (G, T, 3) by which direct light differs, which renderers draw by pixel and `irradiance` leaves out.
    """

    irradiance: NDArray[np.float32]
    reflected: Floats
    transmitted: Floats
    is_baked: bool
    detail: Detail | None = None
    lobes: Floats | None = None
    change: NDArray[np.float32] | None = None

    @property
    def whole(self) -> NDArray[np.float32]:
        """All irradiance (G, T, 3), as probes see it."""
        return self.irradiance if self.change is None else np.maximum(self.irradiance + self.change, 0)


class AnsweredLight:
    """Light of one baked scene for edited colours of its materials. Methods may run in any thread."""

    def __init__(self, baked: BakedScene, stored: StoredAnswer) -> None:
        self._baked, self._stored = baked, stored
        self._materials = [baked.record.materials[name] for name in stored.materials]
        self._details = TextureDetails(baked, stored)
        self._last: tuple[Textures, Detail | None] | None = None  # the last exchanged textures and their detail
        self._reference = stored.answer.reference()
        self._as_baked = Lit(stored.answer.baked, *_shown(self._materials), is_baked=True)
        self._seen: dict[str, tuple[NDArray[Any], ...]] = {}

    @property
    def as_baked(self) -> Lit:
        """The light before any edit."""
        return self._as_baked

    @cached_property
    def lamp_changes(self) -> LampChanges:
        """The direct light of edited lamps on the texels."""
        return LampChanges(self._baked, self._stored)

    def lit(
        self, edited: Mapping[str, Material], textures: Textures = NO_TEXTURES,
        change: NDArray[np.float32] | None = None,
    ) -> Lit:  # fmt: skip
        """The light with these materials and textures, by name, in place of the baked ones.

        Direct light on the texels differs by a `change` (G, T, 3), W/m^2, from `lamp_changes`.
        """
        now = [edited.get(name, given) for name, given in zip(self._stored.materials, self._materials, strict=True)]
        detail, of_materials = self._detail(textures), edited_albedos(self._materials, now)
        if change is None and detail is None and of_materials.same_as(self._stored.answer.albedos):
            return self._as_baked
        answer, albedos = self._stored.answer, of_materials
        if detail is not None:
            rows, answer = own_rows(answer), self._by_point
            albedos = detail.albedos(Albedos(of_materials.reflected[rows], of_materials.transmitted[rows]))
        lobes = changed_lobes(self._materials, now)
        irradiance = answer.irradiance(albedos, self._reference)
        if change is not None:
            irradiance = with_direct_change(answer, self._stored.patch, albedos, irradiance, change)
        return Lit(irradiance, *_shown(now), is_baked=False, detail=detail, lobes=lobes, change=change)

    @cached_property
    def _by_point(self) -> Answer:
        """The answer with an albedo for each point, made for the first exchanged texture: it costs a quarter more."""
        return with_own_albedos(self._stored.answer)

    def _detail(self, textures: Textures) -> Detail | None:
        """The detail of exchanged textures; that of the last ones is kept, for drags of colours."""
        last = self._last
        same = last is not None and last[0].keys() == textures.keys()
        if last is None or not same or not all(placed_alike(last[0][name], one) for name, one in textures.items()):
            self._last = last = dict(textures), self._details.of(textures)
        return last[1]

    def maps(self, light: Lit) -> tuple[Floats | None, Floats | None]:
        """Light maps (H, W, 3) of front and back in the scene's units; texels that do not answer are as baked."""
        both = self._baked.irradiance, self._baked.irradiance_back
        if light.is_baked:
            return both
        whole = light.irradiance.sum(axis=0)
        return self.shown_at_texels(both[0], whole, 0), self.shown_at_texels(both[1], whole, 1)

    def layers(self, light: Lit) -> NDArray[np.float16]:
        """`maps` as the layers (n, H, W, 4) of a texture."""
        if light.is_baked:
            return self._layers_as_baked.copy()
        found = self._layers_as_baked.copy()
        factors = np.full((len(light.irradiance), 3), 1 / self._baked.unit)
        for layer, (rows, texels) in zip(found, self.of_sides, strict=False):
            mix_into(layer, light.irradiance, rows, texels, factors)
        return found

    @cached_property
    def _layers_as_baked(self) -> NDArray[np.float16]:
        return light_layers(self._baked.irradiance, self._baked.irradiance_back)

    @cached_property
    def of_sides(self) -> tuple[tuple[NDArray[np.intp], NDArray[np.uint32]], ...]:
        """By side: indices of its answering texels, and their positions in the flattened map."""
        texels = self._stored.texels
        each = (np.flatnonzero(texels % 2 == side) for side in range(2))
        return tuple((mine, texels[mine] // 2) for mine in each)

    def shown_at_texels(self, baked: Floats | None, irradiance: Floats, side: int) -> Floats | None:
        """`baked` (..., H, W, 3), in the scene's units, of a side with new irradiance (..., T, 3), W/m^2."""
        if baked is None:
            return None
        mine, texels = self.of_sides[side]
        values = np.array(baked, np.float32)
        flat = values.reshape(*values.shape[:-3], -1, 3)
        flat[..., texels, :] = irradiance[..., mine, :] / np.float32(self._baked.unit)
        return values

    @cached_property
    def stays_as_baked(self) -> tuple[LitTexels | None, ...]:
        """By side, the light by group of the texels that do not answer."""
        assert self._baked.groups is not None, "asked for with groups alone"
        both = zip(self._baked.groups.lit_sides, self.of_sides, strict=True)
        return tuple(None if side is None else side.without(texels) for side, (_, texels) in both)

    @property
    def probes(self) -> tuple[str, ...]:
        """Objects whose probes answer."""
        return tuple(name for name in self._stored.seen if name in self._baked.probes)

    def probe_change(self, name: str, light: Lit) -> NDArray[np.float32]:
        """Change (6, N, N, 3) of the radiance of a probe, in the scene's units."""
        return np.asarray(self.probe_changes(name, light).sum(axis=0))

    def probe_changes(self, name: str, light: Lit) -> NDArray[np.float32]:
        """`probe_change` by light group, (G, 6, N, N, 3)."""
        seen, as_baked, stored = self._stored.seen[name], self._as_baked, self._stored
        places, texels, tint, sun = self._seen_by(name)
        tints = [tint, tint]
        if light.detail is not None:
            tints = [self._per_exitance(one[places]) for one in self._details.tints(name, seen, light.detail)]
        found = np.zeros((len(light.irradiance), seen.texel.size, 3), np.float32)
        states = (
            (one.whole, by, one.reflected, one.transmitted) for one, by in zip((as_baked, light), tints, strict=True)
        )
        change(found, places, texels, stored.material, stored.other, sun, stored.of_sun, *states)
        return found.reshape(len(found), *seen.texel.shape, 3)

    def _seen_by(self, name: str) -> tuple[NDArray[Any], ...]:
        """Texels (n,) of a probe that see answering ones; numbers, textures over pi (n, 3) and the sun of these."""
        if name not in self._seen:
            seen = self._stored.seen[name]
            places = np.flatnonzero(seen.texel.reshape(-1) >= 0)
            tint = self._per_exitance(seen.tint.reshape(-1, 3)[places].astype(np.float32))
            sun = seen.sun.reshape(-1)[places].astype(np.float32)[:, None] * self._stored.sun.astype(np.float32)
            self._seen[name] = places, seen.texel.reshape(-1)[places], tint, sun
        return self._seen[name]

    def _per_exitance(self, tint: Floats) -> Floats:
        """Radiance, in the scene's units, for each W/m^2 of exitance that textures of factor `tint` send."""
        return np.asarray(tint / np.float32(np.pi * self._baked.unit))

    def probe_irradiance(self, name: str, change: Floats) -> tuple[float, ...]:
        """`Probe.irradiance` of a probe after a `change` (6, N, N, 3) of its radiance; empty if the baked one is."""
        baked = self._baked.probes[name].irradiance
        return tuple(np.array(baked) + self._baked.unit * irradiance_of(change)) if baked else ()

    def likely_error(self, light: Lit, factors: Floats | None = None) -> float:
        """Estimated bound on the texels' RMS error over their mean light, in a mix of `factors` (G, 3).

        The change by the edit, or the remaining light if that is less, is uncertain by the relative error of the
        computed indirect light before any edit, as far as MOST_WRONG, and by OF_CHANGE. All light that changed lobes
        scatter less or more is uncertain: where it goes is not known. The direct sun counts as light and never changes.
        """
        before, direct, computed = self._error_texels
        now = np.ascontiguousarray(light.irradiance[:, :: self._error_step])
        shares = np.ones((len(now), 3), np.float32) if factors is None else np.asarray(factors, np.float32)
        now, before, direct, computed = (
            np.einsum("gtc,gc->tc", one, shares) for one in (now, before, direct, computed)
        )
        indirect = before - direct
        known = indirect > FAINT * indirect.mean()
        wrong = np.divide(computed, indirect, out=np.ones_like(computed), where=known) - 1
        noise = OF_CHANGE if light.detail is None else OF_TEXTURE
        off = np.hypot(np.minimum(np.abs(wrong), MOST_WRONG), noise) * np.minimum(np.abs(now - before), now)
        if light.lobes is not None and light.lobes.any():
            off = np.hypot(off, light.lobes[self._stored.material[:: self._error_step]] * now)
        mean = float((now.mean(axis=0) + self._mean_sun * shares[self._stored.of_sun]).mean())
        return float(np.sqrt((off**2).mean())) / max(mean, 1e-30)

    @property
    def _error_step(self) -> int:
        """Every how many texels one counts in the estimate of the error."""
        return max(1, len(self._stored.texels) // ERROR_TEXELS)

    @cached_property
    def _error_texels(self) -> tuple[NDArray[np.float32], ...]:
        """Baked, direct and computed indirect light (G, n, 3) of the texels that count in the estimate of the error."""
        answer = self._stored.answer
        lights = answer.baked, answer.direct, self._reference
        return tuple(np.ascontiguousarray(of[:, :: self._error_step], np.float32) for of in lights)

    @cached_property
    def _mean_sun(self) -> NDArray[np.float32]:
        """(3,) mean direct irradiance of the sun on the texels."""
        return np.asarray(
            upsampled(side_by_side(self._stored.point_sun[None]), self._stored.answer.near)[0].mean(axis=0)
        )

    def groups(self, light: Lit) -> GroupArrays | None:
        """Light by group, for mixing; as baked before an edit, None if the scene was baked without groups."""
        base = self._baked.groups
        if base is None or light.is_baked:
            return base
        return AnsweredGroups(base.records, base.store, base.unit, base=base, answer=self, light=light)

    def probe(self, name: str, light: Lit) -> Probe:
        """A probe in this light."""
        baked = self._baked.probes[name]
        if light.is_baked:
            return baked
        groups = self.groups(light)
        by_group = None if groups is None else groups.probe(name)
        if by_group is not None:  # clipped at 0 by group, as in a mix
            radiance = np.asarray(by_group.sum(axis=0))
            own = tuple(map(float, irradiance_of(radiance) * self._baked.unit)) if baked.irradiance else ()
            return replace(baked, radiance=radiance, irradiance=own)
        change = self.probe_change(name, light)
        radiance = np.maximum(finite(baked.radiance)[0] + change, 0)
        return replace(baked, radiance=radiance, irradiance=self.probe_irradiance(name, change))


@dataclass(frozen=True, eq=False, kw_only=True)
class AnsweredGroups(GroupArrays):
    """Light by group that answers edited materials: `light` replaces the light of `base`."""

    base: GroupArrays
    answer: AnsweredLight
    light: Lit

    @cached_property
    def sides(self) -> tuple[Floats | None, ...]:
        """Light maps by group, laid out as in `base`."""
        show, irradiance = self.answer.shown_at_texels, self.light.irradiance
        return tuple(show(baked, irradiance, side) for side, baked in enumerate(self.base.sides))

    def light_map(self, factors: Floats) -> tuple[NDArray[np.float16] | None, ...]:
        """A mix of all groups by side, laid out as in `base`."""
        found = []
        for (rows, texels), rest in zip(self.answer.of_sides, self.answer.stays_as_baked, strict=True):
            layer = None if rest is None else rest.mixed(factors)
            if layer is not None:
                mix_into(layer, self.light.irradiance, rows, texels, factors / np.float32(self.unit))
            found.append(layer)
        return tuple(found)

    def probe(self, name: str) -> Floats | None:
        """Radiance of an object's probe by group, laid out as in `base`."""
        by_group = self.base.probe(name)
        if by_group is None or name not in self.answer.probes:
            return by_group
        return np.asarray(np.maximum(by_group + self.answer.probe_changes(name, self.light), 0))


def _shown(materials: list[Material]) -> tuple[Floats, Floats]:
    """Diffuse colours that probes see, float32, without the diffuse equivalent of lobes."""
    albedos: Albedos = albedos_of(materials)
    return albedos.reflected.astype(np.float32), albedos.transmitted.astype(np.float32)
