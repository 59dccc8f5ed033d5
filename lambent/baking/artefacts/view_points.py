"""The surface points that the pixels of a view show, and everything that emits light."""

from __future__ import annotations

import numpy as np

from lambent.baking.context import BakeContext
from lambent.baking.running.keys import geometry_inputs, key_of, light_inputs, texture_inputs
from lambent.baking.transport.view import View
from lambent.core.plain import triple
from lambent.store.contract import SceneRecord, write_scene_record

KIND = "view_points"
NEEDS = ()
OF_VIEWS = True
REVISION = 2
PARTS = ("pixel", "object", "theta_o")
BACKDROP = "backdrop"


def points_key(context: BakeContext, view: View) -> str:
    """Key of a view's points and all their data."""
    scene = context.in_views
    places = [view.meta["view"]["camera"] | {"name": ""}, view.width, view.height]
    materials = [o.material for o in scene.objects]
    return key_of(
        KIND, REVISION, places, materials, texture_inputs(scene, "normal", "direction"), *geometry_inputs(scene)
    )


def keys(context: BakeContext) -> dict[str, str]:
    found: dict[str, str] = {}
    for view in context.views:
        key = points_key(context, view)
        found |= {view.name(KIND, part): key for part in PARTS}
        found[view.name(KIND, BACKDROP)] = key_of(KIND, REVISION, key, light_inputs(context.in_views))
    return found


def describe(context: BakeContext) -> None:
    """For a store of views alone, write a scene record without objects: their materials, cameras and exposure."""
    store, scene = context.store, context.in_views
    if any(artefact.name.startswith("geometry/") for artefact in store.artefacts()):
        return
    low, high = scene.bounds
    record = SceneRecord(
        name=scene.name, objects=(), materials=dict(scene.materials), cameras=scene.cameras,
        exposure_ev=scene.exposure_ev, bounds=(triple(low), triple(high)), warnings=scene.warnings,
    )  # fmt: skip
    write_scene_record(store, record)


def bake(context: BakeContext) -> None:
    objects = [[o.name, o.material] for o in context.in_views.objects]
    for i, view in enumerate(context.views):
        context.progress(i, len(context.views), f"view {view.camera.name}")
        points = context.view_tracer.points(view)
        theta_o = np.arctan2(np.hypot(points.wo[:, 0], points.wo[:, 1]), points.wo[:, 2])
        arrays = points.pixel.astype(np.uint32), points.object.astype(np.uint32), theta_o
        for part, array in zip(PARTS, arrays, strict=True):
            context.put(KIND, view.name(KIND, part), array, {**view.meta, "objects": objects})
        backdrop = np.minimum(context.view_tracer.backdrop(view), np.finfo(np.float16).max).astype(np.float16)
        context.put(KIND, view.name(KIND, BACKDROP), backdrop, view.meta)
    context.progress(1, 1, "views")
