"""Images by the real-time renderer: the frames that the window draws."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lambent.baked.answering.stored import read_answer
from lambent.core.arrays import Floats
from lambent.core.discovery import known
from lambent.core.errors import UserError
from lambent.core.light.light_mix import WHITE, MixTrack
from lambent.core.progress import Progress, silent
from lambent.core.views.camera import Camera
from lambent.realtime.frame_state import FrameState, quantity_of
from lambent.realtime.gpu.device import open_device
from lambent.realtime.incident import AUTO, look_ups
from lambent.realtime.incident.light_field import check_serves
from lambent.realtime.integrators.integrators import integrator
from lambent.realtime.light.baked import read_baked
from lambent.realtime.light.group_arrays import BAKE_GROUPS, FIELDS_FOLLOW, NO_GROUPS
from lambent.realtime.objects.replaced import with_replacements
from lambent.realtime.planar.planar_integrators import CHOICES as PLANARS
from lambent.realtime.renderer import SUPERSAMPLES, Renderer
from lambent.realtime.sun.turned_sky import under_turned_sky
from lambent.render.applied_materials import AppliedMaterials
from lambent.render.images import NOISE, Images, Settings
from lambent.scenes.lamp_edits import LampEdit
from lambent.scenes.looks.variants import variant_named
from lambent.scenes.scene import Look, Variant
from lambent.store.contract import SIDES, noise_name
from lambent.store.kept.states import lamps_of, variants_of
from lambent.store.store import Store

METERED_PX = 256  # longer side of the picture for metering
QMC_SAMPLES = 256  # per pixel of a still by a progressive integrator
FILM_SUPERSAMPLES = 4  # per pixel in image sequences of radiance


class RealTime(Images):
    """Images by an integrator of `realtime.integrators.integrators`.

    Displayed images of a film (`moving`) are single frames with coverage, as the window shows them in motion; a still
    is the mean of many frames with different subpixel offsets.
    """

    def __init__(self, store: Store, settings: Settings, moving: bool, note: Callable[[str], None]) -> None:
        super().__init__(settings)
        if settings.show == NOISE and noise_name(SIDES[0]) not in store:
            hint = "`lambent bake` of the same scene adds it from the samples that the store keeps"
            raise UserError("the store has no noise of its light map", field="--show", got=NOISE, hint=hint)
        known("way for planar reflectors", settings.planar, PLANARS, field="--planar")
        self._progressive, self._moving = integrator(settings.integrator).progressive, moving
        self.quantity = quantity_of(settings.show)
        self._frame = partial(
            FrameState, width=settings.width, height=settings.height, integrator=settings.integrator,
            n=None if self._progressive else settings.samples,
            view_transform="filmic" if settings.is_false_coloured else settings.view, show=settings.show,
            planar=settings.planar, covers=moving, lookup=settings.lookup, lookups=dict(settings.lookups),
            near_m=settings.near_m,
        )  # fmt: skip
        lookup = known("look-up", settings.lookup, (AUTO, *look_ups()), field="--lookup")
        baked = read_baked(store, settings.light_field_mb, settings.light_field_cache)
        if settings.replacements:
            if settings.changes_materials or settings.light:
                hint = "leave out --recolour, --texture, --variant, --keyframes and --light"
                raise UserError("cannot be combined with --replace", field="--replace", hint=hint)
            baked = with_replacements(baked, settings.replacements)
            note("shadows and reflections of the replaced object remain on other objects")
        baked = under_turned_sky(baked, settings.sky_turn_deg)
        check_serves(baked, lookup, store.folder.name)
        self._renderer = Renderer(open_device(), baked)
        for text in self._renderer.missing:
            note(text)
        self._applied = AppliedMaterials(store, self._renderer, note, follows=settings.follows)
        self._store, self._light = store, settings.light or MixTrack()
        if (settings.recolour or settings.textures) and not self._applied.answers:
            read_answer(store)  # raises the error that names what is missing
        self._check_light(self._light, note)
        self._looks: Mapping[str, Look] = {}
        self._lamps: Mapping[int, LampEdit] = {}
        if settings.variant:
            self._looks = variant_named(variants_of(store), settings.variant).looks
            self._lamps = lamps_of(store, settings.variant)

    def _check_light(self, light: MixTrack, note: Callable[[str], None]) -> None:
        """Raise `UserError` if the store lacks a group of the mix; note light that the mix does not change."""
        scene = self._renderer.scene
        if not light.groups:
            return
        if scene.groups is None:
            raise UserError(NO_GROUPS, field="--light", hint=BAKE_GROUPS)
        scene.groups.factors(dict.fromkeys(light.groups, WHITE))
        if scene.light_fields:
            note(FIELDS_FOLLOW)

    def apply_variant(self, variant: Variant) -> None:
        self._light, self._looks = self.settings.light or MixTrack.of(variant.light), variant.looks
        self._lamps = lamps_of(self._store, variant.name)

    def _state(self, camera: Camera) -> FrameState:
        """State of the next frame, once its materials and light are on the GPU."""
        track = self.settings.looks
        looks = {**self._looks, **(track.looks_at(self.time_s) if track else {})}
        self._applied.apply(looks, self.settings.recolour, self.settings.textures, self._lamps)
        light = self._light.factors_at(self.time_s)
        return self._frame(camera, light=light, materials=self._applied.materials, maps=self._renderer.light_version)

    @property
    def light_fields(self) -> dict[str, Any]:
        return self._renderer.streaming.statistics

    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        if self._progressive:
            return self._renderer.converged(self._state(camera), self.settings.samples or QMC_SAMPLES, progress)
        return self._renderer.still_radiance(self._state(camera), FILM_SUPERSAMPLES if self._moving else SUPERSAMPLES)

    def displayed(self, camera: Camera, progress: Progress = silent) -> NDArray[np.uint8]:
        if self._progressive or self.settings.is_false_coloured:
            return super().displayed(camera, progress)
        draw = self._renderer.display_image if self._moving else self._renderer.still
        frame = self._state(camera)
        exposure_ev = self.exposure_ev
        if exposure_ev is None:
            share = min(1.0, METERED_PX / max(frame.size))
            width, height = (max(1, round(share * size)) for size in frame.size)
            exposure_ev = self.exposed(self._renderer.image(replace(frame, width=width, height=height)))
        return draw(replace(frame, exposure_ev=exposure_ev))
