"""One frame: state in, image out. The window and the headless commands run this same code.

renderer = Renderer(open_device(), store)
picture = renderer.display_image(FrameState(camera, 1680, 1050))
"""

from __future__ import annotations

import time
from collections.abc import Generator, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import wgpu
from numpy.typing import NDArray

from lambent.core.camera import Camera, clip_from_world, image_plane
from lambent.core.colour import srgb_decode, srgb_encode
from lambent.core.errors import UserError, did_you_mean
from lambent.core.false_colour import Range
from lambent.core.images import to_bytes
from lambent.core.photometry import ILLUMINANCE, LUMINANCE, NOISE, Quantity
from lambent.core.progress import Progress, silent
from lambent.core.sequences import hammersley, radical_inverse
from lambent.materials.document import Material
from lambent.realtime.baked import BakedScene, read_baked
from lambent.realtime.clusters import Clusters
from lambent.realtime.frame_data import FRAME_DTYPE
from lambent.realtime.integrators import INTEGRATORS, integrator
from lambent.realtime.mirror import MirrorView, mirror_views
from lambent.realtime.mirror_integrators import AUTO, TILE, planar_integrator
from lambent.realtime.parts import Cut, Steps, Whole
from lambent.realtime.passes.accumulate import AccumulatePass
from lambent.realtime.passes.depth import DepthPass
from lambent.realtime.passes.planar import MOST_MIRRORS, PlanarPass
from lambent.realtime.passes.shade import FRINGE, Draw, ShadePass
from lambent.realtime.passes.sky import SkyPass
from lambent.realtime.passes.smooth import SmoothPass
from lambent.realtime.passes.tonemap import FALSE_COLOUR, VIEW_TRANSFORMS, TonemapPass
from lambent.realtime.patterns import N_MAX, automatic_n
from lambent.realtime.resources import Layouts, SceneResources
from lambent.realtime.targets import PassTimer, Targets
from lambent.realtime.textures import bits_that_show
from lambent.store.store import Store

Floats = NDArray[np.float32]
LIGHT_MAP = "light-map"  # irradiance, in the place of radiance
LIGHT_MAP_NOISE = "noise"  # its relative standard error before it was denoised
# Weights of diffuse, specular, sky, what the light map holds.
SHOW = {
    "full": (1, 1, 1, 0), "diffuse": (1, 0, 0, 0), "specular": (0, 1, 0, 0),
    LIGHT_MAP: (0, 0, 0, 1), LIGHT_MAP_NOISE: (0, 0, 0, 1),
}  # fmt: skip
QUANTITIES = {LIGHT_MAP: ILLUMINANCE, LIGHT_MAP_NOISE: NOISE}  # of what is shown; of everything else luminance
QMC_N = 8  # samples per pixel, lobe and frame of the progressive mode
SMOOTH_PRIOR = 0.5  # share of the prior from which edges are those of one frame, and so are blended
SUPERSAMPLES = 16  # frames of a still: below, thin lines come out dotted


