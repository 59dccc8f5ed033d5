"""Opaque objects whose backs viewers see; their backs get a light map too.

A sheet without thickness, such as a shelf, is visible from both sides, and a file may have a box whose faces look
inwards. Only points on visible backs are lit: a wall's far side is not sampled.
"""

from __future__ import annotations

from lambent.baking.engine import engine
from lambent.baking.running.keys import geometry_inputs, key_of
from lambent.baking.running.timing import Timed, untimed
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.core.progress import Progress, silent
from lambent.scenes.scene import Scene
from lambent.store.contract import is_two_sided
from lambent.store.store import Store

BACKS = "backs"  # document: its key, and the objects
LEAST = 4e-5  # share of viewers' rays, ten in number, below which a back stays black


def find_backs(
    sight: TriangleVisibility, store: Store, timed: Timed = untimed, progress: Progress = silent, *, anew: bool = False
) -> None:
    """Store which backs are seen; kept while geometry is unchanged, even if cameras change, unless `anew`."""
    scene = sight.scene
    clear = sorted(name for name, material in scene.materials.items() if material.transmits)
    key = key_of(BACKS, 2, clear, [o.material for o in scene.objects], *geometry_inputs(scene))
    if not anew and store.documents.get(BACKS, {}).get("key") == key:
        return
    engine()  # before Mitsuba is imported
    from lambent.baking.tracing.seen.viewed import seen_from_behind

    progress(0, 1, "backs in view")
    with timed(BACKS):
        found = seen_from_behind(sight, LEAST)
    store.set_document(BACKS, {"key": key, "objects": found})


def backs_of(store: Store) -> frozenset[str]:
    """Names of the opaque objects with visible backs; empty before `find_backs`."""
    return frozenset(store.documents.get(BACKS, {}).get("objects", []))


def crossed_by_light(scene: Scene) -> list[bool]:
    """By object, whether light crosses it: its whole back is then lit, as far as light reaches it."""
    masked = {name for name, textures in scene.textures.items() if textures.opacity}
    return [is_two_sided(scene.materials[o.material], masked=o.material in masked) for o in scene.objects]
