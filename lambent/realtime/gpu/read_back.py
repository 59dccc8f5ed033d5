"""The content of buffers and textures, read back from the GPU."""

from __future__ import annotations

import math
import re
from typing import Any

BC6H = "bc6h-rgb-ufloat"
BLOCKS = {BC6H: (16, 4)}  # bytes of a block, and its texels a side
WORDS = ("rgb10a2unorm", "rgb9e5ufloat", "depth32float")  # of 4 bytes a texel


def texel(format: str) -> tuple[int, int]:
    """Bytes of a channel, and channels, of an uncompressed format."""
    if format in WORDS:
        return 4, 1
    parts = re.match(r"([rgba]+)(8|16|32)", format)
    assert parts is not None, format
    return int(parts[2]) // 8, len(parts[1])


def buffer_bytes(device: Any, buffer: Any) -> bytes:
    """All bytes of a buffer."""
    return bytes(device.queue.read_buffer(buffer))


def texture_levels(device: Any, texture: Any) -> list[bytes]:
    """The MIP levels of a texture, the finest first, of each all layers; rows are packed tightly."""
    size, side = BLOCKS.get(texture.format) or (math.prod(texel(texture.format)), 1)
    width, height, layers = texture.size
    levels = []
    for level in range(texture.mip_level_count):
        columns, rows = (-(-max(1, n >> level) // side) for n in (width, height))
        layout = {"bytes_per_row": columns * size, "rows_per_image": rows}
        source = {"texture": texture, "mip_level": level}
        levels.append(bytes(device.queue.read_texture(source, layout, (columns * side, rows * side, layers))))
    return levels
