"""The state of a frame: all its inputs besides the store, their allowed values, and the record that shaders read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.geometry.sequences import radical_inverse
from lambent.core.light.false_colour import Range
from lambent.core.light.light_mix import Factors
from lambent.core.light.photometry import ILLUMINANCE, LUMINANCE, NOISE, Quantity
from lambent.core.views.camera import Camera, clip_from_world, image_plane
from lambent.materials.document import Material
from lambent.realtime.gpu.structs import FRAME_DTYPE, Record
from lambent.realtime.integrators.integrators import integrator
from lambent.realtime.integrators.patterns import N_MAX, automatic_n
from lambent.realtime.planar.planar_integrators import AUTO, MOST_SHARED, TILE, planar_integrator

LIGHT_MAP = "light-map"  # irradiance in place of radiance
LIGHT_MAP_NOISE = "noise"  # relative standard error of the irradiance before denoising
# Weights of diffuse, specular, sky, light map.
SHOW = {
    "full": (1, 1, 1, 0), "diffuse": (1, 0, 0, 0), "specular": (0, 1, 0, 0),
    LIGHT_MAP: (0, 0, 0, 1), LIGHT_MAP_NOISE: (0, 0, 0, 1),
}  # fmt: skip
QUANTITIES = {LIGHT_MAP: ILLUMINANCE, LIGHT_MAP_NOISE: NOISE}  # shown quantity; luminance for all others
FALSE_COLOUR = "false-colour"
VIEW_TRANSFORMS = {FALSE_COLOUR: 3, "linear": 0, "neutral": 1, "filmic": 2}  # as tonemap.wgsl numbers them
MOST_PX = 8192  # of a texture, by WebGPU's default limits
QMC_N = 8  # samples per pixel, lobe and frame of the progressive mode


def check_shown(show: str, width: int, height: int) -> None:
    """Raise `UserError` for an unknown part of the light, or a picture size out of range."""
    known("part of the light", show, SHOW)
    if not (0 < width <= MOST_PX and 0 < height <= MOST_PX):
        got, expected = f"{width}x{height}", f"1x1 to {MOST_PX}x{MOST_PX}"
        raise UserError("picture size is out of range", got=got, expected=expected)


@dataclass(frozen=True)
class FrameState:
    """All that a frame depends on besides the store.

    Attributes
    ----------
    camera : Camera
    width, height : int
        Pixels.
    integrator : str
        A name of `integrators.INTEGRATORS`.
    n : int, optional
        Samples per lobe, 1 to 64; by default chosen per material from its roughness.
    exposure_ev : float
        Radiance is multiplied by 2^exposure_ev before the view transform, in the display image only.
    view_transform : str
        filmic, neutral, linear, or false-colour: luminance in colours of `scale`.
    scale : false_colour.Range
        Range of the false colours, in the unit of `quantity_of(show)`.
    near_m : float, optional
        Near plane; by default a ten-thousandth of the scene's size.
    materials : mapping
        Materials, by name, that replace the store's.
    maps : int
        `Renderer.light_version`: the picture changes with the light and with the loaded maps of light fields.
    light : mapping
        Factors of light groups, by name and channel; groups left out are as baked.
    mixed : int
        `LightMixer.version`: the picture changes when more of a mix is ready.
    lookup : str
        Method to find the light of a direction in a probe: auto, or a look-up of `realtime.incident`.
    lookups : mapping
        The same for single objects, by name.
    planar : str
        Whether planar reflectors are mirrored: auto, or off (drawn from their probes).
    show : str
        full, diffuse, specular, light-map (irradiance, W/m^2), or noise (relative standard error of the irradiance,
        always in false colours).
    accumulate : int, optional
        Index of the frame in a progressive series: it is averaged into the frames 0 ... index - 1 before it.
    antialias : bool
        Blend edges of the display image; when accumulating, jitter the frames instead.
    covers : bool
        Average each pixel of a frame in motion over five places, so that thin geometry stays whole. In software this
        takes 1.45 times as long for a frame of an interior.
    over : bool
        Draw over the last displayed frame of few samples, and draw only objects whose materials have changed since. If
        anything else has changed, except the size or planar reflections, the frame is drawn whole.
    jitter_px : tuple of float
        Offset of the shaded point from each pixel's centre, right and down, within (-.5, .5).
    """

    camera: Camera
    width: int = 1680
    height: int = 1050
    integrator: str = "lamps"
    n: int | None = None
    exposure_ev: float = 0.0
    view_transform: str = "filmic"
    scale: Range = field(default_factory=Range)
    near_m: float | None = None
    materials: Mapping[str, Material] = field(default_factory=dict)
    maps: int = 0
    light: Factors = field(default_factory=dict)
    mixed: int = 0
    lookup: str = "auto"
    lookups: Mapping[str, str] = field(default_factory=dict)
    planar: str = AUTO
    show: str = "full"
    accumulate: int | None = None
    antialias: bool = True
    covers: bool = False
    over: bool = False
    jitter_px: tuple[float, float] = (0.0, 0.0)

    def check(self) -> None:
        """Raise `UserError` for an invalid value. Names of look-ups are checked later, when objects are drawn."""
        integrator(self.integrator)
        planar_integrator(self.integrator, self.planar)
        if self.n is not None and not 1 <= self.n <= N_MAX:
            raise UserError("sample count is out of range", field="n", got=self.n, expected=f"1 to {N_MAX}")
        known("view transform", self.view_transform, reversed(VIEW_TRANSFORMS))
        if self.is_false_coloured:
            self.scale.check()
        check_shown(self.show, self.width, self.height)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self.width, self.height

    @property
    def is_false_coloured(self) -> bool:
        """Whether the display image is in false colours."""
        return self.view_transform == FALSE_COLOUR or self.show == LIGHT_MAP_NOISE

    @property
    def is_smoothed(self) -> bool:
        """Whether edges of the display image are blended if it comes from one frame."""
        return self.antialias and not self.is_false_coloured

    def samples(self, material: Material, roughness: float = 1.0, without_lamps: bool = False) -> int:
        """Samples per lobe of a material in this frame; `roughness` is a factor on the document's roughness.

        `without_lamps`: the sampled cube map holds no lamps.
        """
        if integrator(self.integrator).progressive:
            return self.n or QMC_N
        return self.n or automatic_n(material, roughness, without_lamps)

    def planar_samples(self, material: Material, roughness: float = 1.0) -> int:
        """`samples` on planar reflectors, where neighbouring pixels share a lobe's samples."""
        n = self.samples(material, roughness)
        return min(n, MOST_SHARED) if self.n is None else n


