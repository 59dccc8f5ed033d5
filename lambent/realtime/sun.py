"""The sun that the light map leaves out, and the shadow map that shows where it shines: made once, as a scene opens.

Depths along the sun's direction, 1 nearest to it, in at most four squares: the first holds what cameras see, the last
the whole scene. What blocks light in a bake blocks it here: all surfaces but the holes of masked ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.directions import basis
from lambent.core.geometry import points_on_triangles, triangle_areas
from lambent.realtime.baked import BakedScene
from lambent.realtime.integrators import INTEGRATORS
from lambent.realtime.layouts import SHADOW_MAP, Layouts
from lambent.realtime.pipelines import pipeline
from lambent.realtime.shader_source import assemble
from lambent.realtime.structs import FRAME_DTYPE, SUN_DTYPE, Record
from lambent.realtime.targets import DEPTH_FORMAT
from lambent.realtime.uploads import upload
from lambent.store.contract import SunRecord

SIDE, MOST_SQUARES, RATIO = 2048, 4, 4.0  # texels along a square; squares; times as large as the one before, at least
BLOCK = 8  # texels along a block whose least and greatest depths are known: SUN_BLOCK of shaders/sun.wgsl
POINTS = 1 << 15  # of surfaces, that tell where cameras look
MIDDLE = 0.96  # of what they see lies in the first square, along each axis
RIM_PX = 4  # texels around the scene


@dataclass(frozen=True)
class SunSquares:
    """Where a shadow map lies: axes (3, 3) across, down and towards the sun, depths from `low_m` over `span_m`.

    squares (n, 3): corner along across and down, and side, all metres.
    """

    axes: Floats
    low_m: float
    span_m: float
    squares: Floats

    def clip_from_world(self, square: Floats) -> Floats:
        """(4, 4) of one square; depth 1 is nearest to the sun."""
        across, down, towards = self.axes
        u, v, side = square
        found = np.zeros((4, 4))
        found[0] = [*(2 / side * across), -2 * u / side - 1]
        found[1] = [*(-2 / side * down), 2 * v / side + 1]
        found[2] = [*(towards / self.span_m), -self.low_m / self.span_m]
        found[3, 3] = 1
        return found


def squares_of(direction: Sequence[float], corners: Floats, eyes: Floats, side: int = SIDE) -> SunSquares:
    """The squares for triangles (F, 3, 3) and the places of cameras (n, 3), for maps of `side` texels."""
    towards = np.asarray(direction, float)
    across, down = basis(towards)
    axes = np.stack([across, down, towards])
    places = corners.reshape(-1, 3) @ axes.T
    low, high = places.min(axis=0), places.max(axis=0)
    size = float(max(np.max(high[:2] - low[:2]), 1e-3)) * side / (side - 2 * RIM_PX)
    whole = np.array([*((low + high)[:2] / 2 - size / 2), size])
    low_seen, high_seen = _seen(corners, eyes, axes[:2])
    about, width = (low_seen + high_seen) / 2, float(np.max(high_seen - low_seen))
    squares = [whole]
    if 0 < width < size / 1.5:
        count = min(MOST_SQUARES - 1, int(np.ceil(np.log(size / width) / np.log(RATIO))))
        sizes = width * (size / width) ** (np.arange(count) / count)
        squares = [np.array([*(about - one / 2), one]) for one in sizes] + squares
    rim = 1e-4 * float(high[2] - low[2]) + 1e-3
    return SunSquares(axes, float(low[2]) - rim, float(high[2] - low[2]) + 2 * rim, np.array(squares))


def _seen(corners: Floats, eyes: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Low and high corner (2,), along two axes (2, 3), of cameras and the MIDDLE of the surfaces around them.

    Surfaces count by area over the cube of the distance, of which far ones hold a bounded share however large they are;
    nothing counts as nearer than 1 m. Without cameras there is no more than nothing to see.
    """
    area = triangle_areas(corners)
    if not len(eyes) or not area.sum() > 0:
        return np.zeros(2), np.zeros(2)
    rng = np.random.default_rng(0)
    share = np.sqrt(area) / np.sqrt(area).sum()
    face = rng.choice(len(area), size=POINTS, p=share)
    points = points_on_triangles(corners, face, rng)
    nearest = np.min([np.linalg.norm(points - eye, axis=1) for eye in eyes], axis=0)
    weight = area[face] / share[face] / np.maximum(nearest, 1) ** 3
    bounds = np.array([_quantiles(values, weight) for values in (points @ axes.T).T])
    own = eyes @ axes.T
    return np.minimum(bounds[:, 0], own.min(axis=0)), np.maximum(bounds[:, 1], own.max(axis=0))


def _quantiles(values: Floats, weight: Floats) -> tuple[float, float]:
    """What lies between holds MIDDLE of the weight."""
    order = np.argsort(values)
    up_to = np.cumsum(weight[order]) / weight.sum()
    low, high = np.searchsorted(up_to, [(1 - MIDDLE) / 2, (1 + MIDDLE) / 2])
    return float(values[order[low]]), float(values[order[min(high, len(order) - 1)]])


