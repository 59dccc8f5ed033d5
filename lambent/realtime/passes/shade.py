"""The light of every visible pixel; one pipeline per integrator and set of constants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lambent.realtime.integrators import Integrator
from lambent.realtime.passes.depth import DEPTH_FORMAT, TRIANGLES, VERTEX_BUFFERS
from lambent.realtime.resources import LOOKUPS, Layouts, ObjectResources, SceneResources
from lambent.realtime.shader_source import assemble


@dataclass(frozen=True)
class Draw:
    """One object as it is drawn in this frame."""

    item: ObjectResources
    integrator: Integrator
    lobes: int
    n: int  # samples per lobe
    lookup: str
    material_group: Any


class ShadePass:
    """Draws objects where their depth is the one that the depth pass left."""

    def __init__(self, device: Any, layouts: Layouts) -> None:
        self._device = device
        self._layout = device.create_pipeline_layout(
            bind_group_layouts=[layouts.frame, layouts.material, layouts.object, layouts.light]
        )
        self._modules: dict[str, Any] = {}
        self._pipelines: dict[tuple[Any, ...], Any] = {}

    def draw(self, target: Any, resources: SceneResources, draws: list[Draw], format: str) -> int:
        """Encode into the render pass `target`, whose group 0 is set; returns the draw calls."""
        target.set_bind_group(3, resources.light_group)
        target.set_vertex_buffer(0, resources.vertices)
        target.set_index_buffer(resources.indices, "uint32")
        for draw in draws:
            record = draw.item.record
            target.set_pipeline(self._pipeline(draw, format))
            target.set_bind_group(1, draw.material_group)
            target.set_bind_group(2, draw.item.group(draw.integrator.prefiltered))
            target.draw_indexed(record.face_count * 3, 1, record.first_face * 3)
        return len(draws)

    def _pipeline(self, draw: Draw, format: str) -> Any:
        # Constants, not uniforms: the compiler unrolls, a quarter faster.
        constants = {
            "SAMPLES": draw.n,
            "LOBES": draw.lobes,
            "LOOKUP": LOOKUPS[draw.lookup],
            "PLANES": draw.item.light.plane_count if draw.lookup == "planes" else 0,
            **draw.integrator.constants,
        }
        key = (draw.integrator.shader, format, *constants.values())
        if key not in self._pipelines:
            module = self._module(draw.integrator.shader)
            self._pipelines[key] = self._device.create_render_pipeline(
                layout=self._layout,
                vertex={"module": module, "entry_point": "vertex_main", "buffers": VERTEX_BUFFERS},
                fragment={
                    "module": module,
                    "entry_point": "shade_main",
                    "targets": [{"format": format}],
                    "constants": constants,
                },
                primitive=TRIANGLES,
                depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": False, "depth_compare": "equal"},
            )
        return self._pipelines[key]

    def _module(self, shader: str) -> Any:
        if shader not in self._modules:
            self._modules[shader] = self._device.create_shader_module(code=assemble(shader, "probe_light.wgsl", "shade.wgsl"))
        return self._modules[shader]
