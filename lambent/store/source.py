"""Where the scene of a store is."""

from __future__ import annotations

from lambent.core.errors import UserError
from lambent.scenes import load_scene
from lambent.scenes.scene import Scene
from lambent.store.store import Store

SOURCE = "source"  # document: "builtin:NAME", or a path relative to the store's folder


def scene_of(store: Store, given: str | None = None) -> Scene:
    """The scene that a store was baked from: as given, else where it was when it was baked."""
    place = given or store.documents.get(SOURCE)
    if not isinstance(place, str):
        raise UserError("store does not say where its scene is", file=store.folder, hint="name it with --scene")
    return load_scene(place if given or place.startswith("builtin:") else str(store.folder / place))