@dataclass(frozen=True)
class FrameState:
    """All that a frame depends on besides the store.

    Attributes
    ----------
    camera : Camera
        Or anything with its fields.
    width, height : int
        Pixels.
    integrator : str
        A name of `integrators.INTEGRATORS`.
    n : int, optional
        Samples per lobe, 1 to 64; by default chosen per material from its roughness.
    exposure_ev : float
        Radiance is multiplied by 2^exposure_ev before the view transform; only the display image knows it.
    view_transform : str
        filmic, neutral, linear, or false-colour: luminance in colours of `scale`.
    scale : false_colour.Range
        What the false colours mean, in the unit of `quantity_of(show)`.
    near_m : float, optional
        Nearer things are cut away; by default a ten-thousandth of the scene's size.
    materials : mapping
        Materials that stand in for the store's, by name.
    lookup : str
        How a direction finds its light in a probe: auto, plain, planes or distance.
    lookups : mapping
        The same for single objects, by name.
    planar : str
        How planar reflectors are drawn: auto, off (by their probes), or a way of `mirror_integrators`.
    show : str
        full, diffuse, specular, light-map: the irradiance, W/m^2, or noise: its relative standard error, which is
        always in false colours.
    accumulate : int, optional
        Index of the frame in a progressive series: it is averaged into the frames 0 ... index - 1 before it.
    prior : float
        Share, in the display image of a progressive series, of the last picture of few samples that was displayed.
    antialias : bool
        Edges of the display image are blended, or, when accumulating, frames are jittered.
    jitter_px : tuple of float
        Where light is looked up in each pixel: right of and below its centre, within (-.5, .5).
    """

    camera: Camera
    width: int = 1680
    height: int = 1050
    integrator: str = "rings"
    n: int | None = None
    exposure_ev: float = 0.0
    view_transform: str = "filmic"
    scale: Range = field(default_factory=Range)
    near_m: float | None = None
    materials: Mapping[str, Material] = field(default_factory=dict)
    lookup: str = "auto"
    lookups: Mapping[str, str] = field(default_factory=dict)
    planar: str = AUTO
    show: str = "full"
    accumulate: int | None = None
    prior: float = 0.0
    antialias: bool = True
    jitter_px: tuple[float, float] = (0.0, 0.0)

    def check(self) -> None:
        """Raise `UserError` for a value that no frame can have."""
        integrator(self.integrator)
        planar_integrator(self.integrator, self.planar)
        if self.n is not None and not 1 <= self.n <= N_MAX:
            raise UserError("sample count is out of range", field="n", got=self.n, expected=f"1 to {N_MAX}")
        if self.view_transform not in VIEW_TRANSFORMS:
            raise UserError(
                "unknown view transform", got=self.view_transform, expected=", ".join(reversed(VIEW_TRANSFORMS))
            )
        if self.is_false_coloured:
            self.scale.check()
        if self.show not in SHOW:
            hint = did_you_mean(self.show, SHOW)
            raise UserError("unknown part of the light", got=self.show, expected=", ".join(SHOW), hint=hint)
        if not (0 < self.width <= 8192 and 0 < self.height <= 8192):
            size = f"{self.width}x{self.height}"
            raise UserError("picture size is out of range", got=size, expected="1x1 to 8192x8192")

    @property
    def is_false_coloured(self) -> bool:
        """Whether the display image is in false colours."""
        return self.view_transform == FALSE_COLOUR or self.show == LIGHT_MAP_NOISE

    @property
    def is_smoothed(self) -> bool:
        """Whether edges of a single frame are blended: false colours would name numbers that are not there."""
        return self.antialias and not self.is_false_coloured

    def samples(self, material: Material, roughness: float = 1.0) -> int:
        """Samples per lobe of a material in this frame; `roughness` is a factor on that of the document."""
        return self.n or (QMC_N if integrator(self.integrator).progressive else automatic_n(material, roughness))


