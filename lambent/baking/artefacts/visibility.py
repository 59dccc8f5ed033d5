"""Visibility of lights from the points of a view: traced once, independent of edits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lambent.baking.artefacts.view_points import points_key
from lambent.baking.context import BakeContext
from lambent.baking.quality import QualityName
from lambent.baking.running.keys import key_of, light_inputs
from lambent.baking.running.tiles import run_tiles
from lambent.baking.transport.view import View

KIND = "visibility"
NEEDS = ("view_points",)
OF_VIEWS = True
REVISION = 3
POINTS = 1 << 16  # per chunk


@dataclass(frozen=True)
class Settings:
    """Numbers of `lights`, ascending: editing starts with the first and switches to the next when it is ready."""

    lights: tuple[int, ...]


SETTINGS = {
    QualityName.preview: Settings((400,)),
    QualityName.normal: Settings((400, 4000)),
    QualityName.final: Settings((400, 10_000)),
}


def lights_key(context: BakeContext, view: View, count: int) -> str:
    """Key of the visibility from a view's points for this many lights."""
    scene = context.in_views
    return key_of(KIND, REVISION, points_key(context, view), light_inputs(scene), count, *_through(context))


def _through(context: BakeContext) -> list[bool]:
    """By object, whether light from behind it counts."""
    materials = (context.editable(o.material) for o in context.in_views.objects)
    return [any(term.side == "transmission" for term in material.terms) for material in materials]


def keys(context: BakeContext) -> dict[str, str]:
    counts = context.settings(KIND).lights
    return {view.name(KIND, str(n)): lights_key(context, view, n) for view in context.views for n in counts}


def bake(context: BakeContext) -> None:
    """Trace the first lights of each view; `transport` traces the others when it needs them."""
    for view in context.views:
        trace(context, view, context.settings(KIND).lights[0])


def trace(context: BakeContext, view: View, count: int) -> None:
    """Continue the visibility of this many lights until it is complete."""
    from lambent.baking.transport.visibility import BITS, visibility

    name = view.name(KIND, str(count))
    if name not in context.stale(KIND):
        return
    tracer = context.view_tracer
    points, lights = tracer.points(view), tracer.lights(count)
    behind = np.array(_through(context), bool)[points.object]
    shape = -(-len(lights) // BITS), len(points)
    meta = {**view.meta, "lights": len(lights)}
    chunks = max(1, shape[0]), max(1, min(POINTS, shape[1]))
    writer = context.store.begin(name, KIND, shape, chunks, "uint32", key=context.keys(KIND)[name], meta=meta)
    run_tiles(
        writer, lambda region, _: visibility(tracer.scene, points.where(region[1]), lights, behind[region[1]]),
        seed=0, progress=context.progress, what=f"visibility of {len(lights)} lights",
    )  # fmt: skip
    writer.finish()
