"""A view of a store's room, baked for relighting with the materials, textures and lamps that the room has now.

The room as baked shares its store. An edited one has a store of its own, ROOM.relight.store beside ROOM.store: views of
the store stay as they are, also those that are edited in place.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from lambent.baking.artefacts.relighting import KIND
from lambent.baking.bake import bake, found
from lambent.baking.context import BakeContext
from lambent.baking.quality import QualityName, quality_named
from lambent.baking.running.again import COPY_OF, LIGHT, check_copy, edited_scene
from lambent.baking.transport.view import View
from lambent.core.light.light_mix import LightMix
from lambent.core.progress import Progress, silent
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import Scene
from lambent.store.kept.images import with_paths
from lambent.store.kept.session import RoomState
from lambent.store.source import environment_image
from lambent.store.store import MANIFEST, Store


def relight_copy(folder: Path) -> Path:
    """Path of the store of edited views: ROOM.relight.store beside ROOM.store."""
    folder = folder.resolve()
    return folder.with_name(f"{folder.name.removesuffix('.store')}.relight.store")


@dataclass(frozen=True)
class Relit:
    """A view of the store in `folder`, of its room as edited; the mix of light groups does not count."""

    folder: Path
    room: RoomState
    view: View

    @property
    def place(self) -> Path:
        """Folder of the store that has, or will have, the view."""
        as_baked = self.room.model_copy(update={"light": LightMix()}) == RoomState()
        return self.folder.resolve() if as_baked else relight_copy(self.folder)

    def scene(self) -> Scene:
        """The edited scene; raises `UserError` if the store does not know its scene."""
        room = self.room
        textures = with_paths(room.textures, self.folder)
        return edited_scene(Store.open(self.folder), room.materials, textures, room.lamps)

    def is_baked(self, scene: Scene) -> bool:
        """Whether the view of the `scene` is baked, in any quality."""
        if not (self.place / MANIFEST).exists():
            return False
        store, scene = Store.open(self.place), replace(scene, textures=prepared(scene.textures))
        for name in QualityName:
            context = BakeContext(
                scene, store, found(), quality_named(name), {}, self._seed, views=(self.view,),
                environment=environment_image(Store.open(self.folder)),
            )  # fmt: skip
            if not context.stale("view_points") and not context.stale(KIND):
                return True
        return False

    def bake(self, progress: Progress = silent) -> None:
        """Bake the view, or go on with it, in the quality of the store's light map, but not finer than normal."""
        store = Store.open(self.folder)
        made = store.artefact(LIGHT).meta.get("quality") if LIGHT in store else None
        coarse = made not in (QualityName.normal, QualityName.final)
        if self.place != self.folder.resolve():
            check_copy(store, self.place)
            with Store.create(self.place, store.inputs) as copy:
                copy.set_document(COPY_OF, store.folder.name)
        bake(
            self.scene(), self.place, quality=QualityName.preview if coarse else QualityName.normal, only={KIND},
            views=[self.view], seed=self._seed, environment=environment_image(store), progress=progress,
        ).close()  # fmt: skip

    @property
    def _seed(self) -> int:
        store = Store.open(self.folder)
        return int(store.artefact(LIGHT).meta.get("seed", 0)) if LIGHT in store else 0
