"""A device that keeps what every object was made from, for objects whose makers WebGPU does not tell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import wgpu


@dataclass(frozen=True)
class Made:
    """The kind of an object of WebGPU, its descriptor, and the object itself, which keeps its `id` in use."""

    kind: str
    descriptor: dict[str, Any]
    one: Any


class DescribedDevice:
    """Stands for a device of wgpu; `made` has the descriptor of every object, by `id`."""

    KINDS = ("bind_group_layout", "bind_group", "pipeline_layout", "shader_module", "render_pipeline", "sampler")

    def __init__(self, device: Any) -> None:
        self._device = device
        self.made: dict[int, Made] = {}
        for kind in self.KINDS:
            setattr(self, f"create_{kind}", partial(self._create, kind))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._device, name)

    def _create(self, kind: str, **descriptor: Any) -> Any:
        return self._noted(kind, descriptor, getattr(self._device, f"create_{kind}")(**descriptor))

    def create_buffer(self, **descriptor: Any) -> Any:
        """A buffer that can be read back."""
        readable = {**descriptor, "usage": descriptor["usage"] | wgpu.BufferUsage.COPY_SRC}
        return self._noted("buffer", descriptor, self._device.create_buffer(**readable))

    def create_buffer_with_data(self, *, data: Any, **descriptor: Any) -> Any:
        """A buffer with content that can be read back."""
        readable = {**descriptor, "usage": descriptor["usage"] | wgpu.BufferUsage.COPY_SRC}
        made = self._device.create_buffer_with_data(data=data, **readable)
        return self._noted("buffer", {**descriptor, "size": made.size}, made)

    def create_texture(self, **descriptor: Any) -> Any:
        """A texture that can be read back, and whose views are described."""
        readable = {**descriptor, "usage": descriptor["usage"] | wgpu.TextureUsage.COPY_SRC}
        made = self._device.create_texture(**readable)
        view = made.create_view

        def create_view(**of: Any) -> Any:
            return self._noted("view", {**of, "texture": made}, view(**of))

        made.create_view = create_view
        return self._noted("texture", descriptor, made)

    def _noted(self, kind: str, descriptor: dict[str, Any], one: Any) -> Any:
        self.made[id(one)] = Made(kind, descriptor, one)
        return one
