"""Draws frames: state in, image out. The window and the headless commands run this same code.

renderer = Renderer(open_device(), store)
image = renderer.display_image(FrameState(camera, 1680, 1050))
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.arrays import Floats
from lambent.core.errors import UserError
from lambent.core.geometry.sequences import hammersley
from lambent.core.light.colour import srgb_decode, srgb_encode
from lambent.core.pictures.images import to_bytes
from lambent.core.progress import Progress, silent
from lambent.materials.lobes import widths
from lambent.realtime.display.display import SmoothPass, TonemapPass
from lambent.realtime.frame_state import LIGHT_MAP_NOISE, QMC_N, SHOW, FrameState, frame_data
from lambent.realtime.gpu.commands import Commands
from lambent.realtime.gpu.layouts import Layouts
from lambent.realtime.gpu.structs import FRAME_DTYPE, Record
from lambent.realtime.gpu.targets import PassTimer, Targets, pixels
from lambent.realtime.integrators.integrators import integrator
from lambent.realtime.light.baked import BakedScene, read_baked
from lambent.realtime.light.light_mixer import LightMixer
from lambent.realtime.light_fields.streaming import Streaming
from lambent.realtime.objects.clusters import Clusters
from lambent.realtime.objects.draws import draws_of, panes_of
from lambent.realtime.overlays.computed_picture import UploadedPicture
from lambent.realtime.overlays.discs import Discs
from lambent.realtime.overlays.outline import Outline
from lambent.realtime.passes.accumulate import AccumulatePass
from lambent.realtime.passes.base import BasePass
from lambent.realtime.passes.context import FrameContext, Pass
from lambent.realtime.passes.cover import CoverPass
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.passes.light import LightPass
from lambent.realtime.planar.planar_integrators import planar_integrator
from lambent.realtime.planar.planar_pass import PlanarPass
from lambent.realtime.planar.planar_view import MOST_REFLECTORS, PlanarView, planar_views, views_of_any_camera
from lambent.realtime.planar.reflector_faces import ReflectorFaces
from lambent.realtime.resources import SceneResources
from lambent.realtime.sun.sun_pass import SunPass
from lambent.store.store import Store

SUPERSAMPLES = 16  # frames of a still: below, thin lines come out dotted


class Renderer:
    """Draws frames of one baked scene on one device.

    Attributes
    ----------
    scene : BakedScene
    waits : bool
        Whether a frame waits for the maps of light fields that it needs, where a budget leaves some out, and for its
        mix of light groups. Else the nearest maps stand in, the mix comes part by part, and `light_version` and
        `mixer.version` grow when more is ready.
    missing : tuple of str
        What the store lacks, in plain words.
    """

    def __init__(
        self, device: Any, source: Store | BakedScene, beside: Renderer | None = None, kin: Renderer | None = None
    ) -> None:
        """`beside` draws the same scene on the same device already: what stays on the GPU is shared with it.

        Of `kin`, only what no edit changes: this renderer has light of its own.
        """
        self.device = device
        self.scene = source if isinstance(source, BakedScene) else read_baked(source)
        self.missing = self.scene.missing
        shared = beside or kin
        self._layouts: Layouts = shared._layouts if shared else Layouts(device)
        layouts, scene = self._layouts, self.scene
        self.resources: SceneResources = (
            beside.resources if beside else SceneResources(layouts, self.scene, kin.resources if kin else None)
        )
        self._clusters: Clusters = (
            shared._clusters if shared else Clusters(scene.positions, scene.faces, scene.record.objects)
        )
        self.streaming: Streaming = beside.streaming if beside else Streaming(scene, self.resources.objects)
        self.mixer: LightMixer = beside.mixer if beside else LightMixer(layouts, scene, self.resources)
        self.waits, self.reflector_faces = True, ReflectorFaces(scene)
        depth, base = DepthPass(layouts), BasePass(layouts)
        self.planar = planar = PlanarPass(layouts, depth)
        light = LightPass(layouts, planar.reflections)
        display = TonemapPass(layouts), SmoothPass(layouts)
        self.cover, self.accumulate = CoverPass(layouts, depth, light), AccumulatePass(layouts)
        self._passes: tuple[Pass, ...] = (
            depth, SunPass(layouts), planar, base, light, self.cover, self.accumulate,
            *display,
        )  # fmt: skip
        self._targets, self._timer = Targets(device), PassTimer(device)
        self._frame_buffer = layouts.uniform(FRAME_DTYPE.itemsize)
        self._frame_group = layouts.group(layouts.frame, self._frame_buffer, self.resources.sampler)
        self._done = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC | wgpu.BufferUsage.COPY_DST)
        self._few: Any = None  # radiance of the last displayed frame of few samples
        self._few_state: FrameState | None = None
        self._counts: dict[str, Any] = {}

    def draw(self, state: FrameState, target_view: Any = None) -> Any:
        """Draw a frame; returns the texture of linear radiance that it left.

        With `target_view` (of a texture of the state's size and of `DISPLAY_FORMAT`) the frame is also shown there,
        encoded and smoothed. Returns before the GPU is done: see `finish`.
        """
        started = time.perf_counter()
        encoder, commands = self.device.create_command_encoder(), Commands()
        radiance = self.frame(state, commands, target_view)
        commands.encode(encoder)
        self._timer.resolve(encoder)
        self.device.queue.submit([encoder.finish()])
        self._counts["encode_ms"] = (time.perf_counter() - started) * 1e3
        return radiance

    def frame(self, state: FrameState, commands: Commands, target_view: Any = None, *, whole: bool = False) -> Any:
        """Write the passes of a frame into `commands`; returns the texture of linear radiance that they leave.

        `whole`: for other cameras, with the faces out of view and all mirrored views.
        """
        context = self._frame_context(commands, state, target_view, whole)
        self._encode(context)
        return context.radiance

    @property
    def clusters(self) -> Clusters:
        """What is seen of the scene."""
        return self._clusters

    @property
    def frame_buffer(self) -> Any:
        """The buffer of the record that all passes of a frame read (FRAME_DTYPE)."""
        return self._frame_buffer

    def target(self, name: str, size: tuple[int, int]) -> Any:
        """The texture of a display image, of (width, height)."""
        return self._targets.display(name, size)

    @property
    def light_version(self) -> int:
        """Grows with every change of light and maps: of another one a picture is another picture."""
        return self.streaming.version + self.resources.light_version

    def outline(self) -> Outline:
        """What draws outlines of the scene's objects."""
        return Outline(self._layouts, self.resources, self._clusters)

    def discs(self) -> Discs:
        """What draws discs at places in the scene."""
        return Discs(self._layouts, self.resources, self._clusters)

    def uploaded_picture(self) -> UploadedPicture:
        """What shows radiance that was made elsewhere as frames show theirs."""
        return UploadedPicture(self._layouts, self.resources)

    def base(self, radiance: Any, state: FrameState) -> None:
        """Draw the next frame with `FrameState.over` over a texture (rgba16float) of radiance that shows a state."""
        self._few, self._few_state = radiance, state

    def redrawn(self, state: FrameState) -> frozenset[str] | None:
        """Materials whose objects alone a frame would draw with `FrameState.over`; None where it is drawn whole."""
        before = self._few_state
        if before is None or replace(state, **_redrawable(before)) != replace(before, over=state.over):
            return None
        if panes_of(before, self.resources) or panes_of(state, self.resources):
            return None  # laid over what may be drawn anew
        materials = self.scene.record.materials
        return frozenset(
            name
            for name in materials
            if state.materials.get(name, materials[name]) != before.materials.get(name, materials[name])
        )

    def finish(self) -> None:
        """Return when the GPU is done with all frames."""
        self.device.queue.read_buffer(self._done)

    def image(self, state: FrameState) -> Floats:
        """Linear radiance (height, width, 3) float32, row 0 on top."""
        return self.in_units(pixels(self.device, self.draw(state)), state)

    def in_units(self, texels: NDArray[Any], state: FrameState) -> NDArray[np.float32]:
        """W/(sr m^2), or what else the state shows, of texels of the texture of radiance that `draw` left."""
        return np.asarray(texels, np.float32) * np.float32(self._unit(state))

    def _unit(self, state: FrameState) -> float:
        return 1.0 if state.show == LIGHT_MAP_NOISE else self.scene.unit

    def display_image(self, state: FrameState) -> NDArray[np.uint8]:
        """(height, width, 3) uint8 after exposure, view transform and sRGB encoding, row 0 on top."""
        state.check()  # before a texture of a size that cannot be is made
        image = self._targets.display("display", state.size)
        self.draw(state, image.create_view())
        return pixels(self.device, image)

    def still(self, state: FrameState, supersamples: int = SUPERSAMPLES) -> NDArray[np.uint8]:
        """`display_image` from `supersamples` frames that look at other places of each pixel.

        The mean is that of the light a display would emit: after the view transform, so that edges against a lamp are
        smooth, and before the encoding, so that half a pixel of white is half as bright.
        """
        emitted = srgb_decode(np.arange(256, dtype=np.float32) / 255)
        mean = _mean(emitted[self.display_image(part)] for part in _subframes(state, supersamples))
        return to_bytes(srgb_encode(mean))

    def still_radiance(self, state: FrameState, supersamples: int = SUPERSAMPLES) -> Floats:
        """`image`, the mean over each pixel, from `supersamples` frames that look at other places of it."""
        return _mean(self.image(part) for part in _subframes(state, supersamples))

    def converged(self, state: FrameState, spp: int, progress: Progress = silent) -> Floats:
        """Linear radiance (height, width, 3) of at least `spp` unfiltered samples per pixel and lobe.

        By the state's integrator, if it is progressive, else by `qmc`.
        """
        if not integrator(state.integrator).progressive:
            state = replace(state, integrator="qmc")
        per_frame = state.n or QMC_N
        frames = max(1, -(-spp // per_frame))
        radiance = None
        for index in range(frames):
            radiance = self.draw(replace(state, accumulate=index))
            if index % 16 == 15:
                self.finish()
                progress((index + 1) * per_frame, frames * per_frame, "samples per pixel")
        return self.in_units(pixels(self.device, radiance), state)

    @property
    def statistics(self) -> dict[str, Any]:
        """Of the last frame: gpu_ms per pass (empty without timestamps), draw calls, triangles, samples, encode_ms.

        Waits for the GPU.
        """
        return {**self._counts, "gpu_ms": self._timer.read()}

    def _encode(self, context: FrameContext) -> None:
        """Encode all passes of a frame."""
        for one in self._passes:
            one.encode(context)
        if context.is_passing:
            self._few, self._few_state = context.radiance, context.state
        self._counts = {
            "integrator": context.state.integrator,
            "width": context.state.width,
            "height": context.state.height,
            "draw_calls": context.counts["draw_calls"],
            "mirrors": len(context.views),
            "triangles": len(self.scene.faces),
            "light_fields": self.streaming.statistics,
            "samples_per_pixel": max((d.n * d.lobes for d in context.draws if d.integrator.specular), default=0),
        }

    def _frame_context(self, encoder: Any, state: FrameState, target_view: Any, whole: bool = False) -> FrameContext:
        """A frame before its first pass."""
        state.check()
        data = frame_data(state, self.scene.record.bounds)
        for factor in (data["exposure"], data["scale"][3:]):  # light is in the scene's units
            factor *= self._unit(state)
        self.device.queue.write_buffer(self._frame_buffer, 0, data.tobytes())
        self.mixer.follow(state.light, waits=self.waits)
        panes = panes_of(state, self.resources)
        views = self._planar_views(state, data, whole)
        reflecting = {part.object for view in views for part in view.reflector.parts}
        draws = draws_of(state, self.resources, reflecting, panes)
        self.streaming.follow(draws, data, waits=self.waits)
        passing = target_view is not None and state.accumulate is None  # seen once, so half floats do
        halves = (
            passing or whole or self.resources.mixes_parts or panes
        )  # single precision cannot be blended everywhere
        target = self._targets.fit(state.size, "rgba16float" if halves else "rgba32float", passing=passing)
        context = FrameContext(
            encoder, state, data, self._frame_group, self.resources, self._clusters, self._targets, self._timer, target,
            [draw for draw in draws if not draw.is_pane], [draw for draw in draws if draw.is_pane], views, Counter(),
            shown=target_view, whole=whole,
        )  # fmt: skip
        if passing and state.over:
            context.base, context.redrawn = self._few, self.redrawn(state)
        return context

    def reflectors(self, state: FrameState) -> list[int]:
        """Numbers of the scene's reflectors that a frame may mirror; those of clear glass have their probes."""
        if planar_integrator(state.integrator, state.planar) is None or not SHOW[state.show][1]:
            return []
        panes = panes_of(state, self.resources)
        return [k for k, r in enumerate(self.scene.record.reflectors) if any(p.object not in panes for p in r.parts)]

    def widest(self, state: FrameState) -> dict[str, float]:
        """The largest m of each object's lobes, by its name."""
        record, shown = self.scene.record, {**self.scene.record.materials, **state.materials}
        return {
            o.name: max((max(widths(lobe)) for lobe in shown[o.material].lobes if not lobe.retro), default=0.0)
            for o in record.objects
        }

    def _planar_views(self, state: FrameState, data: Record, whole: bool) -> list[PlanarView]:
        """Mirrored views of the planar reflectors that have a buffer in this frame."""
        wanted = self.reflectors(state)
        reflectors = [self.scene.record.reflectors[k] for k in wanted]
        if whole:
            return views_of_any_camera(data, reflectors, state.size)
        if not wanted:
            return []
        shares, widest = self.reflector_faces.shares(data)[np.array(wanted)], self.widest(state)
        return planar_views(data, reflectors, state.width, state.height, MOST_REFLECTORS, widest, shares)


def _subframes(state: FrameState, count: int) -> Iterator[FrameState]:
    if count < 1:
        raise UserError("a still needs at least one frame", field="supersamples", got=count)
    places = hammersley(count)
    for x, y in (places - places.mean(axis=0)).tolist():
        yield replace(state, accumulate=None, antialias=False, jitter_px=(x, y))


def _redrawable(state: FrameState) -> dict[str, Any]:
    """The fields in which a frame may differ from one that it is drawn over."""
    return {name: getattr(state, name) for name in ("materials", "planar", "width", "height")}


def _mean(images: Iterable[Floats]) -> Floats:
    total: Floats = np.zeros((), np.float32)
    count = 0
    for image in images:
        count, total = count + 1, total + image
    return np.asarray(total / np.float32(count))
