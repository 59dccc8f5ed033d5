"""Radiance to what a display shows: exposure, view transform, sRGB."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import wgpu

from lambent.realtime.parts import Cut, Steps, Whole
from lambent.realtime.passes.screen import cover
from lambent.realtime.resources import Layouts
from lambent.realtime.shader_source import assemble

if TYPE_CHECKING:
    from lambent.realtime.targets import PassTimer  # which knows the format of this one

DISPLAY_FORMAT = "rgba8unorm"
FALSE_COLOUR = "false-colour"
VIEW_TRANSFORMS = {FALSE_COLOUR: 3, "linear": 0, "neutral": 1, "filmic": 2}


class TonemapPass:
    """Draws a radiance texture over the whole target."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        self._device = device
        texture = {"sample_type": "unfilterable-float", "view_dimension": "2d"}
        self._group_layout = device.create_bind_group_layout(
            entries=[{"binding": i, "visibility": wgpu.ShaderStage.FRAGMENT, "texture": texture} for i in (0, 1)]
        )
        module = device.create_shader_module(code=assemble("tonemap.wgsl"))
        self._pipeline = device.create_render_pipeline(
            layout=device.create_pipeline_layout(bind_group_layouts=[layouts.frame, self._group_layout]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": "tonemap_main", "targets": [{"format": DISPLAY_FORMAT}]},
            primitive={"topology": "triangle-list"},
        )

    def encode(
        self, part: Whole | Cut, frame_group: Any, radiance: tuple[Any, Any], target: Any, timer: PassTimer
    ) -> Steps:
        """Draw textures of radiance into the view `target`: the second, if any, with the share that the frame says."""
        seen, prior = radiance
        views = [(seen if texture is None else texture).create_view() for texture in (seen, prior)]
        group = self._device.create_bind_group(
            layout=self._group_layout, entries=[{"binding": i, "resource": view} for i, view in enumerate(views)]
        )
        for band in part.bands("tonemap", seen.size[:2]):
            cover(part.encoder, target, self._pipeline, [frame_group, group], timer.writes("tonemap"), band)
            yield
        return 0
