"""Depths of all surfaces that block light, drawn in any projection; holes of masked surfaces are open."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import DEPTH_FORMAT
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.realtime.objects.clusters import merged


class SolidDepths:
    """Draws the objects of `resources`, a `SceneResources`, except those of some materials; depth 0 is farthest."""

    def __init__(self, layouts: Layouts, resources: Any, materials: Collection[str] = ()) -> None:
        self._layouts, self._resources = layouts, resources
        device, groups = layouts.device, [layouts.frame, layouts.material]
        whole, masked = (device.create_shader_module(code=assemble(name)) for name in ("vertex.wgsl", "mask.wgsl"))
        self._whole = pipeline(device, whole, "", groups[:1], (), compare="greater", writes_depth=True)
        self._masked = pipeline(device, masked, "mask_main", groups, (), compare="greater", writes_depth=True)
        records = (item.record for item in resources.objects)
        self._records = [r for r in records if r.material not in materials]
        self._ranges = merged(
            ((r.first_face, r.first_face + r.face_count) for r in self._records if r.name not in resources.masked),
            gap=1,
        )

    def draw(self, encoder: Any, view: Any, clip_from_world: Floats) -> None:
        """Encode a pass that clears a depth texture's view and draws into it."""
        layouts, resources = self._layouts, self._resources
        data = np.zeros((), FRAME_DTYPE)
        data["clip_from_world"] = clip_from_world.T
        depth = {"view": view, "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store"}
        render = encoder.begin_render_pass(color_attachments=[], depth_stencil_attachment=depth)
        frame = layouts.group(layouts.frame, layouts.buffer("UNIFORM", data), resources.sampler)
        render.set_bind_group(0, frame)
        render.set_vertex_buffer(0, resources.vertices)
        render.set_index_buffer(resources.indices, "uint32")
        render.set_pipeline(self._whole)
        for first, count in self._ranges:
            render.draw_indexed(count * 3, 1, first * 3)
        for record in self._records:
            if record.name in resources.masked:
                material = resources.scene.record.materials[record.material]
                group = resources.materials[record.material].group(material, INTEGRATORS["diffuse"], 1)
                render.set_pipeline(self._masked)
                render.set_bind_group(1, group)
                render.draw_indexed(record.face_count * 3, 1, record.first_face * 3)
        render.end()


def depth_texture(device: Any, width: int, height: int, layers: int) -> Any:
    """Depth texture that can be read back."""
    usage = wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
    return device.create_texture(size=(width, height, layers), format=DEPTH_FORMAT, usage=usage)


def read_depths(device: Any, texture: Any, layer: int) -> NDArray[np.float32]:
    """(height, width) depths of a layer; waits for the GPU. The width must be a multiple of 64 texels."""
    width, height, _ = texture.size
    source = {"texture": texture, "origin": (0, 0, layer)}
    data = device.queue.read_texture(source, {"bytes_per_row": 4 * width}, (width, height, 1))
    return np.frombuffer(data, np.float32).reshape(height, width)
