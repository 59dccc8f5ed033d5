"""Edges and thin geometry in motion: pixels become means over several places in them (coverage.wgsl)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from lambent.realtime.frame_state import frame_data
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import pipeline, screen_pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.gpu.structs import FRAME_DTYPE
from lambent.realtime.gpu.targets import DEPTH_FORMAT, Target, target_texture
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.passes.light import LightPass

PLACES = (0.2, 0.4), (0.4, -0.2), (-0.2, -0.4), (-0.4, 0.2)  # px, as places.wgsl
LIGHT_FORMAT, STEPS_FORMAT = "rgba16float", "r32uint"


@dataclass(frozen=True)
class Covering:
    """Textures of one size."""

    places: list[Any]  # depth at each place
    steps: Any  # step from each place to the pixel with its light, see places.wgsl
    missed: Any  # light of surfaces that no neighbouring pixel shows
    covered: Any

    @staticmethod
    def of(device: Any, size: tuple[int, int]) -> Covering:
        formats = (*[DEPTH_FORMAT] * len(PLACES), STEPS_FORMAT, LIGHT_FORMAT, LIGHT_FORMAT)
        *places, steps, missed, covered = (target_texture(device, size, format) for format in formats)
        return Covering(places, steps, missed, covered)


@dataclass(frozen=True)
class Pipelines:
    """Pipelines of the pass, and layouts of its bind groups."""

    depths: Any
    coverage: Any
    steps: Any
    known: list[Any]  # by place
    read: Any
    cover: Any

    @staticmethod
    def of(layouts: Layouts) -> Pipelines:
        device = layouts.device
        depths, steps = layouts.of(*["exact"] * (1 + len(PLACES))), layouts.of("numbers")
        read = layouts.of("exact", "exact", "numbers")
        module = device.create_shader_module(code=assemble("missed.wgsl"))
        known = [
            pipeline(
                device, module, "missed_main", [layouts.frame, steps], (), compare="always",
                writes_depth=True, vertex="screen_main", constants={"PLACE": place},
            )
            for place in range(len(PLACES))
        ]  # fmt: skip
        coverage = screen_pipeline(device, "coverage", [depths], [STEPS_FORMAT])
        cover = screen_pipeline(device, "cover", [layouts.frame, read], [LIGHT_FORMAT])
        return Pipelines(depths, coverage, steps, known, read, cover)


class CoverPass:
    """Averages the light of all surfaces in a pixel, weighted by their shares of its places.

    Most surfaces are already shaded at a neighbouring pixel. The pass shades only surfaces that miss all pixel centres.
    """

    def __init__(self, layouts: Layouts, depth: DepthPass, light: LightPass) -> None:
        self._layouts, self._depth, self._light = layouts, depth, light
        self._covering = lru_cache(1)(lambda size: Covering.of(layouts.device, size))
        self.uniforms = [layouts.uniform(FRAME_DTYPE.itemsize) for _ in PLACES]

    @cached_property
    def _pipelines(self) -> Pipelines:  # frames that do not ask for it never wait for its shaders
        return Pipelines.of(self._layouts)

    def encode(self, context: FrameContext) -> None:
        """Draw the covered radiance, which becomes the frame's."""
        if not context.is_covered:
            return
        size, group, use = context.state.size, self._layouts.group, self._pipelines
        covering: Covering = self._covering(size)
        places = self._places(context, covering)
        for place in places:
            render = place.begin("places", [], "clear", depth="clear")
            context.counts["draw_calls"] += self._depth.draw(render, place)
            render.end()
        steps = covering.steps.create_view()
        depths = group(use.depths, *(texture.create_view() for texture in (context.target.depth, *covering.places)))
        context.cover("coverage", [steps], use.coverage, [depths])
        self._missed_light(places, group(use.steps, steps))
        read = group(use.read, context.radiance.create_view(), covering.missed.create_view(), steps)
        context.cover("cover", [covering.covered.create_view()], use.cover, [context.frame_group, read])
        context.radiance = covering.covered

    def _places(self, context: FrameContext, covering: Covering) -> list[FrameContext]:
        """The frame as it is seen through each place."""
        made = []
        bounds = context.resources.scene.record.bounds
        for at, uniform, depth in zip(PLACES, self.uniforms, covering.places, strict=True):
            jitter = (context.state.jitter_px[0] + at[0], context.state.jitter_px[1] + at[1])
            moved, data = frame_data(replace(context.state, jitter_px=jitter), bounds), context.data.copy()
            for name in ("clip_from_world", "forward"):
                data[name] = moved[name]
            self._layouts.device.queue.write_buffer(uniform, 0, data.tobytes())
            frame = self._layouts.group(self._layouts.frame, uniform, context.resources.sampler)
            made.append(replace(context, data=data, frame_group=frame, target=Target(depth, covering.missed)))
        return made

    def _missed_light(self, places: Sequence[FrameContext], steps: Any) -> None:
        for index, (place, known) in enumerate(zip(places, self._pipelines.known, strict=True)):
            render = place.begin("missed", [], "clear")
            render.set_pipeline(known)
            render.set_bind_group(1, steps)
            render.draw(3)
            render.end()
            self._light.missed(place, "load" if index else "clear")
