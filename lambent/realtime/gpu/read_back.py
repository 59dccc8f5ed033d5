"""The content of buffers and textures, read back from the GPU."""

from __future__ import annotations

from typing import Any

import numpy as np

BLOCKS = {"bc6h-rgb-ufloat": (16, 4)}  # bytes of a block, and its texels a side
TEXELS = {  # bytes of a channel, and channels
    "r8unorm": (1, 1), "rg8unorm": (1, 2), "rgba8unorm": (1, 4), "rgba8unorm-srgb": (1, 4), "r16float": (2, 1),
    "rg16float": (2, 2), "rgba16float": (2, 4), "r32float": (4, 1), "rg32float": (4, 2), "rgba32float": (4, 4),
    "r32uint": (4, 1), "rgba16uint": (2, 4), "rgba32uint": (4, 4), "rgb10a2unorm": (4, 1), "depth32float": (4, 1),
    "rgb9e5ufloat": (4, 1),
}  # fmt: skip


def buffer_bytes(device: Any, buffer: Any) -> bytes:
    """All bytes of a buffer."""
    return bytes(device.queue.read_buffer(buffer))


def texture_levels(device: Any, texture: Any) -> list[bytes]:
    """The MIP levels of a texture, the finest first, of each all layers; rows are packed tightly."""
    size, side = BLOCKS.get(texture.format) or (int(np.prod(TEXELS[texture.format])), 1)
    width, height, layers = texture.size
    levels = []
    for level in range(texture.mip_level_count):
        columns, rows = (-(-max(1, n >> level) // side) for n in (width, height))
        layout = {"bytes_per_row": columns * size, "rows_per_image": rows}
        source = {"texture": texture, "mip_level": level}
        levels.append(bytes(device.queue.read_texture(source, layout, (columns * side, rows * side, layers))))
    return levels
