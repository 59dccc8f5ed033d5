"""The traced scene of a store: the geometry that its light map belongs to, under the lights of its scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lambent.baking.surfaces.atlas import Atlas, merged, mesh_of_faces
from lambent.baking.tracing.traced_scene import TracedScene
from lambent.core.arrays import Floats
from lambent.scenes.replacement import Replacement, with_replacements
from lambent.scenes.scene import Scene, SceneObject
from lambent.store.consistency import read_geometry
from lambent.store.contract import SceneRecord, scene_record, sun_left_out
from lambent.store.store import Store

GUIDING = 0.25  # effort of the sky's guide: 1 has .8 % less noise, and takes 1.3 s longer on one core


def stored_scene(store: Store, scene: Scene, replacements: Sequence[Replacement] = ()) -> TracedScene:
    """A store's scene with the objects of its bake, divided into parts, and their light map coordinates.

    Meshes in place of objects have no light map; their diffuse light is traced. If the light map has the light of the
    sun too, the scene has no sun of its own.
    """
    record, arrays = scene_record(store), read_geometry(store)
    openings = {o.name: o for o in scene.objects if o.luminaire is not None}
    objects, uv2 = _objects(record, arrays)
    objects = tuple(replace(openings[o.name], mesh=o.mesh) if o.name in openings else o for o in objects)
    scene = replace(scene, objects=objects, parts={o.name: o.part_of for o in record.objects if o.part_of})
    scene, unmapped = with_replacements(scene, replacements), frozenset(one.object for one in replacements)
    uv2 |= {name: np.zeros((len(scene.object(name).mesh.positions), 2), np.float32) for name in unmapped}
    width, height = store.artefact("geometry/uv2").meta["light_map_size"]
    atlas = Atlas(scene, uv2, width, height)
    own = merged(atlas) if unmapped else arrays
    has_sun = sun_left_out(store) is not None
    return TracedScene(atlas, own, [False] * len(objects), sun_left_out=has_sun, unmapped=unmapped, effort=GUIDING)


def scene_alone(scene: Scene) -> TracedScene:
    """A scene with its own objects, without a light map, for whole paths."""
    return TracedScene(Atlas(scene, {}, 1, 1), {}, [False] * len(scene.objects), effort=GUIDING)


def _objects(record: SceneRecord, arrays: dict[str, Floats]) -> tuple[tuple[SceneObject, ...], dict[str, Floats]]:
    """The objects of a store, and the light map coordinates (V, 2) of each, by name."""
    objects, uv2 = [], {}
    for o in record.objects:
        mesh, uv2[o.name] = mesh_of_faces(arrays, o.first_face, o.face_count)
        objects.append(SceneObject(o.name, mesh, o.material, o.emission))
    return tuple(objects), uv2
