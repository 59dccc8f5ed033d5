"""Images by the path tracer: the reference for the real-time renderer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from lambent.bake.engine import engine
from lambent.core.arrays import Floats
from lambent.core.camera import Camera
from lambent.core.errors import UserError
from lambent.core.progress import Progress, silent
from lambent.materials.recolour import recoloured
from lambent.render.images import Images, Settings
from lambent.scenes.replacement import with_replacements
from lambent.scenes.retexturing import materials_without_uv, retextured
from lambent.scenes.scene import Scene, Variant
from lambent.scenes.turned_sky import under_turned_sky
from lambent.scenes.variants import dressed, looks_as_loaded, variant_named
from lambent.store.source import changed_inputs, scene_of
from lambent.store.states import variants_of
from lambent.store.store import Store

SPP = 64
AS_THE_FILE_IS = (
    "traced with the present geometry, lights and surroundings, and the materials of the bake; --scene FILE traces a "
    "file with its own"
)


class PathTraced(Images):
    """Path traced images of the scene that a store was baked from, or of the file `scene` in its place."""

    def __init__(self, store: Store, settings: Settings, scene: str | None, note: Callable[[str], None]) -> None:
        super().__init__(settings)
        if settings.show != "full":
            raise UserError("the path tracer shows all light", field="--show", got=settings.show, expected="full")
        if settings.light is not None:
            hint = "leave it out, or choose another integrator"
            raise UserError("the path tracer traces the light of the scene", field="--light", hint=hint)
        if settings.planar != "auto":
            got = settings.planar
            raise UserError("the path tracer has no such choice", field="--planar", got=got, expected="auto")
        if settings.lookup != "auto":
            got = settings.lookup
            raise UserError("the path tracer has no such choice", field="--lookup", got=got, expected="auto")
        baked = scene_of(store, scene)
        self._baked, self._note = with_replacements(baked, settings.replacements), note
        self.apply_variant(
            variant_named(variants_of(store), settings.variant) if settings.variant else Variant("as baked")
        )
        if changed := changed_inputs(store, baked):
            traced = f"{scene} is traced as it is now" if scene else AS_THE_FILE_IS
            note(f"changed since the bake: {', '.join(changed)}; {traced}")
        engine()

    def apply_variant(self, variant: Variant) -> None:
        self._variant = variant
        if variant.light.groups:
            self._note(f"the path tracer ignores the light mix of {variant.name}: it traces the light of the scene")

    def _scene_now(self) -> Scene:
        """The scene with the materials of the next image."""
        track = self.settings.looks
        looks = {**self._variant.looks, **(track.looks_at(self.time_s) if track else {})}
        if self.settings.textures:
            loaded = looks_as_loaded(self._baked.materials, self._baked.textures)
            bare = materials_without_uv([(o.material, o.mesh.uv) for o in self._baked.objects])
            looks |= retextured({**loaded, **looks}, self.settings.textures, self._baked.textures, bare)
        changed = dressed(self._baked, replace(self._variant, looks=looks))
        return replace(
            changed, materials={**changed.materials, **recoloured(changed.materials, self.settings.recolour)}
        )

    def radiance(self, camera: Camera, progress: Progress = silent) -> Floats:
        from lambent.bake.reference.path_traced import (
            render_reference,  # imports Mitsuba, whose variant `engine` has set
        )

        settings = self.settings
        spp, size = settings.samples or SPP, (settings.width, settings.height)
        with TemporaryDirectory() as folder:
            scene = under_turned_sky(self._scene_now(), settings.sky_turn_deg, Path(folder))
            return render_reference(scene, camera, *size, spp, settings.seed, progress)[0]
