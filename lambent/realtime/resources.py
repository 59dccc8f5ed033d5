"""A baked scene on the GPU: vertices, light maps, cube maps and the bind groups that hold them."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.colour import HALF_MAX
from lambent.core.errors import UserError
from lambent.materials.document import Material
from lambent.realtime.aim import aim_table, aimed_share, widest_lobe
from lambent.realtime.baked import BakedScene, Probe
from lambent.realtime.cube_mips import SMOOTH_AREA, finite, mip_chain, smooth_chain
from lambent.realtime.device import WEBGPU_LIMITS
from lambent.realtime.frame_data import OBJECT_DTYPE, lobe_data, material_data, sample_data
from lambent.realtime.integrators import Cube, Integrator
from lambent.realtime.split_sum import prefiltered_cube
from lambent.realtime.textures import PARTS, MaterialPictures, Pictures, material_pictures
from lambent.store.contract import ObjectRecord

Floats = NDArray[np.floating]
LOOKUPS = {"plain": 0, "planes": 1, "distance": 2}
PLANE_STEP = 6  # plane counts are padded to multiples of this: each count is a pipeline of its own
VERTEX_FLOATS = 13  # position, normal, tangent, uv2, uv

_FRAGMENT = wgpu.ShaderStage.FRAGMENT
_BOTH = wgpu.ShaderStage.FRAGMENT | wgpu.ShaderStage.VERTEX
_UNIFORM = {"buffer": {"type": "uniform"}}
_STORAGE = {"buffer": {"type": "read-only-storage"}}
_SAMPLER = {"sampler": {"type": "filtering"}}
_CUBE = {"texture": {"sample_type": "float", "view_dimension": "cube"}}
_FLAT = {"texture": {"sample_type": "float", "view_dimension": "2d"}}


def device_needs(scene: BakedScene) -> dict[str, int]:
    """Limits above WebGPU's defaults that a scene needs; give them to `device.open_device`."""
    needs = {"max-buffer-size": max(len(scene.positions) * VERTEX_FLOATS * 4, scene.faces.size * 4)}
    if scene.irradiance is not None:
        needs["max-texture-dimension-2d"] = max(scene.irradiance.shape[:2])
    return {name: value for name, value in needs.items() if value > WEBGPU_LIMITS[name]}


class Layouts:
    """Bind group layouts: 0 frame, 1 material, 2 object, 3 light maps."""

    def __init__(self, device: Any) -> None:
        self._device = device
        self.frame = self._make(_BOTH, _UNIFORM, _SAMPLER)
        self.material = self._make(_FRAGMENT, _UNIFORM, _STORAGE, _STORAGE, _SAMPLER, *[_FLAT] * len(PARTS))
        self.object = self._make(_FRAGMENT, _UNIFORM, _STORAGE, _CUBE, _CUBE, _STORAGE)
        self.light = self._make(_FRAGMENT, _FLAT, _FLAT, _FLAT)
        self.cube = self._make(_FRAGMENT, _CUBE)
        self.shown = self._make(_FRAGMENT, _FLAT, _SAMPLER)

    def _make(self, visibility: int, *kinds: dict[str, Any]) -> Any:
        entries = [{"binding": i, "visibility": visibility, **kind} for i, kind in enumerate(kinds)]
        return self._device.create_bind_group_layout(entries=entries)

    def group(self, layout: Any, *resources: Any) -> Any:
        """Bind group of `resources` (buffers, samplers, views) in the layout's order."""
        entries = [
            {"binding": i, "resource": {"buffer": r} if isinstance(r, wgpu.GPUBuffer) else r}
            for i, r in enumerate(resources)
        ]
        return self._device.create_bind_group(layout=layout, entries=entries)


