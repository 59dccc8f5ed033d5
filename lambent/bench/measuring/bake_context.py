"""The bake of a finished store, for benches that trace rays as the bake did."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lambent.core.progress import Progress, silent
from lambent.scenes.looks.textures import prepared
from lambent.scenes.scene import Scene
from lambent.store.store import Store

if TYPE_CHECKING:
    from lambent.baking.context import BakeContext
    from lambent.baking.quality import Quality


def context_of(store: Store, scene: Scene, quality: Quality, progress: Progress = silent) -> BakeContext:
    """The bake context of a store and its scene, as far as geometry and light map need it; the engine is chosen."""
    from lambent.baking.bake import found
    from lambent.baking.context import BakeContext
    from lambent.baking.methods import METHODS
    from lambent.baking.probes.division import divided
    from lambent.baking.surfaces.cuts import cut_for_viewers
    from lambent.baking.surfaces.visible_triangles import TriangleVisibility

    ready = replace(scene, textures=prepared(scene.textures))
    as_baked = cut_for_viewers(divided(TriangleVisibility(ready), store, progress), store).scene
    return BakeContext(as_baked, store, found(), quality, store.documents.get(METHODS, {}))
