"""A baked scene on the GPU: vertices, light maps, probes, materials, and their bind groups."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.plain import Triple
from lambent.realtime.gpu.cube_mips import finite
from lambent.realtime.gpu.device import WEBGPU_LIMITS
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import VERTEX_FLOATS
from lambent.realtime.gpu.structs import OBJECT_DTYPE
from lambent.realtime.gpu.uploads import half, upload, upload_layer, with_alpha
from lambent.realtime.incident import LookUp, brings_light, look_ups
from lambent.realtime.integrators.integrators import Cube
from lambent.realtime.lamps.changed import ChangedLamps
from lambent.realtime.lamps.lamps import PointLamps
from lambent.realtime.light.baked import DARK, BakedScene, Probe
from lambent.realtime.light.probe_light import ProbeLight, kind_of
from lambent.realtime.materials.material_buffers import MaterialBuffers
from lambent.realtime.materials.textures import TextureCache
from lambent.realtime.objects.clusters import Ranges, merged
from lambent.realtime.objects.parts import WITHIN, neighbouring_faces
from lambent.realtime.sun.sun import SunLight, sun_light
from lambent.realtime.sun.sun_disc import without_sun
from lambent.scenes.looks.variants import textures_in_look
from lambent.scenes.scene import ImageTexture, Look
from lambent.store.contract import MOST_BORDERS, ObjectRecord

EVEN_NICHES = 9  # index, in a shader object's `irradiance`, of the flag for `Probe.even_niches`


def device_needs(scene: BakedScene) -> dict[str, int]:
    """Limits that a scene needs beyond WebGPU's defaults, for `device.open_device`."""
    needs = {"max-buffer-size": max(len(scene.positions) * VERTEX_FLOATS * 4, scene.faces.size * 4)}
    if scene.irradiance is not None:
        needs["max-texture-dimension-2d"] = max(scene.irradiance.shape[:2])
    if scene.lamps is not None:
        needs["max-storage-buffer-binding-size"] = stored = scene.lamps.rows * scene.lamps.reached.nbytes
        needs["max-buffer-size"] = max(needs["max-buffer-size"], stored)
    return {name: value for name, value in needs.items() if value > WEBGPU_LIMITS[name]}


class ObjectResources:
    """One object: its faces, its light and its bind groups.

    `beyond` has the ranges (first, count) of other parts' faces that its light is added to.
    """

    def __init__(
        self, layouts: Layouts, record: ObjectRecord, light: ProbeLight, unit: float, beyond: Ranges,
        has_shares: bool = False, lamp: int = 0,
    ) -> None:  # fmt: skip
        """`has_shares`: the light map holds the share of the probe's light that arrives, by direction.

        An object that is the opening of a drawn `lamp` has its number, from 1.
        """
        self._has_shares, self.lamp = has_shares, lamp
        self.record, self.light, self._layouts, self._unit, self.beyond = record, light, layouts, unit, beyond
        self.emission = record.emission
        self.groups: dict[tuple[Cube, LookUp], Any] = {}

    def relight(self, light: ProbeLight, emission: Triple) -> None:
        """Show the light of another probe, and the emission, W/(sr m^2)."""
        if light is not self.light or emission != self.emission:
            self.light, self.emission = light, emission
            self.groups = {}

    def group(self, cube: Cube, look_up: LookUp) -> Any:
        """Group 2 for draws that read a cube map by a look-up."""
        if (cube, look_up) not in self.groups:
            self.groups[cube, look_up] = self._new_group(cube, look_up)
        return self.groups[cube, look_up]

    def _new_group(self, cube: Cube, look_up: LookUp) -> Any:
        """Group 2: cube map, resources of the look-up, and the table of the lamps taken out of a `cleaned` cube map.

        If the look-up has its own light and the light is not as baked, the cube map holds the ratio to the baked light.
        """
        probe, view = self.light.probe, self.light.view(cube)
        if shows_change := brings_light(look_up) and self.light.is_relit:
            view = self.light.change_view()
        data = np.zeros(1, OBJECT_DTYPE)
        data["centre"][0] = (*probe.centre, self.light.half_log2_texels("box" if shows_change else cube))
        data["sky_change"][0] = (*self.light.sky_change, self._has_shares)
        data["emission"][0] = (*(np.array(self.emission) / self._unit), self.lamp)
        data["irradiance"].reshape(-1)[: len(probe.irradiance)] = np.array(probe.irradiance) / (self._unit * probe.gain)
        data["irradiance"].reshape(-1)[EVEN_NICHES] = probe.even_niches
        data["borders"][0] = [*self.record.borders, *[WITHIN] * (MOST_BORDERS - len(self.record.borders))]
        uniform = self._layouts.buffer("UNIFORM", data)
        lamps = self.light.table(look_up) if cube == "cleaned" else self._layouts.empty
        layout = self._layouts.object(look_up.BINDINGS, kind_of(cube))
        return self._layouts.group(layout, uniform, view, lamps, *self.light.resources(look_up))


