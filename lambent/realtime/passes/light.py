"""The light of every visible pixel: objects, the sky behind them, and the edges of masked surfaces."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lambent.core.arrays import Floats
from lambent.realtime.frame_state import LIGHT_MAP_NOISE
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.pipelines import pipeline, screen_pipeline
from lambent.realtime.gpu.shader_source import assemble
from lambent.realtime.incident import included
from lambent.realtime.light.probe_light import kind_of
from lambent.realtime.objects.clusters import Seen
from lambent.realtime.objects.draws import Draw
from lambent.realtime.passes.context import FrameContext
from lambent.realtime.passes.depth import draw_runs, set_geometry


@dataclass(frozen=True)
class Stage:
    """Entry point of a pass for an object's light, and its shader if it is not the integrator's."""

    entry: str
    shader: str = ""
    front_face: str = "ccw"
    blend: str = ""  # of `_BLENDS`: blending with the background; opaque by default
    mixes_parts: bool = False  # mixes the light of an object's parts near their borders

    def shaders(self, draw: Draw) -> tuple[str, ...]:
        """Names of the files for the shader of a draw."""
        if not self.shader:
            return "diffuse.wgsl", "probe_light.wgsl", "shade.wgsl", draw.shader
        return draw.shader, "planar_shown.wgsl" if draw.planar else "probe_light.wgsl", "shade.wgsl", self.shader


SHADE = Stage("shade_main", "shade.wgsl", mixes_parts=True)
FRINGE = Stage("fringe_main", "fringe.wgsl", blend="over")  # of masked surfaces, after fully covered pixels
_BLENDS = {
    name: {
        "color": {"src_factor": source, "dst_factor": behind, "operation": "add"},
        "alpha": {"src_factor": "zero", "dst_factor": "one", "operation": "add"},
    }
    for name, source, behind in (
        ("over", "src-alpha", "one-minus-src-alpha"), ("added", "one", "one"), ("tinted", "zero", "src"),
    )
}  # fmt: skip


class Shading:
    """Draws objects at the depths of the depth pass; one pipeline per integrator, look-up and set of constants.

    `light` is the layout of group 3, `reflections` its layout for draws with `planar`.
    """

    def __init__(self, layouts: Layouts, stage: Stage, light: Any, reflections: Any = None) -> None:
        self._layouts, self._stage, self._light, self._reflections = layouts, stage, light, reflections
        self._modules: dict[tuple[Any, ...], Any] = {}
        self._pipelines: dict[tuple[Any, ...], Any] = {}

    def draw(
        self, render: Any, context: FrameContext, draws: Iterable[Draw], seen: Seen, formats: tuple[str, ...],
        light: Any,
    ) -> None:  # fmt: skip
        """Encode into a render pass of `formats` whose group 0 is set; `light` is group 3."""
        set_geometry(render, context.resources)
        draws = list(draws)
        if self._stage.mixes_parts:
            draws += [replace(draw, is_beyond=True) for draw in draws if draw.item.beyond]
        bound: list[Any] = [None] * 4  # encoding what is bound already would cost as much as the draw
        for draw in draws:
            runs = [run for faces in draw.faces for run in seen.of(*faces)]
            if not runs:
                continue
            reflecting = context.reflections if self._is_reflecting(draw) else light
            pipeline = self._pipeline(draw, formats, context.resources.lamps.constants)
            wanted = [pipeline, draw.material_group, draw.object_group, reflecting]
            if wanted[0] is not bound[0]:
                render.set_pipeline(wanted[0])
            for number in (1, 2, 3):
                if wanted[number] is not bound[number]:
                    render.set_bind_group(number, wanted[number])
            bound = wanted
            context.counts["draw_calls"] += draw_runs(render, seen, runs)

    def _is_reflecting(self, draw: Draw) -> bool:
        return draw.planar and self._reflections is not None

    def _pipeline(self, draw: Draw, formats: tuple[str, ...], lamps: dict[str, int]) -> Any:
        stage, constants = self._stage, draw.constants | lamps
        shaders = (stage.shaders(draw), draw.look_up.NAME)
        key = (*shaders, formats, *constants.items())
        if key not in self._pipelines:
            layouts = self._layouts
            if shaders not in self._modules:
                code = assemble(*shaders[0], given=included(draw.look_up))
                self._modules[shaders] = layouts.device.create_shader_module(code=code)
            light = self._reflections if self._is_reflecting(draw) else self._light
            groups = [layouts.frame, layouts.material, layouts.object(draw.look_up.BINDINGS, kind_of(draw.cube)), light]
            self._pipelines[key] = pipeline(
                layouts.device, self._modules[shaders], stage.entry, groups, formats, constants=constants,
                compare="greater" if stage.blend else "equal",
                blend=_BLENDS.get(stage.blend or ("added" if draw.is_beyond else "")),
                front_face=stage.front_face,
            )  # fmt: skip
        return self._pipelines[key]


class Glazing:
    """Blends clear glass over the background; panes write no depth.

    Panes are drawn from the farthest to the nearest. For each pane, all faces first absorb from the light behind, then
    all faces add their reflections.
    """

    def __init__(self, layouts: Layouts, front_face: str = "ccw") -> None:
        passing = Stage("pass_main", "glazing.wgsl", front_face, blend="tinted")
        mirroring = Stage("mirror_main", "glazing.wgsl", front_face, blend="added", mixes_parts=True)
        self._layouts = layouts
        self._passing, self._mirroring = (Shading(layouts, stage, layouts.light) for stage in (passing, mirroring))

    def draw(self, render: Any, context: FrameContext, seen: Seen, formats: tuple[str, ...]) -> None:
        """Encode into a render pass of `formats` that holds depth and light of everything else."""
        if not context.panes:
            return
        light = self._layouts.group(self._layouts.light, *context.pane_light)
        eye = context.data["eye"][:3]

        def middle_m(pane: Draw) -> Floats:
            return np.asarray(np.mean(pane.item.record.bounds, axis=0))

        def distance(pane: Draw) -> float:
            return float(np.linalg.norm(middle_m(pane) - eye))

        for pane in sorted(context.panes, key=distance, reverse=True):
            if context.whole:
                render.begin_pane(middle_m(pane))
            for shading in (self._passing, self._mirroring):
                shading.draw(render, context, [pane], seen, formats, light)


class LightPass:
    """Draws linear radiance into the frame's target, after its depth."""

    def __init__(self, layouts: Layouts, reflections: Any) -> None:
        """`reflections` is the layout of group 3 for draws with pixels on planar reflectors."""
        self._layouts, self._glazing = layouts, Glazing(layouts)
        self._shade, self._fringe = (Shading(layouts, stage, layouts.light, reflections) for stage in (SHADE, FRINGE))
        self._sky: dict[str, Any] = {}

    def encode(self, context: FrameContext) -> None:
        """Draw the target, which becomes the frame's radiance."""
        resources, format, layouts = context.resources, context.target.radiance.format, self._layouts
        shows_noise = context.state.show == LIGHT_MAP_NOISE
        light = resources.noise_group if shows_noise else layouts.group(layouts.light, *context.light)
        masked = resources.masked if context.blends_masks else set()
        fringes = [draw for draw in context.draws if draw.item.record.name in masked]
        draws = context.draws
        if context.redrawn is not None:
            draws = [draw for draw in draws if draw.item.record.material in context.redrawn]
        load_op = "clear" if context.redrawn is None else "load"
        render, seen = context.begin("shade", [context.target.radiance.create_view()], load_op), context.seen()
        self._shade.draw(render, context, draws, seen, (format,), light)
        if context.redrawn is None:  # a base already has sky and fringes, and fringes must not be blended twice
            self._draw_sky(render, context, format)
            self._fringe.draw(render, context, fringes, seen, (format,), light)
            self._glazing.draw(render, context, seen, (format,))
        render.end()
        context.radiance = context.target.radiance

    def missed(self, context: FrameContext, load_op: str) -> None:
        """Draw the missed surfaces (`CoverPass`), whose depths the target holds, and the sky between them."""
        format, layouts = context.target.radiance.format, self._layouts
        light = layouts.group(layouts.light, *context.light)
        render = context.begin("missed light", [context.target.radiance.create_view()], load_op)
        self._shade.draw(render, context, context.draws, context.thin(), (format,), light)
        self._draw_sky(render, context, format)
        self._glazing.draw(render, context, context.seen(), (format,))
        render.end()

    def _draw_sky(self, render: Any, context: FrameContext, format: str) -> None:
        """Draw the environment where depth is infinite."""
        if format not in self._sky:
            groups = [self._layouts.frame, self._layouts.cube]
            self._sky[format] = screen_pipeline(self._layouts.device, "sky", groups, [format], compare="equal")
        render.set_pipeline(self._sky[format])
        render.set_bind_group(1, context.resources.sky_group)
        render.draw(3)
        context.counts["draw_calls"] += 1