class SunLight:
    """A sun on the GPU: its record, its shadow map and the blocks of that; none without `squares`.

    `nowhere` stands for the pixels that see a sun where there is none.
    """

    def __init__(
        self, layouts: Layouts, sun: SunRecord | None = None, squares: SunSquares | None = None, depths: Any = None
    ) -> None:
        self.exists = squares is not None
        self.uniform = layouts.buffer("UNIFORM", sun_data(sun, squares))
        self.nowhere = upload(layouts.device, [np.zeros((1, 1, 1, 1), np.float16)], "r16float").create_view()
        if squares is not None:
            read = [_read(layouts.device, depths, layer) for layer in range(len(squares.squares))]
            blocks = upload(layouts.device, [block_ranges(np.stack(read))], "rg32float")
            views = (texture.create_view(dimension="2d-array") for texture in (depths, blocks))
            self.group = layouts.group(layouts.of(*SHADOW_MAP), self.uniform, *views)


def sun_data(sun: SunRecord | None, squares: SunSquares | None) -> Record:
    """Record of SUN_DTYPE; all 0 without a sun."""
    data = np.zeros(1, SUN_DTYPE)
    if sun is None or squares is None:
        return data
    across, down, towards = squares.axes
    data["towards"][0] = *towards, np.tan(sun.radius_rad)
    data["across"][0], data["down"][0] = (*across, squares.low_m), (*down, squares.span_m)
    data["irradiance"][0] = *sun.irradiance, len(squares.squares)
    for row, (u, v, side) in zip(data["squares"][0], squares.squares, strict=False):
        row[:] = u, v, SIDE / side, side / SIDE
    return data


def block_ranges(depths: Floats) -> NDArray[np.float32]:
    """Least and greatest depths (layers, n, 3 n / 2, 2) of blocks of maps (layers, side, side), n = side / BLOCK.

    Levels of blocks of BLOCK, 2 BLOCK, ... texels lie beside each other, the second and all further ones in a column:
    adapters in software read one MIP level for four pixels at once.
    """
    layers, side = depths.shape[:2]
    n = count = side // BLOCK
    cut = depths.reshape(layers, n, BLOCK, n, BLOCK)
    level = np.stack([cut.min(axis=(2, 4)), cut.max(axis=(2, 4))], axis=-1).astype(np.float32)
    found = np.zeros((layers, n, n + n // 2, 2), np.float32)
    found[:, :, :n] = level
    while (count := count // 2) > 0:
        cut = level.reshape(layers, count, 2, count, 2, 2)
        level = np.stack([cut[..., 0].min(axis=(2, 4)), cut[..., 1].max(axis=(2, 4))], axis=-1)
        found[:, n - 2 * count : n - count, n : n + count] = level
    return found


def draw_depths(layouts: Layouts, squares: SunSquares, resources: Any) -> Any:
    """Texture of a layer for each square, with the depths of all surfaces of a scene (`resources.SceneResources`)."""
    device, groups = layouts.device, [layouts.frame, layouts.material]
    texture = _depth_texture(device, SIDE, len(squares.squares))
    whole, masked = (device.create_shader_module(code=assemble(name)) for name in ("vertex.wgsl", "mask.wgsl"))
    draw_whole = pipeline(device, whole, "", groups[:1], (), compare="greater", writes_depth=True)
    draw_masked = pipeline(device, masked, "mask_main", groups, (), compare="greater", writes_depth=True)
    encoder = device.create_command_encoder()
    for layer, square in enumerate(squares.squares):
        data = np.zeros((), FRAME_DTYPE)
        data["clip_from_world"] = squares.clip_from_world(square).T
        frame = layouts.group(layouts.frame, layouts.buffer("UNIFORM", data), resources.sampler)
        view = texture.create_view(dimension="2d", base_array_layer=layer, array_layer_count=1)
        depth = {"view": view, "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store"}
        render = encoder.begin_render_pass(color_attachments=[], depth_stencil_attachment=depth)
        render.set_bind_group(0, frame)
        render.set_vertex_buffer(0, resources.vertices)
        render.set_index_buffer(resources.indices, "uint32")
        render.set_pipeline(draw_whole)
        for first, count in resources.whole_ranges:
            render.draw_indexed(count * 3, 1, first * 3)
        for item in resources.objects:
            record = item.record
            if record.name in resources.masked:
                material = resources.scene.record.materials[record.material]
                group = resources.materials[record.material].group(material, INTEGRATORS["diffuse"], 1)
                render.set_pipeline(draw_masked)
                render.set_bind_group(1, group)
                render.draw_indexed(record.face_count * 3, 1, record.first_face * 3)
        render.end()
    device.queue.submit([encoder.finish()])
    return texture


def sun_light(layouts: Layouts, scene: BakedScene, resources: Any) -> SunLight:
    """The sun of a baked scene, its shadow map drawn; dark where there is none."""
    if scene.sun is None or not len(scene.faces):
        return SunLight(layouts)
    paths = (camera for path in scene.record.paths for camera in path.keys)
    eyes = np.array([camera.position for camera in (*scene.record.cameras, *paths)], float).reshape(-1, 3)
    squares = squares_of(scene.sun.direction, scene.positions[scene.faces].astype(float), eyes)
    return SunLight(layouts, scene.sun, squares, draw_depths(layouts, squares, resources))


def _depth_texture(device: Any, side: int, layers: int) -> Any:
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
    return device.create_texture(size=(side, side, layers), format=DEPTH_FORMAT, usage=usage)


def _read(device: Any, texture: Any, layer: int) -> NDArray[np.float32]:
    """(side, side) depths of a layer; waits for the GPU."""
    side = texture.size[0]
    source = {"texture": texture, "origin": (0, 0, layer)}
    data = device.queue.read_texture(source, {"bytes_per_row": 4 * side}, (side, side, 1))
    return np.frombuffer(data, np.float32).reshape(side, side)