def cube_texture(device: Any, levels: list[Floats], format: str = "rgba16float") -> Any:
    """Cube texture of MIP levels (6, n, n, 3) or, for r16float, (6, n, n, 1)."""
    n = levels[0].shape[1]
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    texture = device.create_texture(size=(n, n, 6), format=format, mip_level_count=len(levels), usage=usage)
    for level, values in enumerate(levels):
        half = _with_alpha(values) if format == "rgba16float" else np.minimum(values, HALF_MAX).astype(np.float16)
        size = half.shape[1]
        device.queue.write_texture(
            {"texture": texture, "mip_level": level},
            np.ascontiguousarray(half),
            {"bytes_per_row": size * half.shape[3] * 2, "rows_per_image": size},
            (size, size, 6),
        )
    return texture


def _with_alpha(rgb: Floats) -> NDArray[np.float16]:
    rgba = np.ones((*rgb.shape[:-1], 4), np.float16)
    rgba[..., :3] = np.minimum(rgb, HALF_MAX)
    return rgba


def flat_texture(device: Any, rgb: Floats | None) -> Any:
    """Half-float texture of light (H, W, 3); one black texel where there is none."""
    return _texture(device, np.zeros((1, 1, 3), np.float32) if rgb is None else finite(rgb)[0])


def lean_texture(device: Any, lean: Floats | None) -> Any:
    """Half-float texture of directions (H, W, 3); one of length 0 where there is none."""
    return _texture(device, np.zeros((1, 1, 3), np.float32) if lean is None else np.nan_to_num(lean))


def _texture(device: Any, rgb: Floats) -> Any:
    rgba = _with_alpha(rgb)
    height, width = rgba.shape[:2]
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    texture = device.create_texture(size=(width, height, 1), format="rgba16float", usage=usage)
    device.queue.write_texture({"texture": texture}, rgba, {"bytes_per_row": width * 8}, (width, height, 1))
    return texture


def inverse_depth(distance: Floats) -> Floats:
    """(6, N, N, 1): 1/max(|x|, |y|, |z|) of the points at `distance` (6, N, N) along each texel; linear over planes."""
    from lambent.core.cubemap import face_directions

    n = distance.shape[1]
    length = np.linalg.norm(face_directions(n), axis=-1)
    safe = np.clip(np.nan_to_num(distance, nan=HALF_MAX, posinf=HALF_MAX), 1e-3, HALF_MAX)
    return np.asarray(length / safe)[..., None]