def quantity_of(show: str) -> Quantity:
    """Quantity and unit of an image of `show`."""
    return QUANTITIES.get(show, LUMINANCE)


def near_of(bounds: ArrayLike) -> float:
    """Near plane, m, of a scene with the box `bounds` (2, 3), m: a ten-thousandth of its size, within limits."""
    low, high = np.asarray(bounds)
    return float(np.clip(1e-4 * np.linalg.norm(high - low), 1e-3, 0.1))


def frame_data(state: FrameState, bounds: ArrayLike) -> Record:
    """Record of FRAME_DTYPE; `bounds` (2, 3) is the box of the scene, m."""
    camera, width, height = state.camera, state.width, state.height
    jitter, turn = state.jitter_px, state.jitter_px[0] + 0.5
    if state.accumulate is not None:
        index = np.array([state.accumulate + 1])
        turn = float(radical_inverse(index, 2)[0])
        if state.antialias:
            jitter = (turn - 0.5, float(radical_inverse(index, 3)[0]) - 0.5)
    near_m = state.near_m or near_of(bounds)
    across, up, forward = image_plane(camera, width, height)
    data = np.zeros((), FRAME_DTYPE)
    data["clip_from_world"] = clip_from_world(camera, width, height, near_m, jitter).T  # WGSL stores columns
    data["eye"][:3], data["across"][:3], data["up"][:3] = camera.position, across, up
    data["forward"][:3] = forward + across * (2 * jitter[0] / width) - up * (2 * jitter[1] / height)
    data["eye"][3] = np.floor(turn * TILE) % TILE
    data["show"] = SHOW[state.show]
    data["scale"] = (state.scale.low, state.scale.high, state.scale.log, quantity_of(state.show).per_y)
    data["first_sample"] = (state.accumulate or 0) * (state.n or QMC_N)
    data["view_transform"] = VIEW_TRANSFORMS[FALSE_COLOUR if state.is_false_coloured else state.view_transform]
    data["exposure"] = 2.0**state.exposure_ev
    return data
