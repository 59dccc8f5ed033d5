"""Images of a store by any renderer: their settings, and the display of radiance."""

from __future__ import annotations

import logging
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.light_fields.map_cache import LEAST_RECENT
from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.colour import shown
from lambent.core.light.exposure import ev100_of, metered
from lambent.core.light.false_colour import Range, false_colour, fitting_range, with_scale
from lambent.core.light.light_mix import MixTrack
from lambent.core.light.photometry import LUMINANCE, Quantity, photometric
from lambent.core.pictures.images import to_bytes
from lambent.core.plain import Triple
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.core.views.projections import Projection, View
from lambent.realtime.frame_state import check_shown
from lambent.realtime.integrators.integrators import INTEGRATORS
from lambent.scenes.looks.look_track import LookTrack
from lambent.scenes.replacement import Replacement
from lambent.scenes.scene import Variant

TRACED, PATH_TRACER = "traced", "path"
DRAWN = "lamps"  # the integrator of pictures that cannot be traced
LEAST_NOISE = 1e-4
FALSE_COLOUR, NOISE = "false-colour", "noise"
ANYWHERE = Camera("anywhere", (0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
log = logging.getLogger(__name__)
DARK_EV100 = -2.5  # below this, a metered picture may show nothing but light leaks from outside
MOST_EV = 64  # largest exposure in stops, up or down; 2^64 fits into float32
VIEWS = ("filmic", "neutral", "linear", FALSE_COLOUR)


@dataclass(frozen=True)
class Settings:
    """How images are rendered. Errors name the matching options of `lambent render`.

    Attributes
    ----------
    width, height : int
        Pixels.
    integrator : str
        "traced" against the baked light, "path" for whole paths, or one of
        `realtime.integrators.integrators.INTEGRATORS`, which draw.
    samples : int, optional
        Per pixel for converging integrators ("traced": as many as `noise` needs, in a film 8, "path": 64, "qmc": 256),
        otherwise per lobe (by default chosen from each material's roughness).
    noise : float, optional
        For traced pictures: the relative standard error (`traced.picture.TracedPicture.noise`) that ends them. By
        default a still ends at .02 or at 48 samples.
    denoise : bool, optional
        For traced pictures: by default "traced" ones are denoised, "path" ones are not.
    exposure_ev : float, optional
        Stops, -64 to 64, for displayed images; by default the scene's, else metered from the first image
        (`core.light.exposure.metered`) and kept for the rest.
    view : str
        View transform of displayed images, one of `VIEWS`; "false-colour" shows luminance in cd/m^2.
    scale : Range, optional
        Range of false colours, in the unit of the shown quantity; by default fitted to the first image and kept for the
        rest.
    log : bool
        Whether a fitted scale is logarithmic.
    show : str
        Part of the light: full, diffuse, specular, light-map (irradiance in lx), or noise, the light map's relative
        standard error in percent, always in false colours.
    planar : str
        Method for planar reflectors: auto, off (from their probes), or a method of the integrator.
    lookup : str
        Source of light for reflected rays: auto, or a look-up of `realtime.incident`.
    projection : Projection
        Perspective, or a projection resampled from the faces of a cube around the eye.
    light_field_mb : float, optional
        GPU memory for the maps of light fields, MB; by default enough for all maps.
    light : MixTrack, optional
        Mix of the store's light groups over the time of a film; by default the mix saved with the view or walk, else as
        baked.
    light_field_cache : str
        Eviction policy if not all maps fit: least-recent or adaptive (`baked.light_fields.map_cache`).
    sky_turn_deg : float
        Rotation of the sky about the vertical, -360 to 360, from -z towards -x (`realtime.sun.turned_sky`).
    field_deg : float, optional
        Field of view across the width of a fisheye or cylinder, degrees; 180 and 360 by default.
    seed : int
        For the path tracer, 0 or more: different seeds have independent noise.
    recolour : mapping
        Diffuse colour, linear RGB, by material; indirect light follows (`realtime.answering.answering`).
    textures : mapping
        Texture that a material shows instead of its own: an image file, another material, or none, as
        `scenes.looks.retexturing` parses it. Its mean becomes the diffuse colour, unless `recolour` has one; light
        follows.
    variant : str
        Name of a variant of the store (`store.kept.states`): its materials, overridden by `recolour` and `textures`,
        and its light mix, unless `light` has one. Indirect light follows.
    looks : LookTrack, optional
        Looks of materials over the time of a film, overriding the variant's; indirect light follows.
    lookups, near_m : mapping, float, optional
        For drawn pictures: look-ups of single objects by name, and the near clipping distance.
    follows : bool
        Whether light of other surfaces follows changed materials.
    rebaked : bool
        For traced pictures: take the light of the copy in which the window has baked its edits again.
    replacements : tuple of Replacement
        Meshes that replace objects with light fields of their volume (`realtime.objects.replaced`).
    """

    width: int = 1280
    height: int = 720
    integrator: str = TRACED
    samples: int | None = None
    noise: float | None = None
    denoise: bool | None = None
    exposure_ev: float | None = None
    view: str = "filmic"
    scale: Range | None = None
    log: bool = True
    show: str = "full"
    planar: str = "auto"
    lookup: str = "auto"
    projection: Projection = Projection.perspective
    field_deg: float | None = None
    light_field_mb: float | None = None
    seed: int = 0
    light: MixTrack | None = None
    sky_turn_deg: float = 0.0
    light_field_cache: str = LEAST_RECENT
    recolour: Mapping[str, Triple] = field(default_factory=dict)
    textures: Mapping[str, str] = field(default_factory=dict)
    variant: str = ""
    looks: LookTrack | None = None
    lookups: Mapping[str, str] = field(default_factory=dict)
    near_m: float | None = None
    follows: bool = True
    rebaked: bool = False
    replacements: tuple[Replacement, ...] = ()

    @property
    def changes_materials(self) -> bool:
        """Whether materials differ from the baked ones."""
        return bool(self.recolour or self.textures or self.variant or self.looks)

    @property
    def is_traced(self) -> bool:
        """Whether images are traced, not drawn."""
        return self.integrator in (TRACED, PATH_TRACER)

    @property
    def denoises(self) -> bool:
        """Whether traced images are denoised."""
        return self.integrator == TRACED if self.denoise is None else self.denoise

    @property
    def is_false_coloured(self) -> bool:
        """Whether displayed images are in false colours."""
        return self.view == FALSE_COLOUR or self.show == NOISE

    def view_of(self, camera: Camera) -> View:
        """The projected view of a camera."""
        return View.of(camera, self.projection, self.width, self.height, self.field_deg)

    def check(self) -> None:
        """Raise `UserError` for an impossible value, or an option that the integrator does not have.

        Renderers check the rest.
        """
        known("integrator", self.integrator, (TRACED, PATH_TRACER, *INTEGRATORS), field="--integrator")
        if self.projection is Projection.perspective:
            check_shown(self.show, self.width, self.height)
        if self.integrator == PATH_TRACER and self.show != "full":
            raise UserError("the path tracer shows all light", field="--show", got=self.show, expected="full")
        for option, method in (("--planar", self.planar), ("--lookup", self.lookup)):
            if self.is_traced and method != "auto":
                hint = "add --integrator lamps"
                raise UserError("applies to drawn pictures only", field=option, got=method, expected="auto", hint=hint)
        known("view transform", self.view, VIEWS, field="--view")
        if self.scale is not None:
            self.scale.check()
        if self.exposure_ev is not None and not -MOST_EV <= self.exposure_ev <= MOST_EV:  # also refuses nan
            got, expected = self.exposure_ev, f"-{MOST_EV} to {MOST_EV} EV"
            raise UserError("is out of range", field="--exposure", got=got, expected=expected)
        for option, value in (("--noise", self.noise), ("--denoise", self.denoise)):
            if value is not None and not self.is_traced:
                hint = "leave it out, or choose traced or path"
                raise UserError("applies to traced pictures only", field=option, got=self.integrator, hint=hint)
        if self.noise is not None:
            if not LEAST_NOISE <= self.noise <= 1:  # also refuses nan
                raise UserError("is out of range", field="--noise", got=self.noise, expected=f"{LEAST_NOISE:g} to 1")
            if self.samples is not None:
                raise UserError("excludes --samples", field="--noise", hint="leave out one")
        if not -360 <= self.sky_turn_deg <= 360:  # also refuses nan
            got, expected = self.sky_turn_deg, "-360 to 360 degrees"
            raise UserError("is out of range", field="--sky-turn", got=got, expected=expected)
        if self.projection is not Projection.perspective:
            self.view_of(ANYWHERE).check()
        elif self.field_deg is not None:
            raise UserError(
                "applies to fisheyes and cylinders only", field="--field", hint="a camera has its own field of view"
            )


class Images(ABC):
    """Images of a store; false colours show `quantity`."""

    quantity: Quantity = LUMINANCE
    time_s: float = 0.0  # time within the film of the next image
    keeps: bool = False  # whether an interrupted image counts, as it is; `interrupted` then tells
    interrupted: bool = False
    samples: int | None = None  # of each pixel of the last image, if it was traced
    noise: float | None = None  # its relative standard error, if that ended it

    def __init__(self, settings: Settings) -> None:
        self.settings, self.scale = settings, settings.scale  # None until an image in false colours was displayed
        self.exposure_ev = settings.exposure_ev  # None until an image was displayed

    @property
    def light_fields(self) -> dict[str, Any]:
        """`realtime.light_fields.streaming.Streaming.statistics` of light fields with a memory budget, else empty."""
        return {}

    def apply_variant(self, variant: Variant) -> None:
        """Show a variant from the next image on; a light mix of the settings overrides the variant's.

        Raises
        ------
        UserError
            If the renderer supports one state of materials only.
        """
        raise UserError("excludes --edit", field="--variants")

    @abstractmethod
    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        """Linear radiance (height, width, 3) float32, row 0 on top."""

    def displayed(self, camera: Camera, progress: Progress = silent) -> NDArray[np.uint8]:
        """Display-encoded image (height, width, 3) uint8: after exposure and view transform, or in false colours."""
        radiance = self.radiance(camera, progress)
        if not self.settings.is_false_coloured:
            return to_bytes(shown(radiance, self.settings.view, self.exposed(radiance)))
        values = photometric(radiance, self.quantity)
        self.scale = self.scale or fitting_range(values, log=self.settings.log)
        return with_scale(to_bytes(false_colour(values, self.scale)), self.scale, self.quantity.unit)

    def exposed(self, radiance: Floats) -> float:
        """Exposure of displayed images, EV; metered from `radiance` on first use if none is set."""
        if self.exposure_ev is None:
            found = metered(radiance)
            if found is None:
                log.warning("no light reaches this view: its picture is black")
            elif ev100_of(found) < DARK_EV100:
                log.warning(
                    "hardly any light reaches this view (metered at EV100 %.1f, darker than by moonlight): what it "
                    "shows may have slipped in along joints",
                    ev100_of(found),
                )
            self.exposure_ev = found or 0.0
        return self.exposure_ev
