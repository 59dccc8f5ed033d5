"""The light of every visible pixel; one pipeline per integrator and set of constants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lambent.materials.document import Material
from lambent.realtime.clusters import Seen
from lambent.realtime.integrators import Integrator
from lambent.realtime.passes.depth import DEPTH_FORMAT, TRIANGLES, VERTEX_BUFFERS, draw_seen
from lambent.realtime.resources import LOOKUPS, Layouts, ObjectResources, SceneResources
from lambent.realtime.shader_source import assemble
from lambent.realtime.textures import BITS


@dataclass(frozen=True)
class Draw:
    """One object as it is drawn in this frame."""

    item: ObjectResources
    material: Material
    integrator: Integrator
    lobes: int
    n: int  # samples per lobe
    lookup: str
    material_group: Any
    textures: int = 0  # bits of the pictures to read, see realtime.textures
    planar: bool = False  # has pixels on planar reflectors


@dataclass(frozen=True)
class Stage:
    """What a pass makes of an object's light: shader and entry point, what targets it has beside that of light."""

    shader: str = "shade.wgsl"
    entry: str = "shade_main"
    front_face: str = "ccw"
    further_targets: tuple[str, ...] = ()
    blended: bool = False  # laid over what is behind by its alpha, in no order, instead of standing for it


SHADE = Stage()
FRINGE = Stage("fringe.wgsl", "fringe_main", blended=True)  # of masked surfaces, after what is whole
WIDENING = BITS["roughness"] | BITS["normal"]  # pictures that make lobes wider
_OVER = {
    "color": {"src_factor": "src-alpha", "dst_factor": "one-minus-src-alpha", "operation": "add"},
    "alpha": {"src_factor": "zero", "dst_factor": "one", "operation": "add"},
}


def constants_of(draw: Draw) -> dict[str, int]:
    """Constants of a draw's pipeline, not uniforms: the compiler unrolls, a quarter faster."""
    return {
        "SAMPLES": draw.n,
        "LOBES": draw.lobes,
        "TEXTURES": draw.textures,
        "LOOKUP": LOOKUPS[draw.lookup],
        "PLANES": draw.item.light.plane_count if draw.lookup == "planes" else 0,
        **draw.integrator.constants,
        **(aim_constant(draw) if draw.integrator.aimed else {}),
    }


def aim_constant(draw: Draw) -> dict[str, int]:
    """AIM of aim.wgsl's users: without it nothing that aims is compiled."""
    return {"AIM": int(draw.item.light.is_aimed_at(draw.material, draw.lookup, draw.textures & WIDENING != 0))}


class ShadePass:
    """Draws objects where their depth is the one that the depth pass left."""

    def __init__(self, device: Any, layouts: Layouts, stage: Stage = SHADE, planar_layout: Any = None) -> None:
        """`planar_layout` is that of group 3 for draws with `planar`."""
        self._device, self._stage = device, stage
        if planar_layout is not None:
            self._planar_layout = device.create_pipeline_layout(
                bind_group_layouts=[layouts.frame, layouts.material, layouts.object, planar_layout]
            )
        self._layout = device.create_pipeline_layout(
            bind_group_layouts=[layouts.frame, layouts.material, layouts.object, layouts.light]
        )
        self._modules: dict[tuple[str, ...], Any] = {}
        self._pipelines: dict[tuple[Any, ...], Any] = {}

    def draw(
        self,
        target: Any,
        resources: SceneResources,
        draws: list[Draw],
        seen: Seen,
        format: str,
        planar_group: Any = None,
        light_group: Any = None,
    ) -> int:
        """Encode into the render pass `target`, whose group 0 is set; returns the draw calls.

        `light_group` stands in for that of the light maps.
        """
        target.set_vertex_buffer(0, resources.vertices)
        target.set_index_buffer(resources.indices, "uint32")
        calls = 0
        for draw in draws:
            record = draw.item.record
            if not seen.of(record.first_face, record.face_count):
                continue
            target.set_pipeline(self._pipeline(draw, format))
            target.set_bind_group(1, draw.material_group)
            target.set_bind_group(2, draw.item.group(draw.integrator.cube, draw.integrator.aimed))
            target.set_bind_group(3, planar_group if draw.planar else light_group or resources.light_group)
            calls += draw_seen(target, seen, record.first_face, record.face_count)
        return calls

    def _pipeline(self, draw: Draw, format: str) -> Any:
        constants = constants_of(draw)
        key = (draw.integrator.shader, draw.planar, format, *constants.items())
        if key not in self._pipelines:
            module = self._module(draw)
            self._pipelines[key] = self._device.create_render_pipeline(
                layout=self._planar_layout if draw.planar else self._layout,
                vertex={"module": module, "entry_point": "vertex_main", "buffers": VERTEX_BUFFERS},
                fragment={
                    "module": module,
                    "entry_point": self._stage.entry,
                    "targets": self._targets(format),
                    "constants": constants,
                },
                primitive={**TRIANGLES, "front_face": self._stage.front_face},
                depth_stencil={
                    "format": DEPTH_FORMAT,
                    "depth_write_enabled": False,
                    "depth_compare": "greater" if self._stage.blended else "equal",
                },
            )
        return self._pipelines[key]

    def _targets(self, format: str) -> list[dict[str, Any]]:
        blend = {"blend": _OVER} if self._stage.blended else {}
        return [{"format": target, **blend} for target in (format, *self._stage.further_targets)]

    def _module(self, draw: Draw) -> Any:
        specular = "planar_shown.wgsl" if draw.planar else "probe_light.wgsl"
        names = (draw.integrator.shader, specular, "shade.wgsl", self._stage.shader)
        if names not in self._modules:
            self._modules[names] = self._device.create_shader_module(code=assemble(*names))
        return self._modules[names]