class Light:
    """A probe's cube maps on the GPU, each made when an integrator first asks for it.

    `version` counts how often the light was replaced.
    """

    def __init__(self, device: Any, probe: Probe | None, sampler: Any) -> None:
        self._device, self._sampler = device, sampler
        self._radiance = np.zeros((6, 1, 1, 3), np.float32) if probe is None else probe.radiance
        self._cubes: dict[Cube, Any] = {}
        self._aim: tuple[Any, float] | None = None
        self.version = 0
        distance = None if probe is None else probe.distance
        self.centre = (0.0, 0.0, 0.0) if probe is None else probe.centre
        self.irradiance = () if probe is None else probe.irradiance
        depth = np.full((6, 1, 1, 1), 1e-4, np.float32) if distance is None else inverse_depth(distance)
        self.depth_view = cube_texture(device, [depth], "r16float").create_view(dimension="cube")
        planes = np.zeros((0, 4), np.float32) if probe is None else np.asarray(probe.planes, np.float32)
        self.plane_count = -(-len(planes) // PLANE_STEP) * PLANE_STEP
        about_centre = np.zeros((max(1, self.plane_count), 4), np.float32)  # a zero plane is never approached
        about_centre[: len(planes)] = planes
        about_centre[: len(planes), 3] += planes[:, :3] @ np.asarray(self.centre, np.float32)
        self.planes = device.create_buffer_with_data(data=about_centre, usage=wgpu.BufferUsage.STORAGE)
        self.has_distance = distance is not None

    def replace_radiance(self, cube: Floats) -> None:
        """Show other light, (6, N, N, 3)."""
        self._radiance, self._cubes, self._aim = cube, {}, None
        self.version += 1

    def view(self, cube: Cube) -> Any:
        return self._texture(cube).create_view(dimension="cube")

    @property
    def aim(self) -> tuple[Any, float]:
        """The table that samples are aimed at lamps by, and how far these stand out; made when first asked for."""
        if self._aim is None:
            table = aim_table(finite(self._radiance)[0])
            buffer = self._device.create_buffer_with_data(data=table, usage=wgpu.BufferUsage.STORAGE)
            self._aim = buffer, float(table[0, 1])
        return self._aim

    def is_aimed_at(self, material: Material, lookup: str, pictured: bool) -> bool:
        """Whether samples of a material's lobes, which pictures may widen, are worth aiming at all."""
        return lookup != "distance" and aimed_share(widest_lobe(material, pictured), self.aim[1]) > 1 / 16

    def half_log2_texels(self, cube: Cube) -> float:
        """Half the log2 of texels per unit area of the cube [-1, 1]^3 (N^2/4 in 4.17), of which a look-up blurs one."""
        return float(np.log2(self._radiance.shape[1] / 2) - (np.log2(SMOOTH_AREA) / 2 if cube == "smooth" else 0))

    def _texture(self, cube: Cube) -> Any:
        if cube not in self._cubes:
            if cube == "prefiltered":
                self._cubes[cube] = prefiltered_cube(self._device, self._texture("box"), self._sampler)
            else:
                chain = smooth_chain if cube == "smooth" else mip_chain
                self._cubes[cube] = cube_texture(self._device, chain(finite(self._radiance)[0]))
        return self._cubes[cube]

    def lookup(self, wanted: str) -> str:
        """The look-up to use where `wanted` is "auto" or cannot be had: planes, else the distance map, else plain."""
        if wanted not in ("auto", *LOOKUPS):
            raise UserError("unknown look-up", got=wanted, expected="auto, " + ", ".join(LOOKUPS))
        possible = {"planes": self.plane_count > 0, "distance": self.has_distance, "plain": True}
        return wanted if possible.get(wanted, False) else next(name for name, can in possible.items() if can)


class MaterialBuffers:
    """A material's uniforms and samples; written again only when the material, the integrator or n changes."""

    def __init__(self, device: Any, layouts: Layouts, sampler: Any, pictures: MaterialPictures) -> None:
        self._device, self._layouts = device, layouts
        self.pictures = pictures
        self._bound = (sampler, *(picture.view for picture in pictures.pictures))
        self._written: tuple[Any, ...] = ()
        self._buffers: list[Any] = []
        self.group: Any = None

    def twin(self) -> MaterialBuffers:
        """Buffers of the same material for another pass, with another integrator or n."""
        return MaterialBuffers(self._device, self._layouts, self._bound[0], self.pictures)

    def update(self, material: Material, how: Integrator, n: int) -> None:
        if self._written == (material, id(how), n):
            return
        self._written = (material, id(how), n)
        lobes = material.lobes if how.specular else ()
        data = [material_data(material, self.pictures), lobe_data(lobes), sample_data(lobes, how, n)]
        if [d.nbytes for d in data] != [b.size for b in self._buffers]:
            usages = [wgpu.BufferUsage.UNIFORM, wgpu.BufferUsage.STORAGE, wgpu.BufferUsage.STORAGE]
            self._buffers = [
                self._device.create_buffer(size=d.nbytes, usage=usage | wgpu.BufferUsage.COPY_DST)
                for d, usage in zip(data, usages, strict=True)
            ]
            self.group = self._layouts.group(self._layouts.material, *self._buffers, *self._bound)
        for buffer, values in zip(self._buffers, data, strict=True):
            self._device.queue.write_buffer(buffer, 0, values.tobytes())


class ObjectResources:
    """One object: its range of the index buffer, its light and its bind groups."""

    def __init__(self, device: Any, layouts: Layouts, record: ObjectRecord, light: Light) -> None:
        self.record, self.light, self._layouts = record, light, layouts
        self._device = device
        self._groups: dict[tuple[Cube, bool], Any] = {}
        self._version = light.version  # of the light that the groups hold

    def group(self, cube: Cube, aimed: bool = False) -> Any:
        """Group 2 with that cube map, and with the table of lamps for shaders that read it."""
        light, key = self.light, (cube, aimed)
        if self._version != light.version:
            self._version, self._groups = light.version, {}
        if key not in self._groups:
            data = np.zeros(1, OBJECT_DTYPE)
            data["centre"][0] = (*light.centre, light.half_log2_texels(cube))
            data["emission"][0, :3] = self.record.emission
            data["irradiance"][0, : len(light.irradiance)] = light.irradiance
            uniform = self._device.create_buffer_with_data(data=data.tobytes(), usage=wgpu.BufferUsage.UNIFORM)
            table = light.aim[0] if aimed else light.planes  # a binding must hold something
            self._groups[key] = self._layouts.group(
                self._layouts.object, uniform, light.planes, light.view(cube), light.depth_view, table
            )
        return self._groups[key]


class SceneResources:
    """Everything of a baked scene that stays on the GPU from frame to frame."""

    def __init__(self, device: Any, scene: BakedScene, layouts: Layouts) -> None:
        self.scene = scene
        self.sampler = device.create_sampler(
            mag_filter="linear", min_filter="linear", mipmap_filter="linear",
            address_mode_u="clamp-to-edge", address_mode_v="clamp-to-edge", address_mode_w="clamp-to-edge",
        )  # fmt: skip
        uv = np.zeros_like(scene.uv2) if scene.uv is None else scene.uv
        vertices = np.concatenate([scene.positions, scene.normals, scene.tangents, scene.uv2, uv], axis=1)
        self.vertices = device.create_buffer_with_data(
            data=np.ascontiguousarray(np.nan_to_num(vertices), np.float32), usage=wgpu.BufferUsage.VERTEX
        )
        self.indices = device.create_buffer_with_data(
            data=np.ascontiguousarray(scene.faces, np.uint32), usage=wgpu.BufferUsage.INDEX
        )
        maps = (scene.irradiance, scene.irradiance_back)
        self._light_maps = [*(flat_texture(device, values) for values in maps), lean_texture(device, scene.lean)]
        self.light_map_views = [texture.create_view() for texture in self._light_maps]
        self.light_group = layouts.group(layouts.light, *self.light_map_views)
        self._device, self._layouts = device, layouts
        environment = np.zeros((6, 1, 1, 3)) if scene.environment is None else finite(scene.environment)[0]
        self._environment = cube_texture(device, [environment])
        self.sky_group = layouts.group(layouts.cube, self._environment.create_view(dimension="cube"))
        lights: dict[Probe | None, Light] = {}
        self.objects = []
        for record in scene.record.objects:
            probe = scene.probe_of(record)
            if probe not in lights:
                lights[probe] = Light(device, probe, self.sampler)
            self.objects.append(ObjectResources(device, layouts, record, lights[probe]))
        pictures = Pictures(device)
        self.materials = {
            name: MaterialBuffers(
                device, layouts, pictures.sampler, material_pictures(pictures, scene.textures.get(name))
            )
            for name in scene.record.materials
        }
        records = scene.record.objects
        self.cut_out = [record for record in records if self.materials[record.material].pictures.masked]
        self.whole_ranges = _ranges([record for record in records if record not in self.cut_out])

    @cached_property
    def noise_group(self) -> Any:
        """In the place of `light_group`: how exact the light map is."""
        both = (self.scene.noise, self.scene.noise_back)
        grey = (None if noise is None else np.repeat(noise[..., None], 3, axis=-1) for noise in both)
        textures = [*(flat_texture(self._device, values) for values in grey), lean_texture(self._device, None)]
        return self._layouts.group(self._layouts.light, *(texture.create_view() for texture in textures))


def _ranges(records: list[ObjectRecord]) -> list[tuple[int, int]]:
    """(first, count) of the faces of objects, neighbours together."""
    ranges: list[tuple[int, int]] = []
    for record in records:
        if ranges and sum(ranges[-1]) == record.first_face:
            ranges[-1] = (ranges[-1][0], ranges[-1][1] + record.face_count)
        else:
            ranges.append((record.first_face, record.face_count))
    return ranges
