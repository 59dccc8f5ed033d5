"""Images traced against the baked light, or by whole paths: the reference for all others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from lambent.baked.answering.stored import NO_ANSWER
from lambent.baking.running.again import rebaked_copy
from lambent.core.arrays import Floats
from lambent.core.interruption import is_interruption
from lambent.core.light.light_mix import WHITE, MixTrack
from lambent.core.progress import Cancelled, Progress, silent
from lambent.core.views.camera import Camera
from lambent.render.edits import Edits, edits_of
from lambent.render.images import PATH_TRACER, Images, Settings
from lambent.scenes.lamp_edits import LampEdit, with_lamp_edits
from lambent.scenes.looks.retexturing import materials_without_uv
from lambent.scenes.looks.variants import variant_named
from lambent.scenes.scene import Look, Variant
from lambent.store.kept.states import lamps_of, variants_of
from lambent.store.source import changed_inputs, scene_of
from lambent.store.store import Store
from lambent.traced.picture import TracedPicture
from lambent.traced.room import TracedRoom, room_of_paths, room_of_store

PATHS = 64  # samples of each pixel by whole paths
# Samples in a film's frame; limits of a still, whichever is met first. More gain less than .005 FLIP a doubling.
FILM_SAMPLES, STILL_SAMPLES, NOISE = 8, 48, 0.02
FIRST_ASKED, CHECKED_EVERY = 8, 1.5  # samples before the first estimate of the noise, and growth until the next
MOST_SAMPLES = 4096
# Samples from which denoising is fine. With 8, that takes as long as 4 more samples, which lower FLIP as much or more.
FINE = 16
AS_THE_FILE_IS = (
    "traced with the present lights and surroundings, and the materials of the bake; --scene FILE traces a file with "
    "its own by --integrator path"
)


class TracedImages(Images):
    """Images by `traced`, or by `path`, of a store or, whole paths alone, of the file `scene` in its place."""

    def __init__(
        self, store: Store, settings: Settings, scene: str | None, note: Callable[[str], None], *, moving: bool = False
    ) -> None:
        super().__init__(settings)
        self._limits = limits_of(settings, moving=moving)
        self._path = settings.integrator == PATH_TRACER
        self._note, self._noted = note, set[str]()
        self.scene = scene_of(store, scene)
        if changed := changed_inputs(store, self.scene):
            traced = f"{scene} is traced as it is now" if scene else AS_THE_FILE_IS
            note(f"changed since the bake: {', '.join(changed)}; {traced}")
        self._store, self._lamps = store, lamps_of(store, settings.variant)
        self._room = self._room_with(self._lamps)
        self._light, self._looks = settings.light or MixTrack(), dict[str, Look]()
        if settings.variant:
            self._looks = dict(variant_named(variants_of(store), settings.variant).looks)
        self._room.check(dict.fromkeys(self._light.groups, WHITE))

    def _room_with(self, lamps: Mapping[int, LampEdit], before: TracedRoom | None = None) -> TracedRoom:
        settings, store = self.settings, self._store
        how: dict[str, Any] = {"sky_turn_deg": settings.sky_turn_deg, "replacements": settings.replacements}
        if self._path:
            return room_of_paths(with_lamp_edits(self.scene, lamps), **how)
        if settings.rebaked:
            copy = Store.open(rebaked_copy(store.folder))
            return room_of_store(copy, with_lamp_edits(scene_of(copy), lamps))
        return room_of_store(store, self.scene, lamps=lamps, before=before, **how)

    def apply_variant(self, variant: Variant) -> None:
        self._light, self._looks = self.settings.light or MixTrack.of(variant.light), dict(variant.looks)
        if (lamps := lamps_of(self._store, variant.name)) != self._lamps:
            self._room, self._lamps = self._room_with(lamps, self._room), lamps

    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        settings = self.settings
        picture = TracedPicture(
            self.room().tracer, camera, (settings.width, settings.height), seed=settings.seed, path=self._path,
            part=settings.show,
        )  # fmt: skip
        try:
            self.noise = sampled(picture, *self._limits, denoised=settings.denoises, progress=progress)
        except BaseException as error:
            if not (self.keeps and picture.samples and (isinstance(error, Cancelled) or is_interruption(error))):
                raise
            self.interrupted = True
            self._note(f"interrupted: the picture has {picture.samples} samples per pixel")
        self.samples = picture.samples
        return picture.denoised(fast=picture.samples < FINE) if settings.denoises else picture.mean()

    def room(self) -> TracedRoom:
        """The room in the state of the next image."""
        edits = self._edits()
        if not self.settings.rebaked:
            self._room.set_materials(edits.looks, edits.materials)
            self._room.follow(self.settings.follows)
        self._room.mix(self._light.factors_at(self.time_s))
        if edits.materials and not self._room.answers:
            self._once(f"light between surfaces stays as baked: {NO_ANSWER}")
        return self._room

    def _edits(self) -> Edits:
        """The changed materials of the next image."""
        settings, track = self.settings, self.settings.looks
        looks = {**self._looks, **(track.looks_at(self.time_s) if track else {})}
        scene, bare = self.scene, self._without_uv
        return edits_of(scene.materials, scene.textures, bare, looks, settings.recolour, settings.textures)

    def _once(self, text: str) -> None:
        if text not in self._noted:
            self._noted.add(text)
            self._note(text)

    @cached_property
    def _without_uv(self) -> frozenset[str]:
        return materials_without_uv([(o.material, o.mesh.uv) for o in self.scene.objects])


def limits_of(settings: Settings, *, moving: bool) -> tuple[int, float | None]:
    """Most samples of each pixel, and the noise that ends a picture earlier, if any."""
    if settings.samples is not None:
        return settings.samples, None
    if settings.noise is not None:
        return MOST_SAMPLES, settings.noise
    if settings.integrator == PATH_TRACER:
        return PATHS, None
    return (FILM_SAMPLES, None) if moving else (STILL_SAMPLES, NOISE)


def sampled(
    picture: TracedPicture, most: int, limit: float | None, *, denoised: bool, progress: Progress = silent
) -> float | None:
    """Add at most that many samples, fewer if the noise falls below a limit; returns the last estimate of the noise.

    Noise falls with the root of the number of samples, which tells the time left.
    """
    noise, asked, expected = None, FIRST_ASKED if limit is not None else most, float(most)
    while picture.samples < most and (noise is None or limit is None or noise > limit):
        picture.sample(min(asked, most) - picture.samples)
        if limit is not None and picture.samples >= min(asked, most):
            noise = picture.noise(denoised=denoised)
            expected = min(picture.samples * max(1.0, (noise / limit) ** 2), most)
            asked = int(np.ceil(min(expected, CHECKED_EVERY * picture.samples)))
        progress(min(picture.samples, expected), expected, "tracing")
    return noise
