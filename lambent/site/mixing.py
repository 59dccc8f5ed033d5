"""What the light groups of a store add to a site: each group's own part of all that a mix of them changes.

Light adds up, so the page sums textures and numbers, each group's times its factor by channel. A probe's lamps stay the
texels, and shares of their light, that were taken out for the state as exported; the native renderer looks for lamps
anew in every mix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lambent.baked.probes.irradiance import irradiance_of
from lambent.core.arrays import Floats
from lambent.core.light.light_mix import LEAST_K, MOST_K, GroupMix, LightMix, black_body
from lambent.realtime.gpu.cube_mips import finite, mip_chain, smooth_chain
from lambent.realtime.gpu.structs import LAMP_DTYPE, OBJECT_DTYPE, SUN_DTYPE, offsets_of
from lambent.realtime.gpu.uploads import half
from lambent.realtime.integrators.integrators import Cube
from lambent.realtime.light.group_arrays import GroupArrays
from lambent.realtime.light.light_mixer import owners_of
from lambent.realtime.light.probe_lamps import HEAD_ROWS, LAMP_ROWS
from lambent.realtime.renderer import Renderer
from lambent.realtime.resources import ObjectResources
from lambent.scenes.light_groups import SKY
from lambent.site.manifest import FACES, Manifest

RGB, BYTES = 3, 4  # of a float32
SLIDER_K, COLOURS = (1800.0, 12000.0), 129  # range of the page's sliders, as in the window; colours of black bodies
Levels = list[Floats]  # MIP levels (layers, n, n, 3)


class Mixing:
    """The parts by light group of what the frames of a site read. `bytes_of` has the groups' files' bytes, by name."""

    def __init__(self, manifest: Manifest, renderer: Renderer, groups: GroupArrays) -> None:
        self._manifest, self._renderer, self._groups = manifest, renderer, groups
        self._scene, self._resources = renderer.scene, renderer.resources
        self.names = [record.name for record in groups.records]
        self._files: list[set[str]] = [set() for _ in self.names]
        self._units = np.eye(len(self.names), dtype=np.float32)[:, :, None].repeat(RGB, axis=2)  # each group alone

    @cached_property
    def said(self) -> dict[str, Any]:
        """For the manifest: the groups' names, and black bodies' colours of luminance 1 at equal ratios of kelvins."""
        colours = np.round(black_body(np.geomspace(LEAST_K, MOST_K, COLOURS)), 6).tolist()
        bodies = {"rangeK": [LEAST_K, MOST_K], "sliderK": SLIDER_K, "colours": colours}
        return {"lightGroups": self.names, "blackBodies": bodies}

    @property
    def bytes_of(self) -> dict[str, int]:
        """Bytes to transfer when a group's light first changes, by its name, in all states."""
        files = self._manifest.chunks.files
        return {name: sum(files.get(one, 0) for one in of) for name, of in zip(self.names, self._files, strict=True)}

    def state(self, light: LightMix) -> dict[str, Any]:
        """Of the state of the room that the manifest wrote last, which shows a mix: its textures and numbers by group.

        Textures: the place, and each group's content, of fewer layers if the others never change; the light map first.
        Numbers: values as exported, then by group and channel what a factor multiplies; `spans` are their buffers,
        offsets in bytes, and counts.
        """
        used = list(self._used())
        textures, numbers = [*self._light_map(), *self._skies(), *self._probes(used)], Numbers(len(self.names))
        for buffer, offset, parts in self._numbers(used):
            if (place := self._manifest.place_of(buffer)) is not None:
                numbers.add(place, offset, parts, self._manifest.floats(buffer, offset, parts.shape[2]))
        piece = self._manifest.chunks.add(numbers.table.tobytes())
        for files in self._files:
            files.add(piece["file"])
        return {
            "light": [_said(light.of(name)) for name in self.names],
            "textures": textures, "numbers": piece, "spans": numbers.spans,
        }  # fmt: skip

    def _used(self) -> Iterator[Used]:
        """What frames read of each object: several cube maps, if planar reflectors show it."""
        for item, owner in zip(self._resources.objects, owners_of(self._scene), strict=True):
            for (cube, _), group in item.groups.items():
                if self._manifest.place_of(group) is not None:
                    yield Used(item, owner, cube, group)

    def _texture(self, texture: Any, by_group: list[Levels | None]) -> list[dict[str, Any]]:
        """The entry of a texture with its content by group, None for a group without light there; none if not drawn."""
        place = self._manifest.place_of(texture)
        if place is None or not any(by_group):
            return []
        pieces: list[dict[str, Any] | None] = []
        for levels, files in zip(by_group, self._files, strict=True):
            piece = None if levels is None else self._texels(levels)
            if piece is not None:
                files.add(piece["file"])
            pieces.append(piece)
        layers = next(len(levels[0]) for levels in by_group if levels is not None)
        self._manifest.let_mix(place)
        return [{"texture": place, "layers": layers, "pieces": pieces}]

    def _texels(self, levels: Levels) -> dict[str, Any]:
        """Where levels (layers, rows, columns, 3) are, as half floats of alpha 0: the alpha of the texture stays."""
        padded = [np.pad(half(level), [(0, 0)] * 3 + [(0, 1)]) for level in levels]
        return self._manifest.packed_texels("rgba16float", len(levels[0]), [level.tobytes() for level in padded])

    def _light_map(self) -> list[dict[str, Any]]:
        """Without the direct light of lamps that pixels draw, so that values may be negative."""
        drawn, sides = self._scene.lamps, self._surfaces.groups.sides
        lit = [layer for layer, side in enumerate(sides) if side is not None]
        if not lit:
            return []
        by_group: list[Levels | None] = []
        for number, unit in enumerate(self._units):
            maps = np.zeros((lit[-1] + 1, *sides[lit[0]].shape[1:]), np.float32)
            for layer in lit:
                maps[layer] = sides[layer][number]
            for layer, direct in enumerate([] if drawn is None else drawn.in_map(unit)[: len(maps)]):
                maps[layer] -= direct
            by_group.append([maps] if maps.any() else None)
        return self._texture(self._manifest.texture_of(self._resources.light_view), by_group)

    def _skies(self) -> list[dict[str, Any]]:
        skies = [self._renderer.mixer.baked.sky(unit) for unit in self._units]
        found = []
        for which, group in enumerate((self._resources.sky_group, self._resources.mirrored_sky_group)):
            cubes = [sky[which] for sky in skies]
            by_group = [[finite(cube)[0]] if cube is not None and cube.any() else None for cube in cubes]
            found += self._texture(self._manifest.resource(group, 0), by_group)
        return found

    def _probes(self, used: list[Used]) -> Iterator[dict[str, Any]]:
        """Cube maps of probes."""
        textures = {id(texture): (texture, one) for one in used if (texture := self._manifest.resource(one.group, 1))}
        for texture, one in textures.values():
            by_group = self._of_probe(one)
            if by_group is not None:
                chain = _chain_of(one)
                yield from self._texture(texture, [chain(cube) if cube.any() else None for cube in by_group])

    def _of_probe(self, one: Used) -> Floats | None:
        """Radiance (n, 6, N, N, 3) by group of the probe that an object shows; None if the store has none by group."""
        if one.owner is not None:
            found = self._surfaces.probe_by_group(one.owner)
            return None if found is None else finite(found)[0]
        skies = [sky for unit in self._units if (sky := self._renderer.mixer.baked.sky(unit)[1]) is not None]
        return finite(np.stack(skies))[0] if skies else None

    @property
    def _surfaces(self) -> Any:
        return self._renderer.mixer.surfaces

    def _numbers(self, used: list[Used]) -> Iterator[tuple[Any, int, Floats]]:
        """Buffers, offsets in bytes, and what a factor multiplies there: (n, 3, K) by group and channel."""
        baked, resources, unit = self._renderer.mixer.baked, self._resources, self._scene.unit
        if self._scene.sun is not None:
            sun = _diagonal([baked.sun(one) for one in self._units])
            yield resources.sun.uniform, offsets_of(SUN_DTYPE)["irradiance"], sun
        for place, lamp in enumerate(resources.lamps.records):
            offset = place * LAMP_DTYPE.itemsize + offsets_of(LAMP_DTYPE)["intensity"]
            yield resources.lamps.bindings[0], offset, _diagonal(self._units[:, lamp.group] * lamp.intensity)
        for one in used:
            uniform, record = self._manifest.resource(one.group, 0), one.item.record
            if not any(baked.emission(record, 0 * self._units[0])):  # else no group has it
                emission = np.array([baked.emission(record, each) for each in self._units])
                yield uniform, offsets_of(OBJECT_DTYPE)["emission"], _diagonal(emission / unit)
            if self._groups.number(SKY) is not None:
                change = _diagonal([baked.sky_change(each) for each in self._units])
                yield uniform, offsets_of(OBJECT_DTYPE)["sky_change"], change
            yield from self._numbers_of_probe(one, uniform)

    def _numbers_of_probe(self, one: Used, uniform: Any) -> Iterator[tuple[Any, int, Floats]]:
        """Irradiance, and the flux of the lamps taken out: each group's share of the light in their texels."""
        by_group, light = self._of_probe(one), one.item.light
        if by_group is None:
            return
        if light.probe.irradiance:
            parts = np.array([[irradiance_of(cube * channel) for channel in np.eye(RGB)] for cube in by_group])
            yield uniform, offsets_of(OBJECT_DTYPE)["irradiance"], parts / light.probe.gain
        if one.cube != "cleaned":
            return
        rest, flat = light.lamps.radiance.reshape(-1, RGB), by_group.reshape(len(by_group), -1, RGB)
        for place, lamp in enumerate(light.lamps.lamps):
            shares = _ratio(flat[:, lamp.texels], rest[lamp.texels], 0.0)
            offset = 4 * BYTES * (HEAD_ROWS + LAMP_ROWS * place + 1)
            yield self._manifest.resource(one.group, 2), offset, _diagonal((shares * lamp.flux).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Used:
    """What frames read of an object: its bind group with a cube map of the probe that `owner` owns, or else the sky."""

    item: ObjectResources
    owner: str | None
    cube: Cube
    group: Any


def mixing_of(manifest: Manifest, renderer: Renderer, note: Callable[[str], None]) -> Mixing | None:
    """None where the light has no groups; with light fields neither, whose frames are others under a mix."""
    if renderer.scene.groups is None:
        return None
    if renderer.scene.light_fields:
        note("the page has no sliders of light: the store has light fields")
        return None
    return Mixing(manifest, renderer, renderer.scene.groups)


class Numbers:
    """A table (1 + 3 n, W) of numbers as exported and their parts by group and channel; `spans` say where they are."""

    def __init__(self, groups: int) -> None:
        self._rows = 1 + RGB * groups
        self.spans: list[tuple[int, int, int]] = []  # buffer, bytes, numbers
        self._parts: list[Floats] = []

    def add(self, place: int, offset: int, parts: Floats, now: Floats) -> None:
        """Numbers `now` (K,) of a buffer, and their parts (n, 3, K)."""
        if parts.any():
            self.spans.append((place, offset, len(now)))
            self._parts.append(np.concatenate([now[None], parts.reshape(-1, len(now))]).astype(np.float32))

    @property
    def table(self) -> Floats:
        return np.concatenate([np.zeros((self._rows, 0), np.float32), *self._parts], axis=1)


def _said(mix: GroupMix) -> dict[str, Any]:
    return {"intensity": mix.intensity if mix.on else 0.0, "kelvin": mix.temperature_k, "colour": list(mix.colour)}


def _diagonal(rgb: Any) -> Floats:
    """(n, 3, 3) parts of colours (n, 3): each channel is of its own factor."""
    return np.asarray(rgb)[:, :, None] * np.eye(RGB)


def _chain_of(one: Used) -> Callable[[Floats], Levels]:
    """Makes levels of a cube map (6, N, N, 3) of one group's light in a probe, in the form that an object reads."""
    if one.cube != "cleaned":
        return smooth_chain if one.cube == "smooth" else mip_chain
    whole, *_ = one.item.light.lamps.chain()
    left = whole.reshape(-1, FACES, *whole.shape[1:])  # with 0, 1, ... groups of lamps taken out
    shares = [_ratio(cube, left[0], 1.0) for cube in left]

    def chain(cube: Floats) -> Levels:
        chains = [smooth_chain(cube * share) for share in shares]
        return [np.concatenate(levels) for levels in zip(*chains, strict=True)]

    return chain


def _ratio(part: Floats, whole: Floats, otherwise: float) -> Floats:
    """part / whole, `otherwise` where there is nothing."""
    return np.divide(part, whole, out=np.full(part.shape, otherwise, np.float32), where=whole > 0)
