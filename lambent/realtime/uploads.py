"""Arrays to textures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.colour import HALF_MAX


def half(values: Floats) -> NDArray[np.float16]:
    """As half floats, cut at the largest of them."""
    return np.clip(values, -HALF_MAX, HALF_MAX).astype(np.float16)


def with_alpha(rgb: Floats) -> NDArray[np.float16]:
    """(..., 4) half floats of light (..., 3), alpha 1."""
    rgba = np.ones((*rgb.shape[:-1], 4), np.float16)
    rgba[..., :3] = half(rgb)
    return rgba


def upload(device: Any, levels: Sequence[NDArray[Any]], format: str) -> Any:
    """Texture of MIP levels (layers, rows, columns, channels) whose texels are those of `format`."""
    layers, height, width = levels[0].shape[:3]
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    size = (width, height, layers)
    texture = device.create_texture(size=size, format=format, mip_level_count=len(levels), usage=usage)
    rewrite(device, texture, levels)
    return texture


def rewrite(device: Any, texture: Any, levels: Sequence[NDArray[Any]]) -> None:
    """Replace the first MIP levels of a texture, and of each the first layers."""
    for level, values in enumerate(levels):
        layers, rows, columns, channels = values.shape
        device.queue.write_texture(
            {"texture": texture, "mip_level": level},
            np.ascontiguousarray(values),
            {"bytes_per_row": columns * channels * values.itemsize, "rows_per_image": rows},
            (columns, rows, layers),
        )


def cube_texture(device: Any, levels: Sequence[Floats], format: str = "rgba16float") -> Any:
    """Cube texture of MIP levels (6, n, n, 3) or, for r16float, (6, n, n, 1)."""
    return upload(device, cube_levels(levels, format), format)


def cube_levels(levels: Sequence[Floats], format: str = "rgba16float") -> list[NDArray[np.float16]]:
    """Levels as `cube_texture` uploads them."""
    return [with_alpha(level) if format == "rgba16float" else half(level) for level in levels]
