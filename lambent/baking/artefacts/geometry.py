"""Meshes with light map coordinates, their textures, and the scene record."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from functools import partial

from lambent.baking.context import GEOMETRY, BakeContext
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import geometry_inputs, key_of
from lambent.baking.surfaces.atlas import merged, object_records, unwrap
from lambent.baking.surfaces.cuts import longest_piece
from lambent.baking.surfaces.visible_triangles import TriangleVisibility
from lambent.core.plain import triple
from lambent.scenes.reflectors import Reflector, find_reflectors
from lambent.scenes.scene import Scene
from lambent.store.contract import SCENE, ReflectorPart, ReflectorRecord, SceneRecord, write_scene_record
from lambent.store.kept.images import with_kept_images
from lambent.store.plans import plan_record
from lambent.store.textures import texture_records, write_textures

KIND = "geometry"
NEEDS = ()
REVISION = 4
REFLECTORS = "reflectors"  # document: the key of all inputs of the reflectors in the scene record


@dataclass(frozen=True)
class Settings:
    """Approximate number of `texels` along a side of the light map."""

    texels: int


SETTINGS = {QualityName.preview: Settings(448), QualityName.normal: Settings(1024), QualityName.final: Settings(2048)}


def keys(context: BakeContext) -> dict[str, str]:
    key = key_of(KIND, REVISION, context.settings(KIND).texels, *geometry_inputs(context.scene))
    return {f"geometry/{name}": key for name in GEOMETRY}


def bake(context: BakeContext) -> None:
    from lambent.baking.tracing.seen.viewed import texel_sizes

    texels, longest_m = context.settings(KIND).texels, longest_piece(context.store)
    sight = context.sight or TriangleVisibility(context.scene)
    atlas = unwrap(context.scene, texels, context.progress, partial(texel_sizes, sight), longest_m)
    sight.forget()
    meta = {"light_map_size": [atlas.width, atlas.height]}
    for name, array in merged(atlas).items():
        context.put(KIND, f"geometry/{name}", array, meta)


def describe(context: BakeContext) -> None:
    """Write the textures and the scene record: cameras may change without a change of geometry.

    Reflectors are searched again only if their inputs have changed.
    """
    write_textures(context.store, context.scene.textures)
    store = context.store
    scene = replace(context.scene, variants=with_kept_images(store.folder, context.scene.variants))
    materials = [(o.name, scene.materials[o.material].model_dump(mode="json")) for o in scene.objects]
    key = key_of(REFLECTORS, 1, *geometry_inputs(scene), materials, list(map(asdict, scene.reflector_rules)))
    if store.documents.get(REFLECTORS) == key and SCENE in store.documents:
        reflectors = tuple(map(ReflectorRecord.model_validate, store.documents[SCENE]["reflectors"]))
    else:
        with context.timed(REFLECTORS):
            reflectors = tuple(map(_reflector_record, find_reflectors(scene, context.progress)))
    write_scene_record(store, scene_record_of(scene, reflectors))
    store.set_document(REFLECTORS, key)


def scene_record_of(scene: Scene, reflectors: tuple[ReflectorRecord, ...]) -> SceneRecord:
    """The scene without its arrays."""
    low, high = scene.bounds
    return SceneRecord(
        name=scene.name, objects=object_records(scene), materials=dict(scene.materials), cameras=scene.cameras,
        paths=scene.paths, reflectors=reflectors, exposure_ev=scene.exposure_ev,
        bounds=(triple(low), triple(high)), warnings=scene.warnings, textures=texture_records(scene.textures),
        variants=scene.variants, caption=scene.caption, credit=scene.credit,
    )  # fmt: skip


def _reflector_record(r: Reflector) -> ReflectorRecord:
    parts = (ReflectorPart(object=p.object, faces=tuple(map(int, p.faces)), area_m2=p.area_m2) for p in r.parts)
    return ReflectorRecord(
        plane=r.plane, outline=tuple(map(triple, r.outline)), deviation_m=r.deviation_m, two_sided=r.two_sided,
        plan=None if r.plan is None else plan_record(r.plan), parts=tuple(parts),
    )  # fmt: skip
