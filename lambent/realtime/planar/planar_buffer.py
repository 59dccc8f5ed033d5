"""The planar reflection buffer: light of the mirrored view with MIP levels, and the plane seen at every pixel.

Also the walls that bound the view.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import pairwise
from typing import Any

from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import screen_pipeline
from lambent.realtime.gpu.structs import FRAME_DTYPE, MIRRORED_VIEW_DTYPE, PLAN_DTYPE
from lambent.realtime.gpu.targets import DEPTH_FORMAT, Target, target_texture
from lambent.realtime.gpu.uploads import upload
from lambent.realtime.integrators.integrators import INTEGRATORS, Integrator
from lambent.realtime.objects.draws import Draw
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.passes.light import Glazing, Shading, Stage
from lambent.realtime.planar.planar_view import MOST_REFLECTORS, PlanarView, levels_of
from lambent.realtime.sun.sun_pass import SunPass
from lambent.store.contract import PlanRecord
from lambent.store.plans import plan_of

FORMATS = LIGHT_FORMAT, PLANE_FORMAT = "rgba16float", "rgba32float"
MIRRORED_N = 3  # samples per lobe of mirrored objects, from their probes
BLURRED_N = 1  # samples per lobe if the reflector blurs the mirrored view
STAGE = Stage("planar_buffer_main", "planar_buffer.wgsl", "cw", mixes_parts=True)  # mirroring reverses the winding


@dataclass(frozen=True)
class PlanarBuffer:
    """Textures of one size with their views; reflectors that need this size use them one after the other."""

    target: Target
    light: Any  # all levels
    levels: list[Any]
    planes: Any

    @staticmethod
    def of(device: Any, size: tuple[int, int]) -> PlanarBuffer:
        depth, planes = (target_texture(device, size, format) for format in (DEPTH_FORMAT, PLANE_FORMAT))
        light = target_texture(device, size, LIGHT_FORMAT, levels_of(size))
        levels = [light.create_view(base_mip_level=i, mip_level_count=1) for i in range(levels_of(size))]
        return PlanarBuffer(Target(depth, light), light.create_view(), levels, planes.create_view())


class PlanarWalls:
    """Masks the depth of a mirrored view where its eye looks past the foot of a wall, so that nothing is drawn."""

    def __init__(self, layouts: Layouts) -> None:
        self._layouts, self._layout = layouts, layouts.of("uniform", "flat")
        groups = [layouts.frame, self._layout]
        self._pipeline = screen_pipeline(
            layouts.device, "planar_walls", groups, (), compare="always", writes_depth=True
        )
        self._texture = cache(self._uploaded)
        self.uniform = cache(lambda index: layouts.uniform(PLAN_DTYPE.itemsize))

    def draw(self, render: Any, index: int, view: PlanarView) -> int:
        """Encode first into a depth pass whose group 0 is set; returns the draw calls.

        `index` is the view's index in its frame.
        """
        if view.plan is None or view.reflector.plan is None:
            return 0
        self._layouts.device.queue.write_buffer(self.uniform(index), 0, view.plan.tobytes())
        texture = self._texture(view.reflector.plan)
        render.set_pipeline(self._pipeline)
        render.set_bind_group(1, self._layouts.group(self._layout, self.uniform(index), texture))
        render.draw(3)
        return 1

    def _uploaded(self, record: PlanRecord) -> Any:
        distance = plan_of(record).distance[None, ..., None]
        return upload(self._layouts.device, [distance], "r8snorm").create_view()


class PlanarBufferPass:
    """Draws the mirrored views of a frame. Views may share a buffer, so each is used before the next is drawn."""

    def __init__(self, layouts: Layouts, depth: DepthPass) -> None:
        device = layouts.device
        self._layouts, self._depth = layouts, depth
        self._sun = SunPass(layouts, "cw")
        self._shading, self._walls = Shading(layouts, STAGE, layouts.light), PlanarWalls(layouts)
        self.buffer = lru_cache(MOST_REFLECTORS)(lambda size: PlanarBuffer.of(device, size))
        self._glazing = Glazing(layouts, STAGE.front_face)
        self.uniform = cache(lambda index: layouts.uniform(MIRRORED_VIEW_DTYPE.itemsize))
        self._frame = cache(lambda index: layouts.uniform(FRAME_DTYPE.itemsize))
        groups = [layouts.frame, layouts.cube]
        self._sky = screen_pipeline(device, "planar_buffer_sky", groups, FORMATS, compare="equal")
        self._mips = screen_pipeline(device, "planar_buffer_mips", [layouts.shown], [LIGHT_FORMAT])

    def mirrored(self, context: FrameContext) -> Iterator[tuple[FrameContext, PlanarBuffer]]:
        """The mirrored frames of a frame in turn, with their buffers; `uniform` has the record of each."""
        write, layouts = self._layouts.device.queue.write_buffer, self._layouts

        @cache
        def drawn_by(how: Integrator, n: int) -> tuple[list[Draw], list[Draw]]:
            draws, panes = (
                [d.by(how if d.material.lobes else INTEGRATORS["diffuse"], context.resources, n) for d in of]
                for of in (context.draws, context.panes)
            )
            return draws, panes

        for index, view in enumerate(context.views):
            draws, panes = drawn_by(*mirrored_by(context, view))
            if is_blurred(context, view):
                draws = [draw for draw in draws if not draw.item.lamp]
            write(self._frame(index), 0, view.frame.tobytes())
            write(self.uniform(index), 0, view.uniform.tobytes())
            group = layouts.group(layouts.frame, self._frame(index), context.resources.sampler)
            buffer = self.buffer(view.size)
            frame = replace(
                context, data=view.frame, frame_group=group, draws=draws, panes=panes, target=buffer.target,
                shown=None,
            )  # fmt: skip
            yield frame, buffer

    def uniforms(self, index: int) -> tuple[Any, Any, Any]:
        """Buffers of a view, by its number: of FRAME_DTYPE, MIRRORED_VIEW_DTYPE and PLAN_DTYPE."""
        return self._frame(index), self.uniform(index), self._walls.uniform(index)

    def encode(self, context: FrameContext, index: int, view: PlanarView, buffer: PlanarBuffer) -> None:
        """Draw a mirrored frame."""
        resources = context.resources
        render = context.begin("mirror", [], "clear", depth="clear")
        if context.whole and view.plan is not None:
            render.only_upright()
        context.counts["draw_calls"] += self._walls.draw(render, index, view)
        if context.whole:
            render.end()
            render = context.begin("mirror", [], "load")
        context.counts["draw_calls"] += self._depth.draw(render, context)
        render.end()
        self._sun.encode(context)
        light = self._layouts.group(self._layouts.light, *context.light)
        render, seen = context.begin("mirror", [buffer.levels[0], buffer.planes], "clear"), context.seen()
        self._shading.draw(render, context, context.draws, seen, FORMATS, light)
        render.set_pipeline(self._sky)
        render.set_bind_group(1, resources.mirrored_sky_group)
        render.draw(3)
        context.counts["draw_calls"] += 1
        self._glazing.draw(render, context, seen, FORMATS)
        render.end()
        for finer, into in pairwise(buffer.levels):
            group = self._layouts.group(self._layouts.shown, finer, resources.sampler)
            context.cover("mips", [into], self._mips, [group])


def is_blurred(context: FrameContext, view: PlanarView) -> bool:
    """Whether all of a view's reflector blurs it: then it shows no opening of a lamp, whose highlights pixels add."""
    return all(draw.blurs for draw in context.draws if view.has(draw.item.record) and draw.material.lobes)


def mirrored_by(context: FrameContext, view: PlanarView) -> tuple[Integrator, int]:
    """Integrator of the objects in a mirrored view, and its samples per lobe.

    One sample suffices if every lobe of the reflector is wide, because the reflector blurs the view's highlights.
    """
    wanted = INTEGRATORS[context.state.integrator]
    if is_blurred(context, view):
        return INTEGRATORS["rings"], BLURRED_N
    # published integrators also draw mirrored objects as published
    return INTEGRATORS["lamps" if wanted.lamps else "rings"], MIRRORED_N
