"""Cut very large triangles of a scene near its viewers, before the bake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lambent.baking.engine import engine
from lambent.baking.running.keys import geometry_inputs, key_of
from lambent.baking.running.timing import Timed, untimed
from lambent.baking.surfaces.cutting import cut, too_long
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.store.contract import CUTS
from lambent.store.store import Store

MOST_EYES = 128


def cut_for_viewers(sight: TriangleVisibility, store: Store, timed: Timed = untimed) -> TriangleVisibility:
    """The scene with very large triangles cut (`surfaces.cutting`); unchanged geometry keeps its previous cuts.

    The document "cuts" stores the eyes used: adding cameras later changes nothing.
    """
    scene = sight.scene
    long = too_long([o.mesh for o in scene.objects])
    if not len(long):
        return sight
    key = key_of("cuts", 1, *geometry_inputs(scene))
    found = store.documents.get(CUTS)
    if not isinstance(found, dict) or found.get("key") != key:
        engine()  # before Mitsuba is imported
        with timed(CUTS):
            viewers = sight.viewers
        found = {"key": key, "eyes": [], "reach_m": 0.0, "objects": []}
        if viewers is not None:
            longer = too_long([scene.objects[number].mesh for number in long], viewers.reach_m)
            eyes = np.unique(viewers.eyes.round(2), axis=0)[:MOST_EYES]
            names = [scene.objects[number].name for number in long[longer]]
            found |= {"eyes": eyes.tolist(), "reach_m": round(viewers.reach_m, 2), "objects": names}
        store.set_document(CUTS, found)
    if not found["objects"]:
        return sight
    eyes, reach = np.array(found["eyes"]).reshape(-1, 3), found["reach_m"]
    large = set(found["objects"])
    objects = (replace(o, mesh=cut(o.mesh, eyes, reach)) if o.name in large else o for o in scene.objects)
    return TriangleVisibility(replace(scene, objects=tuple(objects)))


def longest_piece(store: Store) -> float:
    """Length limit in metres for parts of objects that share a size of texels."""
    found = store.documents.get(CUTS)
    return float(found["reach_m"]) if found and found["objects"] else np.inf
