"""Bind group layouts: 0 frame, 1 material, 2 object, 3 light of the scene; and bindings of single passes."""

from __future__ import annotations

from functools import cache
from typing import Any

import wgpu
from numpy.typing import NDArray

from lambent.scenes.looks.textures import CHANNELS

_UNFILTERED = {"sample_type": "unfilterable-float"}
KINDS: dict[str, dict[str, Any]] = {
    "uniform": {"buffer": {"type": "uniform"}},
    "storage": {"buffer": {"type": "read-only-storage"}},
    "moving storage": {"buffer": {"type": "read-only-storage", "has_dynamic_offset": True}},
    "written storage": {"buffer": {"type": "storage"}},
    "sampler": {"sampler": {"type": "filtering"}},
    "flat": {"texture": {"sample_type": "float", "view_dimension": "2d"}},
    "layers": {"texture": {"sample_type": "float", "view_dimension": "2d-array"}},
    "cube": {"texture": {"sample_type": "float", "view_dimension": "cube"}},
    "cubes": {"texture": {"sample_type": "float", "view_dimension": "cube-array"}},
    "exact": {"texture": {**_UNFILTERED, "view_dimension": "2d"}},  # loaded, never filtered
    "numbers": {"texture": {"sample_type": "uint", "view_dimension": "2d"}},
    "number layers": {"texture": {"sample_type": "uint", "view_dimension": "2d-array"}},
    "depth layers": {"texture": {"sample_type": "depth", "view_dimension": "2d-array"}},
    "exact layers": {"texture": {**_UNFILTERED, "view_dimension": "2d-array"}},
}


# Light maps; the sun, and the share of it that each pixel sees; lamps, texels they reach, shadow maps and profiles.
LIGHT = "layers", "uniform", "exact", "uniform", "storage", "layers"
# The sun, depths towards it, and their blocks; depths of panes before it, and their transmittances; texels it reaches.
SHADOW_MAP = "uniform", "depth layers", "exact layers", "depth layers", "exact layers", "exact"
PANE = "uniform", "depth layers", "depth layers"  # terms of clear glass, opaque depths, depths of the previous layer


class Layouts:
    """Bind group layouts of one device. Equal kinds of bindings share a layout, so groups fit several pipelines."""

    def __init__(self, device: Any) -> None:
        self.device = device
        self.of = cache(self._of)
        both = wgpu.ShaderStage.FRAGMENT | wgpu.ShaderStage.VERTEX
        self.frame = self._of("uniform", "sampler", visibility=both)
        self.material = self.of("uniform", "storage", "storage", "sampler", *["flat"] * len(CHANNELS))
        self.light = self.of(*LIGHT)
        self.cube = self.of("cube")
        self.shown = self.of("flat", "sampler")
        self.empty = device.create_buffer(size=16, usage=wgpu.BufferUsage.STORAGE)  # a binding must hold something

    def object(self, look_up: tuple[str, ...], cube: str = "cube") -> Any:
        """Layout of group 2 with the bindings of a look-up of incident light; `cube`: kind of the probe's cube map."""
        return self.of("uniform", cube, "uniform" if cube == "cubes" else "storage", *look_up)

    def _of(self, *kinds: str, visibility: int = wgpu.ShaderStage.FRAGMENT) -> Any:
        """Layout of bindings of these `KINDS`, for the stages of `visibility`."""
        entries = [{"binding": i, "visibility": visibility, **KINDS[kind]} for i, kind in enumerate(kinds)]
        return self.device.create_bind_group_layout(entries=entries)

    def buffer(self, usage: str, data: NDArray[Any]) -> Any:
        """Buffer of an array, which can be written again; `usage` is UNIFORM, STORAGE, VERTEX or INDEX."""
        usages = wgpu.BufferUsage[usage] | wgpu.BufferUsage.COPY_DST
        return self.device.create_buffer_with_data(data=data.tobytes(), usage=usages)

    def uniform(self, size: int) -> Any:
        """Uniform buffer of `size` bytes, rewritten for each frame."""
        return self.device.create_buffer(size=size, usage=wgpu.BufferUsage.UNIFORM | wgpu.BufferUsage.COPY_DST)

    def group(self, layout: Any, *resources: Any) -> Any:
        """Bind group of `resources` (buffers, samplers, views) in the layout's order."""
        entries = [
            {"binding": i, "resource": {"buffer": r} if isinstance(r, wgpu.GPUBuffer) else r}
            for i, r in enumerate(resources)
        ]
        return self.device.create_bind_group(layout=layout, entries=entries)
