"""Specular light of planar reflectors, in layers of a separate texture that the shading reads."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from lambent.realtime.gpu.layouts import LIGHT, Layouts
from lambent.realtime.gpu.pipelines import screen_pipeline
from lambent.realtime.gpu.targets import target_texture
from lambent.realtime.integrators.integrators import Integrator
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.passes.light import Shading, Stage
from lambent.realtime.planar.planar_buffer import PlanarBuffer, PlanarBufferPass
from lambent.realtime.planar.planar_integrators import planar_integrator

FORMAT = "rgba16float"
FOUND, CLEANED = 2, 3  # numbers of layers (planar_layers.wgsl) of planar.wgsl and of planar_clean.wgsl
STAGE = Stage("planar_main")  # of the shader of a planar integrator


class PlanarPass:
    """Draws the planar reflection buffers of a frame, and the specular light that its pixels get from them."""

    def __init__(self, layouts: Layouts, depth: DepthPass) -> None:
        self._layouts = layouts
        self._buffers = PlanarBufferPass(layouts, depth)
        # Bindings have no gaps, because they crash a software Vulkan (Mesa 22.3). So the light maps have another number
        # than in shading.
        self._hits = layouts.of("uniform", "flat", "exact", "layers")
        self._shading = Shading(layouts, STAGE, self._hits)
        self.reflections = layouts.of(*LIGHT, "exact layers")
        found = layouts.of("exact layers")
        self._clean = screen_pipeline(layouts.device, "planar_clean", [found], [FORMAT] * CLEANED)
        self._texture = lru_cache(1)(lambda size: target_texture(layouts.device, size, FORMAT))

    def encode(self, context: FrameContext) -> None:
        """Draw the buffer of each view and the light found in it, after the frame's depth."""
        how = planar_integrator(context.state.integrator, context.state.planar)
        if not context.views or how is None:
            return
        texture = self._texture((*context.state.size, FOUND + CLEANED))
        layers = [
            texture.create_view(dimension="2d", base_array_layer=i, array_layer_count=1) for i in range(FOUND + CLEANED)
        ]
        if context.whole:
            context.begin("planar", layers[:FOUND], "clear").end()  # which view is the first depends on the camera
        for index, (mirrored, buffer) in enumerate(self._buffers.mirrored(context)):
            context.encoder.view = index
            self._buffers.encode(mirrored, index, context.views[index], buffer)
            self._encode_hits(context, index, how, buffer, layers[:FOUND])
        context.encoder.view = None
        found = texture.create_view(dimension="2d-array", base_array_layer=0, array_layer_count=FOUND)
        group = self._layouts.group(self._layouts.of("exact layers"), found)
        context.cover("clean", layers[FOUND:], self._clean, [group])
        views = *context.light, texture.create_view(dimension="2d-array")
        context.reflections = self._layouts.group(self.reflections, *views)

    def uniforms(self, index: int) -> tuple[Any, Any, Any]:
        """Buffers of a mirrored view, by its number: of FRAME_DTYPE, MIRRORED_VIEW_DTYPE and PLAN_DTYPE."""
        return self._buffers.uniforms(index)

    def _encode_hits(
        self, context: FrameContext, index: int, how: Integrator, buffer: PlanarBuffer, layers: list[Any]
    ) -> None:
        """The light of one view's pixels."""
        view, uniform = context.views[index], self._buffers.uniform(index)
        light_maps = context.resources.light_view
        group = self._layouts.group(self._hits, uniform, buffer.light, buffer.planes, light_maps)
        mine = (draw for draw in context.draws if draw.lobes and view.has(draw.item.record))
        draws = [draw.by(how, context.resources, draw.planar_n) for draw in mine]
        render = context.begin("planar", layers, "load" if index or context.whole else "clear")
        self._shading.draw(render, context, draws, context.seen(), (FORMAT,) * FOUND, group)
        render.end()
