"""Specular light of planar reflectors, in a picture of its own that the shading reads."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import wgpu

from lambent.realtime.clusters import Clusters, Seen
from lambent.realtime.integrators import Integrator
from lambent.realtime.mirror import MirrorView
from lambent.realtime.mirror_integrators import is_interleaved, is_searched
from lambent.realtime.parts import Band, Cut, Steps, Whole
from lambent.realtime.passes.depth import DEPTH_FORMAT, TRIANGLES, VERTEX_BUFFERS, draw_seen
from lambent.realtime.passes.mirror import MirrorPass
from lambent.realtime.passes.near import NearPass
from lambent.realtime.passes.shade import Draw, constants_of
from lambent.realtime.resources import Layouts, SceneResources
from lambent.realtime.shader_source import assemble
from lambent.realtime.targets import PassTimer, Target

FORMAT = "rgba16float"
CLEANED = ("rgba16float", "rgba16float", "r16float")
MOST_MIRRORS = 4  # reflectors of a frame; those that cover less of it are left to their probes
_FLAT = {"sample_type": "float", "view_dimension": "2d"}
_EXACT = {"sample_type": "unfilterable-float", "view_dimension": "2d"}


class PlanarPass:
    """Mirror pictures of a frame's reflectors, and the specular light that their pixels get from them."""

    def __init__(self, device: Any, layouts: Layouts, resources: SceneResources, depth: Any) -> None:
        self._device, self._layouts, self._resources = device, layouts, resources
        self._mirror = MirrorPass(device, layouts, resources, depth)
        self._near = NearPass(device, layouts)
        self._materials = {name: buffers.twin() for name, buffers in resources.materials.items()}
        # Bindings without gaps: a software Vulkan (Mesa 22.3) dies of them. Shading's light maps, which have the same
        # numbers, are not read here.
        self._look_up = self._group_layout(
            {"buffer": {"type": "uniform"}}, {"texture": _FLAT}, *[{"texture": _EXACT}] * 2
        )
        self.shown_layout = self._group_layout(*[{"texture": _FLAT}] * 3, *[{"texture": _EXACT}] * 5)
        self._clean_layout = self._group_layout(*[{"texture": _EXACT}] * 2)
        self._clean = self._clean_pipeline()
        self._cleaned: list[Any] = []
        self._clean_group: Any = None
        self._layout = device.create_pipeline_layout(
            bind_group_layouts=[layouts.frame, layouts.material, layouts.object, self._look_up]
        )
        self._pipelines: dict[tuple[Any, ...], Any] = {}
        self._size: tuple[int, int] = (0, 0)
        self._light: list[Any] = []
        self._shown: Any = None

    @property
    def shown_group(self) -> Any:
        """Group 3 of shading: light maps and the light of reflectors."""
        return self._shown

    def encode(
        self, part: Whole | Cut, views: list[MirrorView], draws: list[Draw], how: Integrator, frame_group: Any,
        target: Target, clusters: Clusters, clip_from_world: Any, timer: PassTimer,
    ) -> Steps:  # fmt: skip
        """Draw the mirror pictures of `views` and the light that `how` finds in them, part by part.

        `draws` and `clip_from_world` are the frame's; the depth of `target` is there already.
        """
        self._fit(target.radiance.size[:2])
        mirrored = self._mirror.write(views, draws)
        calls = 0
        for index, view in enumerate(views):
            calls += yield from self._mirror.encode(part, index, view, mirrored, clusters, timer)
            mine = [self._planar(draw, how) for draw in draws if _is_part(draw, view)]
            if is_searched(how):
                self._near.encode(part.encoder, self._mirror.picture(view.size), self._mirror.uniform(index), timer)
            for band in part.bands("planar", self._size):
                seen = clusters.seen(clip_from_world, band.shares)
                calls += self._encode_light(part.encoder, index, view, mine, seen, band, frame_group, target, timer)
                yield
        self._encode_clean(part.encoder, is_interleaved(how), timer)
        yield
        return calls

    def marked(self, views: list[MirrorView], draws: list[Draw]) -> list[Draw]:
        """`draws`, those with pixels on a reflector marked as `planar`."""
        return [replace(draw, planar=any(_is_part(draw, view) for view in views)) for draw in draws]

    def _planar(self, draw: Draw, how: Integrator) -> Draw:
        buffers = self._materials[draw.item.record.material]
        buffers.update(draw.material, how, draw.n)
        return replace(draw, integrator=how, material_group=buffers.group)

    def _encode_light(
        self, encoder: Any, index: int, view: MirrorView, draws: list[Draw], seen: Seen, band: Band, frame_group: Any,
        target: Target, timer: PassTimer,
    ) -> int:  # fmt: skip
        picture = self._mirror.picture(view.size)
        uniform, near = self._mirror.uniform(index), self._near.view(view.size)
        group = self._layouts.group(self._look_up, uniform, picture.light_view, picture.planes_view, near)
        kept = {"load_op": "load" if index else band.load_op, "store_op": "store"}
        render = encoder.begin_render_pass(
            color_attachments=[{"view": texture.create_view(), **kept} for texture in self._light],
            depth_stencil_attachment={
                "view": target.depth.create_view(), "depth_load_op": "load", "depth_store_op": "store",
            },
            **timer.writes("planar"),
        )  # fmt: skip
        band.cut(render)
        render.set_bind_group(0, frame_group)
        render.set_bind_group(3, group)
        render.set_vertex_buffer(0, self._resources.vertices)
        render.set_index_buffer(self._resources.indices, "uint32")
        calls = 0
        for draw in draws:
            record = draw.item.record
            render.set_pipeline(self._pipeline(draw))
            render.set_bind_group(1, draw.material_group)
            render.set_bind_group(2, draw.item.group(draw.integrator.cube))
            calls += draw_seen(render, seen, record.first_face, record.face_count)
        render.end()
        return calls

    def _encode_clean(self, encoder: Any, interleaved: bool, timer: PassTimer) -> None:
        render = encoder.begin_render_pass(
            color_attachments=[
                {"view": t.create_view(), "load_op": "clear", "store_op": "store"} for t in self._cleaned
            ],
            **timer.writes("clean"),
        )
        if interleaved:
            render.set_pipeline(self._clean)
            render.set_bind_group(0, self._clean_group)
            render.draw(3)
        render.end()

    def _clean_pipeline(self) -> Any:
        module = self._device.create_shader_module(code=assemble("planar_clean.wgsl"))
        return self._device.create_render_pipeline(
            layout=self._device.create_pipeline_layout(bind_group_layouts=[self._clean_layout]),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={
                "module": module,
                "entry_point": "planar_clean_main",
                "targets": [{"format": format} for format in CLEANED],
            },
            primitive={"topology": "triangle-list"},
        )

    def _pipeline(self, draw: Draw) -> Any:
        constants = constants_of(draw)
        key = (draw.integrator.shader, *constants.items())
        if key not in self._pipelines:
            code = assemble("diffuse.wgsl", "probe_light.wgsl", "shade.wgsl", draw.integrator.shader)
            module = self._device.create_shader_module(code=code)
            self._pipelines[key] = self._device.create_render_pipeline(
                layout=self._layout,
                vertex={"module": module, "entry_point": "vertex_main", "buffers": VERTEX_BUFFERS},
                fragment={
                    "module": module,
                    "entry_point": "planar_main",
                    "targets": [{"format": FORMAT}] * 2,
                    "constants": constants,
                },
                primitive=TRIANGLES,
                depth_stencil={"format": DEPTH_FORMAT, "depth_write_enabled": False, "depth_compare": "equal"},
            )
        return self._pipelines[key]

    def _fit(self, size: tuple[int, int]) -> None:
        if self._size == tuple(size):
            return
        self._size = tuple(size)
        usage = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.RENDER_ATTACHMENT
        self._light = [self._device.create_texture(size=(*size, 1), format=FORMAT, usage=usage) for _ in range(2)]
        self._cleaned = [self._device.create_texture(size=(*size, 1), format=f, usage=usage) for f in CLEANED]
        light, cleaned = ([texture.create_view() for texture in made] for made in (self._light, self._cleaned))
        self._shown = self._layouts.group(self.shown_layout, *self._resources.light_map_views, *light, *cleaned)
        self._clean_group = self._layouts.group(self._clean_layout, *light)

    def _group_layout(self, *kinds: dict[str, Any]) -> Any:
        entries = [{"binding": i, "visibility": wgpu.ShaderStage.FRAGMENT, **kind} for i, kind in enumerate(kinds)]
        return self._device.create_bind_group_layout(entries=entries)


def _is_part(draw: Draw, view: MirrorView) -> bool:
    return draw.lobes > 0 and any(part.object == draw.item.record.name for part in view.reflector.parts)
