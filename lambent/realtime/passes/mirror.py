"""The mirror picture of a planar reflector: light with its MIP levels, and the plane seen at every pixel."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import wgpu

from lambent.realtime.clusters import Clusters
from lambent.realtime.frame_data import FRAME_DTYPE
from lambent.realtime.integrators import INTEGRATORS
from lambent.realtime.mirror import MIRROR_DTYPE, MirrorView, levels_of
from lambent.realtime.parts import Cut, Steps, Whole
from lambent.realtime.passes.depth import DEPTH_FORMAT, DepthPass
from lambent.realtime.passes.screen import cover
from lambent.realtime.passes.shade import Draw, ShadePass, Stage
from lambent.realtime.passes.walls import WallsPass
from lambent.realtime.resources import Layouts, SceneResources
from lambent.realtime.shader_source import assemble
from lambent.realtime.targets import PassTimer

LIGHT_FORMAT, PLANE_FORMAT = "rgba16float", "rgba32float"
MIRROR_N = 3  # samples per lobe of what is mirrored, from its probe
_READ = wgpu.TextureUsage.TEXTURE_BINDING | wgpu.TextureUsage.COPY_SRC
_DRAW = wgpu.TextureUsage.RENDER_ATTACHMENT
STAGE = Stage("mirror.wgsl", "mirror_main", "cw", (PLANE_FORMAT,))  # mirrored triangles turn the other way


class MirrorPicture:
    """Textures of one size, used by one reflector after the other."""

    def __init__(self, device: Any, layouts: Layouts, sampler: Any, size: tuple[int, int]) -> None:
        self.size = size

        def texture(format: str, levels: int = 1, usage: int = _READ | _DRAW) -> Any:
            return device.create_texture(size=(*size, 1), format=format, mip_level_count=levels, usage=usage)

        self.light = texture(LIGHT_FORMAT, levels_of(size))
        self.planes, self.depth = texture(PLANE_FORMAT), texture(DEPTH_FORMAT, usage=_DRAW)
        count = range(levels_of(size))
        self.level_views = [self.light.create_view(base_mip_level=i, mip_level_count=1) for i in count]
        self.mip_groups = [layouts.group(layouts.shown, view, sampler) for view in self.level_views[:-1]]
        self.light_view, self.planes_view = self.light.create_view(), self.planes.create_view()


class MirrorPass:
    """Draws mirror pictures; `views` of a frame share one picture, so each is shaded from before the next is drawn."""

    def __init__(self, device: Any, layouts: Layouts, resources: SceneResources, depth: DepthPass) -> None:
        self._device, self._layouts, self._resources, self._depth = device, layouts, resources, depth
        self._shade = ShadePass(device, layouts, STAGE)
        self._materials = {name: buffers.twin() for name, buffers in resources.materials.items()}
        self._buffers: list[tuple[Any, Any, Any]] = []  # per view: mirrored frame, its group, uniform of the look-up
        self._picture: MirrorPicture | None = None
        self._sky = self._pipeline("mirror_sky.wgsl", "mirror_sky_main", layouts.frame, layouts.cube, sky=True)
        self._mips = self._pipeline("mirror_mips.wgsl", "mirror_mips_main", layouts.shown)
        self._walls = WallsPass(device, layouts)

    def write(self, views: list[MirrorView], frame_draws: list[Draw]) -> list[Draw]:
        """Bring buffers up to date with this frame; returns what the mirror pictures draw."""
        while len(self._buffers) < len(views):
            usage = wgpu.BufferUsage.UNIFORM | wgpu.BufferUsage.COPY_DST
            sizes = FRAME_DTYPE.itemsize, MIRROR_DTYPE.itemsize
            frame, uniform = (self._device.create_buffer(size=size, usage=usage) for size in sizes)
            group = self._layouts.group(self._layouts.frame, frame, self._resources.sampler)
            self._buffers.append((frame, group, uniform))
        self._walls.write(views)
        for view, (frame, _, uniform) in zip(views, self._buffers, strict=False):
            self._device.queue.write_buffer(frame, 0, view.frame.tobytes())
            self._device.queue.write_buffer(uniform, 0, view.uniform.tobytes())
        draws = []
        for draw in frame_draws:
            material = draw.material
            how = INTEGRATORS["rings" if material.lobes else "diffuse"]
            buffers = self._materials[draw.item.record.material]
            buffers.update(material, how, MIRROR_N)
            lobes = len(material.lobes) if how.specular else 0
            made = replace(draw, integrator=how, lobes=lobes, n=MIRROR_N, material_group=buffers.group, planar=False)
            draws.append(made)
        return draws

    def uniform(self, index: int) -> Any:
        """Buffer of MIRROR_DTYPE of the view `index`."""
        return self._buffers[index][2]

    def encode(
        self, part: Whole | Cut, index: int, view: MirrorView, draws: list[Draw], clusters: Clusters, timer: PassTimer
    ) -> Steps:
        """Draw the mirror picture of a view, part by part."""
        picture, clip_from_world = self.picture(view.size), view.frame["clip_from_world"].T
        depth = {"view": picture.depth.create_view(), "depth_clear_value": 0.0, "depth_store_op": "store"}
        first = part.encoder.begin_render_pass(
            color_attachments=[],
            depth_stencil_attachment={**depth, "depth_load_op": "clear"},
            **timer.writes("mirror"),
        )
        first.set_bind_group(0, self._buffers[index][1])
        seen = clusters.seen(clip_from_world)
        calls = self._walls.draw(first, index, view) + self._depth.draw(first, self._resources, seen)
        first.end()
        yield
        for band in part.bands("mirror", view.size):
            target = part.encoder.begin_render_pass(
                color_attachments=[
                    {"view": v, "load_op": band.load_op, "store_op": "store"}
                    for v in (picture.level_views[0], picture.planes_view)
                ],
                depth_stencil_attachment={**depth, "depth_load_op": "load"},
                **timer.writes("mirror"),
            )
            band.cut(target)
            target.set_bind_group(0, self._buffers[index][1])
            seen = clusters.seen(clip_from_world, band.shares)
            calls += 1 + self._shade.draw(target, self._resources, draws, seen, LIGHT_FORMAT)
            target.set_pipeline(self._sky)
            target.set_bind_group(1, self._resources.sky_group)
            target.draw(3)
            target.end()
            yield
        for group, into in zip(picture.mip_groups, picture.level_views[1:], strict=True):
            cover(part.encoder, into, self._mips, [group], timer.writes("mips"))
        return calls

    def picture(self, size: tuple[int, int]) -> MirrorPicture:
        """The textures of that size; those of another are forgotten."""
        if self._picture is None or self._picture.size != size:
            self._picture = MirrorPicture(self._device, self._layouts, self._resources.sampler, size)
        return self._picture

    def _pipeline(self, shader: str, entry: str, *layouts: Any, sky: bool = False) -> Any:
        module = self._device.create_shader_module(code=assemble(shader))
        formats = (LIGHT_FORMAT, PLANE_FORMAT) if sky else (LIGHT_FORMAT,)
        behind = {"format": DEPTH_FORMAT, "depth_write_enabled": False, "depth_compare": "equal"}
        return self._device.create_render_pipeline(
            layout=self._device.create_pipeline_layout(bind_group_layouts=list(layouts)),
            vertex={"module": module, "entry_point": "screen_main"},
            fragment={"module": module, "entry_point": entry, "targets": [{"format": f} for f in formats]},
            primitive={"topology": "triangle-list"},
            **({"depth_stencil": behind} if sky else {}),
        )