class SceneResources:
    """Resources of a baked scene that stay on the GPU between frames."""

    def __init__(self, layouts: Layouts, scene: BakedScene, kin: SceneResources | None = None) -> None:
        """`kin` shows the same scene in other light; cube maps and lamps of baked probes are shared with it."""
        self.scene, self._layouts, device = scene, layouts, layouts.device
        self.sampler = device.create_sampler(
            mag_filter="linear", min_filter="linear", mipmap_filter="linear",
            address_mode_u="clamp-to-edge", address_mode_v="clamp-to-edge", address_mode_w="clamp-to-edge",
        )  # fmt: skip
        uv = np.zeros_like(scene.uv2) if scene.uv is None else scene.uv
        vertices = np.concatenate([scene.positions, scene.normals, scene.tangents, scene.uv2, uv], axis=1)
        self._vertices = np.nan_to_num(vertices).astype(np.float32)  # as baked
        self.vertices = layouts.buffer("VERTEX", self._vertices)
        self.indices = layouts.buffer("INDEX", scene.faces.astype(np.uint32))
        layers = light_layers(scene.irradiance, scene.irradiance_back, scene.dominant_direction, scene.probe_share)
        self.light_layers = list(layers)  # (H, W, 4) each, as shown, the direct light of lamps included
        self.lamps = PointLamps(layouts, scene.lamps)
        without = [self.lamps.taken_out(side, texels) for side, texels in enumerate(layers)]
        self._light_texture = upload(device, [np.stack(without)], "rgba16float")
        self.light_view = self._light_texture.create_view(dimension="2d-array")
        self.light_version = 0  # grows when light answers edited materials, and when textures change
        sky = scene.far_light or DARK
        self.sky_group = self.sky_group_of(with_alpha(finite(sky.radiance)[0]))
        cleaned = without_sun(sky, scene.sun)
        self.mirrored_sky_group = (
            self.sky_group if cleaned is sky else self.sky_group_of(with_alpha(finite(cleaned.radiance)[0]))
        )
        self._as_baked: dict[Probe | None, ProbeLight] = {} if kin is None else kin._as_baked
        lights = self._as_baked
        beyond = neighbouring_faces(scene)
        self.objects, known = [], look_ups()
        shining = [lamp.number for lamp in self.lamps.records]
        for record in scene.record.objects:
            probe = scene.probe_of(record)
            if probe not in lights:
                lights[probe] = ProbeLight(
                    layouts, probe and without_sun(probe, scene.sun, scene.unit), self.sampler, known
                )
            place = 1 + shining.index(record.luminaire) if record.luminaire in shining else 0
            self.objects.append(
                ObjectResources(
                    layouts,
                    record,
                    lights[probe],
                    scene.unit,
                    beyond.get(record.name, []),
                    record.name in scene.share_objects,
                    place,
                )
            )
        self._place_openings()
        textures = TextureCache(device)
        self._textured = {
            name: MaterialBuffers(layouts, textures.sampler, textures.of_material(scene.textures.get(name)))
            for name in ("", *scene.record.materials)
        }
        self._images: dict[str, TextureCache] = {}  # of shown images, by file
        self.show_textures({})
        self.mixes_parts = any(beyond.values())
        self.sun = sun_light(layouts, scene, self)

    def show_textures(self, looks: Mapping[str, Look]) -> None:
        """Show materials with images or other materials' textures; materials left out show their own.

        Documents come from a frame's state. The sun's shadows keep the holes of the baked materials. Raises `UserError`
        for an image that cannot be read, and then changes nothing.
        """
        own = {name: self._textured[name] for name in self.scene.record.materials}
        images: dict[str, TextureCache] = {}  # images that are no longer shown leave the memory
        for name, look in looks.items():
            of = look.textures
            if not isinstance(of, ImageTexture):
                own[name] = self._textured[of]
                continue
            images[of.file] = cache = self._images.get(of.file) or TextureCache(self._layouts.device)
            bound = cache.of_material(textures_in_look(name, look, self.scene.textures))
            own[name] = MaterialBuffers(self._layouts, cache.sampler, bound)
        self.materials, self._images = own, images
        records = self.scene.record.objects
        self.masked = {record.name for record in records if self.materials[record.material].textures.masked}
        self.whole_ranges = lru_cache(8)(self._whole_ranges)
        self.light_version += 1

    def _whole_ranges(self, panes: frozenset[str] = frozenset()) -> Ranges:
        """(first, count) of the faces of all objects without holes, except `panes`."""
        whole = (r for r in self.scene.record.objects if r.name not in self.masked and r.name not in panes)
        return merged(((r.first_face, r.first_face + r.face_count) for r in whole), gap=1)

    def show_light_map(self, sides: Sequence[NDArray[np.float16] | None]) -> None:
        """Show new light maps (H, W, 4) on the front and the back; None leaves a side as it is.

        A third map is the dominant direction, a fourth holds the shares of probes' light.
        """
        for layer, texels in enumerate(sides):
            if texels is not None:
                self.light_layers[layer] = texels
                without = self.lamps.taken_out(layer, texels)
                upload_layer(self._layouts.device, self._light_texture, layer, without)

    @cached_property
    def changed_lamps(self) -> ChangedLamps:
        """Shows lamps that were moved, aimed or exchanged."""
        return ChangedLamps(self._layouts, self)

    def light_of(self, name: str) -> ProbeLight:
        """The light of the object of this name, shared with other objects."""
        return next(one.light for one in self.objects if one.record.name == name)

    def _place_openings(self) -> None:
        """Show openings of lamps that a bake moved where it has them."""
        for item in self.objects:
            if item.lamp and (moved := self.lamps.records[item.lamp - 1].moved) is not None:
                self.move(item.record, np.array(moved))

    def move(self, record: ObjectRecord, world_from_baked: Floats) -> None:
        """Show an object at another place: (4, 4), rigid."""
        faces = self.scene.faces[record.first_face : record.first_face + record.face_count]
        first, last = int(faces.min()), int(faces.max())
        rows, turn = self._vertices[first : last + 1].copy(), world_from_baked[:3, :3].T
        rows[:, :3] = rows[:, :3] @ turn + world_from_baked[:3, 3]
        rows[:, 3:6], rows[:, 6:9] = rows[:, 3:6] @ turn, rows[:, 6:9] @ turn
        self._layouts.device.queue.write_buffer(self.vertices, first * rows.strides[0], rows.tobytes())

    def sky_group_of(self, texels: NDArray[np.float16]) -> Any:
        """Bind group of an environment (6, N, N, 4)."""
        cube = upload(self._layouts.device, [texels], "rgba16float")
        return self._layouts.group(self._layouts.cube, cube.create_view(dimension="cube"))

    @cached_property
    def noise_group(self) -> Any:
        """Group 3 with the noise of the light map in place of its light, without a sun."""
        both = (self.scene.noise, self.scene.noise_back)
        front, back = (None if noise is None else np.repeat(noise[..., None], 3, axis=-1) for noise in both)
        dark = SunLight(self._layouts)
        noise, lamps = light_layers(front, back), PointLamps(self._layouts, None)
        view = upload(self._layouts.device, [noise], "rgba16float").create_view(dimension="2d-array")
        return self._layouts.group(self._layouts.light, view, dark.uniform, dark.nowhere, *lamps.bindings)


def light_layers(
    front: Floats | None, back: Floats | None, direction: Floats | None = None, share: Floats | None = None
) -> NDArray[np.float16]:
    """Layers (n, H, W, 4): light on the front and on the back, dominant direction (H, W, 3 each), shares (H, W, 4).

    Layers end with the last map that is not None. Missing maps before it are black; the shader reads later layers as
    black.
    """
    maps = [None if light is None else finite(light)[0] for light in (front, back)]
    maps += [None if values is None else np.nan_to_num(values) for values in (direction, share)]
    count = max((i + 1 for i, values in enumerate(maps) if values is not None), default=1)
    height, width = max((values.shape[:2] for values in maps if values is not None), default=(1, 1))
    layers = np.zeros((count, height, width, 4), np.float16)
    for layer, values in zip(layers, maps, strict=False):
        if values is not None:
            layer[...] = with_alpha(values) if values.shape[-1] == 3 else half(values)
    return layers
