"""Clear glass in the sun's shadow map: depth and transmittance of its layers, nearest to the sun first.

Depth peeling (Everitt 2001, "Interactive order-independent transparency"): each pass draws the nearest glass behind the
previous layer, until none is left in front of opaque surfaces. Glass beyond the last layer is ignored. Texels are twice
as large as those of the shadow map.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.materials.clear import MOST_TERMS, clear_terms
from lambent.materials.document import Material
from lambent.realtime.gpu.layouts import PANE, Layouts
from lambent.realtime.gpu.pipelines import pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import DEPTH_FORMAT, stored
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.realtime.materials.textures import BITS
from lambent.realtime.sun.sun_squares import SunSquares

MOST_LAYERS = 8  # faces of triple glazing, and two
COLOUR_FORMAT = "rgb10a2unorm"


@dataclass(frozen=True)
class PaneLayers:
    """Textures of `count` layers in each square: depths and transmittances.

    The array index is layer x squares + square, counting the squares of all parts of the sun.
    """

    count: int
    depths: Any
    colours: Any


def no_panes(device: Any) -> PaneLayers:
    """Placeholder textures for a scene without glass."""
    return PaneLayers(0, _texture(device, 1, 1, DEPTH_FORMAT), _texture(device, 1, 1, COLOUR_FORMAT))


def pane_layers(
    layouts: Layouts, parts: Sequence[SunSquares], resources: Any, solid: Any, names: tuple[str, ...]
) -> PaneLayers:
    """Layers of the materials `names` in front of the opaque depths `solid`; `resources` is a `SceneResources`."""
    items = [item for item in resources.objects if item.record.material in names]
    layers: list[tuple[Any, Any]] = []
    while items and len(layers) < MOST_LAYERS:
        layer = _peeled(layouts, parts, resources, items, solid, layers[-1][0] if layers else None)
        if not _holds_any(layouts.device, layer[0]):
            break
        layers.append(layer)
    if not layers:
        return no_panes(layouts.device)
    depths, colours = (_joined(layouts.device, [layer[i] for layer in layers]) for i in (0, 1))
    return PaneLayers(len(layers), depths, colours)


def pane_data(material: Material) -> NDArray[np.float32]:
    """(MOST_TERMS, 4) float32 terms of clear glass, zero-padded."""
    data = np.zeros((MOST_TERMS, 4), np.float32)
    terms = clear_terms(material)
    if terms is not None:
        data[: len(terms)] = terms
    return data


def _peeled(
    layouts: Layouts, parts: Sequence[SunSquares], resources: Any, items: list[Any], solid: Any, before: Any
) -> tuple[Any, Any]:
    """Depths and transmittances of one layer of objects `items`, behind the depths `before`."""
    device, squares = layouts.device, [(part, square) for part in parts for square in part.squares]
    made = tuple(_texture(device, solid.size[0] // 2, len(squares), format) for format in (DEPTH_FORMAT, COLOUR_FORMAT))
    module = device.create_shader_module(code=assemble("pane.wgsl"))
    encoder = device.create_command_encoder()
    for number, (part, square) in enumerate(squares):
        data = np.zeros((), FRAME_DTYPE)
        data["clip_from_world"] = part.clip_from_world(square).T
        data["forward"][:3], data["first_sample"] = part.axes[2], number
        depth, colour = (t.create_view(dimension="2d", base_array_layer=number, array_layer_count=1) for t in made)
        render = encoder.begin_render_pass(
            color_attachments=stored([colour]),
            depth_stencil_attachment={
                "view": depth, "depth_clear_value": 0.0, "depth_load_op": "clear", "depth_store_op": "store",
            },
        )  # fmt: skip
        render.set_bind_group(0, layouts.group(layouts.frame, layouts.buffer("UNIFORM", data), resources.sampler))
        render.set_vertex_buffer(0, resources.vertices)
        render.set_index_buffer(resources.indices, "uint32")
        for item in items:
            record, material = item.record, resources.scene.record.materials[item.record.material]
            buffers = resources.materials[record.material]
            constants = {
                "FIRST": before is None, "MASKED": buffers.textures.masked,
                "TEXTURES": buffers.textures.bits & BITS["specular"],
            }  # fmt: skip
            groups = [layouts.frame, layouts.material, layouts.of(*PANE)]
            render.set_pipeline(
                pipeline(
                    device, module, "pane_main", groups, [COLOUR_FORMAT], compare="greater", writes_depth=True,
                    constants=constants,
                )
            )  # fmt: skip
            terms = layouts.buffer("UNIFORM", pane_data(material))
            views = (t.create_view(dimension="2d-array") for t in (solid, before or solid))
            render.set_bind_group(1, buffers.group(material, INTEGRATORS["diffuse"], 1))
            render.set_bind_group(2, layouts.group(layouts.of(*PANE), terms, *views))
            render.draw_indexed(record.face_count * 3, 1, record.first_face * 3)
        render.end()
    device.queue.submit([encoder.finish()])
    return made


def _holds_any(device: Any, depths: Any) -> bool:
    """Whether anything was drawn; waits for the GPU."""
    width, height, _ = depths.size
    data = device.queue.read_texture(
        {"texture": depths}, {"bytes_per_row": 4 * width, "rows_per_image": height}, depths.size
    )
    return bool(np.frombuffer(data, np.float32).any())


def _texture(device: Any, side: int, layers: int, format: str) -> Any:
    use = wgpu.TextureUsage
    usage = use.RENDER_ATTACHMENT | use.TEXTURE_BINDING | use.COPY_SRC | use.COPY_DST
    return device.create_texture(size=(side, side, layers), format=format, usage=usage)


def _joined(device: Any, textures: list[Any]) -> Any:
    """One texture of the layers of all."""
    side, _, layers = textures[0].size
    whole = _texture(device, side, layers * len(textures), textures[0].format)
    encoder = device.create_command_encoder()
    for i, texture in enumerate(textures):
        target = {"texture": whole, "origin": (0, 0, i * layers)}
        encoder.copy_texture_to_texture({"texture": texture}, target, texture.size)
    device.queue.submit([encoder.finish()])
    return whole