class Renderer:
    """Draws frames of one baked scene on one device.

    Attributes
    ----------
    scene : BakedScene
    missing : tuple of str
        What the store lacks, in plain words.
    """

    def __init__(self, device: Any, source: Store | BakedScene, beside: Renderer | None = None) -> None:
        """`beside` draws the same scene on the same device already: what stays on the GPU is shared with it."""
        self.device = device
        self.scene = source if isinstance(source, BakedScene) else read_baked(source)
        self.missing = self.scene.missing
        self._layouts = beside._layouts if beside else Layouts(device)
        self.resources = beside.resources if beside else SceneResources(device, self.scene, self._layouts)
        self._clusters = beside._clusters if beside else _clusters(self.scene)
        self._depth = DepthPass(device, self._layouts)
        self._planar = PlanarPass(device, self._layouts, self.resources, self._depth)
        self._shade = ShadePass(device, self._layouts, planar_layout=self._planar.shown_layout)
        self._fringe = ShadePass(device, self._layouts, FRINGE)
        self._sky, self._accumulate = SkyPass(device, self._layouts), AccumulatePass(device)
        self._tonemap = TonemapPass(device, self._layouts)
        self._smooth = SmoothPass(device, self._layouts, self.resources.sampler)
        self._targets, self._timer = Targets(device), PassTimer(device)
        self._frame_buffer = device.create_buffer(
            size=FRAME_DTYPE.itemsize, usage=wgpu.BufferUsage.UNIFORM | wgpu.BufferUsage.COPY_DST
        )
        self._frame_group = self._layouts.group(self._layouts.frame, self._frame_buffer, self.resources.sampler)
        self._done = device.create_buffer(size=4, usage=wgpu.BufferUsage.COPY_SRC | wgpu.BufferUsage.COPY_DST)
        self._few: Any = None  # radiance of the last displayed frame of few samples
        self._counts: dict[str, Any] = {}
        self._gpu_ms: dict[str, float] | None = None  # of a frame in parts
        self._frames = 0  # that were begun

    def draw(self, state: FrameState, target_view: Any = None) -> Any:
        """Draw a frame; returns the texture of linear radiance that it left.

        With `target_view` (of a texture of the state's size and of `DISPLAY_FORMAT`) the frame is also shown there,
        encoded and smoothed. Returns before the GPU is done: see `finish`.
        """
        started = time.perf_counter()
        part, self._gpu_ms = Whole(self.device.create_command_encoder()), None
        steps = self._steps(part, state, target_view)
        while True:
            try:
                next(steps)
            except StopIteration as done:
                radiance = done.value
                break
        self._timer.resolve(part.encoder)
        self.device.queue.submit([part.encoder.finish()])
        self._counts["encode_ms"] = (time.perf_counter() - started) * 1e3
        return radiance

    def parts(self, state: FrameState, target_view: Any, cut: Cut) -> Generator[None, None, Any]:
        """The same frame to the bit, in parts of about `parts.PART_S` seconds, each of which is waited for.

        Generator that yields between parts and returns the texture of radiance. It can be dropped at any time; another
        frame of this renderer ends it with a `RuntimeError`. Until the end `target_view` holds nothing that is to be
        seen, and what `draw` returned before is drawn over where it has this size.
        """
        cut.encoder, times, encode_s = self.device.create_command_encoder(), {}, 0.0
        steps = self._steps(cut, state, target_view)
        frame = self._frames + 1
        while True:
            started = time.perf_counter()
            try:
                next(steps)
            except StopIteration as done:
                self._gpu_ms, self._counts["encode_ms"] = times, encode_s * 1e3
                return done.value
            self._timer.resolve(cut.encoder)
            self.device.queue.submit([cut.encoder.finish()])
            encode_s += time.perf_counter() - started
            self.finish()
            cut.took(time.perf_counter() - started)
            for name, ms in self._timer.read().items():
                times[name] = times.get(name, 0.0) + ms
            cut.encoder = self.device.create_command_encoder()
            yield
            if self._frames != frame:
                raise RuntimeError("another frame was begun by the same renderer")

    def finish(self) -> None:
        """Return when the GPU is done with all frames."""
        self.device.queue.read_buffer(self._done)

    def image(self, state: FrameState) -> Floats:
        """Linear radiance (height, width, 3) float32, row 0 on top."""
        return self._read(self.draw(state), state)

    def display_image(self, state: FrameState) -> NDArray[np.uint8]:
        """(height, width, 3) uint8 after exposure, view transform and sRGB encoding, row 0 on top."""
        state.check()  # before a texture of a size that cannot be is made
        picture = self._targets.picture("display", state.width, state.height)
        self.draw(state, picture.create_view())
        return self._read_pixels(picture, state, np.uint8)

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
        return self._read(radiance, state)

    @property
    def statistics(self) -> dict[str, Any]:
        """Of the last frame: gpu_ms per pass (empty without timestamps), draw calls, triangles, samples, encode_ms.

        Waits for the GPU.
        """
        return {**self._counts, "gpu_ms": self._timer.read() if self._gpu_ms is None else self._gpu_ms}

    def _steps(self, part: Whole | Cut, state: FrameState, target_view: Any) -> Generator[None, None, Any]:
        """Encode a frame, part by part; returns the texture of its radiance."""
        state.check()
        self._frames += 1
        draws = self._draws(state)
        data = self._frame_data(state)
        self.device.queue.write_buffer(self._frame_buffer, 0, data.tobytes())
        views = self._mirror_views(state, data)
        passing = target_view is not None and state.accumulate is None  # seen once, so half floats do
        target = self._targets.fit(state.width, state.height, "rgba16float" if passing else "rgba32float")
        calls = yield from self._encode_light(part, draws, views, data, state, target, passing)
        radiance = target.radiance
        if passing:
            self._few = radiance
        if state.accumulate is not None:
            stamps = self._timer.writes("accumulate")
            radiance = self._accumulate.encode(part.encoder, radiance, state.accumulate, stamps)
            yield
        if target_view is not None:
            yield from self._encode_display(part, state, radiance, target_view)
        self._counts = {
            "integrator": state.integrator,
            "width": state.width,
            "height": state.height,
            "draw_calls": calls,
            "mirrors": len(views),
            "triangles": len(self.scene.faces),
            "samples_per_pixel": max((d.n * d.lobes for d in draws if d.integrator.specular), default=0),
        }
        return radiance

    def _draws(self, state: FrameState) -> list[Draw]:
        """What to draw, with every material's buffers up to date."""
        wanted = INTEGRATORS["diffuse" if SHOW[state.show][3] else state.integrator]
        draws, groups = [], {}
        for name, buffers in self.resources.materials.items():
            material = state.materials.get(name, self.scene.record.materials[name])
            lobes = len(material.lobes) if wanted.specular else 0
            how = wanted if lobes else INTEGRATORS["diffuse"]
            n = how.rows or (state.samples(material, buffers.pictures.rough) if lobes else 1)
            buffers.update(material, how, n)
            anisotropic = any(lobe.mx != lobe.my for lobe in material.lobes)
            bits = bits_that_show(buffers.pictures.bits, lobes, anisotropic)
            groups[name] = (material, how, lobes, n, buffers.group, bits)
        for item in self.resources.objects:
            material, how, lobes, n, group, bits = groups[item.record.material]
            lookup = item.light.lookup(state.lookups.get(item.record.name, state.lookup)) if lobes else "plain"
            draws.append(Draw(item, material, how, lobes, n, lookup, group, bits))
        return draws

    def _mirror_views(self, state: FrameState, data: NDArray[np.void]) -> list[MirrorView]:
        """The planar reflectors that this frame draws a mirror picture for."""
        if planar_integrator(state.integrator, state.planar) is None or not SHOW[state.show][1]:
            return []
        record, shown = self.scene.record, {**self.scene.record.materials, **state.materials}
        widest = {
            o.name: max((max(lobe.mx, lobe.my) for lobe in shown[o.material].lobes), default=0.0)
            for o in record.objects
        }
        return mirror_views(data, record.reflectors, state.width, state.height, MOST_MIRRORS, widest)

    def _frame_data(self, state: FrameState) -> NDArray[np.void]:
        camera, width, height = state.camera, state.width, state.height
        jitter = state.jitter_px
        if state.accumulate is not None and state.antialias:
            index = np.array([state.accumulate + 1])
            jitter = (float(radical_inverse(index, 2)[0]) - 0.5, float(radical_inverse(index, 3)[0]) - 0.5)
        low, high = np.asarray(self.scene.record.bounds)
        near_m = state.near_m or float(np.clip(1e-4 * np.linalg.norm(high - low), 1e-3, 0.1))
        across, up, forward = image_plane(camera, width, height)
        data = np.zeros((), FRAME_DTYPE)
        data["clip_from_world"] = clip_from_world(camera, width, height, near_m, jitter).T  # WGSL stores columns
        data["eye"][:3], data["across"][:3], data["up"][:3] = camera.position, across, up
        data["forward"][:3] = forward + across * (2 * jitter[0] / width) - up * (2 * jitter[1] / height)
        data["eye"][3] = np.floor((jitter[0] + 0.5) * TILE) % TILE
        data["show"] = SHOW[state.show]
        data["scale"] = (state.scale.low, state.scale.high, state.scale.log, quantity_of(state.show).per_y)
        data["first_sample"] = (state.accumulate or 0) * (state.n or QMC_N)
        data["view_transform"] = VIEW_TRANSFORMS[FALSE_COLOUR if state.is_false_coloured else state.view_transform]
        data["prior"] = state.prior
        data["exposure"] = 2.0**state.exposure_ev
        return data

    def _encode_light(
        self,
        part: Whole | Cut,
        draws: list[Draw],
        views: list[MirrorView],
        data: NDArray[np.void],
        state: FrameState,
        target: Any,
        passing: bool,
    ) -> Steps:
        """Encode the passes up to linear radiance; of a `passing` frame the edges of masked surfaces are blended."""
        planar, clip_from_world = planar_integrator(state.integrator, state.planar), data["clip_from_world"].T
        light_group = self.resources.noise_group if state.show == LIGHT_MAP_NOISE else None
        cut_out = {record.name for record in self.resources.cut_out} if passing and state.is_smoothed else set()
        depth = {"view": target.depth.create_view(), "depth_clear_value": 0.0, "depth_store_op": "store"}
        with_depth = {"depth_stencil_attachment": {**depth, "depth_load_op": "clear"}}
        first = part.encoder.begin_render_pass(color_attachments=[], **with_depth, **self._timer.writes("depth"))
        first.set_bind_group(0, self._frame_group)
        calls = self._depth.draw(first, self.resources, self._clusters.seen(clip_from_world), fringed=bool(cut_out))
        first.end()
        yield
        views = views if planar else []
        if views and planar:
            calls += yield from self._planar.encode(
                part, views, draws, planar, self._frame_group, target, self._clusters, clip_from_world, self._timer
            )  # fmt: skip
        for band in part.bands("shade", (state.width, state.height)):
            if isinstance(part, Cut):
                draws = self._draws(state)  # a renderer beside this one may have used the materials' buffers since
            draws = self._planar.marked(views, draws)
            fringes = [draw for draw in draws if draw.item.record.name in cut_out]
            shade = part.encoder.begin_render_pass(
                color_attachments=[
                    {"view": target.radiance.create_view(), "load_op": band.load_op, "store_op": "store"}
                ],
                depth_stencil_attachment={**depth, "depth_load_op": "load"},
                **self._timer.writes("shade"),
            )
            band.cut(shade)
            shade.set_bind_group(0, self._frame_group)
            format, seen = target.radiance.format, self._clusters.seen(clip_from_world, band.shares)
            calls += self._shade.draw(shade, self.resources, draws, seen, format, self._planar.shown_group, light_group)
            calls += self._sky.draw(shade, self.resources, format)
            calls += self._fringe.draw(shade, self.resources, fringes, seen, format, light_group=light_group)
            shade.end()
            yield
        return calls

    def _encode_display(self, part: Whole | Cut, state: FrameState, radiance: Any, target_view: Any) -> Steps:
        prior = self._few if self._has_prior(state, radiance) else None
        alone = state.accumulate is None or (prior is not None and state.prior > SMOOTH_PRIOR)
        smooth = alone and state.is_smoothed
        edged = self._targets.picture("edged", state.width, state.height) if smooth else None
        shown = target_view if edged is None else edged.create_view()
        yield from self._tonemap.encode(part, self._frame_group, (radiance, prior), shown, self._timer)
        if edged is not None:
            yield from self._smooth.encode(part, edged, target_view, self._timer)
        return 0

    def _has_prior(self, state: FrameState, radiance: Any) -> bool:
        there = self._few is not None and self._few.size == radiance.size
        return state.accumulate is not None and state.prior > 0 and there

    def _read(self, radiance: Any, state: FrameState) -> Floats:
        dtype = np.float16 if radiance.format == "rgba16float" else np.float32
        return np.asarray(self._read_pixels(radiance, state, dtype), np.float32)

    def _read_pixels(self, texture: Any, state: FrameState, dtype: Any) -> NDArray[Any]:
        row = state.width * 4 * np.dtype(dtype).itemsize
        size = (state.width, state.height, 1)
        data = self.device.queue.read_texture({"texture": texture}, {"bytes_per_row": row}, size)
        return np.frombuffer(data, dtype).reshape(state.height, state.width, 4)[..., :3]


def quantity_of(show: str) -> Quantity:
    """What the numbers of a picture are that shows this part of the light."""
    return QUANTITIES.get(show, LUMINANCE)


def _clusters(scene: BakedScene) -> Clusters:
    return Clusters(scene.positions, scene.faces, scene.record.objects)


def _subframes(state: FrameState, count: int) -> Iterator[FrameState]:
    if count < 1:
        raise UserError("a still needs at least one frame", field="supersamples", got=count)
    places = hammersley(count)
    for x, y in (places - places.mean(axis=0)).tolist():
        yield replace(state, accumulate=None, antialias=False, jitter_px=(x, y))


def _mean(pictures: Iterable[Floats]) -> Floats:
    count, total = 0, np.float32(0)
    for picture in pictures:
        count, total = count + 1, total + picture
    return np.asarray(total / np.float32(count))
