"""Uploads of arrays to textures and buffers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.light.colour import HALF_MAX


def half(values: Floats) -> NDArray[np.float16]:
    """Half floats, clamped to their largest value."""
    return np.clip(values, -HALF_MAX, HALF_MAX).astype(np.float16)


def whole_words(data: NDArray[Any]) -> NDArray[np.uint8]:
    """Bytes of an array, padded to whole words of 4 bytes, as writes to buffers require."""
    flat = np.ascontiguousarray(data).reshape(-1).view(np.uint8)
    return np.pad(flat, (0, -len(flat) % 4)) if len(flat) % 4 else flat


def with_alpha(rgb: Floats) -> NDArray[np.float16]:
    """(..., 4) half floats of light (..., 3), alpha 1."""
    rgba = np.ones((*rgb.shape[:-1], 4), np.float16)
    rgba[..., :3] = half(rgb)
    return rgba


def upload(device: Any, levels: Sequence[NDArray[Any]], format: str, *, drawn_into: bool = False) -> Any:
    """Texture of MIP levels (layers, rows, columns, channels) with texels of `format`, to be sampled and written to.

    It can be `drawn_into` and read back too, if that is asked for.
    """
    layers, height, width = levels[0].shape[:3]
    usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_DST
    if drawn_into:
        usage |= wgpu.TextureUsage.RENDER_ATTACHMENT | wgpu.TextureUsage.COPY_SRC
    size = (width, height, layers)
    texture = device.create_texture(size=size, format=format, mip_level_count=len(levels), usage=usage)
    for level, values in enumerate(levels):
        _, rows, columns, channels = values.shape
        device.queue.write_texture(
            {"texture": texture, "mip_level": level},
            np.ascontiguousarray(values),
            {"bytes_per_row": columns * channels * values.itemsize, "rows_per_image": rows},
            (columns, rows, layers),
        )
    return texture


def upload_layer(device: Any, texture: Any, layer: int, texels: NDArray[Any]) -> None:
    """Replace a layer of a texture by texels (rows, columns, ...)."""
    rows, columns = texels.shape[:2]
    device.queue.write_texture(
        {"texture": texture, "origin": (0, 0, layer)}, np.ascontiguousarray(texels),
        {"bytes_per_row": texels.nbytes // rows, "rows_per_image": rows}, (columns, rows, 1),
    )  # fmt: skip


def cube_texture(device: Any, levels: Sequence[Floats], format: str = "rgba16float") -> Any:
    """Cube texture of MIP levels (6, n, n, 3), or (6, n, n, 1) for r16float."""
    return upload(device, [with_alpha(level) if format == "rgba16float" else half(level) for level in levels], format)
