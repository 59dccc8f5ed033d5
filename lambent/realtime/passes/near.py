"""What is nearest in the cells of a mirror picture: with it few steps search for what stands before a first guess."""

from __future__ import annotations

from typing import Any

import wgpu

from lambent.realtime.passes.mirror import MirrorPicture
from lambent.realtime.passes.screen import cover
from lambent.realtime.resources import Layouts
from lambent.realtime.shader_source import assemble
from lambent.realtime.targets import PassTimer

FORMAT = "rgba32float"
FIRST_PX = 4  # side of the finest cells, NEAR_PX of shaders/planar_mirror.wgsl
MOST_LEVELS = 7  # the coarsest have 256


class NearPass:
    """Cells of one mirror picture after the other, in one texture."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        self._device, self._layouts = device, layouts
        entries = (
            {"binding": 0, "visibility": wgpu.ShaderStage.FRAGMENT, "buffer": {"type": "uniform"}},
            {
                "binding": 1,
                "visibility": wgpu.ShaderStage.FRAGMENT,
                "texture": {"sample_type": "unfilterable-float", "view_dimension": "2d"},
            },
        )
        self._layout = device.create_bind_group_layout(entries=entries)
        self._first, self._next = self._pipeline("near_first_main"), self._pipeline("near_main")
        self._size: tuple[int, int] = (0, 0)
        self._levels: list[Any] = []
        self._view: Any = None

    def view(self, size: tuple[int, int]) -> Any:
        """The cells, all levels, of mirror pictures of that size."""
        if self._size != size:
            usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.RENDER_ATTACHMENT
            cells = (size[0] // FIRST_PX, size[1] // FIRST_PX, 1)
            levels = min(MOST_LEVELS, max(cells).bit_length())
            made = self._device.create_texture(size=cells, format=FORMAT, mip_level_count=levels, usage=usage)
            self._levels = [made.create_view(base_mip_level=i, mip_level_count=1) for i in range(levels)]
            self._view, self._size = made.create_view(), size
        return self._view

    def encode(self, encoder: Any, picture: MirrorPicture, uniform: Any, timer: PassTimer) -> None:
        """Fill the cells from a picture whose planes are drawn."""
        self.view(picture.size)
        finer = picture.planes_view
        for level, into in enumerate(self._levels):
            group = self._layouts.group(self._layout, uniform, finer)
            cover(encoder, into, self._next if level else self._first, [group], timer.writes("mips"))
            finer = into

    def _pipeline(self, entry: str) -> Any:
        module = self._device.create_shader_module(code=assemble("planar_near.wgsl"))
        return self._device.create_render_pipeline(
            layout=self._device.create_pipeline_layout(bind_group_layouts=[self._layout]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": entry, "targets": [{"format": FORMAT}]},
            primitive={"topology": "triangle-list"},
        )
