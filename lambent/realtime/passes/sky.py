"""The environment where no object is."""

from __future__ import annotations

from typing import Any

from lambent.realtime.passes.depth import DEPTH_FORMAT
from lambent.realtime.resources import Layouts, SceneResources
from lambent.realtime.shader_source import assemble


class SkyPass:
    """Fills what the depth pass left at infinity (reversed depth 0)."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        self._device = device
        self._layout = device.create_pipeline_layout(bind_group_layouts=[layouts.frame, layouts.cube])
        self._module = device.create_shader_module(code=assemble("sky.wgsl"))
        self._pipelines: dict[str, Any] = {}

    def draw(self, target: Any, resources: SceneResources, format: str) -> int:
        """Encode into the render pass `target`, whose group 0 is set; returns the draw calls."""
        target.set_pipeline(self._pipeline(format))
        target.set_bind_group(1, resources.sky_group)
        target.draw(3)
        return 1

    def _pipeline(self, format: str) -> Any:
        if format not in self._pipelines:
            self._pipelines[format] = self._device.create_render_pipeline(
                layout=self._layout,
                vertex={"module": self._module, "entry_point": "screen_main"},
                fragment={"module": self._module, "entry_point": "sky_main", "targets": [{"format": format}]},
                primitive={"topology": "triangle-list"},
                depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": False, "depth_compare": "equal"},
            )
        return self._pipelines[format]
