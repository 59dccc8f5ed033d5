"""Baked light that answers edited materials: light maps and probes, from a store's answer (`core.answer`).

A texel of a probe keeps what it holds, and the diffuse light that it sees changes by a E' - a E: its edges stay smooth,
and what mirrors show in it stays as baked. Before the first edit every array is that of the store, to the bit.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lambent.core.answer import Albedos
from lambent.core.arrays import Floats
from lambent.core.irradiance import irradiance_of
from lambent.materials.diffuse_albedos import albedos_of, edited_albedos
from lambent.materials.document import Material
from lambent.realtime.baked import BakedScene, Probe
from lambent.realtime.cube_mips import finite
from lambent.scenes.scene import Look
from lambent.scenes.variants import textures_worn
from lambent.store.answer import SeenSpots, StoredAnswer

FAINT = 0.01  # of the mean indirect light: darker texels say nothing of how exact the rest is


@dataclass(frozen=True, eq=False)
class Lit:
    """Irradiance (T, 3) of the texels that answer, W/m^2, for materials of these albedos; whether it is as baked."""

    irradiance: NDArray[np.float32]
    reflected: Floats
    transmitted: Floats
    is_baked: bool


class AnsweredLight:
    """The light of one baked scene for other colours of its materials. Methods may run in any thread."""

    def __init__(self, baked: BakedScene, stored: StoredAnswer) -> None:
        self._baked, self._stored = baked, stored
        self._materials = [baked.record.materials[name] for name in stored.materials]
        self._reference = stored.answer.reference()
        self._as_baked = Lit(stored.answer.baked.sum(axis=0), *_shown(self._materials), is_baked=True)

    @property
    def as_baked(self) -> Lit:
        """The light before any edit."""
        return self._as_baked

    def lit(self, edited: Mapping[str, Material]) -> Lit:
        """The light when some materials are others."""
        now = [edited.get(name, given) for name, given in zip(self._stored.materials, self._materials, strict=True)]
        albedos = edited_albedos(self._materials, now)
        if albedos.same_as(self._stored.answer.albedos):
            return self._as_baked
        light = self._stored.answer.irradiance(albedos, self._reference).sum(axis=0)
        return Lit(light, *_shown(now), is_baked=False)

    def maps(self, light: Lit) -> tuple[Floats | None, Floats | None]:
        """Light maps (H, W, 3) of both sides in the scene's units; what does not answer is as baked."""
        both = self._baked.irradiance, self._baked.irradiance_back
        if light.is_baked:
            return both
        return self._changed(both[0], light, 0), self._changed(both[1], light, 1)

    def _changed(self, baked: Floats | None, light: Lit, side: int) -> Floats | None:
        if baked is None:
            return None
        texels = self._stored.texels
        mine = np.flatnonzero(texels % 2 == side)
        values = np.array(baked, np.float32)
        values.reshape(-1, 3)[texels[mine] // 2] = light.irradiance[mine] / np.float32(self._baked.unit)
        return values

    @property
    def probes(self) -> tuple[str, ...]:
        """Objects whose probes answer."""
        return tuple(name for name in self._stored.seen if name in self._baked.probes)

    def probe_change(self, name: str, light: Lit) -> NDArray[np.float32]:
        """What is added (6, N, N, 3) to the radiance of a probe, in the scene's units."""
        seen, before = self._stored.seen[name], self._as_baked
        at = np.flatnonzero(seen.texel.reshape(-1) >= 0)
        texel = seen.texel.reshape(-1)[at]
        change = self._sent(seen, at, texel, light) - self._sent(seen, at, texel, before)
        change *= seen.tint.reshape(-1, 3)[at].astype(np.float32) / np.float32(np.pi * self._baked.unit)
        found = np.zeros((seen.texel.size, 3), np.float32)
        found[at] = change
        return found.reshape(*seen.texel.shape, 3)

    def _sent(self, seen: SeenSpots, at: NDArray[np.intp], texel: NDArray[np.int64], light: Lit) -> Floats:
        """Diffuse exitance (n, 3) without its texture of the texels that a probe's texels `at` see."""
        material, other = self._stored.material[texel], self._stored.other[texel]
        sun = seen.sun.reshape(-1)[at].astype(np.float32)[:, None] * self._stored.sun.astype(np.float32)
        this_side = light.irradiance[texel] + np.maximum(sun, 0)
        sent = light.reflected[material] * this_side
        crossed = np.flatnonzero((other >= 0) & light.transmitted[material].any(axis=1))
        if len(crossed):
            other_side = light.irradiance[other[crossed]] + np.maximum(-sun[crossed], 0)
            sent[crossed] += light.transmitted[material[crossed]] * other_side
        return np.asarray(sent)

    def probe_irradiance(self, name: str, change: Floats) -> tuple[float, ...]:
        """What a probe alone would give, of which its object shows the share that its light map has."""
        baked = self._baked.probes[name].irradiance
        return tuple(np.array(baked) + self._baked.unit * irradiance_of(change)) if baked else ()

    def likely_error(self, light: Lit) -> float:
        """How far the light may be off: root mean square over its mean, by texels.

        What an edit changes is taken to be as wrong as this computes the indirect light of the bake itself.
        """
        answer, before, now = self._stored.answer, self._as_baked.irradiance, light.irradiance
        indirect = (answer.baked - answer.direct).sum(axis=0)
        computed = self._reference.sum(axis=0)
        known = indirect > FAINT * indirect.mean()
        wrong = np.divide(computed, indirect, out=np.ones_like(computed), where=known) - 1
        off = np.clip(wrong, -1, 1) * (now - before)
        return float(np.sqrt((off**2).mean()) / max(float(now.mean()), 1e-30))

    def probe(self, name: str, light: Lit) -> Probe:
        """A probe in other light."""
        baked = self._baked.probes[name]
        if light.is_baked:
            return baked
        change = self.probe_change(name, light)
        return replace(
            baked,
            radiance=np.maximum(finite(baked.radiance)[0] + change, 0),
            irradiance=self.probe_irradiance(name, change),
        )


def _shown(materials: list[Material]) -> tuple[Floats, Floats]:
    """Diffuse colours that probes see, float32: without what edits of lobes count as."""
    albedos: Albedos = albedos_of(materials)
    return albedos.reflected.astype(np.float32), albedos.transmitted.astype(np.float32)


def dressed_scene(baked: BakedScene, edited: Mapping[str, Material], looks: Mapping[str, Look]) -> BakedScene:
    """A baked scene with some of its materials replaced, and textures as `looks` have them; its light stays."""
    record = baked.record.model_copy(update={"materials": {**baked.record.materials, **edited}})
    return replace(baked, record=record, textures=textures_worn(baked.textures, looks))


def answered_scene(baked: BakedScene, stored: StoredAnswer, edited: Mapping[str, Material]) -> BakedScene:
    """A baked scene with some of its materials replaced, and its light and probes as they answer that."""
    answer = AnsweredLight(baked, stored)
    light = answer.lit(edited)
    front, back = answer.maps(light)
    probes = {**baked.probes, **{name: answer.probe(name, light) for name in answer.probes}}
    return replace(dressed_scene(baked, edited, {}), irradiance=front, irradiance_back=back, probes=probes)
