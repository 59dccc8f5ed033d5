"""Pixels back from the GPU."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]


def read_picture(device: Any, texture: Any) -> Floats:
    """Linear values (H, W, 3) of a texture that a renderer drew radiance into."""
    width, height = texture.size[:2]
    return _read(device, texture, (0, 0), (width, height))


def read_pixel(device: Any, texture: Any, x: int, y: int) -> tuple[float, float, float]:
    """One of them; positions outside give the nearest."""
    width, height = texture.size[:2]
    place = (min(max(x, 0), width - 1), min(max(y, 0), height - 1))
    r, g, b = _read(device, texture, place, (1, 1))[0, 0].tolist()
    return r, g, b


def _read(device: Any, texture: Any, place: tuple[int, int], size: tuple[int, int]) -> Floats:
    dtype = np.dtype(np.float16 if texture.format == "rgba16float" else np.float32)
    source = {"texture": texture, "origin": (*place, 0)}
    data = device.queue.read_texture(source, {"bytes_per_row": size[0] * 4 * dtype.itemsize}, (*size, 1))
    return np.asarray(np.frombuffer(data, dtype).reshape(size[1], size[0], 4)[..., :3], np.float32)
