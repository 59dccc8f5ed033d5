"""Settings of the picture: exposure, view transform, component of light, integrator, samples, look-up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from lambent.core.light.false_colour import Range
from lambent.core.light.photometry import Quantity
from lambent.core.views.camera import Camera
from lambent.materials.document import Material
from lambent.realtime.frame_state import FALSE_COLOUR, LIGHT_MAP_NOISE, SHOW, FrameState, quantity_of
from lambent.realtime.frame_state import VIEW_TRANSFORMS as ALL_TRANSFORMS
from lambent.realtime.incident import AUTO, look_ups
from lambent.realtime.integrators.integrators import INTEGRATORS as ALL_INTEGRATORS
from lambent.realtime.integrators.patterns import RINGS

# Choices of the panels; the first is the default.
INTEGRATORS = tuple(name for name, how in ALL_INTEGRATORS.items() if how.specular)
VIEW_TRANSFORMS = tuple(reversed(ALL_TRANSFORMS))
SHOWS = tuple(SHOW)
LOOKUPS = (AUTO, *look_ups())
SAMPLE_COUNTS = tuple(n for n in RINGS if n <= 19)
MOST_EV = 12.0  # of a slider, up and down
OF_FRAMES = ("exposure_ev", "view_transform", "integrator", "show", "lookup", "planar", "n", "near_m")


@dataclass
class Look:
    """Settings of a `FrameState`, by its names, and of false colours: `noise_scale` is for the noise, in percent."""

    exposure_ev: float = 0.0
    base_ev: float | None = None  # the exposure that steps count from; None: that of the start
    view_transform: str = VIEW_TRANSFORMS[0]
    integrator: str = INTEGRATORS[0]
    show: str = SHOWS[0]
    shows: tuple[str, ...] = SHOWS  # to choose from
    lookup: str = LOOKUPS[0]
    lookups: dict[str, str] = field(default_factory=dict)  # by object, in place of `lookup`
    planar: str = "auto"
    n: int | None = None  # samples per lobe; None: chosen per material from its roughness
    near_m: float | None = None  # near clipping distance; None: by the scene's size
    scale: Range = field(default_factory=Range)
    noise_scale: Range = field(default_factory=lambda: Range(0.5, 50.0))

    def __post_init__(self) -> None:
        self.base_ev = self.exposure_ev if self.base_ev is None else self.base_ev

    def expose(self, exposure_ev: float) -> None:
        """Set the exposure, and count steps from it."""
        self.exposure_ev = self.base_ev = exposure_ev

    @property
    def steps(self) -> float:
        """The exposure in thirds of a stop from where steps count."""
        return 3 * (self.exposure_ev - (self.base_ev or 0.0))

    def step(self, by: int) -> None:
        """Go to the next third of a stop, brighter (1) or darker (-1)."""
        near = math.floor(self.steps + 1e-6) if by > 0 else math.ceil(self.steps - 1e-6)
        exposure_ev = (self.base_ev or 0.0) + (near + by) / 3
        self.exposure_ev = min(max(exposure_ev, -MOST_EV), MOST_EV)

    @property
    def said_exposure(self) -> str:
        """The nearest third of a stop, as "+1 1/3 EV"."""
        whole, part = divmod(abs(round(self.steps)), 3)
        words = [*([str(whole)] if whole or not part else []), *([f"{part}/3"] if part else [])]
        sign = "" if round(self.steps) == 0 else "+" if self.steps > 0 else "-"
        return f"{sign}{' '.join(words)} EV"

    @property
    def quantity(self) -> Quantity:
        """Quantity that the picture shows: luminance, illuminance, or noise."""
        return quantity_of(self.show)

    @property
    def shows_noise(self) -> bool:
        """Whether the picture is the light map's noise, which is in false colours under every view transform."""
        return self.show == LIGHT_MAP_NOISE

    @property
    def is_false_coloured(self) -> bool:
        return self.shows_noise or self.view_transform == FALSE_COLOUR

    @property
    def display_transform(self) -> str:
        """The view transform without false colours, which filmic replaces."""
        return "filmic" if self.view_transform == FALSE_COLOUR else self.view_transform

    @property
    def shown_scale(self) -> Range:
        """The scale of the shown false colours."""
        return self.noise_scale if self.shows_noise else self.scale

    @shown_scale.setter
    def shown_scale(self, scale: Range) -> None:
        if self.shows_noise:
            self.noise_scale = scale
        else:
            self.scale = scale

    def frame(self, camera: Camera, size: tuple[int, int], materials: Mapping[str, Material]) -> FrameState:
        """The frame of `size` (width, height) in pixels with these settings."""
        settings = {name: getattr(self, name) for name in OF_FRAMES}
        scale = self.shown_scale if self.is_false_coloured else Range()
        # A renamed camera gives the same picture.
        return FrameState(
            replace(camera, name=""),
            *size,
            materials=dict(materials),
            scale=scale,
            lookups=dict(self.lookups),
            **settings,
        )
