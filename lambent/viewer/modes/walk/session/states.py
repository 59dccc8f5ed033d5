"""States of the room, materials and light mix: stored states, variants of the scene, two states side by side."""

from __future__ import annotations

from lambent.core.light.light_mix import LightMix
from lambent.scenes.scene import ImageTexture, Variant
from lambent.store.contract import SceneRecord
from lambent.store.kept.session import RoomState
from lambent.store.kept.views import checked_name, free_name
from lambent.viewer.edits.edits import MaterialEdits
from lambent.viewer.mode import Divider

AS_BAKED = RoomState()
NOW, OTHER, BAKED = "the room now", "other state", "as baked"


class States:
    """State of the States panel; the room states are in the `edits`, with their undo.

    Attributes
    ----------
    split : bool
        Whether the room is shown left of a divider, and another state right of it.
    """

    def __init__(self, edits: MaterialEdits, scene: SceneRecord) -> None:
        self.edits = edits
        self._variants, self._textured = scene.variants, set(scene.textures)
        self.divider = Divider()
        self.typed_name = ""
        self._split = False

    @property
    def split(self) -> bool:
        """Whether the split view is on; undo can remove the other state."""
        return self._split and self.edits.other is not None

    @split.setter
    def split(self, on: bool) -> None:
        self._split = on
        if on and self.edits.other is None:
            self.edits.compare_with(AS_BAKED)

    def exchange(self) -> None:
        """Swap the room with the state it is compared with, or with the bake."""
        if self.edits.other is None:
            self.edits.compare_with(AS_BAKED)
        self.edits.exchange()

    def store(self) -> str:
        """Store the room under the typed name, else the next free one; return the name.

        Raises
        ------
        UserError
            If the name cannot be used.
        """
        typed, stored = self.typed_name, self.edits.stored
        name = checked_name(typed, {BAKED}) if typed.strip() else free_name("state", set(stored))
        self.edits.store(name)
        self.typed_name = ""
        return name

    def compare(self, name: str) -> None:
        """Split the picture between the room and a stored state or the bake."""
        self.split_with(self.all[name])

    def split_with(self, room: RoomState) -> None:
        """Split the picture between the room and another state."""
        self.edits.compare_with(room)
        self._split = True

    @property
    def variants(self) -> dict[str, RoomState]:
        """The room in each of the scene's variants, by name; materials in no variant keep their present state."""
        if not self._variants:
            return {}
        room = self.edits.room
        named = {name for one in self._variants for name in one.looks}
        lights = {name for one in self._variants for name in one.light.groups}
        materials = {name: one for name, one in room.materials.items() if name not in named}
        textures = {name: of for name, of in room.textures.items() if name not in named}
        mixes = {name: mix for name, mix in room.light.groups.items() if name not in lights}
        return {
            one.name: RoomState(
                materials={**materials, **one.materials},
                textures={**textures, **self._textures_of(one)},
                light=LightMix({**mixes, **one.light.groups}),
                lamps=room.lamps,
            )
            for one in self._variants
        }

    def _textures_of(self, variant: Variant) -> dict[str, str | ImageTexture]:
        """Textures of a variant that are not a material's own."""
        own = {name: name if name in self._textured else "" for name in variant.looks}
        return {name: look.textures for name, look in variant.looks.items() if look.textures != own[name]}

    @property
    def all(self) -> dict[str, RoomState]:
        """Stored states by name, and the bake."""
        return {BAKED: AS_BAKED, **self.edits.stored}

    def name_of(self, room: RoomState, otherwise: str) -> str:
        """The name of a stored state."""
        named = {**self.variants, **self.all}
        return next((name for name, stored in named.items() if stored == room), otherwise)

    def label(self) -> None:
        """Label both sides of the divider."""
        self.divider.a_label = self.name_of(self.edits.room, NOW)
        self.divider.b_label = self.name_of(self.edits.other or AS_BAKED, OTHER)
